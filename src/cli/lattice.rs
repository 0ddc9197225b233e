//! `texforge lattice`.

use std::path::{Path, PathBuf};

use clap::ArgMatches;
use serde_json::json;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::cli::output::to_stdout;
use crate::cli::show::table;
use crate::cli::small::{SCHEMA_VERSION, print_json};
use crate::cli::work::{Session, supervise};
use crate::cli::{args, files};
use crate::image::io::Format;
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Samples};
use crate::verb::lattice::{Lattice, LatticeParams, detect_lattice, lattice_autocorrelation};

/// What was typed.
#[derive(Debug)]
struct Request {
    photo: PathBuf,
    params: LatticeParams,
    overlay: Option<PathBuf>,
    autocorrelation: Option<PathBuf>,
    force: bool,
}

/// Runs `texforge lattice`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written. That there is no lattice is none.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let path = |id| matches.get_one::<PathBuf>(id).cloned();
    let request = Request {
        photo: path("photo").unwrap_or_default(),
        params: LatticeParams::from_texts(args::text(matches))?,
        overlay: path("overlay"),
        autocorrelation: path("autocorrelation"),
        force: matches.get_flag("force"),
    };
    let (ctx, session) = Session::begin(matches)?;
    let json = matches.get_flag("json");
    let lattice = supervise(&session, move |session| work(session, &ctx, &request))?;
    if json { print_json(&report(&lattice)) } else { to_stdout(text(&lattice).as_bytes()) }
}

fn work(session: &Session, ctx: &Ctx, request: &Request) -> Result<Lattice> {
    for path in [&request.overlay, &request.autocorrelation].into_iter().flatten() {
        files::check_place(path, &[&request.photo], request.force)?;
    }
    let photo = files::read(&request.photo, MapKind::Color)?;
    session.check()?;
    let lattice = detect_lattice(ctx, &photo, &request.params)?;
    let stage = |path: &Path, picture: &Picture, kind| {
        session.check()?;
        let bytes = files::encode(picture, Some(path), kind, None)?;
        session.staging.stage(path, &bytes)
    };
    if let Some(path) = &request.overlay {
        stage(path, &lattice.overlay(&photo)?, MapKind::Color)?;
    }
    if let Some(path) = &request.autocorrelation {
        let (map, _) = lattice_autocorrelation(ctx, &photo)?;
        let exact = Format::from_extension(path) == Some(Format::Exr);
        stage(path, &if exact { map } else { grey(&map)? }, MapKind::Data)?;
    }
    session.staging.commit(request.force)?;
    Ok(lattice)
}

/// -1..=1 as 8 bits.
fn grey(map: &Picture) -> Result<Picture> {
    let count = map.height() * map.width();
    let level = |i| ((map.samples().unit(i) * 0.5 + 0.5) * 255.0).round() as u8;
    let samples = Samples::U8((0..count).map(level).collect());
    Picture::new(map.height(), map.width(), 1, samples, Encoding::Data)
}

fn report(lattice: &Lattice) -> serde_json::Value {
    json!({
        "schema_version": SCHEMA_VERSION,
        "verb": LatticeParams::VERB,
        "version": env!("CARGO_PKG_VERSION"),
        "found": lattice.found,
        "confidence": lattice.confidence,
        "v1": lattice.v1,
        "v2": lattice.v2,
        "goodness": lattice.goodness,
        "correlation": lattice.correlation,
    })
}

fn text(lattice: &Lattice) -> String {
    let vector = |[x, y]: [f64; 2]| format!("{x:.2} right, {y:.2} down");
    let verdict =
        if lattice.found { "found" } else { "none found; the vectors are but the best guess" };
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    table(&[
        row("lattice", verdict.to_owned()),
        row("confidence", format!("{:.2}", lattice.confidence)),
        row("v1", vector(lattice.v1)),
        row("v2", vector(lattice.v2)),
    ])
}
