//! `texforge noise export`.

use std::path::PathBuf;
use std::sync::Arc;

use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgAction, ArgMatches, Command};
use serde_json::json;

use super::{document, path, read};
use crate::base::error::{Error, Result};
use crate::base::params::Value as _;
use crate::cli::small::{SCHEMA_VERSION, print_json};
use crate::cli::work::{Session, watch_signals};
use crate::cli::{args, folder};
use crate::export::{ExportFile, Target, export};
use crate::image::io::check_place;

const EXAMPLES: &str = "\
Examples:
  texforge noise export granite.json --to glsl -o shaders
  texforge noise export granite.json --to wgsl,hlsl,osl -o shaders
  texforge noise export granite.json --to glsl-es -o web --name stone";

/// The command as it is typed.
pub(super) fn command() -> Command {
    Command::new("export")
        .about("Writes a texture for other programs: shaders that evaluate it at any point, without texforge.")
        .before_help(EXAMPLES)
        .arg(document("document", "TEXTURE"))
        .arg(
            args::file("output", "DIR", "The folder to write to, made if it is not there")
                .short('o')
                .long("output")
                .required(true),
        )
        .arg(
            Arg::new("to")
                .long("to")
                .value_name("TARGET,...")
                .required(true)
                .action(ArgAction::Append)
                .value_delimiter(',')
                .value_parser(PossibleValuesParser::new(Target::CHOICES))
                .help("The languages or programs to write for; may be repeated"),
        )
        .arg(
            Arg::new("name")
                .long("name")
                .value_name("NAME")
                .help("What files and functions are called; without it the document's file name decides"),
        )
        .next_help_heading("Outputs")
        .arg(args::switch("force", "Overwrite outputs that exist already"))
        .arg(args::json())
        .arg(args::switch("quiet", "Say nothing but errors").short('q'))
}

/// What was typed.
#[derive(Debug)]
struct Request {
    document: PathBuf,
    folder: PathBuf,
    name: String,
    targets: Vec<Target>,
    force: bool,
}

/// Runs `texforge noise export`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let document = path(matches, "document");
    let stem = || document.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let typed = matches.get_many::<String>("to").into_iter().flatten();
    let mut targets: Vec<Target> = Vec::new();
    for target in typed.filter_map(|word| Target::parse(word)) {
        if !targets.contains(&target) {
            targets.push(target);
        }
    }
    let request = Request {
        name: matches.get_one::<String>("name").cloned().unwrap_or_else(stem),
        folder: path(matches, "output"),
        targets,
        force: matches.get_flag("force"),
        document,
    };
    folder::check(&request.folder, &[], &[], request.force)?;
    let session = Session::new(Arc::default(), matches.get_flag("quiet"));
    watch_signals();
    let folder = request.folder.clone();
    let summary = folder::filled(&folder, &session, move |session| work(session, &request))?;
    if matches.get_flag("json") { print_json(&summary) } else { Ok(()) }
}

fn work(session: &Session, request: &Request) -> Result<serde_json::Value> {
    let texture = read(&request.document)?;
    let program = texture.program();
    let mut files: Vec<(Target, PathBuf, Vec<u8>)> = Vec::new();
    for &target in &request.targets {
        session.check()?;
        for ExportFile { name, bytes } in export(&request.name, &program, target)? {
            let path = request.folder.join(name);
            match files.iter().find(|(_, other, _)| *other == path) {
                None => files.push((target, path, bytes)),
                // Several targets share a file.
                Some((_, _, same)) if *same == bytes => {}
                Some(_) => {
                    let message = format!("two targets write {}", path.display());
                    return Err(Error::Internal { message });
                }
            }
        }
    }
    if !request.folder.exists() {
        std::fs::create_dir(&request.folder).map_err(Error::io("write", &request.folder))?;
    } else if !request.folder.is_dir() {
        return Err(Error::Exists { path: request.folder.clone() });
    }
    let inputs = [request.document.as_path()];
    files.iter().try_for_each(|(_, path, _)| check_place(path, &inputs, request.force))?;
    for (_, path, bytes) in &files {
        session.staging.stage(path, bytes)?;
    }
    session.staging.commit(request.force)?;
    let written = |(target, path, bytes): &(Target, PathBuf, Vec<u8>)| {
        session.console.say(&format!(
            "{}  {} bytes ({})",
            path.display(),
            bytes.len(),
            target.show()
        ));
        json!({ "target": target.show(), "path": path.to_string_lossy(), "bytes": bytes.len() })
    };
    Ok(json!({
        "schema_version": SCHEMA_VERSION,
        "verb": "noise export",
        "version": env!("CARGO_PKG_VERSION"),
        "files": files.iter().map(written).collect::<Vec<_>>(),
    }))
}
