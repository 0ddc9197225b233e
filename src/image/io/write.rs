//! [`write`] and [`encode`]: a picture becomes a file, or is refused with a reason.

use std::borrow::Cow;
use std::io::Cursor;
use std::iter::once;
use std::path::{Path, PathBuf};

use super::place::{check_output, known_extension};
use super::rows::{one_pixel, write_as};
use super::staging::{Staging, put};
use super::{Format, jpeg, other, unnamed};
use crate::base::error::{Error, Result};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture};

/// How a picture is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WriteOptions {
    /// What the picture's numbers are; colors are marked as such in the file, data never is.
    pub kind: MapKind,
    /// How the picture was made, one line of JSON; kept in the file under the name `texforge`
    /// (PNG text, EXR attribute, JPEG comment, TIFF software tag; the others have no place).
    pub record: Option<String>,
    /// Whether an existing file may be replaced.
    pub force: bool,
}

impl WriteOptions {
    /// No record, nothing overwritten.
    pub fn new(kind: MapKind) -> Self {
        Self { kind, record: None, force: false }
    }
}

/// Writes a picture to `path`, in the format that its extension names, whole or not at all.
///
/// What the format cannot hold is refused: 16 bits in JPEG, WebP, BMP and TGA; floats anywhere but
/// in EXR and TIFF (PNG takes them as 16 bits if they all lie in 0..=1), transparency in JPEG,
/// linear integers anywhere but in PNG and EXR. EXR takes everything: integer colors as linear
/// light, integer data as `v / full scale`, doubles rounded to single floats.
///
/// # Determinism
/// Same picture, same options: same bytes.
///
/// # Errors
/// [`Error::Format`] (unknown extension, or the format cannot hold the picture), [`Error::Exists`],
/// [`Error::Io`].
pub fn write(path: &Path, picture: &Picture, options: &WriteOptions) -> Result<()> {
    let bytes = encode_for(path, picture, known_extension(path)?, options)?;
    put(path, &bytes, options.force)
}

/// Writes pictures as [`write`] does: all of them or none. One after the other is encoded.
///
/// # Errors
/// As [`write`].
pub fn write_all(files: &[(PathBuf, Picture, WriteOptions)], force: bool) -> Result<()> {
    files.iter().try_for_each(|(path, ..)| check_output(path, &[], force))?;
    let staging = Staging::default();
    for (path, picture, options) in files {
        staging.stage(path, &encode_for(path, picture, known_extension(path)?, options)?)?;
    }
    staging.commit(force)
}

/// The bytes that [`write`] would write in this format; for standard output and notebooks.
///
/// # Errors
/// [`Error::Format`].
pub fn encode(picture: &Picture, format: Format, options: &WriteOptions) -> Result<Vec<u8>> {
    encode_for(&unnamed(), picture, format, options)
}

/// Fails if the format that `path` names (PNG without one) cannot hold pictures made of this one's
/// pixels.
///
/// One pixel is tried, or all where the values decide as well as the type: floats that go where
/// only 0 to 1 is held.
///
/// # Errors
/// [`Error::Format`].
pub(crate) fn ensure_can_hold(picture: &Picture, path: Option<&Path>, kind: MapKind) -> Result<()> {
    let format = path.map_or(Ok(Format::Png), known_extension)?;
    let path = path.map_or_else(unnamed, Path::to_owned);
    let options = WriteOptions::new(kind);
    if picture.samples().is_float() && !matches!(format, Format::Exr | Format::Tiff) {
        return encode_for(&path, picture, format, &options).map(drop);
    }
    encode_for(&path, &one_pixel(picture)?, format, &options).map(drop)
}

fn encode_for(
    path: &Path,
    picture: &Picture,
    format: Format,
    options: &WriteOptions,
) -> Result<Vec<u8>> {
    if format.streams() {
        let mut out = Cursor::new(Vec::with_capacity(picture.byte_len() / 2));
        let rows = once(Ok(Cow::Borrowed(picture)));
        write_as(&mut out, (path, format), picture.height(), rows, options)?;
        return Ok(out.into_inner());
    }
    let mut picture = Cow::Borrowed(picture);
    if options.kind != MapKind::Color && picture.encoding != Encoding::Data {
        picture.to_mut().encoding = Encoding::Data;
    }
    let result = match format {
        Format::Jpeg => {
            let record = options.record.as_deref().map(plain_line);
            jpeg::encode(&picture, record.as_deref())
        }
        Format::Pnm => other::encode_pnm(&picture),
        Format::Gif => Err("GIF is not written; use .png".into()),
        _ => other::encode(&picture, format),
    };
    result.map_err(|reason| Error::Format { path: path.to_owned(), reason })
}

/// One line of ASCII: JSON's own escapes for everything else.
pub(super) fn plain_line(record: &str) -> String {
    let mut line = String::with_capacity(record.len());
    for c in record.chars() {
        match c {
            ' '..='~' => line.push(c),
            c if c.is_control() => line.push(' '),
            c => {
                for unit in c.encode_utf16(&mut [0; 2]) {
                    line.push_str("\\u");
                    let digit = |k: u16| char::from_digit(u32::from(*unit >> k & 15), 16);
                    line.extend([12, 8, 4, 0].into_iter().filter_map(digit));
                }
            }
        }
    }
    line
}
