//! OSL: one shader that holds its coefficients.

use std::fmt::Write as _;

use super::shader::{Language, heading, outputs};
use super::tile::stored;
use super::tiling::{Reading, about_levels, levels_pictures, picture_names, table_literals};
use super::{ExportFile, Program};
use crate::base::error::Result;
use crate::method::noise::tiling::SIDE;
use crate::signal::wavelet_noise::Torus;

/// Coefficients are literals, two in an integer: in Cycles a lookup takes a seventh of one in a file, and
/// there is no file to be lost. 32768 literals an array is what its compiler takes well.
const OSL: Language = Language {
    float: "float",
    int: "int",
    bool: "int",
    vectors: ["color", "color", "color"],
    name_first: false,
    tile: &[("int", "tile[32768]")],
    coefficient: "    \
    int i = (row & 255) * 256 + (column & 255);
    return ((tile[i >> 1] >> (16 * (i & 1))) & 65535) - 32768;
",
    handed: "tile",
    chosen: |tile| format!("tile_{tile}"),
    reading: Reading {
        table: ("int", "table[2048]"),
        picture: "string",
        sampler: None,
        above: LEVEL,
        vertex: "    \
    int bytes = table[2 * ((j & 31) * 32 + (i & 31)) + side];
    return color(bytes & 255, (bytes >> 8) & 255, (bytes >> 16) & 255);
",
        sample: "    \
    int low = int(floor(level));
    color fine = NAME_level(picture, x, y, low);
    if (level == low) { return fine; }
    return mix(fine, NAME_level(picture, x, y, low + 1), level - low);
",
    },
};

/// A level of a picture that holds them all. Renderers read between pixels, and filter, each in its own way:
/// the closest pixel is the same in all.
const LEVEL: &str = "\
// A pixel of a picture with all levels of the input.
color NAME_texel(string picture, float column, float row) {
    float s = (column + 0.5) / ACROSS;
    float t = (row + 0.5) / HEIGHT;
    return texture(picture, s, t, \"wrap\", \"clamp\", \"interp\", \"closest\", \"width\", 0.0);
}

// A level of the input, half as large as the last: level 0 lies on the left of the picture, the others on the
// right, one below the other. Between pixels it is linear, and its border goes on outside.
color NAME_level(string picture, float x, float y, int level) {
    float scale = 1.0 / (1 << level);
    float px = clamp(x * scale - 0.5, 0.0, WIDTH * scale - 1.0);
    float py = clamp(y * scale - 0.5, 0.0, HEIGHT * scale - 1.0);
    float tx = px - floor(px);
    float ty = py - floor(py);
    float column = floor(px);
    float row = floor(py);
    if (level > 0) {
        column += WIDTH;
        row += HEIGHT * (1.0 - 2.0 * scale);
    }
    color upper = mix(NAME_texel(picture, column, row), NAME_texel(picture, column + 1, row), tx);
    color lower = mix(NAME_texel(picture, column, row + 1), NAME_texel(picture, column + 1, row + 1), tx);
    return (mix(upper, lower, ty) * 65535.0 - 32768.0) / 8192.0;
}

";

/// `NAME.osl`, and the pictures of a tiled texture.
pub(super) fn osl(name: &str, program: &Program) -> Result<Vec<ExportFile>> {
    let outputs = outputs(program);
    let about =
        program.tiling.as_ref().map_or_else(String::new, |tiling| about_levels(name, tiling));
    let mut text = heading(name, program, &about);
    text += &OSL.helpers(name, program);
    let mut sockets = Vec::new();
    let mut lines = String::new();
    for output in &outputs {
        let value = |i: usize| {
            let v = format!("v{}", output.first + i);
            if output.srgb { format!("(LinearLight ? {name}_linear({v}) : {v})") } else { v }
        };
        let socket = capital(&output.name);
        if output.count == 3 {
            sockets.push(format!("output color {socket} = 0"));
            let values: Vec<_> = (0..3).map(value).collect();
            let _ = writeln!(lines, "    {socket} = color({});", values.join(", "));
        } else {
            for i in 0..output.count {
                let socket =
                    if output.count == 1 { socket.clone() } else { format!("{socket}{}", i + 1) };
                sockets.push(format!("output float {socket} = 0"));
                let _ = writeln!(lines, "    {socket} = {};", value(i));
            }
        }
    }
    let levels = match &program.tiling {
        Some(tiling) => picture_names(name, "levels", tiling),
        None => Vec::new(),
    };
    // Each is a parameter, named as in the functions it is handed to.
    let parameter =
        |(m, file): (usize, &String)| format!("    string input_{m} = \"{file}.png\",\n");
    let files: String = levels.iter().enumerate().map(parameter).collect();
    let [width, height] = program.size;
    let _ = write!(
        text,
        "// UV: texture coordinates, v goes up; the unit square shows what the photo showed.\n\
         // Scale: how many photos to 1. Footprint: distance of samples in pixels of the photo, 0 for no\n\
         // antialiasing. Contrast: 1 as in the photo. LinearLight: 1 for sRGB colors as linear light.\n\
         shader {name}(\n    point UV = point(u, v, 0),\n    float Scale = 1,\n    float Footprint = 0,\n    \
         float Contrast = 1,\n    int LinearLight = 1,\n{files}    {}) {{\n",
        sockets.join(",\n    ")
    );
    for (i, (integers, _)) in program.tiles.iter().enumerate() {
        let pair = |pair: &[i16]| {
            // Two's complement: the odd one's highest bit is the sign.
            let word = u32::from(stored(pair[1])) << 16 | u32::from(stored(pair[0]));
            (word as i32).to_string()
        };
        let rows: Vec<String> = integers
            .chunks(Torus::SIDE)
            .map(|row| row.chunks(2).map(pair).collect::<Vec<_>>().join(","))
            .collect();
        let count = integers.len() / 2;
        let _ = writeln!(text, "    int tile_{i}[{count}] = {{\n{}}};", rows.join(",\n"));
    }
    if let Some(tiling) = &program.tiling {
        let literals = table_literals(tiling);
        let rows: Vec<_> = literals.chunks(2 * SIDE).map(|row| row.join(",")).collect();
        let _ = writeln!(text, "    int table[{}] = {{\n{}}};", literals.len(), rows.join(",\n"));
    }
    let _ = write!(
        text,
        "    float x = UV[0] * Scale * {width};\n    float y = (1 - UV[1] * Scale) * {height};\n    \
         float footprint = Footprint;\n    float contrast = Contrast;\n{}{lines}}}\n",
        OSL.body(name, program)
    );
    let mut out = vec![ExportFile { name: format!("{name}.osl"), bytes: text.into_bytes() }];
    if let Some(tiling) = &program.tiling {
        out.extend(levels_pictures(name, tiling)?);
    }
    Ok(out)
}

/// With a capital, as sockets are written.
fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters
        .next()
        .map_or_else(String::new, |c| c.to_ascii_uppercase().to_string() + letters.as_str())
}
