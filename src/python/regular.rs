//! Near-regular textures for Python.

use std::path::{Path, PathBuf};
use std::time::Instant;

use pyo3::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::record::{record_of, typed_params};
use crate::image::io::{
    Format, STRIP_PIXELS, Staging, WriteOptions, check_outputs, ensure_can_hold, write_strips,
};
use crate::image::mask::Mask;
use crate::image::material::{MapKind, is_plain, output_path};
use crate::image::picture::{Encoding, Picture};
use crate::python::array::{ArrayIn, ArrayOut, MapOut, array_out, map_out};
use crate::python::error::IntoPy as _;
use crate::python::{NamedMap, enter, maps_of, mask_of};
use crate::verb::regular::{RegularMaker, RegularParams, RegularReport};

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
    let material = Material::read(py, &photo, mask, &maps, &params)?;
    let ctx = Ctx::new(seed, threads).into_py(py)?;
    let job = ctx.job();
    let (made, pieces) = enter::enter(py, &job, progress.as_ref(), move || {
        let (made, pieces) = material.maker(&ctx)?.make(&ctx, &material.maps())?;
        let names = material.others.iter().map(|(name, ..)| name.clone());
        Ok((made, names.zip(pieces).collect::<Vec<_>>()))
    })?;
    let pieces = pieces.into_iter().map(|(name, piece)| Ok((name, array_out(py, &piece)?)));
    let report = json(&made.report).into_py(py)?;
    Ok((
        array_out(py, &made.picture)?,
        map_out(py, &made.source_map)?,
        pieces.collect::<PyResult<_>>()?,
        report,
    ))
}

/// Writes a near-regular texture to a file while it is made, and what belongs to it of further maps
/// beside it. Returns the files of these, and the report as JSON.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "one private caller, in _regular.py, passes them by name"
)]
#[pyo3(signature = (*, path, photo, mask, maps, params, seed, overwrite, threads, progress))]
pub(super) fn regular_to_file<'py>(
    py: Python<'py>,
    path: PathBuf,
    photo: ArrayIn<'py>,
    mask: Option<ArrayIn<'py>>,
    maps: Vec<NamedMap<'py>>,
    params: Vec<(String, String)>,
    seed: u64,
    overwrite: bool,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Vec<PathBuf>, String)> {
    let material = Material::read(py, &photo, mask, &maps, &params)?;
    let places = material.places(&path, overwrite).into_py(py)?;
    let ctx = Ctx::new(seed, threads).into_py(py)?;
    let job = ctx.job();
    enter::enter(py, &job, progress.as_ref(), move || {
        let maker = material.maker(&ctx)?;
        let start = Instant::now();
        let mut report = maker.report().clone();
        let typed = typed_params(&RegularParams::schema(), &report.params);
        let record = record_of(RegularParams::VERB, report.version, report.seed, &typed);
        let first =
            WriteOptions { record: Some(record.to_string()), ..WriteOptions::new(material.kind()) };
        let of_maps = material.others.iter().map(|(_, _, kind)| WriteOptions::new(*kind));
        let options = [first].into_iter().chain(of_maps);
        let files: Vec<_> =
            [&path].into_iter().chain(&places).map(PathBuf::as_path).zip(options).collect();
        let staging = Staging::new(ctx.job());
        let maps = material.maps();
        let strips = maker.pictures(&ctx, STRIP_PIXELS, &maps)?;
        write_strips(&staging, &files, maker.size().1, strips)?;
        staging.commit(overwrite)?;
        report.seconds.push(("synthesis", start.elapsed().as_secs_f64()));
        Ok((places, json(&report)?))
    })
}

/// What a texture is made of, checked as far as it can be without looking for a lattice.
struct Material {
    photo: Picture,
    mask: Option<Mask>,
    others: Vec<(String, Picture, MapKind)>,
    settings: RegularParams,
}

impl Material {
    fn read(
        py: Python<'_>,
        photo: &ArrayIn<'_>,
        mask: Option<ArrayIn<'_>>,
        maps: &[NamedMap<'_>],
        params: &[(String, String)],
    ) -> PyResult<Self> {
        let mut settings = RegularParams::default();
        for (name, text) in params {
            settings.set(name, text).into_py(py)?;
        }
        let photo = photo.picture(py)?;
        let mask = mask.map(|mask| mask_of(py, &mask)).transpose()?;
        let others = maps_of(py, &photo, maps)?;
        Ok(Self { photo, mask, others, settings })
    }

    fn maker(&self, ctx: &Ctx) -> Result<RegularMaker<'_>> {
        RegularMaker::new(ctx, &self.photo, self.mask.as_ref(), &self.settings)
    }

    fn maps(&self) -> Vec<(&Picture, MapKind)> {
        self.others.iter().map(|(_, map, kind)| (map, *kind)).collect()
    }

    /// What the photo's numbers are.
    fn kind(&self) -> MapKind {
        if self.photo.encoding == Encoding::Data { MapKind::Data } else { MapKind::Color }
    }

    /// The file of every map, if all files can be written a few rows at a time.
    fn places(&self, path: &Path, overwrite: bool) -> Result<Vec<PathBuf>> {
        let mut places = Vec::new();
        for (name, map, kind) in &self.others {
            if !is_plain(name) {
                let expected = "names of letters, digits, - and _, as files are named after them";
                return Err(Error::parameter("maps", expected, format!("`{name}`")));
            }
            let place = output_path(path, name, map);
            ensure_can_hold(map, Some(&place), *kind)?;
            places.push(place);
        }
        let first = [("path", path.to_owned())].into_iter();
        let all = first.chain(places.iter().map(|place| ("maps", place.clone())));
        check_outputs(all, &[], overwrite)?;
        ensure_can_hold(&self.photo, Some(path), self.kind())?;
        if !Format::from_extension(path).is_some_and(Format::streams) {
            let reason = "this format is not written a few rows at a time; use .png, .tif or .exr, \
                          or `save` of a texture that fits into memory";
            return Err(Error::Format { path: path.to_owned(), reason: reason.into() });
        }
        Ok(places)
    }
}

fn json(report: &RegularReport) -> Result<String> {
    serde_json::to_string(report).map_err(|e| Error::Internal { message: e.to_string() })
}
