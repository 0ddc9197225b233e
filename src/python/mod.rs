//! The Python face: the private module `texforge._texforge`, a handful of functions.
//!
//! It converts, enters the core through one doorway ([`enter`]) and maps errors. Names, defaults
//! and documentation for people are in `python/texforge/_api.py`. No algorithm is in either.

#![expect(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

mod array;
mod enter;
mod error;

use std::ffi::OsString;
use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::base::ctx::Ctx;
use crate::base::error::{Error, ErrorKind, Result};
use crate::image::io::{self, Format, WriteOptions};
use crate::image::mask::Mask;
use crate::image::material::{self, MapKind};
use crate::image::picture::Picture;
use crate::image::sigma_map::SigmaMap;
use crate::image::sourcemap::SourceMap;
use crate::verb::texture_cost as measure;
use crate::verb::texture_cost::TextureCostParams;
use crate::verb::tile::{Guides, Step, TileParams, tile_guided};
use array::{ArrayIn, ArrayOut, MapIn, MapOut, array_out, map_out};
use error::IntoPy;

/// A picture of another map of the material: name, picture, what its numbers are.
type NamedMap<'py> = (String, ArrayIn<'py>, String);

fn kind_named(name: &str) -> Result<MapKind> {
    match name {
        "color" => Ok(MapKind::Color),
        "data" => Ok(MapKind::Data),
        "normal" => Ok(MapKind::Normal),
        _ => Err(Error::parameter("kind", "one of color, data, normal", format!("`{name}`"))),
    }
}

/// Fails before the long work if `map` could not be gathered after it.
fn ensure_same_shape(name: &str, map: &Picture, photo: &Picture) -> Result<()> {
    let probe = SourceMap::new((1, 1), (photo.height(), photo.width()), vec![[0, 0]])?;
    match probe.apply(map, MapKind::Data) {
        Err(Error::SizeMismatch { got_w, got_h, want_w, want_h, remedy, .. }) => {
            let what = format!("the map `{name}`");
            Err(Error::SizeMismatch { what, got_w, got_h, want_w, want_h, remedy })
        }
        other => other.map(drop),
    }
}

/// A line of a tile's trace: level, iteration, texture cost, stationarity cost.
type StepOut = (usize, u32, Option<f64>, f64);

/// Makes a tile. Returns the picture, the source map, the gathered maps, the report as JSON and the
/// trace.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "one private caller, in _api.py, passes them by name"
)]
#[expect(clippy::type_complexity, reason = "one private caller, in _api.py, names its parts")]
#[pyo3(signature = (*, photo, mask, sigma_map, maps, params, seed, threads, progress, trace))]
fn tile<'py>(
    py: Python<'py>,
    photo: ArrayIn<'py>,
    mask: Option<ArrayIn<'py>>,
    sigma_map: Option<ArrayIn<'py>>,
    maps: Vec<NamedMap<'py>>,
    params: Vec<(String, String)>,
    seed: u64,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
    trace: bool,
) -> PyResult<(
    ArrayOut<'py>,
    Option<MapOut<'py>>,
    Vec<(String, ArrayOut<'py>)>,
    String,
    Vec<StepOut>,
)> {
    let mut settings = TileParams::default();
    for (name, text) in &params {
        settings.set(name, text).into_py(py)?;
    }
    settings.validate().into_py(py)?;
    let photo = photo.picture(py)?;
    let mask = mask.map(|mask| mask_of(py, &mask)).transpose()?;
    let sigma_map = match sigma_map {
        Some(map) => Some(SigmaMap::from_picture(&map.picture(py)?).into_py(py)?),
        None => None,
    };
    let mut others = Vec::with_capacity(maps.len());
    for (name, map, kind) in &maps {
        let map = map.picture(py)?;
        ensure_same_shape(name, &map, &photo).into_py(py)?;
        others.push((name.clone(), map, kind_named(kind).into_py(py)?));
    }
    let ctx = Ctx::new(seed, threads).into_py(py)?;
    let job = ctx.job();
    let (tile, gathered) = enter::enter(py, &job, progress.as_ref(), move || {
        let guides = Guides { mask: mask.as_ref(), sigma_map: sigma_map.as_ref(), trace };
        let tile = tile_guided(&ctx, &photo, guides, &settings)?;
        let mut gathered = Vec::with_capacity(others.len());
        if let Some(source_map) = &tile.source_map {
            for (name, map, kind) in others {
                gathered.push((name, source_map.apply(&map, kind)?));
            }
        }
        Ok((tile, gathered))
    })?;
    let report = serde_json::to_string(&tile.report)
        .map_err(|e| Error::Internal { message: e.to_string() })
        .into_py(py)?;
    let source_map = tile.source_map.as_ref().map(|map| map_out(py, map)).transpose()?;
    let maps = gathered
        .into_iter()
        .map(|(name, picture)| Ok((name, array_out(py, &picture)?)))
        .collect::<PyResult<_>>()?;
    let step = |s: &Step| (s.level, s.iteration, s.costs.texture, s.costs.stationarity);
    let trace = tile.trace.iter().map(step).collect();
    Ok((array_out(py, &tile.picture)?, source_map, maps, report, trace))
}

fn mask_of(py: Python<'_>, mask: &ArrayIn<'_>) -> PyResult<Mask> {
    Mask::from_picture(&mask.picture(py)?).into_py(py)
}

/// Measures the exact texture cost on a sample. Returns mean, margin and number of samples.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "one private caller, in _api.py, passes them by name"
)]
#[pyo3(signature = (*, texture, photo, source_map, mask, params, seed, threads, progress))]
fn texture_cost<'py>(
    py: Python<'py>,
    texture: ArrayIn<'py>,
    photo: ArrayIn<'py>,
    source_map: Option<MapIn<'py>>,
    mask: Option<ArrayIn<'py>>,
    params: Vec<(String, String)>,
    seed: u64,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(f64, f64, usize)> {
    let mut settings = TextureCostParams::default();
    for (name, text) in &params {
        settings.set(name, text).into_py(py)?;
    }
    let (texture, photo) = (texture.picture(py)?, photo.picture(py)?);
    let map = source_map.map(|map| map.source_map(py)).transpose()?;
    let mask = mask.map(|mask| mask_of(py, &mask)).transpose()?;
    let ctx = Ctx::new(seed, threads).into_py(py)?;
    let job = ctx.job();
    let cost = enter::enter(py, &job, progress.as_ref(), move || {
        measure::texture_cost(&ctx, &texture, &photo, map.as_ref(), mask.as_ref(), &settings)
    })?;
    Ok((cost.mean, cost.margin, cost.samples))
}

/// Gathers a map through a source map.
#[pyfunction]
#[pyo3(signature = (*, source_map, picture, kind))]
fn apply<'py>(
    py: Python<'py>,
    source_map: MapIn<'py>,
    picture: ArrayIn<'py>,
    kind: &str,
) -> PyResult<ArrayOut<'py>> {
    let kind = kind_named(kind).into_py(py)?;
    let source_map = source_map.source_map(py)?;
    let picture = picture.picture(py)?;
    let out = enter::unheard(py, move || source_map.apply(&picture, kind))?;
    array_out(py, &out)
}

/// Reads a picture.
#[pyfunction]
#[pyo3(signature = (*, path, kind))]
fn read<'py>(py: Python<'py>, path: PathBuf, kind: &str) -> PyResult<ArrayOut<'py>> {
    let kind = kind_named(kind).into_py(py)?;
    let picture = enter::unheard(py, move || io::read(&path, kind))?;
    array_out(py, &picture)
}

/// Writes a picture.
#[pyfunction]
#[pyo3(signature = (*, path, picture, kind, record, overwrite))]
fn write<'py>(
    py: Python<'py>,
    path: PathBuf,
    picture: ArrayIn<'py>,
    kind: &str,
    record: Option<String>,
    overwrite: bool,
) -> PyResult<()> {
    let options = WriteOptions { kind: kind_named(kind).into_py(py)?, record, force: overwrite };
    let picture = picture.picture(py)?;
    enter::unheard(py, move || io::write(&path, &picture, &options))
}

/// The bytes of a PNG file of the picture.
#[pyfunction]
#[pyo3(signature = (*, picture))]
fn encode_png<'py>(py: Python<'py>, picture: ArrayIn<'py>) -> PyResult<Bound<'py, PyBytes>> {
    let picture = picture.picture(py)?;
    let options = WriteOptions::new(MapKind::Color);
    let bytes = enter::unheard(py, move || io::encode(&picture, Format::Png, &options))?;
    Ok(PyBytes::new(py, &bytes))
}

/// Reads a source map.
#[pyfunction]
#[pyo3(signature = (*, path))]
fn read_source_map(py: Python<'_>, path: PathBuf) -> PyResult<MapOut<'_>> {
    let map = enter::unheard(py, move || io::read_source_map(&path))?;
    map_out(py, &map)
}

/// Writes a source map.
#[pyfunction]
#[pyo3(signature = (*, path, source_map, overwrite))]
fn write_source_map<'py>(
    py: Python<'py>,
    path: PathBuf,
    source_map: MapIn<'py>,
    overwrite: bool,
) -> PyResult<()> {
    let map = source_map.source_map(py)?;
    enter::unheard(py, move || io::write_source_map(&path, &map, overwrite))
}

/// What the numbers of a material's map of this name are.
#[pyfunction]
fn map_kind(name: &str) -> &'static str {
    match material::classify(name) {
        Some((_, MapKind::Color)) => "color",
        Some((_, MapKind::Normal)) => "normal",
        Some((_, MapKind::Data)) | None => "data",
    }
}

/// Every parameter of a verb (`texture_cost`, else `tile`), with its default as text.
#[pyfunction]
#[pyo3(signature = (verb = "tile"))]
fn schema<'py>(py: Python<'py>, verb: &str) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let entry = |param: crate::base::params::Param| {
        let dict = PyDict::new(py);
        dict.set_item("name", param.name)?;
        dict.set_item("kind", param.kind)?;
        dict.set_item("choices", param.choices)?;
        dict.set_item("default", param.default)?;
        dict.set_item("range", param.range)?;
        dict.set_item("unit", param.unit)?;
        dict.set_item("doc", param.doc)?;
        Ok(dict)
    };
    let params = match verb {
        TextureCostParams::VERB => TextureCostParams::schema(),
        _ => TileParams::schema(),
    };
    params.into_iter().map(entry).collect()
}

/// The slug of every kind of error.
#[pyfunction]
fn error_kinds() -> Vec<&'static str> {
    ErrorKind::ALL.into_iter().map(ErrorKind::slug).collect()
}

/// Fails inside the doorway with an error of this kind (`internal`: panics); for the tests.
#[pyfunction]
fn fail(py: Python<'_>, kind: String) -> PyResult<()> {
    enter::unheard(py, move || error::example(&kind))
}

/// Runs the command line; returns the exit status.
#[pyfunction]
fn cli_main(py: Python<'_>, args: Vec<OsString>) -> u8 {
    // The panic's message is on stderr already.
    py.detach(|| std::panic::catch_unwind(|| crate::cli::run(args)).unwrap_or(1))
}

/// Reads the command line of `study`; returns what was asked for, or the exit status if there is
/// nothing to do.
#[pyfunction]
fn cli_study(py: Python<'_>, args: Vec<OsString>) -> PyResult<(u8, Option<Bound<'_, PyDict>>)> {
    let request = match crate::cli::study::request(args) {
        Ok(request) => request,
        Err(status) => return Ok((status, None)),
    };
    let dict = PyDict::new(py);
    dict.set_item("folder", request.folder)?;
    dict.set_item("out", request.output)?;
    dict.set_item("seeds", request.seeds)?;
    dict.set_item("size", request.size)?;
    dict.set_item("measures", request.measures)?;
    dict.set_item("samples", request.samples)?;
    dict.set_item("threads", request.threads)?;
    dict.set_item("json", request.json)?;
    dict.set_item("quiet", request.quiet)?;
    Ok((0, Some(dict)))
}

/// The private module.
#[pymodule(gil_used = false)]
mod _texforge {
    #[pymodule_export]
    use super::{
        apply, cli_main, cli_study, encode_png, error_kinds, fail, map_kind, read, read_source_map,
        schema, texture_cost, tile, write, write_source_map,
    };

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
