//! Wang tiles for Python.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::image::io::{self, Format, WriteOptions};
use crate::image::material::{MapKind, is_plain};
use crate::image::picture::Picture;
use crate::python::array::{ArrayIn, ArrayOut, MapOut, array_out, map_out};
use crate::python::error::IntoPy as _;
use crate::python::{NamedMap, enter, maps_of, mask_of};
use crate::verb::extract::WangParams;
use crate::verb::extract::wang::{WangFile, WangFileContent, WangSet};

/// A set and the atlases of further maps.
#[pyclass(frozen, module = "texforge._texforge")]
pub(super) struct Wang(Arc<Made>);

struct Made {
    set: WangSet,
    maps: Vec<(String, Picture, MapKind)>,
}

/// A set for Python: itself, the atlas, its source map, the atlases of further maps by name, the report
/// as JSON.
type WangOut<'py> =
    (Wang, ArrayOut<'py>, Option<MapOut<'py>>, Vec<(String, ArrayOut<'py>)>, String);

/// Makes Wang tiles.
#[pyfunction]
#[pyo3(signature = (*, photo, mask, maps, params, threads, progress))]
pub(super) fn wang<'py>(
    py: Python<'py>,
    photo: ArrayIn<'py>,
    mask: Option<ArrayIn<'py>>,
    maps: Vec<NamedMap<'py>>,
    params: Vec<(String, String)>,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<WangOut<'py>> {
    let mut settings = WangParams::default();
    for (name, text) in &params {
        settings.set(name, text).into_py(py)?;
    }
    let photo = photo.picture(py)?;
    let mask = mask.map(|mask| mask_of(py, &mask)).transpose()?;
    let others = maps_of(py, &photo, &maps)?;
    let ctx = Ctx::new(0, threads).into_py(py)?;
    let job = ctx.job();
    let made = enter::enter(py, &job, progress.as_ref(), move || {
        let set = crate::verb::extract::wang::wang(&ctx, &photo, mask.as_ref(), &settings)?;
        let mut maps = Vec::new();
        for (name, map, kind) in others {
            let atlas = set.atlas_of(&map, kind)?;
            maps.push((name, atlas, kind));
        }
        Ok(Arc::new(Made { set, maps }))
    })?;
    let report = serde_json::to_string(&made.set.report)
        .map_err(|e| Error::Internal { message: e.to_string() })
        .into_py(py)?;
    let atlas = array_out(py, &made.set.atlas)?;
    let source_map = made.set.source_map().map(|map| map_out(py, map)).transpose()?;
    let atlases =
        made.maps.iter().map(|(name, atlas, _)| Ok((name.clone(), array_out(py, atlas)?)));
    let atlases = atlases.collect::<PyResult<_>>()?;
    Ok((Wang(made), atlas, source_map, atlases, report))
}

#[pymethods]
impl Wang {
    /// A plane of this height and width, of the photo or of a map.
    #[pyo3(signature = (*, size, seed, only))]
    fn plane<'py>(
        &self,
        py: Python<'py>,
        size: (usize, usize),
        seed: u64,
        only: Option<String>,
    ) -> PyResult<ArrayOut<'py>> {
        let made = Arc::clone(&self.0);
        let plane = enter::unheard(py, move || {
            let Made { set, maps } = &*made;
            let atlas = match &only {
                None => Some(&set.atlas),
                Some(map) => maps.iter().find(|(name, ..)| name == map).map(|(_, atlas, _)| atlas),
            };
            let Some(atlas) = atlas else {
                let expected = "the name of a map that the set was made with";
                return Err(Error::parameter(
                    "map",
                    expected,
                    format!("`{}`", only.unwrap_or_default()),
                ));
            };
            set.plane(atlas, size, seed)
        })?;
        array_out(py, &plane)
    }

    /// Which tile lies where on a plane of so many tiles, row by row.
    #[pyo3(signature = (*, rows, columns, seed))]
    fn layout<'py>(
        &self,
        py: Python<'py>,
        rows: usize,
        columns: usize,
        seed: u64,
    ) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0.set.layout(seed, (rows, columns)))
    }

    /// Writes the files of the set; returns them.
    #[pyo3(signature = (*, folder, plane, seed, overwrite))]
    fn save(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        plane: (usize, usize),
        seed: u64,
        overwrite: bool,
    ) -> PyResult<Vec<PathBuf>> {
        let made = Arc::clone(&self.0);
        enter::unheard(py, move || {
            if let Some((name, ..)) = made.maps.iter().find(|(name, ..)| !is_plain(name)) {
                let expected = "names of letters, digits, - and _, as files are named after them";
                return Err(Error::parameter("maps", expected, format!("`{name}`")));
            }
            let files = made.set.files(&made.maps, plane, seed)?.into_iter();
            let files: Vec<_> = files
                .map(|file| Ok((folder.join(&file.name), bytes(file)?)))
                .collect::<Result<_>>()?;
            io::write_files(&files, overwrite)?;
            Ok(files.into_iter().map(|(path, _)| path).collect())
        })
    }
}

/// What a file holds.
fn bytes(file: WangFile) -> Result<Vec<u8>> {
    match file.content {
        WangFileContent::Text(text) => Ok(text.into_bytes()),
        WangFileContent::Picture(picture, kind, record) => {
            let path = PathBuf::from(&file.name);
            let format = Format::from_extension(&path).unwrap_or(Format::Png);
            let options = WriteOptions { kind, record, force: true };
            io::encode(&picture, format, &options).map_err(|error| match error {
                Error::Format { reason, .. } => Error::Format { path, reason },
                error => error,
            })
        }
    }
}
