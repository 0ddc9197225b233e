//! `texforge noise`: procedural textures by example.

mod change;
mod export;
mod fit;
mod render;
mod sheet;

use std::path::{Path, PathBuf};

use clap::{Arg, ArgMatches, Command};

use crate::base::error::{Error, Result};
use crate::cli::args;
use crate::cli::output::{Target, to_stdout};
use crate::cli::work::Session;
use crate::image::io::read_text;
use crate::verb::noise::NoiseTexture;

const EXAMPLES: &str = "\
Examples:
  texforge noise fit granite.jpg -o granite.json
  texforge noise render granite.json -o granite.png --size 2048
  texforge noise fit --help";

/// The command as it is typed.
pub(super) fn command() -> Command {
    Command::new("noise")
        .about("Turns a photo of something irregular (stone, sand, plaster) into a procedural texture of a kilobyte.")
        .before_help(EXAMPLES)
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommand(fit::command())
        .subcommand(render::command())
        .subcommand(change::morph_command())
        .subcommand(change::edit_command())
        .subcommand(sheet::command())
        .subcommand(export::command())
}

/// Runs `texforge noise`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    match matches.subcommand() {
        Some(("fit", matches)) => fit::run(matches),
        Some(("render", matches)) => render::run(matches),
        Some(("morph", matches)) => change::morph(matches),
        Some(("edit", matches)) => change::edit(matches),
        Some(("sheet", matches)) => sheet::run(matches),
        Some(("export", matches)) => export::run(matches),
        _ => Err(Error::Internal { message: "a command of noise is not connected".into() }),
    }
}

/// A document as an argument.
fn document(id: &'static str, value_name: &'static str) -> Arg {
    args::file(id, value_name, "A texture's document, written by `texforge noise fit`")
        .required(true)
}

/// Where a document goes, as an argument.
fn output() -> Arg {
    args::file("output", "TEXTURE.json", "The document to write. `-`: to standard output")
        .short('o')
        .long("output")
        .required(true)
}

fn path(matches: &ArgMatches, id: &str) -> PathBuf {
    matches.get_one::<PathBuf>(id).cloned().unwrap_or_default()
}

/// Reads a document; errors name the file.
fn read(path: &Path) -> Result<NoiseTexture> {
    NoiseTexture::from_json(&read_text(path)?).map_err(|error| match error {
        Error::Document { reason } => Error::Decode {
            path: path.to_owned(),
            reason: format!(
                "it is no procedural texture: {reason}; make one with `texforge noise fit`"
            ),
        },
        error => error,
    })
}

/// Writes a document.
fn write(session: &Session, target: &Target, texture: &NoiseTexture, force: bool) -> Result<()> {
    let text = texture.to_json() + "\n";
    if let Some(path) = target.file() {
        session.staging.stage(path, text.as_bytes())?;
    }
    session.staging.commit(force)?;
    match target {
        Target::Stdout => to_stdout(text.as_bytes()),
        Target::File(_) => Ok(()),
    }
}

/// What a texture consists of, for people: bands, or tiles.
fn made_of(bands: usize) -> String {
    if bands == 0 { "tiles".into() } else { format!("{bands} bands") }
}

/// What a target is called.
fn shown(target: &Target) -> String {
    match target {
        Target::Stdout => "standard output".into(),
        Target::File(path) => path.display().to_string(),
    }
}

/// The target that was typed; standard output takes one thing only.
fn target(matches: &ArgMatches) -> Result<Target> {
    let target = Target::typed(&path(matches, "output"))?;
    if target == Target::Stdout && matches.get_flag("json") {
        let expected = "left out when the result goes to standard output";
        return Err(Error::parameter("json", expected, "`-o -`"));
    }
    Ok(target)
}

/// The error, about a flag that has another name than the parameter.
fn about(flag: &'static str, error: Error) -> Error {
    match error {
        Error::Parameter { expected, got, .. } => Error::Parameter { name: flag, expected, got },
        error => error,
    }
}
