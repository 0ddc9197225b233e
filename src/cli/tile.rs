//! `texforge tile`.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ArgMatches;
use serde::{Serialize, Serializer};

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::cli::maps::{self, Wanted};
use crate::cli::output::{Target, to_stdout};
use crate::cli::show::duration;
use crate::cli::small::{SCHEMA_VERSION, print_json, typed};
use crate::cli::work::{Session, supervise, watch_signals};
use crate::cli::{args, files, preview};
use crate::image::mask::Mask;
use crate::image::material::{MapKind, Sibling};
use crate::image::picture::Picture;
use crate::verb::inputs::Inputs;
use crate::verb::tile::{Costs, Method, Report, Size, Tile, TileParams, tile_from};

/// What was typed, checked as far as it can be without looking at a file.
#[derive(Debug)]
struct Request {
    photo: PathBuf,
    target: Target,
    params: TileParams,
    mask: Option<PathBuf>,
    avoid: Option<PathBuf>,
    maps: Vec<Wanted>,
    pick_up: bool,
    source_map: Option<PathBuf>,
    preview: Option<PathBuf>,
    force: bool,
}

/// A file that the run writes.
#[derive(Debug, Serialize)]
struct Written {
    role: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    path: String,
    width: usize,
    height: usize,
}

/// The `--json` object.
#[derive(Debug, Serialize)]
struct Summary {
    schema_version: u32,
    verb: &'static str,
    version: &'static str,
    seed: u64,
    threads: usize,
    params: BTreeMap<&'static str, serde_json::Value>,
    photo: Written,
    tile: Written,
    costs: Costs,
    seconds: Seconds,
    files: Vec<Written>,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Seconds {
    /// In the order of the work.
    #[serde(serialize_with = "in_order")]
    stages: Vec<(&'static str, f64)>,
    total: f64,
}

/// Pairs as one JSON object that keeps their order.
fn in_order<S: Serializer>(
    pairs: &[(&'static str, f64)],
    to: S,
) -> std::result::Result<S::Ok, S::Error> {
    to.collect_map(pairs.iter().copied())
}

/// Runs `texforge tile`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let request = Request::typed(matches)?;
    let seed = matches.get_one("seed").copied().unwrap_or_default();
    let threads = matches.get_one("threads").copied().unwrap_or_default();
    let ctx = Ctx::new(seed, threads)?;
    let session = Session::new(ctx.job(), matches.get_flag("quiet"));
    watch_signals();
    let (summary, line) = supervise(&session, move |session| work(session, &ctx, &request))?;
    session.console.say(&line);
    if matches.get_flag("json") { print_json(&summary) } else { Ok(()) }
}

impl Request {
    fn typed(matches: &ArgMatches) -> Result<Self> {
        let path = |id| matches.get_one::<PathBuf>(id).cloned();
        let params = args::tile_params(matches)?;
        let target = Target::typed(&path("output").unwrap_or_default())?;
        let maps = maps::typed(matches.get_many::<OsString>("map").into_iter().flatten())?;
        let source_map = path("save-source-map");
        let wants = |flag| matches.get_flag(flag);
        // Name what contradicts what, before any file is touched.
        let preview = match (&target, wants("preview")) {
            (_, false) => None,
            (Target::File(tile), true) => Some(tile.with_extension("preview.png")),
            (Target::Stdout, true) => return Err(needs_file("preview")),
        };
        if target == Target::Stdout && !maps.is_empty() {
            return Err(needs_file("map"));
        }
        if target == Target::Stdout && wants("json") {
            return Err(needs_file("json"));
        }
        if params.method == Method::MakeSeamless && (source_map.is_some() || !maps.is_empty()) {
            let expected = "one that copies pixels, when maps or a source map are wanted";
            return Err(Error::parameter("method", expected, "`make-seamless`, which blends"));
        }
        Ok(Self {
            photo: path("photo").unwrap_or_default(),
            pick_up: !wants("no-maps")
                && target != Target::Stdout
                && params.method != Method::MakeSeamless,
            target,
            params,
            mask: path("mask"),
            avoid: path("avoid"),
            maps,
            source_map,
            preview,
            force: wants("force"),
        })
    }

    fn inputs(&self) -> Vec<&Path> {
        let maps = self.maps.iter().map(|m| m.path.as_path());
        let masks = self.mask.as_deref().into_iter().chain(self.avoid.as_deref());
        maps.chain([self.photo.as_path()]).chain(masks).collect()
    }

    /// Fails if an output cannot be written, or two outputs are the same file.
    fn check_outputs(&self, maps: &[Output]) -> Result<()> {
        let tile = self.target.file().map(|p| ("output", p));
        let source_map = self.source_map.as_deref().map(|p| ("save-source-map", p));
        let preview = self.preview.as_deref().map(|p| ("preview", p));
        let mut inputs = self.inputs();
        inputs.extend(maps.iter().map(|m| m.wanted.path.as_path()));
        let maps = maps.iter().map(|m| ("map", m.to.as_path()));
        let mut seen: Vec<PathBuf> = Vec::new();
        for (flag, path) in tile.into_iter().chain(source_map).chain(preview).chain(maps) {
            files::check_place(path, &inputs, self.force)?;
            let place = std::path::absolute(path).map_err(Error::io("write", path))?;
            if seen.contains(&place) {
                let got = format!("{} twice", path.display());
                return Err(Error::parameter(flag, "a file of its own for each output", got));
            }
            seen.push(place);
        }
        Ok(())
    }
}

fn needs_file(flag: &'static str) -> Error {
    Error::parameter(flag, "left out when the tile goes to standard output", "`-o -`")
}

/// A map that was read and has a place to go.
struct Output {
    wanted: Wanted,
    picture: Picture,
    to: PathBuf,
}

/// Everything between the checked command line and the renamed files.
fn work(session: &Session, ctx: &Ctx, request: &Request) -> Result<(Summary, String)> {
    // Look at the places before anything is read: the cheapest refusal first.
    request.check_outputs(&[])?;

    // Read all inputs and let them prove that they fit together.
    let photo = files::read(&request.photo, MapKind::Color)?;
    session.check()?;
    let mut notes: Vec<String> = photo.meta.notes.clone();
    let read_mask = |path: &Option<PathBuf>, what| {
        let Some(path) = path else { return Ok(None) };
        let mask = Mask::from_picture(&files::read(path, MapKind::Color)?)?;
        mask.ensure_size(what, photo.height(), photo.width())?;
        Ok(Some(mask))
    };
    let mask = read_mask(&request.mask, "the mask")?;
    let avoid = read_mask(&request.avoid, "the avoid mask")?;
    let maps = read_maps(session, request, &photo, &mut notes)?;
    request.check_outputs(&maps)?;
    files::ensure_can_hold(&photo, request.target.file(), MapKind::Color)?;
    session.check()?;

    // The long work.
    let inputs = Inputs { photo: &photo, mask: mask.as_ref(), avoid: avoid.as_ref() };
    let Tile { picture, source_map, report } = tile_from(ctx, &inputs, &request.params)?;
    notes.extend(report.notes.iter().cloned());

    // Encode and stage every file; the maps follow the tile.
    let record = record(&report);
    let mut written = Vec::new();
    let mut stage = |role, name: Option<&str>, path: &Path, bytes: Vec<u8>, picture: &Picture| {
        session.check()?;
        session.staging.stage(session, path, &bytes)?;
        written.push(Written::new(role, name, path, picture.width(), picture.height()));
        Ok(())
    };
    let bytes = files::encode(&picture, request.target.file(), MapKind::Color, Some(&record))?;
    if let Some(path) = request.target.file() {
        stage("tile", None, path, bytes.clone(), &picture)?;
    }
    if let Some(source_map) = &source_map {
        for Output { wanted, picture: map, to } in &maps {
            let map = source_map.apply(map, wanted.kind)?;
            let bytes = files::encode(&map, Some(to), wanted.kind, None)?;
            stage("map", Some(wanted.name), to, bytes, &map)?;
        }
        if let Some(path) = &request.source_map {
            stage("source_map", None, path, files::encode_source_map(source_map, path)?, &picture)?;
        }
    }
    if let Some(path) = &request.preview {
        let tiling = preview::tiling(&picture)?;
        stage(
            "preview",
            None,
            path,
            files::encode(&tiling, Some(path), MapKind::Color, None)?,
            &tiling,
        )?;
    }

    // All is computed: now the files get their names, all or none.
    session.staging.commit(session, request.force)?;
    if request.target == Target::Stdout {
        to_stdout(&bytes)?;
    }
    for file in written.iter().filter(|w| w.role != "tile") {
        session.console.say(&format!(
            "{}  {}x{} ({})",
            file.path,
            file.width,
            file.height,
            file.what()
        ));
    }
    for note in &notes {
        session.console.say(&format!("note: {note}"));
    }
    let elapsed = session.console.elapsed();
    let line = line(request, &report, elapsed);
    Ok((summary(ctx, request, &report, notes, written, elapsed), line))
}

/// Reads the maps that were typed and those that lie beside the photo. Of the latter, those that
/// do not fit are left out with a note: nobody asked for them.
fn read_maps(
    session: &Session,
    request: &Request,
    photo: &Picture,
    notes: &mut Vec<String>,
) -> Result<Vec<Output>> {
    let mut wanted = request.maps.clone();
    if request.pick_up {
        let taken: Vec<_> = request.inputs().into_iter().map(Path::to_owned).collect();
        for Sibling { name, kind, path } in files::siblings(&request.photo)? {
            let taken = taken.iter().any(|taken| same_place(taken, &path));
            if !taken && !wanted.iter().any(|m| m.name == name) {
                // Shown as the photo was typed.
                let path = path.strip_prefix(".").map_or(path.clone(), Path::to_owned);
                wanted.push(Wanted { name, path, kind, found: true });
            }
        }
    }
    let mut maps = Vec::new();
    for wanted in wanted {
        session.check()?;
        let read = files::read(&wanted.path, wanted.kind).and_then(|map| {
            map.ensure_finite(&format!("the map `{}`", wanted.name))?;
            maps::ensure_fits(&map, photo, &wanted)?;
            Ok(map)
        });
        let shown = wanted.path.display().to_string();
        match read {
            Ok(picture) => {
                let tile = request.target.file().unwrap_or(Path::new("tile.png"));
                let to = maps::output_path(tile, wanted.name, &picture);
                if wanted.found && same_place(&to, &wanted.path) {
                    // What an earlier run made of a map is no map of the photo.
                    notes.push(format!("{shown} was left alone: it is where this tile's map goes"));
                    continue;
                }
                if wanted.found {
                    let name = &wanted.name;
                    session.console.say(&format!(
                        "{shown}: taken as the photo's {name} map (--no-maps leaves it alone)"
                    ));
                }
                maps.push(Output { wanted, picture, to });
            }
            Err(error) if wanted.found => notes.push(format!("{shown} was left alone: {error}")),
            Err(error) => return Err(error),
        }
    }
    Ok(maps)
}

/// Whether two paths name the same file, as far as both exist.
fn same_place(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

impl Written {
    fn new(
        role: &'static str,
        name: Option<&str>,
        path: &Path,
        width: usize,
        height: usize,
    ) -> Self {
        let path = path.to_string_lossy().into_owned();
        Self { role, name: name.map(str::to_owned), path, width, height }
    }

    fn what(&self) -> String {
        match &self.name {
            Some(name) => format!("{name} map"),
            None => self.role.replace('_', " "),
        }
    }
}

/// How the tile was made, for the file itself. Holds nothing that differs between equal runs.
fn record(report: &Report) -> String {
    serde_json::json!({
        "tool": "texforge",
        "version": report.version,
        "verb": TileParams::VERB,
        "seed": report.seed,
        "params": params(report),
    })
    .to_string()
}

fn params(report: &Report) -> BTreeMap<&'static str, serde_json::Value> {
    let schema = TileParams::schema();
    let value = |name: &str, text: &str| match schema.iter().find(|p| p.name == name) {
        Some(param) => typed(param, text),
        None => text.into(),
    };
    report.params.iter().map(|(name, text)| (*name, value(name, text))).collect()
}

fn summary(
    ctx: &Ctx,
    request: &Request,
    report: &Report,
    notes: Vec<String>,
    files: Vec<Written>,
    elapsed: Duration,
) -> Summary {
    let place = request.target.file().unwrap_or(Path::new("-"));
    let (photo, tile) = (report.photo_size, report.tile_size);
    Summary {
        schema_version: SCHEMA_VERSION,
        verb: TileParams::VERB,
        version: report.version,
        seed: report.seed,
        threads: ctx.threads(),
        params: params(report),
        photo: Written::new("photo", None, &request.photo, photo.0, photo.1),
        tile: Written::new("tile", None, place, tile.0, tile.1),
        costs: report.costs,
        seconds: Seconds { stages: report.seconds.clone(), total: elapsed.as_secs_f64() },
        files,
        notes,
    }
}

/// The line at the end.
fn line(request: &Request, report: &Report, elapsed: Duration) -> String {
    let (w, h) = report.tile_size;
    let (photo_w, photo_h) = report.photo_size;
    let why = if request.params.size == Size::Auto {
        format!(" (default size for a {photo_w}x{photo_h} photo)")
    } else {
        String::new()
    };
    let place = match &request.target {
        Target::Stdout => "standard output".into(),
        Target::File(path) => path.display().to_string(),
    };
    let Costs { texture, stationarity } = report.costs;
    let texture = texture.map_or(String::new(), |cost| format!("texture cost {cost:.2}, "));
    format!(
        "{place}  {w}x{h}{why}, seed {}, {}, {texture}stationarity cost {stationarity:.2}",
        report.seed,
        duration(elapsed),
    )
}
