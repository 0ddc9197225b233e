//! What `texforge tile` says when it is done: to people, to programs, and in the file itself.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Serialize, Serializer};

use crate::base::ctx::Ctx;
use crate::base::params::Value as _;
use crate::base::record::{record_of, typed_params};
use crate::cli::output::Target;
use crate::cli::show::duration;
use crate::cli::small::SCHEMA_VERSION;
use crate::image::rect::Rect;
use crate::verb::params::{Measure, Size, TileParams};
use crate::verb::tile::{Costs, Report};

/// A file that the run writes.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Written {
    pub(super) role: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    pub(super) path: String,
    pub(super) width: usize,
    pub(super) height: usize,
}

/// The `--json` object.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    schema_version: u32,
    verb: &'static str,
    version: &'static str,
    seed: u64,
    threads: usize,
    params: BTreeMap<&'static str, serde_json::Value>,
    /// The place on the dial that chose the sigma.
    #[serde(skip_serializing_if = "Option::is_none")]
    stationarity: Option<f32>,
    photo: Written,
    /// The further photos.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    also: Vec<Written>,
    tile: Written,
    /// The rectangle that was made anew.
    #[serde(skip_serializing_if = "Option::is_none")]
    redo: Option<Rect>,
    costs: Costs,
    seconds: Seconds,
    /// All tiles, the first as well, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    variants: Vec<Variant>,
    files: Vec<Written>,
    notes: Vec<String>,
}

/// One tile of several.
#[derive(Debug, Serialize)]
struct Variant {
    seed: u64,
    tile: Written,
    costs: Costs,
    #[serde(serialize_with = "in_order")]
    seconds: Vec<(&'static str, f64)>,
}

#[derive(Debug, Serialize)]
pub(super) struct Seconds {
    /// In the order of the work.
    #[serde(serialize_with = "in_order")]
    pub(super) stages: Vec<(&'static str, f64)>,
    pub(super) total: f64,
}

/// Pairs as one JSON object that keeps their order.
fn in_order<S: Serializer>(pairs: &[(&'static str, f64)], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(pairs.iter().copied())
}

impl Written {
    pub(super) fn new(
        role: &'static str,
        name: Option<&str>,
        path: &Path,
        width: usize,
        height: usize,
    ) -> Self {
        let path = path.to_string_lossy().into_owned();
        Self { role, name: name.map(str::to_owned), path, width, height }
    }

    /// What it is, for people.
    pub(super) fn what(&self) -> String {
        match &self.name {
            Some(name) => format!("{name} map"),
            None => self.role.replace('_', " "),
        }
    }
}

/// How the tile was made, for the file itself. Holds nothing that differs between equal runs.
pub(super) fn record(seed: u64, params: &[(&'static str, String)], redo: Option<Rect>) -> String {
    let params = typed_params(&TileParams::schema(), params);
    let mut record = record_of(TileParams::VERB, env!("CARGO_PKG_VERSION"), seed, &params);
    if let Some(rect) = redo {
        record["redo"] = serde_json::json!(rect);
    }
    record.to_string()
}

/// All of a run; `tiles` holds each tile's place and report.
pub(super) fn summary(
    ctx: &Ctx,
    photos: &[PathBuf],
    tiles: &[(Target, Report)],
    notes: Vec<String>,
    files: Vec<Written>,
    elapsed: Duration,
) -> Summary {
    let variant = |(target, report): &(Target, Report)| {
        let place = target.file().unwrap_or(Path::new("-"));
        let (width, height) = report.tile_size;
        let tile = Written::new("tile", None, place, width, height);
        Variant { seed: report.seed, tile, costs: report.costs, seconds: report.seconds.clone() }
    };
    let mut variants: Vec<Variant> = tiles.iter().map(variant).collect();
    let report = &tiles[0].1;
    let first = variant(&tiles[0]);
    if variants.len() == 1 {
        variants.clear();
    }
    let photo = |(path, &(width, height)): (&PathBuf, &(usize, usize))| {
        Written::new("photo", None, path, width, height)
    };
    Summary {
        schema_version: SCHEMA_VERSION,
        verb: TileParams::VERB,
        version: report.version,
        seed: first.seed,
        threads: ctx.threads(),
        params: typed_params(&TileParams::schema(), &report.params),
        stationarity: report.stationarity,
        photo: photo((&photos[0], &report.photo_size)),
        also: photos[1..].iter().zip(&report.also_sizes).map(photo).collect(),
        tile: first.tile,
        redo: report.redo,
        costs: first.costs,
        seconds: Seconds { stages: first.seconds, total: elapsed.as_secs_f64() },
        variants,
        files,
        notes,
    }
}

/// The line at the end of a tile.
pub(super) fn line(
    asked: &TileParams,
    target: &Target,
    report: &Report,
    elapsed: Duration,
) -> String {
    let (w, h) = report.tile_size;
    let (photo_w, photo_h) = report.photo_size;
    let why = if asked.size == Size::Auto && report.redo.is_none() {
        format!(" (default size for a {photo_w}x{photo_h} photo)")
    } else {
        String::new()
    };
    let place = match target {
        Target::Stdout => "standard output".into(),
        Target::File(path) => path.display().to_string(),
    };
    let Costs { texture, stationarity, stationarity_by_measure } = report.costs;
    let texture = texture.map_or(String::new(), |cost| format!("texture cost {cost:.2}, "));
    let measure = asked.measure;
    let by_measure = stationarity_by_measure
        .filter(|_| measure != Measure::Histogram)
        .map_or(String::new(), |cost| format!(" (by {}: {cost:.3})", measure.show()));
    let dial = report.stationarity.map_or(String::new(), |place| {
        format!("stationarity {place} is a sigma of {}, ", report.sigma)
    });
    format!(
        "{place}  {w}x{h}{why}, seed {}, {}, {dial}{texture}stationarity cost {stationarity:.2}{by_measure}",
        report.seed,
        duration(elapsed),
    )
}
