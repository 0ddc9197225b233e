//! The files room as this face needs it: results become bytes first and get their names last.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::image::io::{self, Format, WriteOptions};
use crate::image::material::{self, MapKind};
use crate::image::picture::Picture;

pub(super) use crate::image::io::{
    check_output as check_place, check_outputs, encode_source_map, ensure_can_hold, read,
    read_record, read_source_map,
};
pub(super) use crate::image::material::siblings;

/// The bytes of a file at `path`, or of a PNG for standard output.
///
/// # Errors
/// [`Error::Format`] naming the file if its format is unknown or cannot hold the picture.
pub(super) fn encode(
    picture: &Picture,
    path: Option<&Path>,
    kind: MapKind,
    record: Option<&str>,
) -> Result<Vec<u8>> {
    let format = match path {
        None => Format::Png,
        Some(path) => Format::from_extension(path).ok_or_else(|| Error::Format {
            path: path.to_owned(),
            reason: format!("the extension must be one of {}", Format::WRITABLE),
        })?,
    };
    let options = WriteOptions { kind, record: record.map(str::to_owned), force: true };
    io::encode(picture, format, &options).map_err(|error| match (error, path) {
        (Error::Format { reason, .. }, Some(path)) => {
            Error::Format { path: path.to_owned(), reason }
        }
        (error, _) => error,
    })
}

/// What the numbers of a file are by its name; data if the name does not say.
pub(super) fn kind_of_file(path: &Path) -> MapKind {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    material::classify(&name).map_or(MapKind::Data, |(_, kind)| kind)
}

/// The name of variant `number`: `brick.png` becomes `brick-3.png`, `brick_basecolor.png`
/// `brick-3_basecolor.png`.
pub(super) fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default();
    let mut name = OsString::new();
    match stem.to_str().map(|s| s.split_at(material::without_color_ending(s).len())) {
        Some((front, ending)) if !front.is_empty() => {
            name.push(format!("{front}-{number}{ending}"));
        }
        _ => {
            name.push(stem);
            name.push(format!("-{number}"));
        }
    }
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variants_are_numbered_before_the_color_ending() {
        let cases = [
            ("a/brick.png", "a/brick-3.png"),
            ("brick_basecolor.v2.png", "brick_basecolor.v2-3.png"),
            ("brick_basecolor.png", "brick-3_basecolor.png"),
            ("basecolor.png", "basecolor-3.png"),
            ("brick", "brick-3"),
        ];
        for (path, want) in cases {
            assert_eq!(numbered(Path::new(path), 3), Path::new(want), "{path}");
        }
    }

    #[test]
    fn files_are_what_their_names_say() {
        assert_eq!(kind_of_file(Path::new("x/wall_nrm.png")), MapKind::Normal);
        assert_eq!(kind_of_file(Path::new("wetness.png")), MapKind::Data);
    }
}
