//! Room 6: procedural textures written for other programs.
//!
//! [`Program`] lists what every target needs; each target is one file that turns it into text.

mod blender;
mod glsl;
mod hlsl;
mod materialx;
mod names;
mod nodes;
mod osl;
mod program;
mod shader;
mod tile;
mod tiling;
mod wgsl;

use crate::base::error::Result;
use crate::base::params::choice;

pub use program::{Program, ProgramChannel, ProgramTerm, ProgramTiling};

choice! {
    /// A language or a program that a texture is written for.
    pub enum Target {
        /// GLSL 3.30 and later, for desktop OpenGL and Vulkan.
        Glsl = "glsl",
        /// GLSL ES 3.00: WebGL 2, Three.js, Godot.
        GlslEs = "glsl-es",
        /// WGSL: WebGPU, Bevy.
        Wgsl = "wgsl",
        /// HLSL, shader model 4 and later: Unity, Unreal.
        Hlsl = "hlsl",
        /// Open Shading Language: Blender's Cycles and other renderers.
        Osl = "osl",
        /// `MaterialX`: Houdini, Maya, Unreal, USD.
        Materialx = "materialx",
        /// A Python script that builds a node group in Blender, for Eevee and Cycles.
        Blender = "blender",
    }
}

/// One file of an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportFile {
    /// Its name without a folder.
    pub name: String,
    /// Its contents.
    pub bytes: Vec<u8>,
}

/// The files of a texture for a target. `texture_name` names them and the functions in them, with `_`
/// for what cannot stand in a name, and `_texture` behind a word that a language keeps for itself.
///
/// The same program gives the same bytes.
///
/// # Errors
/// [`Error::Format`](crate::Error::Format) if a picture cannot be written, which would be a bug.
pub fn export(texture_name: &str, program: &Program, target: Target) -> Result<Vec<ExportFile>> {
    let name = &names::identifier(texture_name, "texture");
    let plain = &names::plain(texture_name, "texture");
    match target {
        Target::Glsl => glsl::glsl(name, program, false),
        Target::GlslEs => glsl::glsl(name, program, true),
        Target::Wgsl => wgsl::wgsl(name, program),
        Target::Hlsl => hlsl::hlsl(name, program),
        Target::Osl => osl::osl(name, program),
        Target::Materialx => materialx::materialx(program, plain),
        Target::Blender => Ok(blender::blender(program, plain)),
    }
}
