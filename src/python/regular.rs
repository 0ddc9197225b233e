//! Near-regular textures for Python.

use pyo3::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Error;
use crate::python::array::{ArrayIn, ArrayOut, MapOut, array_out, map_out};
use crate::python::error::IntoPy as _;
use crate::python::{NamedMap, enter, maps_of, mask_of};
use crate::verb::regular::{RegularMaker, RegularParams};

/// A texture: the picture, the source map, the further maps by name, and the report as JSON.
type RegularOut<'py> = (ArrayOut<'py>, MapOut<'py>, Vec<(String, ArrayOut<'py>)>, String);

/// Makes a near-regular texture, and what belongs to it of further maps.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "one private caller, in _regular.py, passes them by name"
)]
#[pyo3(signature = (*, photo, mask, maps, params, seed, threads, progress))]
pub(super) fn regular<'py>(
    py: Python<'py>,
    photo: ArrayIn<'py>,
    mask: Option<ArrayIn<'py>>,
    maps: Vec<NamedMap<'py>>,
    params: Vec<(String, String)>,
    seed: u64,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<RegularOut<'py>> {
    let mut settings = RegularParams::default();
    for (name, text) in &params {
        settings.set(name, text).into_py(py)?;
    }
    let photo = photo.picture(py)?;
    let mask = mask.map(|mask| mask_of(py, &mask)).transpose()?;
    let others = maps_of(py, &photo, &maps)?;
    let ctx = Ctx::new(seed, threads).into_py(py)?;
    let job = ctx.job();
    let (made, pieces) = enter::enter(py, &job, progress.as_ref(), move || {
        let maps: Vec<_> = others.iter().map(|(_, map, kind)| (map, *kind)).collect();
        let maker = RegularMaker::new(&ctx, &photo, mask.as_ref(), &settings)?;
        let (made, pieces) = maker.make(&ctx, &maps)?;
        let names = others.iter().map(|(name, ..)| name.clone());
        Ok((made, names.zip(pieces).collect::<Vec<_>>()))
    })?;
    let pieces = pieces.into_iter().map(|(name, piece)| Ok((name, array_out(py, &piece)?)));
    let report = serde_json::to_string(&made.report)
        .map_err(|e| Error::Internal { message: e.to_string() })
        .into_py(py)?;
    Ok((
        array_out(py, &made.picture)?,
        map_out(py, &made.source_map)?,
        pieces.collect::<PyResult<_>>()?,
        report,
    ))
}
