//! WGSL: functions to import or paste, and a shader that shows them.

use super::shader::{Language, Output, about_tile, heading, outputs};
use super::tile::tile_picture;
use super::{ExportFile, Program};
use crate::base::error::Result;

const WGSL: Language = Language {
    float: "f32",
    int: "i32",
    bool: "bool",
    vectors: ["vec2<f32>", "vec3<f32>", "vec4<f32>"],
    name_first: true,
    tile: &[("texture_2d<f32>", "tile"), ("i32", "layer")],
    coefficient: "    \
    var line = (row & 255) + 256 * layer;
    let flipped = false; // true where pictures are loaded bottom row first
    if (flipped) { line = i32(textureDimensions(tile).y) - 1 - line; }
    let bytes = textureLoad(tile, vec2<i32>(column & 255, line), 0).rg;
    return dot(bytes, vec2<f32>(65280.0, 255.0)) - 32768.0;
",
    handed: "tile, layer",
    chosen: |tile| format!("tile, {tile}"),
};

/// `NAME.wgsl`, `NAME_example.wgsl` and the picture of coefficients.
pub(super) fn wgsl(name: &str, program: &Program) -> Result<Vec<ExportFile>> {
    let functions = heading(name, program, &about_tile(name, program))
        + &WGSL.texture(name, program, ("texture_2d<f32>", "tile"));
    let example = format!("{functions}{}", example(name, &outputs(program)));
    Ok(vec![
        ExportFile { name: format!("{name}.wgsl"), bytes: functions.into_bytes() },
        ExportFile { name: format!("{name}_example.wgsl"), bytes: example.into_bytes() },
        tile_picture(name, program)?,
    ])
}

fn example(name: &str, outputs: &[Output]) -> String {
    let shown = if let [one] = outputs {
        format!("    return {};\n", WGSL.shown(one, "texture_here"))
    } else {
        let line = |(i, o): (usize, &Output)| {
            let value = WGSL.shown(o, &format!("texture_here.{}", o.name));
            format!("    if (view.shown == {i}u) {{ return {value}; }}\n")
        };
        let lines: String = outputs.iter().enumerate().map(line).collect();
        format!("{lines}    return vec4<f32>();\n")
    };
    format!(
        "
// An example: the texture over the whole window.
struct View {{
    origin: vec2<f32>, // of the window, in pixels of the photo
    scale: f32, // pixels of the photo to a pixel of the window
    contrast: f32,
    linear_light: u32,
    shown: u32, // which of the maps
}}
@group(0) @binding(0) var {name}_tile: texture_2d<f32>;
@group(0) @binding(1) var<uniform> view: View;

@fragment fn example(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {{
    let p = view.origin + view.scale * at.xy;
    let footprint = max(length(dpdx(p)), length(dpdy(p)));
    let texture_here = {name}({name}_tile, p, footprint, view.contrast, view.linear_light != 0u);
{shown}}}
"
    )
}
