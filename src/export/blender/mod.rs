//! Blender: a Python script that builds a shader node group, for Eevee and Cycles alike.
//!
//! Its code is `group.py`, and `noise.py` or `tiles.py`; behind it come the numbers. The script draws the
//! pictures itself. Of noise it draws the coefficients of cubic splines, which Blender can look up: with 3
//! samples to a coefficient the error of a band is 0.3 to 0.4 % of its amplitude.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::nodes::{Group, Nodes, TOGETHER, Tiles};
use super::{ExportFile, Program};
use crate::image::material::MapKind;

/// The `FINE` of `noise.py`.
const FINE: usize = 3;

/// What builds the group: functions, which call those of one of the others.
const GROUP: &str = include_str!("group.py");
const NOISE: &str = include_str!("noise.py");
const TILES: &str = include_str!("tiles.py");

/// The file `name.py`.
pub(super) fn blender(program: &Program, name: &str) -> Vec<ExportFile> {
    let nodes = Nodes::new(program, FINE);
    let maps = program.maps.iter().zip(&program.kinds).map(|((map, encoding, channels), kind)| {
        let normal = match kind {
            MapKind::Normal | MapKind::NormalGl => "gl",
            MapKind::NormalDx => "dx",
            MapKind::Color | MapKind::Data => "",
        };
        json!({ "name": map, "encoding": encoding, "channels": channels, "normal": normal })
    });
    let matrix = program.matrix.iter().map(|row| row.chunks(TOGETHER).map(three).collect());
    let (code, own) = match &nodes.tiles {
        Some(tiles) => (TILES, tiling(tiles)),
        None => (NOISE, noise(program, &nodes)),
    };
    let numbers = [
        ("name", json!(name)),
        ("size", json!(program.size)),
        ("maps", maps.collect()),
        ("mean", json!(program.mean)),
        ("matrix", matrix.collect::<Vec<Value>>().into()),
        ("groups", nodes.groups.iter().map(group).collect()),
    ];
    let mut text = format!(
        r#""""{name}: a procedural texture by texforge, as a shader node group for Blender 4.0 and newer.

Run it in Blender's text editor, or by `blender --python {name}.py`; then, in a material's nodes, choose
Add > Group > {name}. Its input Vector takes texture coordinates, of which a unit is one photo (connect
Texture Coordinate's UV; positions work as well), Scale is the number of photos to a unit, Contrast
multiplies what differs from the mean. Every map of the texture is an output: colors in linear light,
normals in the world's directions. Run again, it makes the group anew; materials keep it.
"""

{GROUP}

{code}

build(
    {{
"#
    );
    for (key, value) in numbers {
        // Into a string: that does not fail.
        let _ = writeln!(text, "        \"{key}\": {value},");
    }
    text += &own;
    text += "    }\n)\n";
    vec![ExportFile { name: format!("{name}.py"), bytes: text.into_bytes() }]
}

/// What `noise.py` reads.
fn noise(program: &Program, nodes: &Nodes) -> String {
    let bands = program.terms.iter().zip(&nodes.spans);
    let bands = bands.map(|(term, span)| json!({ "tile": term.tile, "span": span }));
    let bands: Value = bands.collect();
    let turn = json!(nodes.turn.map_or(Vec::new(), |rows| rows.to_vec()));
    let shifts = json!(nodes.shifts);
    let mut text = format!(
        r#"        "turn": {turn},
        "bands": {bands},
        "shifts": {shifts},
        "tiles": [
"#
    );
    for (integers, scale) in &program.tiles {
        let bytes: Vec<u8> = integers.iter().flat_map(|v| v.to_le_bytes()).collect();
        let coefficients = packed(&bytes);
        let _ =
            writeln!(text, "            {{\"scale\": {scale}, \"coefficients\": {coefficients}}},");
    }
    text + "        ],\n"
}

/// What `tiles.py` reads.
fn tiling(tiles: &Tiles) -> String {
    let Tiles { cell, sharpness, top, first, step, size, together, .. } = tiles;
    let inputs = tiles.inputs.iter().map(|samples| {
        let bytes: Vec<u8> = samples.iter().flat_map(|v| v.to_le_bytes()).collect();
        packed(&bytes) + ",\n"
    });
    let inputs: String = inputs.collect();
    let [choices, alike] = [&tiles.choices, &tiles.alike].map(|bytes| packed(bytes.as_flattened()));
    format!(
        r#"        "tiling": {{
            "cell": {cell:?},
            "sharpness": {sharpness},
            "top": {top:?},
            "first": {first:?},
            "step": {step:?},
            "size": {size:?},
            "together": {together},
            "choices": {choices},
            "alike": {alike},
            "inputs": [
{inputs}],
        }},
"#
    )
}

/// A part of a row of the matrix.
fn three(row: &[f32]) -> Value {
    json!(std::array::from_fn::<_, TOGETHER, _>(|k| row.get(k).copied().unwrap_or(0.0)))
}

fn group(group: &Group) -> Value {
    let shape = group.shape.as_ref().map_or(json!({}), |shape| {
        let straight = shape.straight.map_or(Vec::new(), |v| v.to_vec());
        json!({ "straight": straight, "base": shape.base, "pieces": shape.pieces })
    });
    json!({ "offsets": group.offsets, "weights": group.weights, "shape": shape })
}

/// Bytes as a string of the script's, in lines of base 64. (Random numbers: compression would gain 6 %.)
fn packed(bytes: &[u8]) -> String {
    const IN_A_LINE: usize = 75;
    let lines = bytes.chunks(IN_A_LINE).map(|bytes| STANDARD.encode(bytes) + "\n");
    format!("\"\"\"\n{}\"\"\"", lines.collect::<String>())
}
