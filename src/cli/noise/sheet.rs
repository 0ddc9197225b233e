//! `texforge noise sheet`.

use std::path::PathBuf;

use clap::{ArgMatches, Command};
use serde_json::json;

use super::{path, read, shown, target};
use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::cli::output::{Target, to_stdout};
use crate::cli::show::duration;
use crate::cli::small::{SCHEMA_VERSION, print_json};
use crate::cli::work::{Session, supervise};
use crate::cli::{args, files};
use crate::image::material::MapKind;
use crate::verb::noise::{NamedMap, NoiseParams, fit_noise};

const EXAMPLES: &str = "\
Examples:
  texforge noise sheet granite.jpg -o sheet.png
  texforge noise sheet granite.jpg -o paper.png --bands square --weights direct
  texforge noise sheet granite.json -o sheet.png";

/// The command as it is typed.
pub(super) fn command() -> Command {
    let command = Command::new("sheet")
        .about("Shows the photo beside the texture, four times as large and octave by octave: is noise the right tool?")
        .before_help(EXAMPLES)
        .arg(args::file("input", "PHOTO", "The photo, which is fitted, or a texture's document (NAME.json), which is shown \
             without it").required(true))
        .arg(args::file("output", "SHEET", "The picture to write. `-`: PNG to standard output")
            .short('o')
            .long("output")
            .required(true))
        .args(NoiseParams::schema().into_iter().map(args::flag));
    args::usual(command)
}

/// What was typed.
#[derive(Debug)]
struct Request {
    input: PathBuf,
    output: Target,
    params: NoiseParams,
    force: bool,
}

/// Runs `texforge noise sheet`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let request = Request {
        input: path(matches, "input"),
        output: target(matches)?,
        params: NoiseParams::from_texts(args::text(matches))?,
        force: matches.get_flag("force"),
    };
    let (ctx, session) = Session::begin(matches)?;
    let summary = supervise(&session, move |session| work(session, &ctx, &request))?;
    if matches.get_flag("json") { print_json(&summary) } else { Ok(()) }
}

fn work(session: &Session, ctx: &Ctx, request: &Request) -> Result<serde_json::Value> {
    let place = request.output.file();
    if let Some(path) = place {
        files::check_place(path, &[&request.input], request.force)?;
    }
    let document = request.input.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    let (texture, photo) = if document {
        (read(&request.input)?, None)
    } else {
        let photo = files::read(&request.input, MapKind::Color)?;
        session.check()?;
        let map = NamedMap { name: "basecolor", kind: MapKind::Color, picture: &photo };
        (fit_noise(ctx, &[map], None, &request.params)?.0, Some(photo))
    };
    let sheet = texture.sheet(ctx, photo.as_ref())?;
    let bytes = files::encode(&sheet, place, MapKind::Color, None)?;
    if let Some(path) = place {
        session.staging.stage(path, &bytes)?;
    }
    session.staging.commit(request.force)?;
    if place.is_none() {
        to_stdout(&bytes)?;
    }
    let (elapsed, score) = (session.console.elapsed(), &texture.document().score);
    let what = if document { "texture" } else { "photo, texture" };
    session.console.say(&format!(
        "{}  {what}, four times as large; {} octaves, the finest first; fit {:.2} (recommended: {}), {}",
        shown(&request.output),
        texture.document().octaves(),
        score.fit,
        score.recommended,
        duration(elapsed),
    ));
    Ok(json!({
        "schema_version": SCHEMA_VERSION,
        "verb": "noise sheet",
        "version": env!("CARGO_PKG_VERSION"),
        "path": place.map(|path| path.to_string_lossy()),
        "width": sheet.width(),
        "height": sheet.height(),
        "octaves": texture.document().octaves(),
        "score": score,
        "seconds": { "total": elapsed.as_secs_f64() },
    }))
}
