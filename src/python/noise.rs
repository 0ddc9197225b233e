//! Procedural textures for Python.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes};

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::params::Value as _;
use crate::export::{Target, export};
use crate::image::io;
use crate::image::mask::Mask;
use crate::method::noise::Filter;
use crate::python::array::{ArrayIn, ArrayOut, array_out, bytes_out, copied};
use crate::python::error::IntoPy as _;
use crate::python::{enter, kind_named, mask_of};
use crate::verb::noise::{
    self, NamedMap, NoiseEdit, NoiseParams, NoiseTexture, RenderParams, SampleType,
};

/// A map to fit: its name, its samples, what its numbers are.
type MapIn<'py> = (String, ArrayIn<'py>, String);

/// Fits a procedural texture; returns it and the report as JSON.
#[pyfunction]
#[pyo3(signature = (*, maps, mask, params, seed, threads, progress))]
pub(super) fn fit_noise<'py>(
    py: Python<'py>,
    maps: Vec<MapIn<'py>>,
    mask: Option<ArrayIn<'py>>,
    params: Vec<(String, String)>,
    seed: u64,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Noise, String)> {
    let mut settings = NoiseParams::default();
    for (name, text) in &params {
        settings.set(name, text).into_py(py)?;
    }
    let read = |(name, picture, kind): &MapIn<'py>| {
        Ok((name.clone(), picture.picture(py)?, kind_named(kind).into_py(py)?))
    };
    let maps = maps.iter().map(read).collect::<PyResult<Vec<_>>>()?;
    let mask: Option<Mask> = mask.map(|mask| mask_of(py, &mask)).transpose()?;
    let ctx = Ctx::new(seed, threads).into_py(py)?;
    let job = ctx.job();
    let (texture, report) = enter::enter(py, &job, progress.as_ref(), move || {
        let maps: Vec<_> = maps
            .iter()
            .map(|(name, picture, kind)| NamedMap { name, kind: *kind, picture })
            .collect();
        noise::fit_noise(&ctx, &maps, mask.as_ref(), &settings)
    })?;
    let report = serde_json::to_string(&report)
        .map_err(|e| Error::Internal { message: e.to_string() })
        .into_py(py)?;
    Ok((Noise(texture), report))
}

/// A procedural texture.
#[pyclass(frozen, module = "texforge._texforge")]
pub(super) struct Noise(NoiseTexture);

impl Noise {
    /// Runs `work` on the texture, on as many threads.
    fn enter<T: Send + 'static>(
        &self,
        py: Python<'_>,
        threads: usize,
        progress: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(&Ctx, &NoiseTexture) -> Result<T> + Send + 'static,
    ) -> PyResult<T> {
        let ctx = Ctx::new(0, threads).into_py(py)?;
        let texture = self.0.clone();
        enter::enter(py, &ctx.job(), progress, move || work(&ctx, &texture))
    }
}

#[pymethods]
impl Noise {
    /// The texture of a document's text.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: String) -> PyResult<Self> {
        enter::unheard(py, move || NoiseTexture::from_json(&text)).map(Self)
    }

    /// The texture of a document's file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        enter::unheard(py, move || {
            NoiseTexture::from_json(&io::read_text(&path)?).map_err(|error| match error {
                Error::Document { reason } => {
                    Error::Document { reason: format!("{}: {reason}", path.display()) }
                }
                other => other,
            })
        })
        .map(Self)
    }

    /// The text of the document.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// Values at `count` points of two or three doubles (with a normal for each, or none): floats, for
    /// every point all channels.
    #[expect(
        clippy::too_many_arguments,
        reason = "one private caller, in _noise.py, passes them by name"
    )]
    #[pyo3(signature = (*, points, count, axes, normals, footprint, keep_contrast, threads))]
    fn at<'py>(
        &self,
        py: Python<'py>,
        points: Bound<'py, PyAny>,
        count: usize,
        axes: usize,
        normals: Option<Bound<'py, PyAny>>,
        footprint: f64,
        keep_contrast: bool,
        threads: usize,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let filter = Filter { footprint, keep_contrast };
        let values = if axes == 2 {
            let points: Vec<[f64; 2]> = copied(py, &points, count)?;
            self.enter(py, threads, None, move |ctx, texture| texture.at(ctx, &points, filter))?
        } else {
            let points: Vec<[f64; 3]> = copied(py, &points, count)?;
            let normals: Option<Vec<[f64; 3]>> =
                normals.map(|normals| copied(py, &normals, count)).transpose()?;
            self.enter(py, threads, None, move |ctx, texture| {
                texture.solid(ctx, &points, normals.as_deref(), filter)
            })?
        };
        bytes_out(py, bytemuck::cast_slice(&values))
    }

    /// A block of the solid texture of (depth, height, width) voxels: floats, for every voxel all
    /// channels.
    #[expect(
        clippy::too_many_arguments,
        reason = "one private caller, in _noise.py, passes them by name"
    )]
    #[pyo3(signature = (*, shape, scale, origin, keep_contrast, threads, progress))]
    fn volume<'py>(
        &self,
        py: Python<'py>,
        shape: [usize; 3],
        scale: f64,
        origin: [f64; 3],
        keep_contrast: bool,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let values = self.enter(py, threads, progress.as_ref(), move |ctx, texture| {
            texture.volume(ctx, shape, scale, origin, keep_contrast)
        })?;
        bytes_out(py, bytemuck::cast_slice(&values))
    }

    /// Pictures of a part of the texture by name: of one map, or of all.
    #[expect(
        clippy::too_many_arguments,
        reason = "one private caller, in _noise.py, passes them by name"
    )]
    #[pyo3(signature = (*, size, scale, origin, tileable, keep_contrast, dtype, only, threads, progress))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        size: (usize, usize),
        scale: f64,
        origin: [f64; 2],
        tileable: bool,
        keep_contrast: bool,
        dtype: &str,
        only: Option<&str>,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Vec<(String, ArrayOut<'py>)>> {
        let samples = match dtype {
            "uint8" => SampleType::U8,
            "uint16" => SampleType::U16,
            "float32" => SampleType::F32,
            _ => {
                let expected = "one of uint8, uint16, float32";
                return Err(Error::parameter("dtype", expected, format!("`{dtype}`"))).into_py(py);
            }
        };
        let params = RenderParams { size, scale, origin, tileable, keep_contrast, samples };
        let maps = self.enter(py, threads, progress.as_ref(), move |ctx, texture| {
            texture.render(ctx, &params)
        })?;
        maps.iter()
            .filter(|(name, ..)| only.is_none_or(|only| only == name))
            .map(|(name, _, picture)| Ok((name.clone(), array_out(py, picture)?)))
            .collect()
    }

    /// The texture between this and another.
    #[pyo3(signature = (*, other, t))]
    fn morph(&self, py: Python<'_>, other: &Self, t: f64) -> PyResult<Self> {
        let (texture, other) = (self.0.clone(), other.0.clone());
        enter::unheard(py, move || texture.morph(&other, t)).map(Self)
    }

    /// The texture with changes.
    #[pyo3(signature = (*, params, gains, means, seed))]
    fn edit(
        &self,
        py: Python<'_>,
        params: Vec<(String, String)>,
        gains: Vec<f64>,
        means: Vec<(String, Vec<f64>)>,
        seed: Option<u32>,
    ) -> PyResult<Self> {
        let mut edit = NoiseEdit { gains, means, seed, ..NoiseEdit::default() };
        for (name, text) in &params {
            edit.params.set(name, text).into_py(py)?;
        }
        let texture = self.0.clone();
        enter::unheard(py, move || texture.edit(&Ctx::new(0, 0)?, &edit)).map(Self)
    }

    /// Files of the texture for a target, by name.
    #[pyo3(signature = (*, target, name))]
    fn export<'py>(
        &self,
        py: Python<'py>,
        target: &str,
        name: String,
    ) -> PyResult<Vec<(String, Bound<'py, PyBytes>)>> {
        let target = Target::parse(target)
            .ok_or_else(|| Error::parameter("target", Target::expected(), format!("`{target}`")))
            .into_py(py)?;
        let texture = self.0.clone();
        let files = enter::unheard(py, move || export(&name, &texture.program(), target))?;
        Ok(files.into_iter().map(|f| (f.name, PyBytes::new(py, &f.bytes))).collect())
    }
}

/// The targets of exports.
#[pyfunction]
pub(super) fn export_targets() -> Vec<&'static str> {
    Target::CHOICES.to_vec()
}

/// Writes files, each whole or not at all.
#[pyfunction]
#[pyo3(signature = (*, files, overwrite))]
pub(super) fn write_files(
    py: Python<'_>,
    files: Vec<(PathBuf, Bound<'_, PyBytes>)>,
    overwrite: bool,
) -> PyResult<()> {
    let files: Vec<_> =
        files.into_iter().map(|(path, bytes)| (path, bytes.as_bytes().to_vec())).collect();
    enter::unheard(py, move || io::write_files(&files, overwrite))
}
