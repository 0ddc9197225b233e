//! Reading and writing pictures.
//!
//! [`read`] decides the format by content, keeps the samples in their own type, and brings colours
//! to sRGB (integers) or linear light (floats); what it changed stands in `meta.notes`. [`write`]
//! puts a picture where it belongs at once or not at all; what a format cannot hold is refused,
//! never rounded away. [`write_rows`] does so for pictures larger than memory. None writes time stamps: same picture, same bytes.

mod exif;
mod exr;
mod files;
mod icc;
mod jpeg;
mod other;
mod place;
mod png;
mod record;
mod rows;
mod source_map;
mod staging;
mod strips;
mod tiff;
mod write;

use std::fmt::Display;
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Meta, Picture, Samples};

pub use files::{read_text, write_files};
pub(crate) use place::check_outputs;
pub use place::{check_output, check_place};
pub use record::read_record;
pub use rows::write_rows;
pub use source_map::{encode_source_map, read_source_map, write_source_map};
pub(crate) use staging::Staging;
pub(crate) use strips::{STRIP_PIXELS, write_strips};
pub(crate) use write::ensure_can_hold;
pub use write::{WriteOptions, encode, write, write_all};

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics, 8 and 16 bits.
    Png,
    /// JPEG, 8 bits, lossy.
    Jpeg,
    /// TIFF, 8 and 16 bits, floats.
    Tiff,
    /// WebP, 8 bits; written lossless.
    WebP,
    /// `OpenEXR`, half and single floats.
    Exr,
    /// Windows bitmap, 8 bits.
    Bmp,
    /// Truevision TGA, 8 bits.
    Tga,
    /// Netpbm, 8 and 16 bits.
    Pnm,
    /// GIF; read only, first frame.
    Gif,
}

impl Format {
    /// Names of the formats that are read, for messages.
    pub const READABLE: &'static str = "PNG, JPEG, TIFF, WebP, EXR, BMP, TGA, PNM and GIF";
    /// Extensions that are written, for messages.
    pub const WRITABLE: &'static str =
        ".png, .jpg, .tif, .webp, .exr, .bmp, .tga, .pgm, .ppm or .pam";

    /// The format of a file with this extension, if it can be written.
    pub fn from_extension(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "png" => Self::Png,
            "jpg" | "jpeg" => Self::Jpeg,
            "tif" | "tiff" => Self::Tiff,
            "webp" => Self::WebP,
            "exr" => Self::Exr,
            "bmp" => Self::Bmp,
            "tga" => Self::Tga,
            "pgm" | "ppm" | "pnm" | "pam" => Self::Pnm,
            _ => return None,
        })
    }

    /// Whether it can be written a few rows at a time ([`write_rows`]).
    pub fn streams(self) -> bool {
        matches!(self, Self::Png | Self::Tiff | Self::Exr)
    }

    /// The format of a file that begins with these bytes. TGA has no signature: it is what the
    /// extension says, if the header makes sense.
    fn sniff(bytes: &[u8], path: &Path) -> Option<Self> {
        let starts = |magic: &[u8]| bytes.starts_with(magic);
        if starts(b"\x89PNG\r\n\x1a\n") {
            Some(Self::Png)
        } else if starts(b"\xff\xd8\xff") {
            Some(Self::Jpeg)
        } else if starts(b"II*\0") || starts(b"MM\0*") || starts(b"II+\0") || starts(b"MM\0+") {
            Some(Self::Tiff)
        } else if starts(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
            Some(Self::WebP)
        } else if starts(b"\x76\x2f\x31\x01") {
            Some(Self::Exr)
        } else if starts(b"BM") {
            Some(Self::Bmp)
        } else if starts(b"GIF87a") || starts(b"GIF89a") {
            Some(Self::Gif)
        } else if bytes.len() > 2 && bytes[0] == b'P' && (b'1'..=b'7').contains(&bytes[1]) {
            bytes[2].is_ascii_whitespace().then_some(Self::Pnm)
        } else {
            let header = bytes.len() >= 18
                && bytes[1] <= 1
                && matches!(bytes[2], 1 | 2 | 3 | 9 | 10 | 11)
                && matches!(bytes[16], 8 | 15 | 16 | 24 | 32);
            (header && Self::from_extension(path) == Some(Self::Tga)).then_some(Self::Tga)
        }
    }
}

/// The bytes of a file and its name for messages: what every decoder is given.
struct Source<'a> {
    bytes: &'a [u8],
    path: &'a Path,
    kind: MapKind,
}

impl Source<'_> {
    fn bad(&self, reason: impl Into<String>) -> Error {
        Error::Decode { path: self.path.to_owned(), reason: reason.into() }
    }

    /// For a decoder's own complaint about the file's bytes.
    fn damaged(&self, format: &str, complaint: impl Display) -> Error {
        self.bad(format!(
            "the {format} data is damaged or incomplete ({complaint}); get the file again or save \
             it anew"
        ))
    }

    /// For a valid file of a variety that we do not read.
    fn unsupported(&self, what: impl Display) -> Error {
        self.bad(format!("it holds {what}, which is not supported; save it as PNG, TIFF or EXR"))
    }

    /// Checks the size that a header claims, before anything is allocated. `ratio` is how many
    /// times smaller than its samples a file of this format can be at most.
    fn check_size(
        &self,
        (width, height): (usize, usize),
        bytes_per_pixel: usize,
        ratio: Option<u64>,
    ) -> Result<()> {
        if width == 0 || height == 0 {
            return Err(self.bad(format!(
                "its header says {width}x{height} pixels; get the file again or save it anew"
            )));
        }
        if width > Picture::MAX_SIDE || height > Picture::MAX_SIDE {
            return Err(self.bad(format!(
                "its header says {width}x{height} pixels, at most {0}x{0} are read; cut or shrink \
                 the picture",
                Picture::MAX_SIDE
            )));
        }
        let need = (width as u64 * height as u64).checked_mul(bytes_per_pixel as u64);
        let most = ratio.map(|ratio| (self.bytes.len() as u64).saturating_mul(ratio) + (1 << 16));
        if most.is_some_and(|most| need.is_none_or(|need| need > most)) {
            return Err(self.bad(format!(
                "its header says {width}x{height} pixels, far more than {} bytes can hold; the \
                 file is damaged or incomplete, get it again",
                self.bytes.len()
            )));
        }
        // The decoder's buffer and one copy of it (orientation, profile) exist at the same time.
        ensure_available(&format!("reading {}", self.path.display()), need.map(|n| 2 * n))
    }
}

/// What a decoder returns: samples as stored, and what it found out about them.
struct Raw {
    width: usize,
    height: usize,
    channels: usize,
    samples: Samples,
    /// What integer or float samples of this file mean if they are colours.
    encoding: Encoding,
    /// EXIF orientation, 1..=8.
    orientation: u8,
    icc: Option<Vec<u8>>,
    pixels_per_metre: Option<(u32, u32)>,
    notes: Vec<String>,
}

impl Raw {
    fn new((width, height): (usize, usize), channels: usize, samples: Samples) -> Self {
        let encoding = if samples.is_float() { Encoding::Linear } else { Encoding::Srgb };
        Self {
            width,
            height,
            channels,
            samples,
            encoding,
            orientation: 1,
            icc: None,
            pixels_per_metre: None,
            notes: Vec::new(),
        }
    }
}

/// Reads a picture; `kind` says what its numbers are.
///
/// Colours ([`MapKind::Color`]) come out as [`Encoding::Srgb`] if they are integers and as
/// [`Encoding::Linear`] if they are floats; an embedded profile that is not sRGB is converted.
/// Other kinds come out as [`Encoding::Data`], bit for bit as stored. The orientation of EXIF is
/// applied. Notes in `meta.notes` say what was done. NaN and infinite samples pass.
///
/// # Determinism
/// Same file, same samples, on every CPU.
///
/// # Errors
/// [`Error::Io`] (missing, unreadable), [`Error::Format`] (none of the formats we read),
/// [`Error::Decode`] (damaged, incomplete, lying, unsupported variety), [`Error::Memory`].
pub fn read(path: &Path, kind: MapKind) -> Result<Picture> {
    let bytes = load(path)?;
    decode(&Source { bytes: &bytes, path, kind })
}

/// As [`read`], from bytes; `name` stands for the file in messages.
///
/// # Errors
/// As [`read`], except [`Error::Io`].
pub fn read_bytes(bytes: &[u8], name: &str, kind: MapKind) -> Result<Picture> {
    decode(&Source { bytes, path: Path::new(name), kind })
}

/// The bytes of a file, if they fit into memory.
fn load(path: &Path) -> Result<Vec<u8>> {
    let io = |source| Error::Io { action: "read", path: path.to_owned(), source };
    let length = std::fs::metadata(path).map_err(io)?.len();
    ensure_available(&format!("reading {}", path.display()), Some(length))?;
    std::fs::read(path).map_err(io)
}

/// The picture files in the folder of `path`, by extension, in the order of their names.
pub(crate) fn files_beside(path: &Path) -> Result<Vec<PathBuf>> {
    let folder = place::folder_of(path);
    let io = |source| Error::Io { action: "list", path: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let file = entry.map_err(io)?.path();
        let gif = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("gif"));
        if (gif || Format::from_extension(&file).is_some()) && file.is_file() {
            files.push(file);
        }
    }
    files.sort();
    Ok(files)
}

fn decode(source: &Source) -> Result<Picture> {
    if source.bytes.is_empty() {
        return Err(source.bad("the file is empty; get it again or save it anew"));
    }
    let format = Format::sniff(source.bytes, source.path).ok_or_else(|| Error::Format {
        path: source.path.to_owned(),
        reason: format!(
            "not a picture format that is read ({}); convert it to one of them",
            Format::READABLE
        ),
    })?;
    guarded(source, || {
        let raw = match format {
            Format::Png => png::decode(source),
            Format::Jpeg => jpeg::decode(source),
            Format::Tiff => tiff::decode(source),
            Format::Exr => exr::decode(source),
            Format::WebP | Format::Bmp | Format::Tga | Format::Pnm | Format::Gif => {
                other::decode(source, format)
            }
        }?;
        finish(source, raw)
    })
}

/// Runs `f`; a panic of a decoder on hostile bytes is the file's fault, not ours.
fn guarded<T>(source: &Source, f: impl FnOnce() -> Result<T>) -> Result<T> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(f))
        .unwrap_or_else(|_| Err(source.damaged("picture", "its decoder gave up")))
}

/// From samples as stored to a picture: profile, orientation, encoding.
fn finish(source: &Source, mut raw: Raw) -> Result<Picture> {
    let color = source.kind == MapKind::Color && raw.encoding != Encoding::Data;
    let mut icc = None;
    if let Some(profile) = raw.icc.take() {
        if color {
            icc = icc::convert(&mut raw, profile);
        } else if !icc::is_srgb(&profile) {
            raw.notes.push(
                "a color profile is embedded but ignored, because the file holds data, not colors"
                    .into(),
            );
        }
    }
    let (height, width, samples) =
        exif::upright(raw.samples, (raw.height, raw.width, raw.channels), raw.orientation);
    if raw.orientation != 1 {
        raw.notes
            .push(format!("the orientation tag of the file ({}) was applied", raw.orientation));
        if raw.orientation >= 5 {
            raw.pixels_per_metre = raw.pixels_per_metre.map(|(x, y)| (y, x));
        }
    }
    let encoding = if color { raw.encoding } else { Encoding::Data };
    let mut picture = Picture::new(height, width, raw.channels, samples, encoding)
        .map_err(|e| source.bad(e.to_string()))?;
    picture.meta = Meta { icc, pixels_per_metre: raw.pixels_per_metre, notes: raw.notes };
    Ok(picture)
}

/// A path for messages about pictures that are not in a file.
fn unnamed() -> PathBuf {
    PathBuf::from("the picture")
}

#[cfg(test)]
mod color_tests;
#[cfg(test)]
mod rows_tests;
#[cfg(test)]
mod tests;
