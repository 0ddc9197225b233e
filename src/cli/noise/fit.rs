//! `texforge noise fit`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{ArgMatches, Command};
use serde_json::json;

use super::{made_of, output, path, shown, target, write};
use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::base::record::typed_params;
use crate::cli::maps::{self, Wanted};
use crate::cli::output::Target;
use crate::cli::show::duration;
use crate::cli::small::{SCHEMA_VERSION, print_json};
use crate::cli::sources::Sources;
use crate::cli::summary::{Seconds, Written};
use crate::cli::work::{Session, supervise};
use crate::cli::{args, files};
use crate::image::io::check_place;
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::verb::noise::{NamedMap, NoiseParams, fit_noise};

const EXAMPLES: &str = "\
Examples:
  texforge noise fit granite.jpg -o granite.json
  texforge noise fit plaster.jpg -o plaster.json --mask usable.png
  texforge noise fit rust.jpg -o rust.json --map roughness=rust_rough.png --map height=rust_height.png
  texforge noise fit sand.jpg -o other_sand.json --seed 7
  texforge noise fit gravel.jpg -o gravel.json --model tiling
  texforge noise fit granite.jpg -o paper.json --bands square --weights direct
  texforge noise fit granite.jpg -o - | jq .score";

/// The command as it is typed.
pub(super) fn command() -> Command {
    let command = Command::new("fit")
        .about("Analyses a photo: what remains is a document of about a kilobyte, from which any part of an endless \
                texture like it is made.")
        .before_help(EXAMPLES)
        .arg(Sources::photo())
        .arg(output())
        .args(NoiseParams::schema().into_iter().map(args::flag))
        .next_help_heading("Inputs")
        .arg(Sources::mask())
        .arg(maps::flag("A further map of the same surface and of the photo's size, analysed together with it so that they \
             stay correlated; may be repeated"));
    args::usual(command)
}

/// What was typed.
#[derive(Debug)]
struct Request {
    photo: PathBuf,
    output: Target,
    params: NoiseParams,
    mask: Option<PathBuf>,
    maps: Vec<Wanted>,
    force: bool,
}

/// Runs `texforge noise fit`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let maps = matches.get_many::<OsString>("map").into_iter().flatten();
    let request = Request {
        photo: path(matches, "photo"),
        output: target(matches)?,
        params: NoiseParams::from_texts(args::text(matches))?,
        mask: matches.get_one("mask").cloned(),
        maps: maps::typed(maps, 1)?,
        force: matches.get_flag("force"),
    };
    let (ctx, session) = Session::begin(matches)?;
    let summary = supervise(&session, move |session| work(session, &ctx, &request))?;
    if matches.get_flag("json") { print_json(&summary) } else { Ok(()) }
}

fn work(session: &Session, ctx: &Ctx, request: &Request) -> Result<serde_json::Value> {
    if let Some(path) = request.output.file() {
        let mut inputs: Vec<&Path> = vec![&request.photo];
        inputs.extend(request.mask.iter().map(PathBuf::as_path));
        inputs.extend(request.maps.iter().flat_map(|m| &m.paths).map(PathBuf::as_path));
        check_place(path, &inputs, request.force)?;
    }
    let photo = files::read(&request.photo, MapKind::Color)?;
    let mut notes = photo.meta.notes.clone();
    session.check()?;
    let mask = match &request.mask {
        None => None,
        Some(path) => Some(Mask::from_picture(&files::read(path, MapKind::Color)?)?),
    };
    let mut pictures = vec![("basecolor", MapKind::Color, photo)];
    for wanted in &request.maps {
        session.check()?;
        pictures.push((wanted.name, wanted.kind, files::read(&wanted.paths[0], wanted.kind)?));
    }
    let maps: Vec<NamedMap> = pictures
        .iter()
        .map(|(name, kind, picture)| NamedMap { name, kind: *kind, picture })
        .collect();
    let (texture, report) = fit_noise(ctx, &maps, mask.as_ref(), &request.params)?;
    notes.extend(report.notes.iter().cloned());
    write(session, &request.output, &texture, request.force)?;

    notes.iter().for_each(|note| session.console.say(&format!("note: {note}")));
    let (elapsed, score) = (session.console.elapsed(), &texture.document().score);
    let made_of = made_of(report.bands);
    session.console.say(&format!(
        "{}  {} bytes, {made_of}, seed {}, fit {:.2} (recommended: {}), {}",
        shown(&request.output),
        report.bytes,
        ctx.seed,
        score.fit,
        score.recommended,
        duration(elapsed),
    ));
    let (width, height) = report.photo_size;
    Ok(json!({
        "schema_version": SCHEMA_VERSION,
        "verb": NoiseParams::VERB,
        "version": report.version,
        "seed": ctx.seed,
        "threads": ctx.threads(),
        "params": typed_params(&NoiseParams::schema(), &report.params),
        "photo": Written::new("photo", None, &request.photo, width, height),
        "path": request.output.file().map(|path| path.to_string_lossy()),
        "bytes": report.bytes,
        "bands": report.bands,
        "score": score,
        "maps": texture.document().maps,
        "seconds": Seconds { stages: report.seconds, total: elapsed.as_secs_f64() },
        "notes": notes,
    }))
}
