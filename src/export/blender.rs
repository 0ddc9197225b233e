//! Blender: a Python script that builds a shader node group, for Eevee and Cycles alike.
//!
//! Its code is `blender_group.py`, behind it come the numbers. The script draws the pictures itself. It
//! draws the coefficients of cubic splines, which Blender can look up: with 3 samples to a coefficient the
//! error of a band is 0.3 to 0.4 % of its amplitude.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::nodes::{Group, Nodes, TOGETHER};
use super::{ExportFile, Program};
use crate::image::material::MapKind;

/// The script's `FINE`.
const FINE: usize = 3;

/// What builds the group: functions.
const CODE: &str = include_str!("blender_group.py");

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
    let bands = program.terms.iter().zip(&nodes.spans);
    let bands = bands.map(|(term, span)| json!({ "tile": term.tile, "span": span }));
    let matrix = program.matrix.iter().map(|row| row.chunks(TOGETHER).map(three).collect());
    let numbers = [
        ("name", json!(name)),
        ("size", json!(program.size)),
        ("turn", json!(nodes.turn.map_or(Vec::new(), |rows| rows.to_vec()))),
        ("maps", maps.collect()),
        ("mean", json!(program.mean)),
        ("matrix", matrix.collect::<Vec<Value>>().into()),
        ("bands", bands.collect()),
        ("groups", nodes.groups.iter().map(group).collect()),
        ("shifts", json!(nodes.shifts)),
    ];
    let mut text = format!(
        r#""""{name}: a procedural texture by texforge, as a shader node group for Blender 4.0 and newer.

Run it in Blender's text editor, or by `blender --python {name}.py`; then, in a material's nodes, choose
Add > Group > {name}. Its input Vector takes texture coordinates, of which a unit is one photo (connect
Texture Coordinate's UV; positions work as well), Scale is the number of photos to a unit, Contrast
multiplies what differs from the mean. Every map of the texture is an output: colors in linear light,
normals in the world's directions. Run again, it makes the group anew; materials keep it.
"""

{CODE}build(
    {{
"#
    );
    for (key, value) in numbers {
        // Into a string: that does not fail.
        let _ = writeln!(text, "        \"{key}\": {value},");
    }
    text += "        \"tiles\": [\n";
    for (integers, scale) in &program.tiles {
        let lines = packed(integers);
        let _ = writeln!(
            text,
            "            {{\"scale\": {scale}, \"coefficients\": \"\"\"\n{lines}\"\"\"}},"
        );
    }
    text += "        ],\n    }\n)\n";
    vec![ExportFile { name: format!("{name}.py"), bytes: text.into_bytes() }]
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

/// Integers, little end first, as lines of base 64. (Random numbers: compression would gain 6 %.)
fn packed(integers: &[i16]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const GROUPS_IN_A_LINE: usize = 25;
    let bytes: Vec<u8> = integers.iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut text = String::new();
    for (i, group) in bytes.chunks(3).enumerate() {
        let byte = |k: usize| u32::from(group.get(k).copied().unwrap_or(0));
        let word = (byte(0) << 16) | (byte(1) << 8) | byte(2);
        for k in 0..4 {
            let digit = DIGITS[((word >> (18 - 6 * k)) & 63) as usize];
            text.push(if k <= group.len() { char::from(digit) } else { '=' });
        }
        if i % GROUPS_IN_A_LINE == GROUPS_IN_A_LINE - 1 {
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_written_in_base_64() {
        // By Python: base64.b64encode(numpy.array([1, -2, 3, 4], "<i2")).
        assert_eq!(packed(&[1, -2, 3, 4]), "AQD+/wMABAA=");
        assert_eq!(packed(&[1, -2, 3]), "AQD+/wMA");
        assert_eq!(packed(&[-32768]), "AIA=");
    }
}
