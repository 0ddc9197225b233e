//! Pictures written in pieces against the same pictures written whole.

use std::borrow::Cow;
use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::sync::mpsc::sync_channel;

use proptest::prelude::*;

use super::rows::write_with;
use super::tests::{all_types, picture};
use super::*;
use crate::base::error::ErrorKind;
use crate::image::picture::Sample;
use crate::with_samples;

const STREAMED: [(Format, &str); 3] =
    [(Format::Png, "a.png"), (Format::Tiff, "a.tif"), (Format::Exr, "a.exr")];

/// The picture in pieces that end at these rows; where a row does not exist, at the last.
fn cut(whole: &Picture, ends: &[usize]) -> Vec<Result<Picture>> {
    fn copied<T: Sample>(v: &[T]) -> Samples {
        T::wrap(v.to_vec())
    }
    let (height, row) = (whole.height(), whole.width() * whole.channels());
    let mut ends: Vec<usize> = ends.iter().map(|end| *end.min(&height)).collect();
    ends.extend([0, height]);
    ends.sort_unstable();
    ends.dedup();
    let piece = |pair: &[usize]| {
        let range = pair[0] * row..pair[1] * row;
        let samples = with_samples!(whole.samples(), v => copied(&v[range]));
        whole.with_samples(pair[1] - pair[0], whole.width(), whole.channels(), samples)
    };
    ends.windows(2).map(piece).collect()
}

fn written(
    name: &str,
    height: usize,
    rows: Vec<Result<Picture>>,
    options: &WriteOptions,
) -> Result<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    write_rows(&mut out, Path::new(name), height, rows, options)?;
    Ok(out.into_inner())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn pieces_make_the_file_that_the_whole_picture_makes(
        h in 1..40_usize, w in 1..9_usize, c in 1..6_usize, color: bool, along: bool, seed: u64,
        ends in prop::collection::vec(0..40_usize, 0..6),
    ) {
        let color = color && c <= 4;
        let kind = if color { MapKind::Color } else { MapKind::Normal };
        let record = along.then(|| "{\"seed\":7}".to_owned());
        let options = WriteOptions { record, ..WriteOptions::new(kind) };
        for mut picture in all_types((h, w, c), color, seed) {
            picture.meta.pixels_per_metre = along.then_some((11811, 5900));
            let profile = along && picture.encoding == Encoding::Srgb;
            picture.meta.icc = profile.then(|| vec![7; 300]);
            for (format, name) in STREAMED {
                let label = format!("{h}x{w}x{c} {} as {name}", picture.samples().dtype());
                let whole = encode(&picture, format, &options);
                let pieces = written(name, h, cut(&picture, &ends), &options);
                match (whole, pieces) {
                    (Ok(whole), Ok(pieces)) => prop_assert!(whole == pieces, "{}", label),
                    (Err(whole), Err(pieces)) => {
                        let whole = whole.to_string().replace("the picture", name);
                        prop_assert_eq!(whole, pieces.to_string(), "{}", label);
                    }
                    (whole, _) => prop_assert!(false, "{}: whole {:?}", label, whole.is_ok()),
                }
            }
        }
    }
}

/// Several strips of TIFF, blocks of EXR and, with more than 64 MiB, chunks of PNG.
#[test]
fn large_pictures_come_back_whole() {
    let options = WriteOptions::new(MapKind::Color);
    let check = |picture: &Picture, (format, name): (Format, &str), ends: &[usize]| {
        let whole = encode(picture, format, &options).expect(name);
        let pieces = written(name, picture.height(), cut(picture, ends), &options).expect(name);
        assert!(whole == pieces, "{name}: other bytes");
        let back = read_bytes(&whole, name, MapKind::Color).expect(name);
        assert!(back.samples() == picture.samples(), "{name}: other samples");
        whole
    };
    let medium = picture::<u16>((700, 600, 4), Encoding::Srgb, 5);
    for ends in [vec![], vec![1, 2, 399], (0..700).collect()] {
        check(&medium, STREAMED[0], &ends);
        check(&medium, STREAMED[1], &ends);
    }
    check(&picture::<f32>((100, 30, 3), Encoding::Linear, 5), STREAMED[2], &[1, 15, 17, 64]);

    let (h, w) = (8200, 8200);
    let value = |i: usize| (i % w / 32 + i / w / 16) as u8 ^ (i as u8 & 3);
    let large = Samples::U8((0..h * w).map(value).collect());
    let large = Picture::new(h, w, 1, large, Encoding::Srgb).expect("large");
    let file = check(&large, STREAMED[0], &[1, 1000, 1001, 8199]);
    let chunks = file.windows(4).filter(|name| *name == b"IDAT").count();
    assert!(chunks > 1, "{chunks} chunks: not streamed");
}

#[test]
fn big_tiff_comes_back() {
    let small = picture::<u16>((40, 7, 3), Encoding::Srgb, 1);
    let rows = cut(&small, &[3, 20]).into_iter().map(|piece| piece.map(Cow::Owned));
    let mut out = Cursor::new(Vec::new());
    let options = WriteOptions::new(MapKind::Color);
    let big = tiff::write_kind::<_, ::tiff::encoder::TiffKindBig>;
    write_with(&mut out, Path::new("a.tif"), 40, rows, &options, big).expect("write");
    let bytes = out.into_inner();
    assert_eq!(bytes[2], 43, "the number of BigTIFF");
    let back = read_bytes(&bytes, "a.tif", MapKind::Color).expect("read");
    assert_eq!(back.samples(), small.samples());
}

#[test]
fn rows_that_make_no_picture_are_refused() {
    let small = picture::<u8>((6, 4, 3), Encoding::Srgb, 1);
    let like = |size, seed| picture::<u8>(size, Encoding::Srgb, seed);
    let options = WriteOptions::new(MapKind::Color);
    for (_, name) in STREAMED {
        let refused = |height, second: Option<Picture>| {
            let rows = [Some(small.clone()), second].into_iter().flatten().map(Ok).collect();
            written(name, height, rows, &options).expect_err(name)
        };
        let mut other = like((2, 4, 3), 2);
        other.meta.icc = Some(vec![7; 300]);
        for (error, part) in [
            (refused(7, None), "it has 6 rows, 7 were announced"),
            (refused(5, None), "it has 6 rows, 5 were announced"),
            (refused(7, Some(like((2, 4, 3), 2))), "it has 8 rows, 7 were announced"),
            (refused(8, Some(like((2, 5, 3), 2))), "5 pixels wide, the first row 4"),
            (refused(8, Some(like((2, 4, 1), 2))), "uint8 of 1 channels"),
            (refused(8, Some(picture::<u16>((2, 4, 3), Encoding::Srgb, 2))), "uint16"),
            (refused(8, Some(other)), "profile"),
            (refused(Picture::MAX_SIDE + 1, None), "rows are too many"),
            (written(name, 6, Vec::new(), &options).expect_err(name), "no rows"),
        ] {
            assert_eq!(error.kind(), ErrorKind::BadPicture, "{name}: {error}");
            assert!(error.to_string().contains(part), "{name}: {error}");
        }
        let rows = vec![Ok(small.clone()), Err(Error::Cancelled)];
        let error = written(name, 8, rows, &options).expect_err(name);
        assert_eq!(error.kind(), ErrorKind::Cancelled, "{name}: that of the rows");
    }
    for name in ["a.jpg", "a.webp", "a.bmp", "a.tga", "a.ppm", "a", "a.doc"] {
        let error = written(name, 6, vec![Ok(small.clone())], &options).expect_err(name);
        assert_eq!(error.kind(), ErrorKind::Format, "{name}: {error}");
        assert!(error.to_string().contains(".png"), "{name}: {error}");
    }
}

/// A disk with room for so many bytes.
struct Full(usize);

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 = self.0.checked_sub(bytes.len()).ok_or(io::ErrorKind::StorageFull)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Full {
    fn seek(&mut self, _: SeekFrom) -> io::Result<u64> {
        Ok(0)
    }
}

#[test]
fn a_full_disk_is_told_as_such() {
    let options = WriteOptions::new(MapKind::Color);
    let noise = picture::<f32>((400, 300, 3), Encoding::Data, 1);
    let mut large = picture::<u8>((4, 17_000, 4), Encoding::Srgb, 1);
    large.encoding = Encoding::Data;
    for (_, name) in STREAMED {
        // At once; in the middle; the last byte.
        for room in
            [0, 30_000, written(name, 400, cut(&noise, &[]), &options).expect(name).len() - 1]
        {
            let out = Full(room);
            let error = write_rows(out, Path::new(name), 400, cut(&noise, &[100]), &options);
            let error = error.expect_err(name);
            let full = matches!(&error, Error::Io { source, path, .. }
                if source.kind() == io::ErrorKind::StorageFull && path == Path::new(name));
            assert!(full, "{name}, {room} bytes: {error:?}");
        }
    }
    // The rows stop being asked for, and the streamed PNG does not panic.
    let mut asked = 0;
    let rows = std::iter::repeat_with(|| {
        asked += 1;
        Ok(large.clone())
    });
    let error = write_rows(Full(5_000_000), Path::new("a.png"), 1000, rows, &options);
    assert_eq!(error.expect_err("full").kind(), ErrorKind::Io);
    assert!((10..100).contains(&asked), "{asked} pieces of 272 KB were asked for");
}

#[test]
fn several_files_are_written_side_by_side() {
    let pictures = [1, 2].map(|seed| picture::<u8>((50, 20, 3), Encoding::Srgb, seed));
    let options = WriteOptions::new(MapKind::Color);
    let files = std::thread::scope(|scope| {
        let writers = [(), ()].map(|()| {
            let (send, receive) = sync_channel(1);
            let write = || {
                let mut out = Cursor::new(Vec::new());
                write_rows(&mut out, Path::new("a.png"), 50, receive, &options).expect("write");
                out.into_inner()
            };
            (send, scope.spawn(write))
        });
        let pieces = pictures.each_ref().map(|picture| cut(picture, &[10, 20, 30, 40]));
        let [first, second] = pieces;
        for (one, other) in first.into_iter().zip(second) {
            writers[0].0.send(one).expect("first");
            writers[1].0.send(other).expect("second");
        }
        writers.map(|(send, writer)| {
            drop(send);
            writer.join().expect("file")
        })
    });
    for (picture, file) in pictures.iter().zip(files) {
        assert!(file == encode(picture, Format::Png, &options).expect("whole"));
    }
}
