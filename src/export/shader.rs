//! A texture as text in any of the C-like languages, which differ in little but words.

use std::fmt::Write as _;

use super::names::{fields, identifier};
use super::tile::tile_picture;
use super::tiling::{Reading, about_table_and_input, picture_names, table_and_input};
use super::{ExportFile, Program, ProgramChannel};
use crate::base::error::Result;
use crate::method::noise::KNOTS;
use crate::method::noise::tiling::SIDE;
use crate::signal::wavelet_noise::Torus;

/// The words of a language.
#[derive(Clone, Copy)]
pub(super) struct Language {
    /// Types of a fraction, of a whole number, and of yes and no.
    pub(super) float: &'static str,
    pub(super) int: &'static str,
    pub(super) bool: &'static str,
    /// Types of 2, 3 and 4 fractions.
    pub(super) vectors: [&'static str; 3],
    /// Whether a name comes before its type: `fn f(a: f32) -> f32`, `let a = 1.0`.
    pub(super) name_first: bool,
    /// Parameters that hand on the coefficients, type and name each.
    pub(super) tile: &'static [(&'static str, &'static str)],
    /// A function's body that returns the coefficient of `column` and `row`, which are in the tile.
    pub(super) coefficient: &'static str,
    /// What a function hands on for those parameters.
    pub(super) handed: &'static str,
    /// The same from the texture's function, which knows the number of the tile.
    pub(super) chosen: fn(usize) -> String,
    /// How the pictures of a tiled texture are read.
    pub(super) reading: Reading,
}

/// A fraction as text that every language reads back to the same bits.
pub(super) fn number(v: f32) -> String {
    format!("{v:?}")
}

impl Language {
    fn parameters(&self, parameters: &[(&str, &str)]) -> String {
        let one = |(ty, name): &(&str, &str)| {
            if self.name_first { format!("{name}: {ty}") } else { format!("{ty} {name}") }
        };
        parameters.iter().map(one).collect::<Vec<_>>().join(", ")
    }

    /// A function's first line.
    pub(super) fn head(&self, returns: &str, name: &str, parameters: &[(&str, &str)]) -> String {
        let parameters = self.parameters(parameters);
        if self.name_first {
            format!("fn {name}({parameters}) -> {returns} {{\n")
        } else {
            format!("{returns} {name}({parameters}) {{\n")
        }
    }

    /// A line that names a value that stays.
    pub(super) fn value(&self, ty: &str, name: &str, value: &str) -> String {
        let word = if self.name_first { "let" } else { ty };
        format!("    {word} {name} = {value};\n")
    }

    /// A line that names a fraction that changes.
    fn variable(&self, name: &str) -> String {
        let word = if self.name_first { "var" } else { self.float };
        format!("    {word} {name} = 0.0;\n")
    }

    /// The functions that give the surface over coefficients.
    fn noise_helpers(&self, name: &str) -> String {
        let (float, int) = (self.float, self.int);
        let mut out = String::new();
        let tile = self.tile;
        let with = |rest: &[(&'static str, &'static str)]| [tile, rest].concat();

        out += "// A coefficient of the noise, a whole number. The tile goes round.\n";
        out += &self.head(
            float,
            &format!("{name}_coefficient"),
            &with(&[(int, "column"), (int, "row")]),
        );
        out += self.coefficient;
        out += "}\n\n";

        out += "// Three neighbours in a row, weighted.\n";
        let weights = [(float, "a"), (float, "b"), (float, "c"), (int, "column"), (int, "row")];
        out += &self.head(float, &format!("{name}_row"), &with(&weights));
        let handed = self.handed;
        let _ = writeln!(
            out,
            "    return a * {name}_coefficient({handed}, column, row)\n         \
             + b * {name}_coefficient({handed}, column + 1, row)\n         \
             + c * {name}_coefficient({handed}, column + 2, row);\n}}\n"
        );

        out += "// Quadratic B-spline surface over the coefficients around (x, y), whose unit is a coefficient;\n\
                // (column, row) is where 0 lies in the tile.\n";
        let position = [(float, "x"), (float, "y"), (int, "column"), (int, "row")];
        out += &self.head(float, &format!("{name}_noise"), &with(&position));
        for axis in ["x", "y"] {
            out += &self.value(float, &format!("m{axis}"), &format!("ceil({axis} - 0.5)"));
            out += &self.value(float, &format!("t{axis}"), &format!("m{axis} - ({axis} - 0.5)"));
            out += &self.value(float, &format!("a{axis}"), &format!("0.5 * t{axis} * t{axis}"));
            let last = format!("0.5 * (1.0 - t{axis}) * (1.0 - t{axis})");
            out += &self.value(float, &format!("c{axis}"), &last);
            out += &self.value(float, &format!("b{axis}"), &format!("1.0 - a{axis} - c{axis}"));
        }
        out += &self.value(int, "i", &format!("{int}(mx) - 1 + column"));
        out += &self.value(int, "j", &format!("{int}(my) - 1 + row"));
        let row = |k| format!("{name}_row({handed}, ax, bx, cx, i, j + {k})");
        let _ = writeln!(
            out,
            "    return ay * {}\n         + by * {}\n         + cy * {};\n}}\n",
            row(0),
            row(1),
            row(2)
        );
        out
    }

    /// The functions that the texture's own function calls.
    pub(super) fn helpers(&self, name: &str, program: &Program) -> String {
        let float = self.float;
        let mut out = match &program.tiling {
            Some(tiling) => self.tiled_helpers(name, tiling),
            None => self.noise_helpers(name),
        };
        out += "// The share of a band that samples so many pixels apart can hold.\n";
        let band = [(float, "level"), (float, "footprint")];
        out += &self.head(float, &format!("{name}_kept"), &band);
        out += "    if (footprint <= 0.0) { return 1.0; }\n";
        out += &self.value(float, "t", "clamp(1.0 + level - log2(footprint), 0.0, 1.0)");
        out += "    return t * t * (3.0 - 2.0 * t);\n}\n\n";

        if program.channels.iter().any(|c| c.shape.is_some()) {
            out += "// A piece of a histogram's curve.\n";
            let piece = ["t", "c0", "c1", "c2", "c3"].map(|name| (float, name));
            out += &self.head(float, &format!("{name}_piece"), &piece);
            out += "    return c0 + t * (c1 + t * (c2 + t * c3));\n}\n\n";
        }
        for (k, channel) in program.channels.iter().enumerate() {
            if let Some(pieces) = &channel.shape {
                out += &self.histogram(name, k, pieces);
            }
        }
        if program.maps.iter().any(|(_, encoding, _)| encoding == "srgb") {
            out += "// From sRGB to linear light.\n";
            out += &self.head(float, &format!("{name}_linear"), &[(float, "value")]);
            out += "    if (value <= 0.04045) { return value / 12.92; }\n\
                    \x20   return pow((value + 0.055) / 1.055, 2.4);\n}\n\n";
        }
        out
    }

    /// The functions that give channel `k` its histogram.
    fn histogram(&self, name: &str, k: usize, pieces: &[(f32, [f32; 5])]) -> String {
        let float = self.float;
        let curve = format!("{name}_curve_{k}");
        let mut out = format!(
            "// The values of channel {k} in the photo, by standard deviations of the noise.\n"
        );
        out += &self.head(float, &curve, &[(float, "deviations")]);
        let ends = [KNOTS[0], KNOTS[KNOTS.len() - 1]].map(|u| number(u as f32));
        out += &self.value(float, "u", &format!("clamp(deviations, {}, {})", ends[0], ends[1]));
        for (i, (knot, [c0, c1, c2, c3, per])) in pieces.iter().enumerate() {
            let [knot, c0, c1, c2, c3, per] = [*knot, *c0, *c1, *c2, *c3, *per].map(number);
            let piece =
                format!("return {name}_piece((u - ({knot})) * {per}, {c0}, {c1}, {c2}, {c3});");
            let _ = match pieces.get(i + 1) {
                Some((next, _)) => {
                    writeln!(out, "    if (u < {}) {{ {piece} }}", number(*next))
                }
                None => writeln!(out, "    {piece}"),
            };
        }
        out += "}\n\n// Its mean over noise that the samples cannot hold, of so many deviations.\n";
        let parameters = [(float, "u"), (float, "lost")];
        out += &self.head(float, &format!("{name}_channel_{k}"), &parameters);
        let _ = writeln!(out, "    if (lost == 0.0) {{ return {curve}(u); }}");
        out += &self.value(float, "side", "1.7320508 * lost");
        let _ = writeln!(
            out,
            "    return ({curve}(u - side) + {curve}(u + side)) / 6.0 + {curve}(u) * 2.0 / 3.0;\n}}\n"
        );
        out
    }

    /// Lines that make the independent channels `c0`, `c1`, ... of `x`, `y` and `footprint`.
    fn noise_channels(&self, name: &str, program: &Program) -> String {
        let float = self.float;
        let mut out = String::new();
        let turned = |axis: &str| {
            program.turn.map_or_else(
                || format!("{axis} - 0.5"),
                |[c, s]| {
                    let [c, s] = [c, s].map(|v| number(v as f32));
                    match axis {
                        "x" => format!("({c} * x + {s} * y) - 0.5"),
                        _ => format!("({c} * y - {s} * x) - 0.5"),
                    }
                },
            )
        };
        out += "    // The middle of the photo's first pixel is 0";
        out += if program.turn.is_some() { "; the noise has directions.\n" } else { ".\n" };
        out += &self.value(float, "px", &turned("x"));
        out += &self.value(float, "py", &turned("y"));
        let mut levels: Vec<u32> =
            program.terms.iter().map(|t| t.levels[0].min(t.levels[1])).collect();
        levels.sort_unstable();
        levels.dedup();
        out += "    // What is kept of each octave.\n";
        for l in &levels {
            let kept = format!("{name}_kept({}, footprint)", number(*l as f32));
            out += &self.value(float, &format!("k{l}"), &kept);
        }
        for (c, channel) in program.channels.iter().enumerate() {
            let _ = writeln!(out, "    // Independent channel {c}: the sum of its bands.");
            out += &self.variable(&format!("n{c}"));
            out += &self.variable(&format!("lost{c}"));
            for (t, term) in program.terms.iter().enumerate() {
                let weight = channel.weights[t] * program.tiles[term.tile].1;
                if weight == 0.0 {
                    continue;
                }
                let l = term.levels[0].min(term.levels[1]);
                // Whole coefficients of an offset are added to indices: in floats they would cost digits.
                let at = |axis: usize| {
                    let (level, offset) = (term.levels[axis], channel.offsets[t][axis]);
                    let per = number((level as f32).exp2().recip());
                    let within = number((offset & ((1 << level) - 1)) as f32);
                    (
                        format!("(p{} + {within}) * {per}", ["x", "y"][axis]),
                        (offset >> level) as usize % Torus::SIDE,
                    )
                };
                let ((x, i), (y, j)) = (at(0), at(1));
                let tile = (self.chosen)(term.tile);
                let _ = writeln!(
                    out,
                    "    n{c} += {} * k{l} * {name}_noise({tile}, {x}, {y}, {i}, {j});",
                    number(weight)
                );
                if channel.shape.is_some() {
                    let share = number(channel.shares[t]);
                    let _ = writeln!(out, "    lost{c} += {share} * (1.0 - k{l} * k{l});");
                }
            }
            out += &self.channel(name, c, channel);
        }
        out
    }

    /// A line that makes channel `c` of its noise and, if it has a histogram, of what of it is lost.
    pub(super) fn channel(&self, name: &str, c: usize, channel: &ProgramChannel) -> String {
        let value = if channel.shape.is_some() {
            let per = number(channel.per_deviation);
            format!("{name}_channel_{c}(n{c} * {per}, sqrt(lost{c}))")
        } else {
            format!("n{c}")
        };
        self.value(self.float, &format!("c{c}"), &value)
    }

    /// Lines that make the outputs `v0`, `v1`, ... of `x` and `y`, in pixels of the photo, and of
    /// `footprint`, `contrast` and `linear_light`.
    pub(super) fn body(&self, name: &str, program: &Program) -> String {
        let float = self.float;
        let mut out = match &program.tiling {
            Some(tiling) => self.tiled_channels(name, program, tiling),
            None => self.noise_channels(name, program),
        };
        out += "    // Mean, and what each channel adds.\n";
        for (i, (mean, row)) in program.mean.iter().zip(&program.matrix).enumerate() {
            let sum: Vec<_> =
                row.iter().enumerate().map(|(c, m)| format!("{} * c{c}", number(*m))).collect();
            let value = format!("{} + contrast * ({})", number(*mean), sum.join(" + "));
            out += &self.value(float, &format!("v{i}"), &value);
        }
        out
    }
}

/// One output: up to four numbers of a map.
pub(super) struct Output {
    /// Its name: the map's.
    pub(super) name: String,
    /// The first of the numbers.
    pub(super) first: usize,
    /// How many.
    pub(super) count: usize,
    /// Whether they are sRGB.
    pub(super) srgb: bool,
}

/// The outputs of all maps, in order.
pub(super) fn outputs(program: &Program) -> Vec<Output> {
    let mut first = 0;
    let mut out = Vec::new();
    let names = fields(program.maps.iter().map(|(name, ..)| identifier(name, "map")));
    for ((_, encoding, channels), name) in program.maps.iter().zip(names) {
        for (part, from) in (0..*channels).step_by(4).enumerate() {
            let name = if *channels > 4 { format!("{name}_{part}") } else { name.clone() };
            let count = (channels - from).min(4);
            out.push(Output { name, first: first + from, count, srgb: encoding == "srgb" });
        }
        first += channels;
    }
    out
}

impl Language {
    /// The type of an output.
    pub(super) fn type_of(&self, output: &Output) -> &'static str {
        match output.count {
            1 => self.float,
            n => self.vectors[n - 2],
        }
    }

    /// An output made of the numbers `v0`, `v1`, ...
    fn made(&self, output: &Output) -> String {
        let numbers: Vec<_> = (0..output.count).map(|i| format!("v{}", output.first + i)).collect();
        match output.count {
            1 => numbers.join(""),
            _ => format!("{}({})", self.type_of(output), numbers.join(", ")),
        }
    }

    /// The type that the texture's function returns: a struct for several outputs.
    pub(super) fn returned(&self, name: &str, outputs: &[Output]) -> String {
        match outputs {
            [one] => self.type_of(one).to_owned(),
            _ => format!("{name}_maps"),
        }
    }

    /// The whole texture: helpers, and the function `name(tile, p, footprint, contrast, linear_light)`.
    /// That of a tiled texture takes its table and its input in place of the tile.
    pub(super) fn texture(&self, name: &str, program: &Program) -> String {
        let (float, bool) = (self.float, self.bool);
        let outputs = outputs(program);
        let returned = self.returned(name, &outputs);
        let mut out = self.helpers(name, program);
        if outputs.len() > 1 {
            out += "// All maps at a point.\n";
            let _ = writeln!(out, "struct {returned} {{");
            for output in &outputs {
                let (ty, field) = (self.type_of(output), &output.name);
                let _ = if self.name_first {
                    writeln!(out, "    {field}: {ty},")
                } else {
                    writeln!(out, "    {ty} {field};")
                };
            }
            out += if self.name_first { "}\n\n" } else { "};\n\n" };
        }
        out += TEXTURE;
        let pictures = match &program.tiling {
            Some(tiling) => self.tiled_parameters(tiling),
            None => vec![(self.tile[0].0, self.tile[0].1.to_owned())],
        };
        let mut parameters: Vec<_> = pictures.iter().map(|(ty, n)| (*ty, n.as_str())).collect();
        parameters.extend([
            (self.vectors[0], "p"),
            (float, "footprint"),
            (float, "contrast"),
            (bool, "linear_light"),
        ]);
        out += &self.head(&returned, name, &parameters);
        out += &self.value(float, "x", "p.x");
        out += &self.value(float, "y", "p.y");
        out += &self.body(name, program);
        let values: Vec<_> = outputs.iter().map(|o| self.finished(name, o)).collect();
        for line in values.iter().flat_map(|(lines, _)| lines) {
            out += line;
        }
        let values: Vec<_> = values.into_iter().map(|(_, value)| value).collect();
        if let [one] = &values[..] {
            let _ = writeln!(out, "    return {one};");
        } else if self.name_first {
            let _ = writeln!(out, "    return {returned}({});", values.join(", "));
        } else {
            let _ = writeln!(out, "    {returned} maps;");
            for (output, value) in outputs.iter().zip(&values) {
                let _ = writeln!(out, "    maps.{} = {value};", output.name);
            }
            out += "    return maps;\n";
        }
        out += "}\n";
        out
    }

    /// Lines that bring an output to linear light if asked for, and its value.
    fn finished(&self, name: &str, output: &Output) -> (Vec<String>, String) {
        if !output.srgb {
            return (Vec::new(), self.made(output));
        }
        let word = if self.name_first { "var" } else { self.float };
        let all = output.first..output.first + output.count;
        let lines = all.clone().map(|i| {
            format!(
                "    {word} l{i} = v{i};\n    if (linear_light) {{ l{i} = {name}_linear(v{i}); }}\n"
            )
        });
        let numbers: Vec<_> = all.clone().map(|i| format!("l{i}")).collect();
        let value = match output.count {
            1 => numbers.join(""),
            _ => format!("{}({})", self.type_of(output), numbers.join(", ")),
        };
        (lines.collect(), value)
    }

    /// Four numbers to look at, of an output's value.
    pub(super) fn shown(&self, output: &Output, value: &str) -> String {
        let four = self.vectors[2];
        match output.count {
            1 => format!("{four}({value}, {value}, {value}, 1.0)"),
            2 => format!("{four}({value}, 0.0, 1.0)"),
            3 => format!("{four}({value}, 1.0)"),
            _ => value.to_owned(),
        }
    }
}

const TEXTURE: &str = "\
// The texture at p, in pixels of the photo: x goes right, y down.
// footprint: distance of samples in pixels of the photo, 0 for no antialiasing.
// contrast: 1 as in the photo, 0 is its mean color.
// linear_light: whether sRGB colors come as linear light. Values are not clipped to 0..1.
";

/// Comments at the top of a file.
pub(super) fn heading(name: &str, program: &Program, pictures: &str) -> String {
    let [width, height] = program.size;
    let period = if let Some(tiling) = &program.tiling {
        // Two rows lie as far right as the next column but one.
        let [across, down] = tiling.layout.cell.map(|n| n as usize * SIDE);
        format!("{across} x {} pixels", 2 * down)
    } else {
        let coarsest = program.terms.iter().flat_map(|t| t.levels).max().unwrap_or(0);
        format!("{} pixels", Torus::SIDE << coarsest)
    };
    let again = if program.turn.is_some() {
        String::new()
    } else {
        format!("// All repeats after {period}: where coordinates grow large, wrap them there.\n")
    };
    format!(
        "// {name}: a procedural texture, written by texforge from a photo of {width} x {height} pixels.\n\
         // It has no end; coordinates are in pixels of that photo. A float keeps them to 1/4000 of a pixel\n\
         // within 4096 pixels of the origin, to 1/16 within a million.\n\
         {again}{pictures}\n"
    )
}

/// Comments about the pictures that a texture needs.
pub(super) fn about_pictures(name: &str, program: &Program) -> String {
    if let Some(tiling) = &program.tiling {
        return about_table_and_input(name, tiling);
    }
    let (side, height) = (Torus::SIDE, Torus::SIDE * program.tiles.len());
    format!(
        "// {name}_tile.png ({side} x {height}) holds its coefficients: red is the high byte, green the low one.\n\
         // Load it as it is: 8 bits, not sRGB, not compressed, no mipmaps, top row first (or set flipped).\n"
    )
}

/// The pictures that a texture needs.
pub(super) fn pictures(name: &str, program: &Program) -> Result<Vec<ExportFile>> {
    match &program.tiling {
        Some(tiling) => table_and_input(name, tiling),
        None => Ok(vec![tile_picture(name, program)?]),
    }
}

/// What the pictures are called in the examples: as their files, in the order of the function's parameters.
pub(super) fn pictures_in_example(name: &str, program: &Program) -> Vec<String> {
    match &program.tiling {
        Some(tiling) => {
            let input = picture_names(name, "input", tiling);
            std::iter::once(format!("{name}_table")).chain(input).collect()
        }
        None => vec![format!("{name}_tile")],
    }
}
