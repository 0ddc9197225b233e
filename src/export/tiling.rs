//! A tiled texture as text in any of the C-like languages, and its pictures.

use std::fmt::Write as _;

use super::shader::{Language, number};
use super::{ExportFile, Program, ProgramTiling};
use crate::base::error::Result;
use crate::image::io::{Format, WriteOptions, encode};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Samples};
use crate::method::noise::tiling::SIDE;
use crate::method::noise::tiling::input::halved;

/// How a language reads the table and the input. In bodies of functions `NAME` stands for the texture's
/// name, `WIDTH` and `HEIGHT` for the input's sides, `ACROSS` for the width of a picture of all its levels.
#[derive(Clone, Copy)]
pub(super) struct Reading {
    /// Parameter that hands on the table, type and `table`, with what belongs to the name.
    pub(super) table: (&'static str, &'static str),
    /// Type of a picture of the input.
    pub(super) picture: &'static str,
    /// Parameter that goes with pictures, where they and their sampler are apart.
    pub(super) sampler: Option<(&'static str, &'static str)>,
    /// What stands above the functions.
    pub(super) above: &'static str,
    /// A function's body that returns the three bytes of the table for the vertex (`i`, `j`): of its left
    /// half or, if `side` is 1, of its right one.
    pub(super) vertex: &'static str,
    /// A function's body that returns the channels of `picture` at (`x`, `y`) in pixels of the input, and
    /// between levels at `level`.
    pub(super) sample: &'static str,
}

impl Language {
    /// Parameters of the texture's function that hand on the table and the input.
    pub(super) fn tiled_parameters(&self, tiling: &ProgramTiling) -> Vec<(&'static str, String)> {
        let reading = &self.reading;
        let pictures = 0..tiling.layout.input.pictures.len();
        let mut out = vec![(reading.table.0, reading.table.1.to_owned())];
        out.extend(pictures.map(|m| (reading.picture, format!("input_{m}"))));
        out.extend(reading.sampler.map(|(ty, name)| (ty, name.to_owned())));
        out
    }

    /// The functions that read the table and the input.
    pub(super) fn tiled_helpers(&self, name: &str, tiling: &ProgramTiling) -> String {
        let (float, int, reading) = (self.float, self.int, &self.reading);
        let three = self.vectors[1];
        let [width, height] = tiling.layout.input.size;
        let words = [("WIDTH", width), ("HEIGHT", height), ("ACROSS", with_levels(tiling))];
        let filled = |text: &str| {
            let put =
                |text: String, (word, n): &(&str, u32)| text.replace(word, &number(*n as f32));
            words.iter().fold(text.to_owned(), put).replace("NAME", name)
        };
        let mut out = filled(reading.above);

        out += "// Bytes of vertex (i, j): on side 0 which part of the input it shows, on side 1 how alike it and\n\
                // the next vertices are, to the right, below to the right and below to the left.\n";
        let vertex = [reading.table, (int, "i"), (int, "j"), (int, "side")];
        out += &self.head(three, &format!("{name}_vertex"), &vertex);
        out += &filled(reading.vertex);
        out += "}\n\n";

        out += "// Up to three channels of the input, in standard deviations, at (x, y) in its pixels.\n";
        let mut sample = vec![(reading.picture, "picture")];
        sample.extend(reading.sampler);
        sample.extend([(float, "x"), (float, "y"), (float, "level")]);
        out += &self.head(three, &format!("{name}_sample"), &sample);
        out += &filled(reading.sample);
        out += "}\n\n";

        out += "// What vertex (i, j) shows where (x, y) leads from it.\n";
        let mut part = vec![reading.table, (reading.picture, "picture")];
        part.extend(reading.sampler);
        part.extend([(int, "i"), (int, "j"), (float, "x"), (float, "y"), (float, "level")]);
        out += &self.head(three, &format!("{name}_part"), &part);
        out += &self.value(three, "choice", &format!("{name}_vertex(table, i, j, 0)"));
        let place = |axis: usize| {
            let [first, step] =
                [tiling.places.first, tiling.places.step].map(|of| number(of[axis] as f32));
            format!("{first} + {step} * choice[{axis}] + {}", ["x", "y"][axis])
        };
        let sampler = self.sampler();
        let (x, y) = (place(0), place(1));
        let _ = writeln!(
            out,
            "    return {name}_sample(picture{sampler},\n        {x},\n        {y},\n        level);\n}}\n"
        );
        out
    }

    /// What a call hands on behind a picture.
    fn sampler(&self) -> String {
        self.reading.sampler.map_or_else(String::new, |(_, name)| format!(", {name}"))
    }

    /// Lines that make the independent channels `c0`, `c1`, ... of `x`, `y` and `footprint`.
    pub(super) fn tiled_channels(
        &self,
        name: &str,
        program: &Program,
        tiling: &ProgramTiling,
    ) -> String {
        let (float, int, three) = (self.float, self.int, self.vectors[1]);
        let mut out = String::new();
        let layout = &tiling.layout;
        let [across, down] = layout.cell.map(|n| number(n as f32));
        out += "    // Distance of vertices in a row, and of rows; a row is half the former right of the last.\n";
        out += &self.value(float, "across", &across);
        out += &self.value(float, "down", &down);
        out += "    // Vertex (i, j) lies up and left of the point, which is (rx, ry) from it. Far away a quotient loses\n    \
                // digits: so that of what is left of it is taken, too.\n";
        out += &self.value(float, "row0", "floor(y / down)");
        out += &self.value(float, "row", "row0 + floor((y - down * row0) / down)");
        out += &self.value(float, "ry", "y - down * row");
        out += &self.value(float, "fv", "ry / down");
        out += &self.value(float, "shifted", "x - 0.5 * across * row");
        out += &self.value(float, "column0", "floor(shifted / across)");
        let column = "column0 + floor((shifted - across * column0) / across - 0.5 * fv)";
        out += &self.value(float, "column", column);
        out += &self.value(float, "rx", "shifted - across * column");
        out += &self.value(float, "fu", "rx / across - 0.5 * fv");
        out += &self.value(int, "i", &format!("{int}(column)"));
        out += &self.value(int, "j", &format!("{int}(row)"));
        out += "    // The triangle's corners are (i + k, j + k), (i + 1 - k, j + k) and (i + k, j + 1 - k).\n";
        out += &self.value(float, "s", "step(1.0, fu + fv)");
        out += &self.value(int, "k", &format!("{int}(s)"));
        out +=
            "    // Weights of their parts. Parts that are alike gain nothing where they meet.\n";
        out += &self.value(float, "sharpness", &number(layout.sharpness as f32));
        let weights = ["1.0 - fu - fv", "s - fu", "s - fv"];
        for (m, weight) in weights.iter().enumerate() {
            let weight = format!("pow(max(abs({weight}), 1e-6), sharpness)");
            out += &self.value(float, &format!("w{m}"), &weight);
        }
        for (side, corner) in [("01", "i, j + k"), ("02", "i + k, j"), ("12", "i + 1, j")] {
            let alike = format!("{name}_vertex(table, {corner}, 1)");
            out += &self.value(three, &format!("alike{side}"), &alike);
        }
        out += &self.value(
            float,
            "products",
            "w0 * w1 * alike01[0] + w0 * w2 * alike02[1] + w1 * w2 * alike12[2]",
        );
        let deviation = "sqrt(w0 * w0 + w1 * w1 + w2 * w2 + 2.0 / 255.0 * products)";
        out += &self.value(float, "deviation", deviation);
        let coarsest = number((tiling.levels - 1) as f32);
        out += "    // The level of the input that samples so far apart can hold, and what is left of the last.\n";
        let level = format!("clamp(log2(max(footprint, 1.0)), 0.0, {coarsest})");
        out += &self.value(float, "level", &level);
        out += &self.value(float, "kept", &format!("{name}_kept({coarsest}, footprint)"));
        let sampler = self.sampler();
        for m in 0..layout.input.pictures.len() {
            let part = |corner: &str, x: &str, y: &str| {
                format!(
                    "{name}_part(table, input_{m}{sampler}, {corner}, \
                     rx - across * {x}, ry - down * {y}, level)"
                )
            };
            let parts = [
                part("i + k, j + k", "1.5 * s", "s"),
                part("i + 1 - k, j + k", "(1.0 - 0.5 * s)", "s"),
                part("i + k, j + 1 - k", "(0.5 + 0.5 * s)", "(1.0 - s)"),
            ];
            let [a, b, c] = parts;
            let sum = format!("w0 * {a}\n        + w1 * {b}\n        + w2 * {c}");
            out += &self.value(three, &format!("parts_{m}"), &sum);
        }
        let together = layout.input.together();
        for (c, channel) in program.channels.iter().enumerate() {
            let _ = writeln!(out, "    // Independent channel {c}.");
            let weight = number(channel.weights[0]);
            let (m, of) = (c / together, c % together);
            let noise = format!("{weight} * kept / deviation * parts_{m}[{of}]");
            out += &self.value(float, &format!("n{c}"), &noise);
            if channel.shape.is_some() {
                let left = left(tiling.deviations.iter().map(|of| of[c]));
                out += &self.value(float, &format!("left{c}"), &format!("kept * ({left})"));
                let lost = format!("max(1.0 - left{c} * left{c}, 0.0)");
                out += &self.value(float, &format!("lost{c}"), &lost);
            }
            out += &self.channel(name, c, channel);
        }
        out
    }
}

/// What is left of a channel's deviation at `level`: straight from each level to the next.
fn left(deviations: impl Iterator<Item = f64>) -> String {
    let deviations: Vec<f64> = deviations.collect();
    let mut out = number(deviations[0] as f32);
    for (n, pair) in deviations.windows(2).enumerate() {
        let step = number((pair[0] - pair[1]) as f32);
        let past =
            if n == 0 { "level".to_owned() } else { format!("level - {}", number(n as f32)) };
        let _ = write!(out, " - {step} * clamp({past}, 0.0, 1.0)");
    }
    out
}

/// `NAME_input`, or `NAME_input_0`, `NAME_input_1`, ... if there are several.
pub(super) fn picture_names(name: &str, what: &str, tiling: &ProgramTiling) -> Vec<String> {
    match tiling.layout.input.pictures.len() {
        1 => vec![format!("{name}_{what}")],
        count => (0..count).map(|m| format!("{name}_{what}_{m}")).collect(),
    }
}

/// `NAME_table.png` and the pictures of the input.
pub(super) fn table_and_input(name: &str, tiling: &ProgramTiling) -> Result<Vec<ExportFile>> {
    let mut out = vec![table_picture(name, tiling)?];
    let files = tiling.layout.input.files()?;
    for (name, bytes) in picture_names(name, "input", tiling).into_iter().zip(files) {
        out.push(ExportFile { name: format!("{name}.png"), bytes });
    }
    Ok(out)
}

/// `NAME_table.png`: a pixel for each vertex, in its left half the choices along x and y, in its right
/// half how alike the vertex and the next ones are.
fn table_picture(name: &str, tiling: &ProgramTiling) -> Result<ExportFile> {
    let table = &tiling.layout.table;
    let rows = table.choices.chunks(SIDE).zip(table.alike.chunks(SIDE));
    let texels = rows.flat_map(|(choices, alike)| {
        choices.iter().map(|[x, y]| [*x, *y, 0]).chain(alike.iter().copied()).flatten()
    });
    let samples = Samples::U8(texels.collect());
    let picture = Picture::new(SIDE, 2 * SIDE, 3, samples, Encoding::Data)?;
    let bytes = encode(&picture, Format::Png, &WriteOptions::new(MapKind::Data))?;
    Ok(ExportFile { name: format!("{name}_table.png"), bytes })
}

/// The table as literals, two for each vertex: its choices, and how alike the next ones are.
pub(super) fn table_literals(tiling: &ProgramTiling) -> Vec<String> {
    let table = &tiling.layout.table;
    let packed = |bytes: [u8; 3]| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], 0]).to_string();
    let vertices = table.choices.iter().zip(&table.alike);
    vertices.flat_map(|([x, y], alike)| [packed([*x, *y, 0]), packed(*alike)]).collect()
}

/// Width of a picture of all levels of the input.
fn with_levels(tiling: &ProgramTiling) -> u32 {
    let [width, _] = tiling.layout.input.size;
    if tiling.levels > 1 { width + width / 2 } else { width }
}

/// `NAME_levels.png`, one for each picture of the input: the input on the left, its halves on the right,
/// one below the other, for languages that have no levels.
pub(super) fn levels_pictures(name: &str, tiling: &ProgramTiling) -> Result<Vec<ExportFile>> {
    let input = &tiling.layout.input;
    let [width, height] = input.size.map(|n| n as usize);
    let together = input.together();
    let across = with_levels(tiling) as usize;
    let mut out = Vec::new();
    for (name, picture) in picture_names(name, "levels", tiling).iter().zip(&*input.pictures) {
        let mut texels = vec![0; across * height * together];
        let fine: Vec<f32> = picture.iter().map(|&v| f32::from(v)).collect();
        let (mut level, mut at) = ((width, height, fine), (0, 0));
        for n in 0..tiling.levels {
            let (w, h, samples) = &level;
            for (y, row) in samples.chunks(w * together).enumerate() {
                let to = ((at.0 + y) * across + at.1) * together;
                for (texel, sample) in texels[to..].iter_mut().zip(row) {
                    *texel = sample.round() as u16;
                }
            }
            at = if n == 0 { (0, width) } else { (at.0 + h, width) };
            if n + 1 < tiling.levels {
                level = halved((*w, *h), samples, together);
            }
        }
        let samples = Samples::U16(texels);
        let picture = Picture::new(height, across, together, samples, Encoding::Data)?;
        let bytes = encode(&picture, Format::Png, &WriteOptions::new(MapKind::Data))?;
        out.push(ExportFile { name: format!("{name}.png"), bytes });
    }
    Ok(out)
}

/// Comments about the table and the pictures of the input.
pub(super) fn about_table_and_input(name: &str, tiling: &ProgramTiling) -> String {
    let [width, height] = tiling.layout.input.size;
    let files: Vec<_> =
        picture_names(name, "input", tiling).iter().map(|n| format!("{n}.png")).collect();
    let (files, many) = (files.join(", "), files.len() > 1);
    let (hold, them) = if many { ("hold", "them") } else { ("holds", "it") };
    format!(
        "// {name}_table.png ({} x {SIDE}) tells which part of the photo lies where. Load it as it is: 8 bits, not\n\
         // sRGB, not compressed, no mipmaps, top row first (or set flipped).\n\
         // {files} ({width} x {height}) {hold} the photo. Load {them} with 16 bits (8 do for most photos), not sRGB,\n\
         // with mipmaps, linear filters and the border going on outside (clamp to edge).\n",
        2 * SIDE
    )
}

/// Comments about the pictures of all levels.
pub(super) fn about_levels(name: &str, tiling: &ProgramTiling) -> String {
    let [_, height] = tiling.layout.input.size;
    let files: Vec<_> =
        picture_names(name, "levels", tiling).iter().map(|n| format!("{n}.png")).collect();
    let hold = if files.len() > 1 { "hold" } else { "holds" };
    format!(
        "// {} ({} x {height}) {hold} the photo's parts at all scales; give the path to input_0 and so on.\n",
        files.join(", "),
        with_levels(tiling)
    )
}
