//! GLSL: functions to include or paste, and a shader that shows them.

use super::shader::{Language, Output, about_tile, heading, outputs};
use super::tile::tile_picture;
use super::{ExportFile, Program};
use crate::base::error::Result;

const GLSL: Language = Language {
    float: "float",
    int: "int",
    bool: "bool",
    vectors: ["vec2", "vec3", "vec4"],
    name_first: false,
    tile: &[("sampler2D", "tile"), ("int", "layer")],
    coefficient: "    \
    int line = (row & 255) + 256 * layer;
    const bool flipped = false; // true where pictures are loaded bottom row first
    if (flipped) { line = textureSize(tile, 0).y - 1 - line; }
    vec2 bytes = texelFetch(tile, ivec2(column & 255, line), 0).rg;
    return dot(bytes, vec2(65280.0, 255.0)) - 32768.0;
",
    handed: "tile, layer",
    chosen: |tile| format!("tile, {tile}"),
};

/// `NAME.glsl`, `NAME_example.frag` and the picture of coefficients.
pub(super) fn glsl(name: &str, program: &Program, es: bool) -> Result<Vec<ExportFile>> {
    let functions = heading(name, program, &about_tile(name, program))
        + &GLSL.texture(name, program, ("sampler2D", "tile"));
    let version = if es {
        "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2D;\n"
    } else {
        "#version 330\n"
    };
    let example = format!("{version}{functions}{}", example(name, &outputs(program)));
    Ok(vec![
        ExportFile { name: format!("{name}.glsl"), bytes: functions.into_bytes() },
        ExportFile { name: format!("{name}_example.frag"), bytes: example.into_bytes() },
        tile_picture(name, program)?,
    ])
}

fn example(name: &str, outputs: &[Output]) -> String {
    let returned = GLSL.returned(name, outputs);
    let (uniform, shown) = if let [one] = outputs {
        (String::new(), format!("    color = {};\n", GLSL.shown(one, "texture_here")))
    } else {
        let line = |(i, o): (usize, &Output)| {
            let value = GLSL.shown(o, &format!("texture_here.{}", o.name));
            format!("    if (shown == {i}) {{ color = {value}; }}\n")
        };
        let lines: String = outputs.iter().enumerate().map(line).collect();
        (
            "uniform int shown; // which of the maps\n".into(),
            format!("    color = vec4(0.0);\n{lines}"),
        )
    };
    format!(
        "
// An example: the texture over the whole window.
uniform sampler2D {name}_tile;
uniform vec2 origin; // of the window, in pixels of the photo
uniform float scale; // pixels of the photo to a pixel of the window
uniform float contrast;
uniform bool linear_light;
{uniform}out vec4 color;

void main() {{
    vec2 p = origin + scale * gl_FragCoord.xy;
    float footprint = max(length(dFdx(p)), length(dFdy(p)));
    {returned} texture_here = {name}({name}_tile, p, footprint, contrast, linear_light);
{shown}}}
"
    )
}
