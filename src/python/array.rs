//! Arrays in and out: a flat buffer of bytes and what its bytes are.
//!
//! Python makes the array contiguous and native-endian and passes it as bytes (the buffer
//! protocol, which the stable ABI has from 3.11 on); it is copied once, attached, before the
//! work starts: whoever changes it meanwhile changes nothing here.

use half::f16;
use pyo3::buffer::PyBuffer;
use pyo3::prelude::*;
use pyo3::types::PyByteArray;

use super::error::IntoPy;
use crate::base::error::{Error, Result};
use crate::base::memory;
use crate::image::picture::{Encoding, Picture, Samples};
use crate::image::sourcemap::{Origin, SourceMap};
use crate::image::symmetry::Symmetry;
use crate::with_samples;

/// Fills a new vector of `len` items from the bytes of a buffer.
pub(super) fn copied<T: bytemuck::Pod>(
    py: Python<'_>,
    buffer: &Bound<'_, PyAny>,
    len: usize,
) -> PyResult<Vec<T>> {
    let bytes = (len as u64).checked_mul(size_of::<T>() as u64);
    memory::ensure_available("copying the array", bytes).into_py(py)?;
    let mut items = bytemuck::zeroed_vec::<T>(len);
    PyBuffer::<u8>::get(buffer)?.copy_to_slice(py, bytemuck::cast_slice_mut(&mut items))?;
    Ok(items)
}

fn product(sides: &[usize]) -> Result<usize> {
    sides.iter().try_fold(1_usize, |n, &side| n.checked_mul(side)).ok_or_else(|| {
        Error::BadPicture { what: "array".into(), reason: "its shape overflows".into() }
    })
}

/// A picture from Python: its samples as a contiguous buffer of bytes, their type as numpy spells
/// it, (height, width, channels), and `srgb`, `linear` or `data`.
#[derive(FromPyObject)]
pub(super) struct ArrayIn<'py>(Bound<'py, PyAny>, String, (usize, usize, usize), String);

impl ArrayIn<'_> {
    /// The picture, copied.
    pub(super) fn picture(&self, py: Python<'_>) -> PyResult<Picture> {
        let Self(buffer, dtype, (height, width, channels), encoding) = self;
        let len = product(&[*height, *width, *channels]).into_py(py)?;
        let samples = match dtype.as_str() {
            "uint8" => Samples::U8(copied(py, buffer, len)?),
            "uint16" => Samples::U16(copied(py, buffer, len)?),
            "float16" => Samples::F16(copied::<f16>(py, buffer, len)?),
            "float32" => Samples::F32(copied(py, buffer, len)?),
            "float64" => Samples::F64(copied(py, buffer, len)?),
            _ => {
                let reason = format!("its samples are {dtype}");
                return Err(Error::BadPicture { what: "array".into(), reason }).into_py(py);
            }
        };
        let encoding = encoding_named(encoding).into_py(py)?;
        Picture::new(*height, *width, *channels, samples, encoding).into_py(py)
    }
}

fn encoding_named(name: &str) -> Result<Encoding> {
    match name {
        "srgb" => Ok(Encoding::Srgb),
        "linear" => Ok(Encoding::Linear),
        "data" => Ok(Encoding::Data),
        _ => Err(Error::parameter("encoding", "one of srgb, linear, data", format!("`{name}`"))),
    }
}

/// A picture for Python, in the same parts as [`ArrayIn`].
pub(super) type ArrayOut<'py> =
    (Bound<'py, PyByteArray>, &'static str, (usize, usize, usize), &'static str);

/// The picture, copied into memory that Python owns.
pub(super) fn array_out<'py>(py: Python<'py>, picture: &Picture) -> PyResult<ArrayOut<'py>> {
    let bytes = with_samples!(picture.samples(), v => bytes_out(py, bytemuck::cast_slice(v)))?;
    let encoding = match picture.encoding {
        Encoding::Srgb => "srgb",
        Encoding::Linear => "linear",
        Encoding::Data => "data",
    };
    let shape = (picture.height(), picture.width(), picture.channels());
    Ok((bytes, picture.samples().dtype(), shape, encoding))
}

/// Bytes, copied into memory that Python owns.
pub(super) fn bytes_out<'py>(py: Python<'py>, bytes: &[u8]) -> PyResult<Bound<'py, PyByteArray>> {
    PyByteArray::new_with(py, bytes.len(), |out| {
        out.copy_from_slice(bytes);
        Ok(())
    })
}

/// A source map from Python: its positions `[y, x]` as a contiguous buffer of 32-bit integers,
/// (height, width), every source's (height, width), and the origins (photo, symmetry) as another
/// such buffer, if there are any.
#[derive(FromPyObject)]
pub(super) struct MapIn<'py>(
    Bound<'py, PyAny>,
    (usize, usize),
    Vec<(usize, usize)>,
    Option<Bound<'py, PyAny>>,
);

impl MapIn<'_> {
    /// The source map, copied.
    pub(super) fn source_map(&self, py: Python<'_>) -> PyResult<SourceMap> {
        let Self(buffer, (height, width), sources, origins) = self;
        let len = product(&[*height, *width]).into_py(py)?;
        let origins: Vec<[u32; 2]> = match origins {
            Some(origins) => copied(py, origins, len)?,
            None => Vec::new(),
        };
        let origin = |&[photo, code]: &[u32; 2]| {
            let origin = u16::try_from(photo).ok().zip(Symmetry::from_code(code));
            origin.map(|(photo, symmetry)| Origin { photo, symmetry }).ok_or_else(|| {
                let reason = format!("origin ({photo}, {code}) is no photo and symmetry (0 to 7)");
                Error::BadPicture { what: "source map".into(), reason }
            })
        };
        let origins = origins.iter().map(origin).collect::<Result<_>>().into_py(py)?;
        let positions = copied(py, buffer, len)?;
        SourceMap::of_views((*height, *width), sources.clone(), positions, origins).into_py(py)
    }
}

/// A source map for Python, in the same parts as [`MapIn`].
pub(super) type MapOut<'py> =
    (Bound<'py, PyByteArray>, (usize, usize), Vec<(usize, usize)>, Option<Bound<'py, PyByteArray>>);

/// The source map, copied into memory that Python owns.
pub(super) fn map_out<'py>(py: Python<'py>, map: &SourceMap) -> PyResult<MapOut<'py>> {
    let bytes = bytes_out(py, bytemuck::cast_slice(map.positions()))?;
    let origin = |o: &Origin| [u32::from(o.photo), u32::from(o.symmetry.code())];
    let origins = map.origins().map(|all| all.iter().map(origin).collect::<Vec<_>>());
    let origins = origins.map(|all| bytes_out(py, bytemuck::cast_slice(&all))).transpose()?;
    Ok((bytes, (map.height(), map.width()), map.source_sizes().to_vec(), origins))
}
