//! A [`SourceMap`] as a file, to be replayed on a map that comes later.

use std::path::Path;

use exr::image::FlatSamples;
use serde::{Deserialize, Serialize};

use super::place::put;
use super::{Format, Source, exr as planes, guarded, load};
use crate::base::error::{Error, Result};
use crate::image::material::MapKind;
use crate::image::sourcemap::SourceMap;

/// Version of the file's layout; readers refuse others.
const VERSION: u32 = 1;

/// What stands in the attribute `texforge`.
#[derive(Serialize, Deserialize)]
struct Header {
    #[serde(rename = "source_map")]
    version: u32,
    #[serde(rename = "source_width")]
    width: usize,
    #[serde(rename = "source_height")]
    height: usize,
}

/// Writes the bytes of [`encode_source_map`].
///
/// # Errors
/// Those of [`encode_source_map`], [`Error::Exists`], [`Error::Io`].
pub fn write_source_map(path: &Path, map: &SourceMap, force: bool) -> Result<()> {
    put(path, &encode_source_map(map, path)?, force)
}

/// A source map as the bytes of an EXR file: two 32-bit integer channels `source.x` and
/// `source.y`, and an attribute `texforge` with the layout's version and the size of the source.
///
/// # Errors
/// [`Error::Format`] if `path`, where the bytes are to go, does not end in `.exr`.
pub fn encode_source_map(map: &SourceMap, path: &Path) -> Result<Vec<u8>> {
    if Format::from_extension(path) != Some(Format::Exr) {
        return Err(Error::Format {
            path: path.to_owned(),
            reason: "a source map is written as EXR only; use a name that ends in .exr".into(),
        });
    }
    let internal = |message: String| Error::Internal { message };
    let (height, width) = map.source_size();
    let header = Header { version: VERSION, width, height };
    let header = serde_json::to_string(&header).map_err(|e| internal(e.to_string()))?;
    let plane = |k: usize| FlatSamples::U32(map.positions().iter().map(|p| p[k]).collect());
    let channels = vec![("source.x".to_owned(), plane(1)), ("source.y".to_owned(), plane(0))];
    planes::encode_planes((map.width(), map.height()), channels, None, Some(&header))
        .map_err(internal)
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
    if header.version != VERSION {
        return Err(source.bad(format!(
            "the source map has version {}, this program reads version {VERSION}; make it again",
            header.version
        )));
    }
    let [(x_name, FlatSamples::U32(x)), (y_name, FlatSamples::U32(y))] = &planes.channels[..]
    else {
        return Err(no_source_map(source, "it does not have two channels of 32-bit integers"));
    };
    if (x_name.as_str(), y_name.as_str()) != ("source.x", "source.y") {
        return Err(no_source_map(source, "its channels are not source.x and source.y"));
    }
    let positions = y.iter().zip(x).map(|(y, x)| [*y, *x]).collect();
    let source_size = (header.height, header.width);
    SourceMap::new((planes.height, planes.width), source_size, positions)
        .map_err(|e| source.bad(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::error::ErrorKind;
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
            let map = SourceMap::new(size, source, positions).expect("inside");
            let dir = tempfile::tempdir().expect("folder");
            let path = dir.path().join("map.exr");
            write_source_map(&path, &map, false).expect("write");
            prop_assert_eq!(read_source_map(&path).expect("read"), map);
        }
    }

    #[test]
    fn refuses_what_is_no_source_map() {
        let dir = tempfile::tempdir().expect("folder");
        let path = dir.path().join("map.exr");
        let map = SourceMap::new((1, 2), (3, 4), vec![[2, 3], [0, 0]]).expect("map");
        let error = write_source_map(&dir.path().join("map.png"), &map, false);
        assert_eq!(error.expect_err("extension").kind(), ErrorKind::Format);

        let x = || FlatSamples::U32(vec![3, 0]);
        let y = || FlatSamples::U32(vec![2, 0]);
        let good = r#"{"source_map":1,"source_width":4,"source_height":3}"#;
        let refuse = |channels: [(&str, FlatSamples); 2], header: Option<&str>, why: &str| {
            let channels = channels.map(|(name, plane)| (name.to_owned(), plane)).to_vec();
            let bytes = planes::encode_planes((2, 1), channels, None, header).expect("encode");
            put(&path, &bytes, true).expect("write");
            let error = read_source_map(&path).expect_err(why);
            assert_eq!(error.kind(), ErrorKind::Decode, "{error}");
            assert!(error.to_string().contains(why), "{error}");
        };
        refuse([("source.x", x()), ("source.y", y())], None, "header is missing");
        refuse([("source.x", x()), ("source.y", y())], Some("{}"), "does not say so");
        let newer = good.replace("map\":1", "map\":2");
        refuse([("source.x", x()), ("source.y", y())], Some(&newer), "version 2");
        refuse([("R", x()), ("G", y())], Some(good), "source.x and source.y");
        let half = FlatSamples::F32(vec![2.0, 0.0]);
        refuse([("source.x", x()), ("source.y", half)], Some(good), "32-bit integers");
        let far = FlatSamples::U32(vec![3, 0]);
        refuse([("source.x", x()), ("source.y", far)], Some(good), "outside");

        std::fs::write(dir.path().join("text.exr"), "hello").expect("text");
        let error = read_source_map(&dir.path().join("text.exr")).expect_err("text");
        assert!(error.to_string().contains("not an EXR"), "{error}");
        let error = read_source_map(&dir.path().join("none.exr")).expect_err("missing");
        assert_eq!(error.kind(), ErrorKind::Io);
    }
}
