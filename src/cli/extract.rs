//! `texforge extract`.

use std::path::{Path, PathBuf};

use clap::{ArgMatches, Command};
use serde::Serialize;
use serde_json::json;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::record::{Typed, typed_params};
use crate::cli::maps::{self, Asked, Map};
use crate::cli::show::duration;
use crate::cli::small::{SCHEMA_VERSION, told};
use crate::cli::sources::Sources;
use crate::cli::summary::{Seconds, Written};
use crate::cli::work::Session;
use crate::cli::{args, files, folder};
use crate::image::mask::Mask;
use crate::image::material::{MapKind, output_path};
use crate::image::picture::Picture;
use crate::verb::extract::{ExtractParams, Extraction, extract};
use crate::verb::inputs::Inputs;
use crate::verb::params::TileParams;

const EXAMPLES: &str = "\
Examples:
  texforge extract cloth.jpg -o cloth_tiles
  texforge extract cloth.jpg -o cloth_tiles --count 8 --periods 2
  texforge extract facade.jpg -o facade_tiles --period 537x638
  texforge extract cloth.jpg -o cloth_tiles --similarity absolute
  texforge extract facade.jpg -o facade_tiles --flatten 0.3 --band 24
  texforge extract scan.png -o tiles --mask usable.png --map normal=scan_nrm.png
  texforge extract cloth.jpg -o tiles --scale off --save-source-maps";

/// The command as it is typed.
pub(super) fn command() -> Command {
    let command = Command::new(ExtractParams::VERB)
        .about("Cuts the tile out of a photo that repeats (cloth, bricks, windows) that stands best for all of it.")
        .before_help(EXAMPLES)
        .arg(Sources::photo())
        .arg(
            args::file("output", "DIR", "The folder to write to, made if it is not there: tile_01.png (the best), \
                 tiling_01.png and so on, and sheet.png, which shows all; pictures of floats are EXR")
                .short('o')
                .long("output")
                .required(true),
        )
        .args(ExtractParams::schema().into_iter().map(args::flag))
        .next_help_heading("Inputs")
        .arg(Sources::mask())
        .args(maps::flags("A further map of the same surface, cut at the same places (tile_01_NAME.png); may be repeated"))
        .next_help_heading("Outputs")
        .arg(args::switch("save-source-maps", "Also write which photo pixel each tile pixel is (tile_01_source.exr), for \
             `texforge apply`; the photo must not be scaled then"));
    args::usual(command)
}

/// What was typed.
#[derive(Debug)]
struct Request {
    photo: PathBuf,
    folder: PathBuf,
    params: ExtractParams,
    mask: Option<PathBuf>,
    maps: Asked,
    source_maps: bool,
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
    params: Typed,
    photo: Written,
    period: serde_json::Value,
    tile_size: (usize, usize),
    scale: (f64, f64),
    scaled_size: (usize, usize),
    alpha: f64,
    beta: f64,
    positions: usize,
    tiles: Vec<Tile>,
    files: Vec<Written>,
    seconds: Seconds,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Tile {
    /// In the scaled photo.
    x: usize,
    y: usize,
    photo_place: [f64; 2],
    continuity: f64,
    resemblance: f64,
    score: f64,
}

/// Runs `texforge extract`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let path = |id| matches.get_one::<PathBuf>(id).cloned();
    let request = Request {
        photo: path("photo").unwrap_or_default(),
        folder: path("output").unwrap_or_default(),
        params: ExtractParams::from_texts(args::text(matches))?,
        mask: path("mask"),
        maps: Asked::from(matches, 1)?,
        source_maps: matches.get_flag("save-source-maps"),
        force: matches.get_flag("force"),
    };
    let (ctx, session) = Session::begin(matches)?;
    let folder = request.folder.clone();
    let done = folder::filled(&folder, &session, move |session| work(session, &ctx, &request))?;
    told(matches, &session, &done)
}

/// What a tile's files are called; the first is number 1.
fn name(role: &str, i: usize, like: &Picture) -> String {
    let extension = if like.samples().is_float() { "exr" } else { "png" };
    format!("{role}_{:02}.{extension}", i + 1)
}

/// The same of its source map.
fn source_name(i: usize) -> String {
    format!("tile_{:02}_source.exr", i + 1)
}

impl Request {
    /// The files that are read besides those of the maps.
    fn inputs(&self) -> Vec<&Path> {
        [&self.photo].into_iter().chain(&self.mask).map(PathBuf::as_path).collect()
    }

    /// Where the pieces of a map go, one of each tile of `photo`.
    fn places_of(&self, photo: &Picture, map: &str, picture: &Picture) -> Vec<PathBuf> {
        let place = |i| output_path(&self.folder.join(name("tile", i, photo)), map, picture);
        (0..self.params.count).map(place).collect()
    }

    /// Fails if the folder cannot be, or holds one of the files already.
    fn check_places(&self, photo: Option<&Picture>, maps: &[Map]) -> Result<()> {
        let folder = &self.folder;
        let mut files = vec![folder.join("sheet.png")];
        for i in 0..self.params.count {
            files.extend(photo.map(|photo| folder.join(name("tile", i, photo))));
            files.extend(photo.map(|photo| folder.join(name("tiling", i, photo))));
            files.extend(self.source_maps.then(|| folder.join(source_name(i))));
        }
        for Map { wanted, pictures } in maps {
            files.extend(
                photo.iter().flat_map(|photo| self.places_of(photo, wanted.name, &pictures[0])),
            );
        }
        let mut inputs = self.inputs();
        inputs.extend(self.maps.paths());
        inputs.extend(maps.iter().flat_map(|m| &m.wanted.paths).map(PathBuf::as_path));
        folder::check(folder, &files, &inputs, self.force)
    }
}

fn work(session: &Session, ctx: &Ctx, request: &Request) -> Result<(Summary, Vec<String>)> {
    request.check_places(None, &[])?;
    let mut photo = files::read(&request.photo, MapKind::Color)?;
    let mut notes = std::mem::take(&mut photo.meta.notes);
    session.check()?;
    let mask = match &request.mask {
        None => None,
        Some(path) => Some(Mask::from_picture(&files::read(path, MapKind::Color)?)?),
    };
    let photos = std::slice::from_ref(&request.photo);
    let made_of = (photos, &Inputs::new(&photo), &TileParams::default());
    let places = |name: &str, map: &Picture| request.places_of(&photo, name, map);
    let maps = request.maps.read(session, made_of, &request.inputs(), places, &mut notes)?;
    request.check_places(Some(&photo), &maps)?;
    let first = request.folder.join(name("tile", 0, &photo));
    files::ensure_can_hold(&photo, Some(&first), MapKind::Color)?;
    session.check()?;

    let made = extract(ctx, &photo, mask.as_ref(), &request.params)?;
    if request.source_maps && made.source_map(0).is_none() {
        let expected = "`off` when source maps are wanted: the period is no whole number of pixels";
        return Err(Error::parameter("scale", expected, "`down`"));
    }
    notes.extend(made.report.notes.iter().cloned());
    let written = write(session, request, &made, &maps)?;

    notes.iter().for_each(|note| session.console.say(&format!("note: {note}")));
    let elapsed = session.console.elapsed();
    let lines = lines(request, &made, elapsed);
    Ok((summary(ctx, request, made, written, notes, elapsed.as_secs_f64()), lines))
}

/// Writes everything: all of it or nothing.
fn write(
    session: &Session,
    request: &Request,
    made: &Extraction,
    maps: &[Map],
) -> Result<Vec<Written>> {
    let mut all: Vec<(Written, Vec<u8>)> = Vec::new();
    let mut add =
        |role, map: Option<&str>, name: &str, picture: &Picture, kind, record: Option<&str>| {
            session.check()?;
            let path = request.folder.join(name);
            let bytes = files::encode(picture, Some(&path), kind, record)?;
            all.push((Written::new(role, map, &path, picture.width(), picture.height()), bytes));
            Ok::<_, Error>(())
        };
    let mut of_maps = Vec::new();
    for Map { wanted, pictures } in maps {
        of_maps.push((wanted, made.tiles_of(&pictures[0], wanted.kind)?));
    }
    let mut source_maps = Vec::new();
    for (i, tile) in made.tiles.iter().enumerate() {
        let picture = &tile.picture;
        let file = name("tile", i, picture);
        add("tile", None, &file, picture, MapKind::Color, Some(&made.record(i)))?;
        for (wanted, tiles) in &of_maps {
            let path = output_path(Path::new(&file), wanted.name, &tiles[i]);
            let path = path.to_string_lossy();
            add("map", Some(wanted.name), &path, &tiles[i], wanted.kind, None)?;
        }
        let tiling = made.tiling(i)?;
        add("tiling", None, &name("tiling", i, picture), &tiling, MapKind::Color, None)?;
        if let Some(map) = made.source_map(i).filter(|_| request.source_maps) {
            let path = request.folder.join(source_name(i));
            let bytes = files::encode_source_map(map, &path)?;
            let written = Written::new("source_map", None, &path, map.width(), map.height());
            source_maps.push((written, bytes));
        }
    }
    add("sheet", None, "sheet.png", &made.sheet()?, MapKind::Color, None)?;
    all.extend(source_maps);
    if !request.folder.exists() {
        std::fs::create_dir(&request.folder).map_err(Error::io("write", &request.folder))?;
    }
    for (written, bytes) in &all {
        session.staging.stage(Path::new(&written.path), bytes)?;
    }
    session.staging.commit(request.force)?;
    Ok(all.into_iter().map(|(written, _)| written).collect())
}

fn lines(request: &Request, made: &Extraction, elapsed: std::time::Duration) -> Vec<String> {
    let (w, h) = made.report.tile_size;
    let line = |(i, tile): (usize, &crate::verb::extract::ExtractedTile)| {
        let [x, y] = tile.photo_place;
        format!(
            "{}  {w}x{h} from {x:.1}, {y:.1}: score {:.2} (continuity {:.2}, resemblance {:.2})",
            request.folder.join(name("tile", i, &tile.picture)).display(),
            tile.place.score,
            tile.place.continuity,
            tile.place.resemblance,
        )
    };
    let mut lines: Vec<String> = made.tiles.iter().enumerate().map(line).collect();
    let sheet = request.folder.join("sheet.png");
    lines.push(format!("{}  (all and their tilings), {}", sheet.display(), duration(elapsed)));
    lines
}

fn summary(
    ctx: &Ctx,
    request: &Request,
    made: Extraction,
    files: Vec<Written>,
    notes: Vec<String>,
    total: f64,
) -> Summary {
    let tile = |tile: &crate::verb::extract::ExtractedTile| Tile {
        x: tile.place.x,
        y: tile.place.y,
        photo_place: tile.photo_place,
        continuity: tile.place.continuity,
        resemblance: tile.place.resemblance,
        score: tile.place.score,
    };
    let report = made.report;
    let (width, height) = report.photo_size;
    Summary {
        schema_version: SCHEMA_VERSION,
        verb: ExtractParams::VERB,
        version: report.version,
        seed: report.seed,
        threads: ctx.threads(),
        params: typed_params(&ExtractParams::schema(), &report.params),
        photo: Written::new("photo", None, &request.photo, width, height),
        period: json!(report.period),
        tile_size: report.tile_size,
        scale: report.scale,
        scaled_size: report.scaled_size,
        alpha: report.alpha,
        beta: report.beta,
        positions: report.positions,
        tiles: made.tiles.iter().map(tile).collect(),
        files,
        seconds: Seconds { stages: report.seconds, total },
        notes,
    }
}
