//! The files room as this face needs it: results become bytes first and get their names last.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::image::io::{self, Format, WriteOptions};
use crate::image::material::{self, MapKind, MapName};
use crate::image::picture::{Picture, Sample, Samples};
use crate::with_samples;

pub(super) use crate::image::io::{
    check_output as check_place, encode_source_map, read, read_record, read_source_map,
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

/// Fails if the format that `path` names cannot hold pictures made of this one's pixels.
///
/// One pixel is tried, or all where the values decide as well as the type: floats that go where
/// only 0 to 1 is held.
///
/// # Errors
/// [`Error::Format`].
pub(super) fn ensure_can_hold(picture: &Picture, path: Option<&Path>, kind: MapKind) -> Result<()> {
    let format = path.map_or(Some(Format::Png), Format::from_extension);
    if picture.samples().is_float() && !matches!(format, Some(Format::Exr | Format::Tiff)) {
        return encode(picture, path, kind, None).map(|_| ());
    }
    let c = picture.channels();
    let pixel = with_samples!(picture.samples(), v => wrap(v[..c].to_vec()));
    encode(&picture.with_samples(1, 1, c, pixel)?, path, kind, None).map(|_| ())
}

/// [`Sample::wrap`] where the type is known by its vector only.
fn wrap<T: Sample>(v: Vec<T>) -> Samples {
    T::wrap(v)
}

/// Fails if one of these outputs, each with the flag that asks for it, cannot be written, or two are
/// the same file.
///
/// # Errors
/// Those of [`check_place`], [`Error::Parameter`].
pub(super) fn check_places(
    outputs: impl Iterator<Item = (&'static str, PathBuf)>,
    inputs: &[&Path],
    force: bool,
) -> Result<()> {
    let mut seen: Vec<PathBuf> = Vec::new();
    for (flag, path) in outputs {
        check_place(&path, inputs, force)?;
        let absolute = std::path::absolute(&path).map_err(Error::io("write", &path))?;
        if seen.contains(&absolute) {
            let got = format!("{} twice", path.display());
            return Err(Error::parameter(flag, "a file of its own for each output", got));
        }
        seen.push(absolute);
    }
    Ok(())
}

/// The map that goes by this name or alias, in any spelling (`normal`, `Normal-GL`).
pub(super) fn map_of_name(name: &str) -> Option<MapName> {
    let plain: String = name.chars().filter(|c| !is_separator(*c)).collect();
    let plain = plain.to_lowercase();
    MapName::ALL.into_iter().find(|map| map.aliases.contains(&plain.as_str()))
}

/// What the numbers of a file are by its name; data if the name does not say.
pub(super) fn kind_of_file(path: &Path) -> MapKind {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    material::classify(&name).map_or(MapKind::Data, |(_, kind)| kind)
}

/// The stem of a tile's name without the ending that calls it a base color, if it has one:
/// `brick_base_color` becomes `brick`, `basecolor` nothing.
pub(super) fn without_color_ending(stem: &str) -> &str {
    let is_color = |word: &str| map_of_name(word).is_some_and(|map| map.name == "basecolor");
    if is_color(stem) {
        return "";
    }
    let mut cuts = stem.char_indices().filter(|(_, c)| is_separator(*c));
    cuts.find(|(at, _)| is_color(&stem[at + 1..])).map_or(stem, |(at, _)| &stem[..at])
}

/// The name of variant `number`: `brick.png` becomes `brick-3.png`, `brick_basecolor.png`
/// `brick-3_basecolor.png`.
pub(super) fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default();
    let mut name = OsString::new();
    match stem.to_str().map(|s| s.split_at(without_color_ending(s).len())) {
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

fn is_separator(c: char) -> bool {
    matches!(c, '_' | '-' | '.' | ' ')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_color_ending_is_found() {
        let cases = [
            ("brick", "brick"),
            ("brick_base_color", "brick"),
            ("old brick-Albedo", "old brick"),
            ("watercolor", "watercolor"),
            ("basecolor", ""),
        ];
        for (stem, want) in cases {
            assert_eq!(without_color_ending(stem), want, "{stem}");
        }
    }

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
    fn names_go_by_their_aliases() {
        assert_eq!(map_of_name("Normal-GL").map(|m| m.name), Some("normal_gl"));
        assert_eq!(map_of_name("my_normal"), None);
        assert_eq!(kind_of_file(Path::new("x/wall_nrm.png")), MapKind::Normal);
        assert_eq!(kind_of_file(Path::new("wetness.png")), MapKind::Data);
    }
}
