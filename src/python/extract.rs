//! The representative tile for Python.

use pyo3::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Error;
use crate::python::array::{ArrayIn, ArrayOut, MapOut, array_out, map_out};
use crate::python::error::IntoPy as _;
use crate::python::{NamedMap, enter, maps_of, mask_of};
use crate::verb::extract::ExtractParams;

/// A tile: the picture, the source map, its place (row, column), that in the photo (to the right,
/// downwards), continuity, resemblance and score, how it was made.
type TileOut<'py> =
    (ArrayOut<'py>, Option<MapOut<'py>>, (usize, usize), [f64; 2], (f64, f64, f64), String);

/// A further map: its name, and its piece of each tile.
type MapTiles<'py> = (String, Vec<ArrayOut<'py>>);

/// Extracts tiles: all of them, the maps', the contact sheet, and the report as JSON.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "one private caller, in _extract.py, passes them by name"
)]
#[pyo3(signature = (*, photo, mask, maps, params, seed, threads, progress))]
pub(super) fn extract<'py>(
    py: Python<'py>,
    photo: ArrayIn<'py>,
    mask: Option<ArrayIn<'py>>,
    maps: Vec<NamedMap<'py>>,
    params: Vec<(String, String)>,
    seed: u64,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Vec<TileOut<'py>>, Vec<MapTiles<'py>>, ArrayOut<'py>, String)> {
    let mut settings = ExtractParams::default();
    for (name, text) in &params {
        settings.set(name, text).into_py(py)?;
    }
    let photo = photo.picture(py)?;
    let mask = mask.map(|mask| mask_of(py, &mask)).transpose()?;
    let others = maps_of(py, &photo, &maps)?;
    let ctx = Ctx::new(seed, threads).into_py(py)?;
    let job = ctx.job();
    let (made, pieces, sheet) = enter::enter(py, &job, progress.as_ref(), move || {
        let made = crate::verb::extract::extract(&ctx, &photo, mask.as_ref(), &settings)?;
        let mut pieces = Vec::new();
        for (name, map, kind) in &others {
            pieces.push((name.clone(), made.tiles_of(map, *kind)?));
        }
        let sheet = made.sheet()?;
        Ok((made, pieces, sheet))
    })?;
    let mut tiles = Vec::new();
    for (i, tile) in made.tiles.iter().enumerate() {
        let map = made.source_map(i).map(|map| map_out(py, map)).transpose()?;
        let place = tile.place;
        tiles.push((
            array_out(py, &tile.picture)?,
            map,
            (place.y, place.x),
            tile.photo_place,
            (place.continuity, place.resemblance, place.score),
            made.record(i),
        ));
    }
    let mut of_maps = Vec::new();
    for (name, pictures) in pieces {
        let arrays = pictures.iter().map(|picture| array_out(py, picture));
        of_maps.push((name, arrays.collect::<PyResult<Vec<_>>>()?));
    }
    let report = serde_json::to_string(&made.report)
        .map_err(|e| Error::Internal { message: e.to_string() })
        .into_py(py)?;
    Ok((tiles, of_maps, array_out(py, &sheet)?, report))
}
