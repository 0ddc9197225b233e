//! GLSL: functions to include or paste, and a shader that shows them.

use super::shader::{
    Language, Output, about_pictures, heading, outputs, pictures, pictures_in_example,
};
use super::tiling::Reading;
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
    reading: Reading {
        table: ("sampler2D", "table"),
        picture: "sampler2D",
        sampler: None,
        above: "const bool NAME_flipped = false; // true where pictures are loaded bottom row first\n\n",
        vertex: "    \
    int line = j & 31;
    if (NAME_flipped) { line = 31 - line; }
    return floor(texelFetch(table, ivec2((i & 31) + 32 * side, line), 0).rgb * 255.0 + 0.5);
",
        sample: "    \
    vec2 at = vec2(x / WIDTH, y / HEIGHT);
    if (NAME_flipped) { at.y = 1.0 - at.y; }
    return (textureLod(picture, at, level).rgb * 65535.0 - 32768.0) / 8192.0;
",
    },
};

/// `NAME.glsl`, `NAME_example.frag` (`NAME_example_es.frag`) and the pictures.
pub(super) fn glsl(name: &str, program: &Program, es: bool) -> Result<Vec<ExportFile>> {
    let functions =
        heading(name, program, &about_pictures(name, program)) + &GLSL.texture(name, program);
    // Both may be written to one folder.
    let (version, suffix) = if es {
        let precision =
            "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\n";
        (format!("#version 300 es\n{precision}"), "_es")
    } else {
        ("#version 330\n".to_owned(), "")
    };
    let example = format!("{version}{functions}{}", example(name, program));
    let mut files = vec![
        ExportFile { name: format!("{name}.glsl"), bytes: functions.into_bytes() },
        ExportFile { name: format!("{name}_example{suffix}.frag"), bytes: example.into_bytes() },
    ];
    files.extend(pictures(name, program)?);
    Ok(files)
}

fn example(name: &str, program: &Program) -> String {
    let outputs = &outputs(program)[..];
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
    let given = pictures_in_example(name, program);
    let sampler = |p: &String| format!("uniform sampler2D {p};\n");
    let samplers: String = given.iter().map(sampler).collect();
    let given = given.join(", ");
    format!(
        "
// An example: the texture over the whole window.
{samplers}uniform vec2 origin; // of the window, in pixels of the photo
uniform float scale; // pixels of the photo to a pixel of the window
uniform float contrast;
uniform bool linear_light;
{uniform}out vec4 color;

void main() {{
    vec2 p = origin + scale * gl_FragCoord.xy;
    float footprint = max(length(dFdx(p)), length(dFdy(p)));
    {returned} texture_here = {name}({given}, p, footprint, contrast, linear_light);
{shown}}}
"
    )
}
