//! `texforge palette`.

use std::path::{Path, PathBuf};

use clap::builder::RangedU64ValueParser;
use clap::{Arg, ArgMatches, Command};
use serde::Serialize;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::cli::output::Target;
use crate::cli::show::duration;
use crate::cli::small::{SCHEMA_VERSION, told};
use crate::cli::sources::Sources;
use crate::cli::summary::{self, Written};
use crate::cli::work::{Session, supervise};
use crate::cli::{args, files};
use crate::image::material::MapKind;
use crate::verb::palette::{MAX_STEPS, Palette, palette};
use crate::verb::params::TileParams;
use crate::verb::tile::Costs;

const NAME: &str = "palette";

const EXAMPLES: &str = "\
Examples:
  texforge palette wall.jpg -o wall.png
  texforge palette wall.jpg -o wall.png --steps 8 --size 256x256 --quality draft
  texforge tile wall.jpg -o wall.png --stationarity 0.75";

/// The command as it is typed.
pub(super) fn command() -> Command {
    // The palette turns these two itself.
    let turned = |name: &str| name == "sigma" || name == "stationarity";
    let params = TileParams::schema().into_iter().filter(|param| !turned(param.name));
    let command = Command::new(NAME)
        .about("Shows a photo evened out from little to much, in steps that look alike, to choose --stationarity by eye.")
        .before_help(EXAMPLES)
        .arg(Sources::photo())
        .arg(
            args::file("output", "TILE", "The tiles to write: TILE-1.png and so on, and TILE.palette.png, which shows all of them")
                .short('o')
                .long("output")
                .required(true),
        )
        .arg(
            Arg::new("steps")
                .long("steps")
                .value_name("N")
                .default_value("5")
                .value_parser(RangedU64ValueParser::<usize>::new().range(2..=MAX_STEPS as u64))
                .allow_negative_numbers(true)
                .help("How many tiles, 2 to 100"),
        )
        .args(params.map(args::flag))
        .next_help_heading("Inputs")
        .args(Sources::args());
    args::usual(command)
}

/// What was typed.
#[derive(Debug)]
struct Request {
    sources: Sources,
    params: TileParams,
    /// Where each tile goes.
    tiles: Vec<PathBuf>,
    /// Where the picture of all goes.
    sheet: PathBuf,
    force: bool,
}

/// The `--json` object.
#[derive(Debug, Serialize)]
struct Summary {
    schema_version: u32,
    verb: &'static str,
    version: &'static str,
    seed: u64,
    threads: usize,
    steps: Vec<Step>,
    /// Of two neighbours each, in L*a*b* units.
    differences: Vec<f64>,
    /// Sigmas that were tried, and how much the look has changed up to each.
    curve: Vec<(f64, f64)>,
    picture: Written,
    seconds: f64,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Step {
    stationarity: Option<f32>,
    sigma: f32,
    tile: Written,
    costs: Costs,
}

/// Runs `texforge palette`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let output = matches.get_one::<PathBuf>("output").cloned().unwrap_or_default();
    let Target::File(output) = Target::typed(&output)? else {
        return Err(Error::parameter("output", "a file's name, as there are several", "`-`"));
    };
    let steps = matches.get_one("steps").copied().unwrap_or(2);
    let request = Request {
        sources: Sources::typed(matches),
        params: TileParams::from_texts(args::text(matches))?,
        tiles: (1..=steps).map(|i| files::numbered(&output, i)).collect(),
        sheet: output.with_extension("palette.png"),
        force: matches.get_flag("force"),
    };
    let (ctx, session) = Session::begin(matches)?;
    let done = supervise(&session, move |session| work(session, &ctx, &request))?;
    told(matches, &session, &done)
}

fn work(session: &Session, ctx: &Ctx, request: &Request) -> Result<(Summary, Vec<String>)> {
    let sources: Vec<&Path> = request.sources.paths().collect();
    for path in request.tiles.iter().chain([&request.sheet]) {
        files::check_place(path, &sources, request.force)?;
    }
    let pictures = request.sources.read(session)?;
    files::ensure_can_hold(&pictures.photo, Some(&request.tiles[0]), MapKind::Color)?;
    session.check()?;
    let made = palette(ctx, &pictures.inputs(), &request.params, request.tiles.len())?;
    let sheet = made.picture()?;
    let Palette { tiles, differences, curve } = made;
    let mut notes = pictures.notes;
    notes.extend(tiles[0].report.notes.iter().cloned());
    let mut steps = Vec::new();
    let mut lines = Vec::new();
    for (path, tile) in request.tiles.iter().zip(&tiles) {
        session.check()?;
        let record = summary::record(tile.report.seed, &tile.report.params, None);
        let bytes = files::encode(&tile.picture, Some(path), MapKind::Color, Some(&record))?;
        session.staging.stage(path, &bytes)?;
        let (width, height) = tile.report.tile_size;
        let step = Step {
            stationarity: tile.report.stationarity,
            sigma: tile.report.sigma,
            tile: Written::new("tile", None, path, width, height),
            costs: tile.report.costs,
        };
        lines.push(format!(
            "{}  {width}x{height}, stationarity {:.2}, sigma {}, stationarity cost {:.2}",
            path.display(),
            step.stationarity.unwrap_or_default(),
            step.sigma,
            step.costs.stationarity,
        ));
        steps.push(step);
    }
    let bytes = files::encode(&sheet, Some(&request.sheet), MapKind::Color, None)?;
    session.staging.stage(&request.sheet, &bytes)?;
    session.staging.commit(request.force)?;
    notes.iter().for_each(|note| session.console.say(&format!("note: {note}")));
    let elapsed = session.console.elapsed();
    let (width, height) = (sheet.width(), sheet.height());
    lines.push(format!(
        "{}  {width}x{height} (all of them), {}",
        request.sheet.display(),
        duration(elapsed)
    ));
    let summary = Summary {
        schema_version: SCHEMA_VERSION,
        verb: NAME,
        version: tiles[0].report.version,
        seed: ctx.seed,
        threads: ctx.threads(),
        steps,
        differences,
        curve,
        picture: Written::new("palette", None, &request.sheet, width, height),
        seconds: elapsed.as_secs_f64(),
        notes,
    };
    Ok((summary, lines))
}
