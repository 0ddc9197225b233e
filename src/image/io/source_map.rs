//! A [`SourceMap`] as a file, to be replayed on a map that comes later.

use std::io::Cursor;
use std::path::Path;

use exr::image::FlatSamples;
use exr::meta::attribute::SampleType;
use serde::{Deserialize, Serialize};

use super::staging::put;
use super::{Format, Source, exr as planes, guarded, load};
use crate::base::error::{Error, Result};
use crate::image::material::MapKind;
use crate::image::sourcemap::{Origin, SourceMap};
use crate::image::symmetry::Symmetry;

/// Versions of the file's layout: positions in one photo; the same with an origin each, in one
/// photo or several. Readers refuse others.
const PLAIN: u32 = 1;
const VIEWS: u32 = 2;

/// The channels, in the order in which EXR keeps them; [`PLAIN`] has the last two.
const CHANNELS: [&str; 4] = ["source.photo", "source.symmetry", "source.x", "source.y"];

/// What stands in the attribute `texforge`.
#[derive(Serialize, Deserialize)]
struct Header {
    #[serde(rename = "source_map")]
    version: u32,
    #[serde(rename = "source_width")]
    width: usize,
    #[serde(rename = "source_height")]
    height: usize,
    /// Width and height of the photos after the first.
    #[serde(rename = "further_sources", default, skip_serializing_if = "Vec::is_empty")]
    further: Vec<(usize, usize)>,
}

/// Writes the bytes of [`encode_source_map`].
///
/// # Errors
/// Those of [`encode_source_map`], [`Error::Exists`], [`Error::Io`].
pub fn write_source_map(path: &Path, map: &SourceMap, force: bool) -> Result<()> {
    put(path, &encode_source_map(map, path)?, force)
}

/// A source map as the bytes of an EXR file: two 32-bit integer channels `source.x` and
/// `source.y`, and an attribute `texforge` with the layout's version and the size of the source. If
/// pixels have origins, two more channels `source.photo` (from 0 on) and `source.symmetry`
/// ([`Symmetry::code`]), and the sizes of all photos.
///
/// # Errors
/// [`Error::Format`] if `path`, where the bytes are to go, does not end in `.exr`; [`Error::BadPicture`]
/// for a map with places between pixels, which the file does not hold.
pub fn encode_source_map(map: &SourceMap, path: &Path) -> Result<Vec<u8>> {
    if Format::from_extension(path) != Some(Format::Exr) {
        return Err(Error::Format {
            path: path.to_owned(),
            reason: "a source map is written as EXR only; use a name that ends in .exr".into(),
        });
    }
    if map.fractions().is_some() {
        return Err(Error::BadPicture {
            what: "source map".into(),
            reason:
                "it has places between pixels, and the file holds whole ones only; make the maps \
                     together with the picture"
                    .into(),
        });
    }
    let internal = |message: String| Error::Internal { message };
    let (height, width) = map.source_size();
    let version = if map.origins().is_some() { VIEWS } else { PLAIN };
    let further = map.source_sizes()[1..].iter().map(|&(h, w)| (w, h)).collect();
    let header = Header { version, width, height, further };
    let header = serde_json::to_string(&header).map_err(|e| internal(e.to_string()))?;
    let first = if map.origins().is_some() { 0 } else { 2 };
    let file = planes::File {
        size: (map.width(), map.height()),
        channels: CHANNELS[first..].iter().map(|name| (*name, SampleType::U32)).collect(),
        density: None,
        record: Some(&header),
    };
    let origin = |i: usize| map.origins().map(|origins| origins[i]).unwrap_or_default();
    let mut out = Cursor::new(Vec::new());
    let written = file.write(&mut out, |blocks| {
        for y in (0..map.height()).step_by(planes::BLOCK) {
            let start = y * map.width();
            blocks.push(|channel, i| match first + channel {
                0 => origin(start + i).photo.into(),
                1 => origin(start + i).symmetry.code().into(),
                2 => map.positions()[start + i][1],
                _ => map.positions()[start + i][0],
            })?;
        }
        Ok(())
    });
    written.map_err(|e| internal(e.to_string()))?;
    Ok(out.into_inner())
}

/// Reads what [`write_source_map`] wrote.
///
/// # Errors
/// [`Error::Io`]; [`Error::Decode`] if the file is damaged, no source map, of another version, or
/// holds positions outside its source.
pub fn read_source_map(path: &Path) -> Result<SourceMap> {
    let bytes = load(path)?;
    let source = Source { bytes: &bytes, path, kind: MapKind::Data };
    if Format::sniff(&bytes, path) != Some(Format::Exr) {
        return Err(no_source_map(&source, "it is not an EXR file"));
    }
    guarded(&source, || decode(&source))
}

fn no_source_map(source: &Source, why: &str) -> Error {
    source.bad(format!("this is no source map ({why}); give the file that --save-source-map wrote"))
}

fn decode(source: &Source) -> Result<SourceMap> {
    let planes = planes::read_planes(source)?;
    let record = planes.record.ok_or_else(|| no_source_map(source, "its header is missing"))?;
    let header: Header = serde_json::from_str(&record)
        .map_err(|_| no_source_map(source, "its header does not say so"))?;
    let names = match header.version {
        PLAIN => &CHANNELS[2..],
        VIEWS => &CHANNELS[..],
        other => {
            return Err(source.bad(format!(
                "the source map has version {other}, this program reads versions {PLAIN} and {VIEWS}; \
                 make it again"
            )));
        }
    };
    let whole = |(_, plane): &(String, FlatSamples)| match plane {
        FlatSamples::U32(values) => Some(values.clone()),
        _ => None,
    };
    let values: Option<Vec<Vec<u32>>> = planes.channels.iter().map(whole).collect();
    let Some(values) = values.filter(|v| v.len() == names.len()) else {
        let why = format!("it does not have {} channels of 32-bit integers", names.len());
        return Err(no_source_map(source, &why));
    };
    if planes.channels.iter().map(|(name, _)| name).ne(names) {
        let why = format!("its channels are not {}", names.join(" and "));
        return Err(no_source_map(source, &why));
    }
    let (x, y) = (&values[names.len() - 2], &values[names.len() - 1]);
    let positions = y.iter().zip(x).map(|(y, x)| [*y, *x]).collect();
    let origin = |(&photo, &code): (&u32, &u32)| {
        let photo = u16::try_from(photo).ok()?;
        Some(Origin { photo, symmetry: Symmetry::from_code(code)? })
    };
    let origins: Option<Vec<Origin>> = match &values[..] {
        [photos, codes, ..] if header.version == VIEWS => {
            photos.iter().zip(codes).map(origin).collect()
        }
        _ => Some(Vec::new()),
    };
    let origins = origins.ok_or_else(|| no_source_map(source, "it names no photo or symmetry"))?;
    let further = header.further.iter().map(|&(w, h)| (h, w));
    let sources = [(header.height, header.width)].into_iter().chain(further).collect();
    SourceMap::of_views((planes.height, planes.width), sources, positions, origins)
        .map_err(|e| source.bad(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::error::ErrorKind;
    use crate::image::io::tests::exr_of_planes;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn comes_back_as_written(
            size in (1..40_usize, 1..40_usize),
            source in (1..70_000_usize, 1..70_000_usize),
            seed: u32,
        ) {
            let mix = |i: usize| (i as u64 + 1).wrapping_mul(u64::from(seed) | 1) as usize >> 7;
            let place = |i: usize| [(mix(2 * i) % source.0) as u32, (mix(2 * i + 1) % source.1) as u32];
            let positions = (0..size.0 * size.1).map(place).collect();
            let mut maps = vec![SourceMap::new(size, source, positions).expect("inside")];
            // The same positions, of two photos in all symmetries.
            let origin = |i: usize| Origin {
                photo: (mix(3 * i) % 2) as u16,
                symmetry: Symmetry::ALL[mix(5 * i) % 8],
            };
            let origins = (0..size.0 * size.1).map(origin).collect();
            let sources = vec![source, (source.0 + 3, source.1)];
            let positions = maps[0].positions().to_vec();
            maps.push(SourceMap::of_views(size, sources, positions, origins).expect("inside"));
            for map in maps {
            let dir = tempfile::tempdir().expect("folder");
            let path = dir.path().join("map.exr");
            write_source_map(&path, &map, false).expect("write");
            prop_assert_eq!(read_source_map(&path).expect("read"), map);
            }
        }
    }

    #[test]
    fn refuses_what_is_no_source_map() {
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("map.exr");
        let map = SourceMap::new((1, 2), (3, 4), vec![[2, 3], [0, 0]]).expect("map");
        let error = write_source_map(&dir.path().join("map.png"), &map, false);
        assert_eq!(error.expect_err("extension").kind(), ErrorKind::Format);

        let between = map.between(vec![[0, 9], [0, 0]]).expect("one a pixel");
        let error = write_source_map(&path, &between, false).expect_err("fractions");
        assert!(error.to_string().contains("between pixels"), "{error}");

        let x = || FlatSamples::U32(vec![3, 0]);
        let y = || FlatSamples::U32(vec![2, 0]);
        let good = r#"{"source_map":1,"source_width":4,"source_height":3}"#;
        let refuse =
            |channels: [(&'static str, FlatSamples); 2], header: Option<&str>, why: &str| {
                put(&path, &exr_of_planes(channels, header), true).expect("write");
                let error = read_source_map(&path).expect_err(why);
                assert_eq!(error.kind(), ErrorKind::Decode, "{error}");
                assert!(error.to_string().contains(why), "{error}");
            };
        refuse([("source.x", x()), ("source.y", y())], None, "header is missing");
        refuse([("source.x", x()), ("source.y", y())], Some("{}"), "does not say so");
        let newer = good.replace("map\":1", "map\":3");
        refuse([("source.x", x()), ("source.y", y())], Some(&newer), "version 3");
        let views = good.replace("map\":1", "map\":2");
        refuse([("source.x", x()), ("source.y", y())], Some(&views), "4 channels");
        refuse([("R", x()), ("G", y())], Some(good), "source.x and source.y");
        let half = FlatSamples::F32(vec![2.0, 0.0]);
        refuse([("source.x", x()), ("source.y", half)], Some(good), "32-bit integers");
        let far = FlatSamples::U32(vec![3, 0]);
        refuse([("source.x", x()), ("source.y", far)], Some(good), "outside");

        for (photo, symmetry, why) in
            [(1, 0, "photo 2 of 1"), (0, 8, "symmetry"), (70_000, 0, "symmetry")]
        {
            let values = [[0, photo], [0, symmetry], [3, 0], [2, 0]];
            let planes = values.map(|values| FlatSamples::U32(values.to_vec()));
            put(&path, &exr_of_planes(CHANNELS.into_iter().zip(planes), Some(&views)), true)
                .expect("write");
            let error = read_source_map(&path).expect_err(why);
            assert!(error.to_string().contains(why), "{error}");
        }

        std::fs::write(dir.path().join("text.exr"), "hello").expect("text");
        let error = read_source_map(&dir.path().join("text.exr")).expect_err("text");
        assert!(error.to_string().contains("not an EXR"), "{error}");
        let error = read_source_map(&dir.path().join("none.exr")).expect_err("missing");
        assert_eq!(error.kind(), ErrorKind::Io);
    }
}
