//! WGSL: functions to import or paste, and a shader that shows them.

use super::shader::{
    Language, Output, about_pictures, heading, outputs, pictures, pictures_in_example,
};
use super::tiling::Reading;
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
    reading: Reading {
        table: ("texture_2d<f32>", "table"),
        picture: "texture_2d<f32>",
        sampler: Some(("sampler", "filtering")),
        above: "const NAME_flipped = false; // true where pictures are loaded bottom row first\n\n",
        vertex: "    \
    var line = j & 31;
    if (NAME_flipped) { line = 31 - line; }
    let bytes = textureLoad(table, vec2<i32>((i & 31) + 32 * side, line), 0).rgb;
    return floor(bytes * 255.0 + 0.5);
",
        sample: "    \
    var at = vec2<f32>(x / WIDTH, y / HEIGHT);
    if (NAME_flipped) { at.y = 1.0 - at.y; }
    return (textureSampleLevel(picture, filtering, at, level).rgb * 65535.0 - 32768.0) / 8192.0;
",
    },
};

/// `NAME.wgsl`, `NAME_example.wgsl` and the picture of coefficients.
pub(super) fn wgsl(name: &str, program: &Program) -> Result<Vec<ExportFile>> {
    let functions =
        heading(name, program, &about_pictures(name, program)) + &WGSL.texture(name, program);
    let example = format!("{functions}{}", example(name, program));
    let mut files = vec![
        ExportFile { name: format!("{name}.wgsl"), bytes: functions.into_bytes() },
        ExportFile { name: format!("{name}_example.wgsl"), bytes: example.into_bytes() },
    ];
    files.extend(pictures(name, program)?);
    Ok(files)
}

fn example(name: &str, program: &Program) -> String {
    let outputs = &outputs(program)[..];
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
    let given = pictures_in_example(name, program);
    let mut bound: Vec<_> = given.iter().map(|p| format!("var {p}: texture_2d<f32>;")).collect();
    let mut given = given.join(", ");
    if program.tiling.is_some() {
        let filtering = format!("{name}_filtering");
        bound.push(format!("var {filtering}: sampler; // linear, also between mipmaps, clamped"));
        given = [given, filtering].join(", ");
    }
    bound.push("var<uniform> view: View;".into());
    let binding = |(i, what): (usize, &String)| format!("@group(0) @binding({i}) {what}\n");
    let bindings: String = bound.iter().enumerate().map(binding).collect();
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
{bindings}
@fragment fn example(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {{
    let p = view.origin + view.scale * at.xy;
    let footprint = max(length(dpdx(p)), length(dpdy(p)));
    let texture_here = {name}({given}, p, footprint, view.contrast, view.linear_light != 0u);
{shown}}}
"
    )
}
