//! OSL: one shader that holds its coefficients.

use std::fmt::Write as _;

use super::shader::{Language, heading, outputs};
use super::tile::stored;
use super::{ExportFile, Program};
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
};

/// `NAME.osl`.
pub(super) fn osl(name: &str, program: &Program) -> Vec<ExportFile> {
    let outputs = outputs(program);
    let mut text = heading(name, program, "");
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
    let [width, height] = program.size;
    let _ = write!(
        text,
        "// UV: texture coordinates, v goes up; the unit square shows what the photo showed.\n\
         // Scale: how many photos to 1. Footprint: distance of samples in pixels of the photo, 0 for no\n\
         // antialiasing. Contrast: 1 as in the photo. LinearLight: 1 for sRGB colors as linear light.\n\
         shader {name}(\n    point UV = point(u, v, 0),\n    float Scale = 1,\n    float Footprint = 0,\n    \
         float Contrast = 1,\n    int LinearLight = 1,\n    {}) {{\n",
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
    let _ = write!(
        text,
        "    float x = UV[0] * Scale * {width};\n    float y = (1 - UV[1] * Scale) * {height};\n    \
         float footprint = Footprint;\n    float contrast = Contrast;\n{}{lines}}}\n",
        OSL.body(name, program)
    );
    vec![ExportFile { name: format!("{name}.osl"), bytes: text.into_bytes() }]
}

/// With a capital, as sockets are written.
fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters
        .next()
        .map_or_else(String::new, |c| c.to_ascii_uppercase().to_string() + letters.as_str())
}
