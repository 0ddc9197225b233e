//! Room 6: procedural textures written for other programs.
//!
//! [`Program`] lists what every target needs; each target is one file that turns it into text.

mod blender;
mod materialx;
mod nodes;
mod program;

pub use program::{Program, ProgramChannel, ProgramTerm};

/// One file of an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportFile {
    /// Its name without a folder.
    pub name: String,
    /// Its contents.
    pub bytes: Vec<u8>,
}

/// Temporary.
///
/// # Errors
/// None.
pub fn nodes_export(evaluator: &crate::method::noise::Evaluator, target: &str, name: &str) -> crate::Result<Vec<ExportFile>> {
    let program = Program::new(evaluator);
    match target {
        "materialx" => materialx::materialx(&program, name),
        _ => Ok(blender::blender(&program, name)),
    }
}
