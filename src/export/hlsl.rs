//! HLSL: functions to include, and a shader that shows them.

use std::fmt::Write as _;

use super::shader::{
    Language, Output, about_pictures, heading, outputs, pictures, pictures_in_example,
};
use super::tiling::Reading;
use super::{ExportFile, Program};
use crate::base::error::Result;

const HLSL: Language = Language {
    float: "float",
    int: "int",
    bool: "bool",
    vectors: ["float2", "float3", "float4"],
    name_first: false,
    tile: &[("Texture2D<float4>", "tile"), ("int", "layer")],
    coefficient: "    \
    int row_of_tile = (row & 255) + 256 * layer;
    const bool flipped = false; // true where pictures are loaded bottom row first, as in Unity
    if (flipped) {
        uint width, height;
        tile.GetDimensions(width, height);
        row_of_tile = int(height) - 1 - row_of_tile;
    }
    float2 bytes = tile.Load(int3(column & 255, row_of_tile, 0)).rg;
    return dot(bytes, float2(65280.0, 255.0)) - 32768.0;
",
    handed: "tile, layer",
    chosen: |tile| format!("tile, {tile}"),
    reading: Reading {
        table: ("Texture2D<float4>", "table"),
        picture: "Texture2D<float4>",
        sampler: Some(("SamplerState", "filtering")),
        above: "static const bool NAME_flipped = false; // true where pictures are loaded bottom row first, as in Unity\n\n",
        vertex: "    \
    int row_of_table = j & 31;
    if (NAME_flipped) { row_of_table = 31 - row_of_table; }
    return floor(table.Load(int3((i & 31) + 32 * side, row_of_table, 0)).rgb * 255.0 + 0.5);
",
        sample: "    \
    float2 at = float2(x / WIDTH, y / HEIGHT);
    if (NAME_flipped) { at.y = 1.0 - at.y; }
    return (picture.SampleLevel(filtering, at, level).rgb * 65535.0 - 32768.0) / 8192.0;
",
    },
};

/// `NAME.hlsl`, `NAME_example.hlsl` and the picture of coefficients.
pub(super) fn hlsl(name: &str, program: &Program) -> Result<Vec<ExportFile>> {
    let functions =
        heading(name, program, &about_pictures(name, program)) + &HLSL.texture(name, program);
    let example = format!("{functions}{}", example(name, program));
    let mut files = vec![
        ExportFile { name: format!("{name}.hlsl"), bytes: functions.into_bytes() },
        ExportFile { name: format!("{name}_example.hlsl"), bytes: example.into_bytes() },
    ];
    files.extend(pictures(name, program)?);
    Ok(files)
}

fn example(name: &str, program: &Program) -> String {
    let outputs = &outputs(program)[..];
    let returned = HLSL.returned(name, outputs);
    let (uniform, shown) = if let [one] = outputs {
        (String::new(), format!("    return {};\n", HLSL.shown(one, "texture_here")))
    } else {
        let line = |(i, o): (usize, &Output)| {
            let value = HLSL.shown(o, &format!("texture_here.{}", o.name));
            format!("    if (shown == {i}) {{ color = {value}; }}\n")
        };
        let lines: String = outputs.iter().enumerate().map(line).collect();
        let shown =
            format!("    float4 color = float4(0.0, 0.0, 0.0, 0.0);\n{lines}    return color;\n");
        ("int shown; // which of the maps\n".into(), shown)
    };
    let mut given = pictures_in_example(name, program);
    let texture = |p: &String| format!("Texture2D<float4> {p};\n");
    let mut textures: String = given.iter().map(texture).collect();
    if program.tiling.is_some() {
        let filtering = format!("{name}_filtering");
        let _ = writeln!(
            textures,
            "SamplerState {filtering}; // linear, also between mipmaps, clamped"
        );
        given.push(filtering);
    }
    let given = given.join(", ");
    format!(
        "
// An example: the texture over the whole window.
{textures}float2 origin; // of the window, in pixels of the photo
float scale; // pixels of the photo to a pixel of the window
float contrast;
bool linear_light;
{uniform}
float4 example(float4 at : SV_Position) : SV_Target {{
    float2 p = origin + scale * at.xy;
    float footprint = max(length(ddx(p)), length(ddy(p)));
    {returned} texture_here = {name}({given}, p, footprint, contrast, linear_light);
{shown}}}
"
    )
}
