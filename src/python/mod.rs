//! The Python face: the private module `texforge._texforge`, a handful of functions.
//!
//! It converts, enters the core through one doorway ([`enter`]) and maps errors. Names, defaults
//! and documentation for people are in `python/texforge/_api.py`. No algorithm is in either.

#![expect(clippy::needless_pass_by_value, reason = "pyo3 hands arguments over by value")]

mod array;
mod enter;
mod error;
mod extract;
mod noise;
mod regular;
mod wang;

use std::ffi::OsString;
use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::analyze::lattice::snap;
use crate::base::ctx::Ctx;
use crate::base::error::{Error, ErrorKind, Result};
use crate::base::params::Value as _;
use crate::image::io::{self, Format, WriteOptions};
use crate::image::mask::Mask;
use crate::image::material::{self, MapKind};
use crate::image::overlay;
use crate::image::picture::Picture;
use crate::image::rect::Rect;
use crate::image::sigma_map::SigmaMap;
use crate::verb::extract::{ExtractParams, WangParams};
use crate::verb::inputs::Inputs;
use crate::verb::lattice::{Lattice, LatticeParams, detect_lattice, lattice_autocorrelation};
use crate::verb::noise::{NoiseEditParams, NoiseParams};
use crate::verb::params::TileParams;
use crate::verb::redo::Redo;
use crate::verb::regular::RegularParams;
use crate::verb::texture_cost as measure;
use crate::verb::texture_cost::TextureCostParams;
use crate::verb::tile::{Step, Tile};
use array::{ArrayIn, ArrayOut, MapIn, MapOut, array_out, map_out};
use error::IntoPy;

/// Another map of the material: name, a picture of each photo's, what its numbers are.
type NamedMap<'py> = (String, Vec<ArrayIn<'py>>, String);

fn kind_named(name: &str) -> Result<MapKind> {
    MapKind::parse(name)
        .ok_or_else(|| Error::parameter("kind", MapKind::expected(), format!("`{name}`")))
}

/// A line of a tile's trace: level, iteration, texture cost, stationarity cost.
type StepOut = (usize, u32, Option<f64>, f64);

/// A tile for Python: the picture, the source map, the gathered maps and the report as JSON.
type TileOut<'py> =
    (ArrayOut<'py>, Option<MapOut<'py>>, Vec<(String, ArrayOut<'py>)>, String, Vec<StepOut>);

/// What a palette is besides its tiles: the differences, the curve and the picture of all.
type PaletteOut<'py> = (Vec<f64>, Vec<(f64, f64)>, ArrayOut<'py>);

/// Makes `count` tiles, of neighbouring seeds or as the steps of a palette.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "one private caller, in _api.py, passes them by name"
)]
#[pyo3(signature = (*, photo, also, mask, avoid, sigma_map, redo, maps, params, seed, count, as_palette, threads, progress, trace))]
fn tiles<'py>(
    py: Python<'py>,
    photo: ArrayIn<'py>,
    also: Vec<ArrayIn<'py>>,
    mask: Option<ArrayIn<'py>>,
    avoid: Option<ArrayIn<'py>>,
    sigma_map: Option<ArrayIn<'py>>,
    redo: Option<(MapIn<'py>, [usize; 4])>,
    maps: Vec<NamedMap<'py>>,
    params: Vec<(String, String)>,
    seed: u64,
    count: usize,
    as_palette: bool,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
    trace: bool,
) -> PyResult<(Vec<TileOut<'py>>, Option<PaletteOut<'py>>)> {
    let mut settings = TileParams::default();
    for (name, text) in &params {
        settings.set(name, text).into_py(py)?;
    }
    settings.validate().into_py(py)?;
    let pictures = |all: &[ArrayIn<'py>]| {
        all.iter().map(|picture| picture.picture(py)).collect::<PyResult<Vec<_>>>()
    };
    let (photo, also) = (photo.picture(py)?, pictures(&also)?);
    let read_mask = |mask: Option<ArrayIn<'py>>| mask.map(|mask| mask_of(py, &mask)).transpose();
    let (mask, avoid) = (read_mask(mask)?, read_mask(avoid)?);
    let sigma_map = match sigma_map {
        Some(map) => Some(SigmaMap::from_picture(&map.picture(py)?).into_py(py)?),
        None => None,
    };
    let redone = match redo {
        Some((map, [y, x, height, width])) => {
            Some((map.source_map(py)?, Rect { y, x, height, width }))
        }
        None => None,
    };
    let mut others = Vec::with_capacity(maps.len());
    for (name, maps, kind) in &maps {
        let (maps, kind) = (pictures(maps)?, kind_named(kind).into_py(py)?);
        Inputs { also: &also, ..Inputs::new(&photo) }
            .ensure_maps_fit(name, &maps.iter().collect::<Vec<_>>(), kind, &settings)
            .into_py(py)?;
        others.push((name.clone(), maps, kind));
    }
    let ctx = Ctx::new(seed, threads).into_py(py)?;
    let job = ctx.job();
    let (made, palette) = enter::enter(py, &job, progress.as_ref(), move || {
        let inputs = Inputs {
            also: &also,
            mask: mask.as_ref(),
            avoid: avoid.as_ref(),
            sigma_map: sigma_map.as_ref(),
            trace,
            redo: redone.as_ref().map(|(of, rect)| Redo { of, rect: *rect }),
            ..Inputs::new(&photo)
        };
        let gather = |tile: Tile| {
            let gathered = tile.source_map.iter().flat_map(|source_map| {
                let gather = |(name, maps, kind): &(String, Vec<Picture>, MapKind)| {
                    let maps: Vec<&Picture> = maps.iter().collect();
                    Ok((name.clone(), source_map.apply_all(&maps, *kind)?))
                };
                others.iter().map(gather)
            });
            let gathered = gathered.collect::<Result<Vec<_>>>()?;
            Ok((tile, gathered))
        };
        let (tiles, rest) = if as_palette {
            let palette = crate::verb::palette::palette(&ctx, &inputs, &settings, count)?;
            let picture = palette.picture()?;
            (palette.tiles, Some((palette.differences, palette.curve, picture)))
        } else {
            (crate::verb::tile::tiles(&ctx, &inputs, &settings, count)?, None)
        };
        Ok((tiles.into_iter().map(gather).collect::<Result<Vec<_>>>()?, rest))
    })?;
    let out = |(tile, gathered): (Tile, Vec<(String, Picture)>)| {
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
    };
    let tiles = made.into_iter().map(out).collect::<PyResult<_>>()?;
    let palette = palette
        .map(|(differences, curve, picture)| {
            PyResult::Ok((differences, curve, array_out(py, &picture)?))
        })
        .transpose()?;
    Ok((tiles, palette))
}

/// Further maps of one photo, which must fit it.
fn maps_of(
    py: Python<'_>,
    photo: &Picture,
    maps: &[NamedMap<'_>],
) -> PyResult<Vec<(String, Picture, MapKind)>> {
    let mut all = Vec::new();
    for (name, maps, kind) in maps {
        let kind = kind_named(kind).into_py(py)?;
        let maps = maps.iter().map(|map| map.picture(py)).collect::<PyResult<Vec<_>>>()?;
        let every: Vec<&Picture> = maps.iter().collect();
        Inputs::new(photo)
            .ensure_maps_fit(name, &every, kind, &TileParams::default())
            .into_py(py)?;
        all.extend(maps.into_iter().map(|map| (name.clone(), map, kind)));
    }
    Ok(all)
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

/// A lattice for Python: both vectors, confidence, whether found, goodness, correlation, and if asked
/// for the autocorrelation and how many of its pixels are one of the photo.
type LatticeOut<'py> = ([f64; 2], [f64; 2], f64, bool, f64, f64, Option<(ArrayOut<'py>, [f64; 2])>);

/// Finds the lattice of a photo.
#[pyfunction]
#[pyo3(signature = (*, photo, params, autocorrelation, threads, progress))]
fn lattice<'py>(
    py: Python<'py>,
    photo: ArrayIn<'py>,
    params: Vec<(String, String)>,
    autocorrelation: bool,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<LatticeOut<'py>> {
    let mut settings = LatticeParams::default();
    for (name, text) in &params {
        settings.set(name, text).into_py(py)?;
    }
    let photo = photo.picture(py)?;
    let ctx = Ctx::new(0, threads).into_py(py)?;
    let job = ctx.job();
    let (found, map) = enter::enter(py, &job, progress.as_ref(), move || {
        let found = detect_lattice(&ctx, &photo, &settings)?;
        let map = autocorrelation.then(|| lattice_autocorrelation(&ctx, &photo)).transpose()?;
        Ok((found, map))
    })?;
    let map = match map {
        Some((map, scale)) => Some((array_out(py, &map)?, scale)),
        None => None,
    };
    let Lattice { v1, v2, confidence, found, goodness, correlation } = found;
    Ok((v1, v2, confidence, found, goodness, correlation, map))
}

/// Draws a lattice over a picture.
#[pyfunction]
#[pyo3(signature = (*, picture, v1, v2))]
fn lattice_overlay<'py>(
    py: Python<'py>,
    picture: ArrayIn<'py>,
    v1: [f64; 2],
    v2: [f64; 2],
) -> PyResult<ArrayOut<'py>> {
    let picture = picture.picture(py)?;
    let out = enter::unheard(py, move || overlay::lattice(&picture, [v1, v2]))?;
    array_out(py, &out)
}

/// A snapped size: width, height, scalings, periods, misfits.
type SnapOut = (usize, usize, [f64; 2], [[i64; 2]; 2], [f64; 2]);

/// The size near a wished one after which a lattice repeats.
#[pyfunction]
#[pyo3(signature = (*, v1, v2, width, height))]
fn lattice_snap(v1: [f64; 2], v2: [f64; 2], width: usize, height: usize) -> Option<SnapOut> {
    let snap = snap::snap([v1, v2], (width, height), snap::MOST_SCALING, 0.0)?;
    Some((snap.width, snap.height, [snap.scale_x, snap.scale_y], snap.periods, snap.misfit))
}

/// Gathers a map, one picture of each photo, through a source map.
#[pyfunction]
#[pyo3(signature = (*, source_map, pictures, kind))]
fn apply<'py>(
    py: Python<'py>,
    source_map: MapIn<'py>,
    pictures: Vec<ArrayIn<'py>>,
    kind: &str,
) -> PyResult<ArrayOut<'py>> {
    let kind = kind_named(kind).into_py(py)?;
    let source_map = source_map.source_map(py)?;
    let maps = pictures.iter().map(|map| map.picture(py)).collect::<PyResult<Vec<_>>>()?;
    let out =
        enter::unheard(py, move || source_map.apply_all(&maps.iter().collect::<Vec<_>>(), kind))?;
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

/// Writes pictures (path, picture, what its numbers are, how it was made): all of them or none.
#[pyfunction]
#[pyo3(signature = (*, files, overwrite))]
fn write<'py>(
    py: Python<'py>,
    files: Vec<(PathBuf, ArrayIn<'py>, String, Option<String>)>,
    overwrite: bool,
) -> PyResult<()> {
    let picture = |(path, picture, kind, record): (PathBuf, ArrayIn<'py>, String, _)| {
        let kind = kind_named(&kind).into_py(py)?;
        Ok((path, picture.picture(py)?, WriteOptions { kind, record, force: overwrite }))
    };
    let pictures = files.into_iter().map(picture).collect::<PyResult<Vec<_>>>()?;
    enter::unheard(py, move || io::write_all(&pictures, overwrite))
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
fn map_kind(name: &str) -> String {
    material::classify(name).map_or(MapKind::Data, |(_, kind)| kind).show()
}

/// Every parameter of a Python function (`texture_cost`, `detect_lattice`, `extract`, `wang`, `regular`,
/// `fit_noise`, `edit` of a procedural texture, else `tile`), with its default as text.
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
        "detect_lattice" => LatticeParams::schema(),
        ExtractParams::VERB => ExtractParams::schema(),
        WangParams::VERB => WangParams::schema(),
        RegularParams::VERB => RegularParams::schema(),
        "fit_noise" => NoiseParams::schema(),
        "edit" => NoiseEditParams::schema(),
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
    use super::extract::extract;
    #[pymodule_export]
    use super::noise::{Noise, export_targets, fit_noise, write_files};
    #[pymodule_export]
    use super::regular::{regular, regular_to_file};
    #[pymodule_export]
    use super::wang::{Wang, wang};
    #[pymodule_export]
    use super::{
        apply, cli_main, cli_study, encode_png, error_kinds, fail, lattice, lattice_overlay,
        lattice_snap, map_kind, read, read_source_map, schema, texture_cost, tiles, write,
        write_source_map,
    };

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
