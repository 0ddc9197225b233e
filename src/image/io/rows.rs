//! [`write_rows`]: a picture that is larger than memory becomes a file, a few rows at a time.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::fmt::Display;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::iter::once;
use std::path::Path;

use super::place::known_extension;
use super::write::plain_line;
use super::{Format, WriteOptions, exr, png, tiff};
use crate::base::error::{Error, Result};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Sample, Samples};
use crate::with_samples;

/// Writes a picture of `height` rows to `out` (an empty file), in the format that the extension of
/// `path` names.
///
/// `rows` yields the picture from the top in pieces of any heights, all of the same width, channels,
/// sample type, encoding and profile; what else comes along is the first piece's. One piece is
/// asked for after the other and dropped once it is written. Besides it a few MB are needed,
/// whatever the height; a PNG of up to 64 MiB of samples is gathered whole. To write several
/// pictures side by side, or compress while the next rows are made, give a channel's receiver to a
/// thread for each.
///
/// What formats can hold is as for [`write`](super::write()); `options.force` is not looked at.
///
/// # Determinism
/// Same picture, same options: same bytes, however the rows are divided; those of
/// [`encode`](super::encode).
///
/// # Errors
/// The first error of `rows`; [`Error::Format`] (the extension is unknown, the format [does not
/// stream](Format::streams) or cannot hold the picture), [`Error::BadPicture`] (pieces differ, or
/// do not make `height` rows; more rows than [`Picture::MAX_SIDE`]), [`Error::Io`]. After an error
/// `out` holds no picture.
pub fn write_rows(
    out: impl Write + Seek,
    path: &Path,
    height: usize,
    rows: impl IntoIterator<Item = Result<Picture>>,
    options: &WriteOptions,
) -> Result<()> {
    let rows = rows.into_iter().map(|piece| piece.map(Cow::Owned));
    write_as(out, (path, known_extension(path)?), height, rows, options)
}

/// As [`write_rows`], in this format; `path` is for messages only.
pub(super) fn write_as<'a>(
    out: impl Write + Seek,
    (path, format): (&Path, Format),
    height: usize,
    rows: impl Iterator<Item = Result<Cow<'a, Picture>>> + 'a,
    options: &WriteOptions,
) -> Result<()> {
    match format {
        Format::Png => write_with(out, path, height, rows, options, png::write),
        Format::Tiff => write_with(out, path, height, rows, options, tiff::write),
        Format::Exr => write_with(out, path, height, rows, options, exr::write),
        _ => Err(Error::Format {
            path: path.to_owned(),
            reason: "this format is not written a few rows at a time; use .png, .tif or .exr"
                .into(),
        }),
    }
}

pub(super) fn write_with<'a, W: Write + Seek>(
    out: W,
    path: &Path,
    height: usize,
    mut rows: impl Iterator<Item = Result<Cow<'a, Picture>>> + 'a,
    options: &WriteOptions,
    encode: impl FnOnce(&mut Sink<'_, W>, &Frame<'_>, &mut Pieces<'_, 'a>) -> Result<()>,
) -> Result<()> {
    if height > Picture::MAX_SIDE {
        let most = Picture::MAX_SIDE;
        return Err(bad(path, format!("{height} rows are too many; choose {most} at most")));
    }
    let first = rows.next().ok_or_else(|| bad(path, "it has no rows".into()))??;
    let like = one_pixel(&first)?;
    let mut pixel = like.clone();
    if options.kind != MapKind::Color {
        pixel.encoding = Encoding::Data;
    }
    let record = options.record.as_deref().map(plain_line);
    let frame = Frame { path, pixel, width: first.width(), height, record };

    let trouble = OnceCell::new();
    let mut sink = Sink { out: BufWriter::new(out), trouble: &trouble };
    let rows = Box::new(once(Ok(first)).chain(rows));
    let mut pieces = Pieces { frame: &frame, like, rows, now: None, done: 0, trouble: &trouble };
    let result = encode(&mut sink, &frame, &mut pieces);
    sink.swallow(BufWriter::flush);
    match trouble.into_inner() {
        Some(source) => Err(Error::Io { action: "write", path: path.to_owned(), source }),
        None => result,
    }
}

fn bad(path: &Path, reason: String) -> Error {
    Error::BadPicture { what: path.display().to_string(), reason }
}

/// The first pixel as a picture of its own.
pub(super) fn one_pixel(picture: &Picture) -> Result<Picture> {
    fn first<T: Sample>(v: &[T], n: usize) -> Samples {
        T::wrap(v[..n].to_vec())
    }
    let c = picture.channels();
    picture.with_samples(1, 1, c, with_samples!(picture.samples(), v => first(v, c)))
}

/// What is known of a picture before its rows.
pub(super) struct Frame<'a> {
    path: &'a Path,
    /// One pixel of it: channels, sample type, what the samples mean, what comes along.
    pub(super) pixel: Picture,
    pub(super) width: usize,
    pub(super) height: usize,
    /// How it was made, one line of ASCII.
    pub(super) record: Option<String>,
}

impl Frame<'_> {
    /// Samples in a row.
    pub(super) fn row_len(&self) -> usize {
        self.width * self.pixel.channels()
    }

    /// The format cannot hold the picture.
    pub(super) fn refused(&self, reason: impl Display) -> Error {
        Error::Format { path: self.path.to_owned(), reason: reason.to_string() }
    }
}

/// The pieces of a picture, checked as they come.
pub(super) struct Pieces<'f, 'a> {
    frame: &'f Frame<'f>,
    like: Picture,
    rows: Box<dyn Iterator<Item = Result<Cow<'a, Picture>>> + 'a>,
    now: Option<Cow<'a, Picture>>,
    done: usize,
    trouble: &'f OnceCell<io::Error>,
}

impl Pieces<'_, '_> {
    /// The samples of the next rows; `None` once all rows have come.
    pub(super) fn next(&mut self) -> Result<Option<&Samples>> {
        let Frame { path, width, height, .. } = *self.frame;
        if self.trouble.get().is_some() {
            // Only to end the work: the trouble itself is what is told.
            return Err(Error::Cancelled);
        }
        // Two pieces are never held at once.
        self.now = None;
        let Some(piece) = self.rows.next().transpose()? else {
            if self.done < height {
                let reason = format!("it has {} rows, {height} were announced", self.done);
                return Err(bad(path, reason));
            }
            return Ok(None);
        };
        let what = format!("{} from row {} on", path.display(), self.done);
        piece.ensure_like(&self.like, &what)?;
        self.done += piece.height();
        if piece.width() != width {
            let reason = format!("it is {} pixels wide, the first row {width}", piece.width());
            return Err(Error::BadPicture { what, reason });
        }
        if self.done > height {
            let reason = format!("it has {} rows, {height} were announced", self.done);
            return Err(bad(path, reason));
        }
        Ok(Some(self.now.insert(piece).samples()))
    }

    /// Hands all samples to `take` in bands of `rows` rows, the last of those that are left;
    /// `stored` makes what the file holds of a piece.
    pub(super) fn bands<T: Sample>(
        &mut self,
        rows: usize,
        stored: impl Fn(&Samples) -> Cow<'_, Samples>,
        mut take: impl FnMut(&[T]) -> Result<(), String>,
    ) -> Result<()> {
        let frame = self.frame;
        let len = rows * frame.row_len();
        let mut held: Vec<T> = Vec::new();
        while let Some(samples) = self.next()? {
            let samples = stored(samples);
            let mut rest = T::slice(&samples).unwrap_or_default();
            while !rest.is_empty() {
                let (now, later) = rest.split_at(rest.len().min(len - held.len()));
                rest = later;
                if now.len() == len {
                    take(now).map_err(|e| frame.refused(e))?;
                    continue;
                }
                held.extend_from_slice(now);
                if held.len() == len {
                    take(&held).map_err(|e| frame.refused(e))?;
                    held.clear();
                }
            }
        }
        if held.is_empty() { Ok(()) } else { take(&held).map_err(|e| frame.refused(e)) }
    }
}

/// Passes bytes on until that fails, then keeps the reason and swallows the rest: encoders panic
/// at errors, lose them in destructors or turn them into text.
pub(super) struct Sink<'a, W: Write> {
    out: BufWriter<W>,
    trouble: &'a OnceCell<io::Error>,
}

impl<W: Write> Sink<'_, W> {
    fn swallow<T: Default>(
        &mut self,
        action: impl FnOnce(&mut BufWriter<W>) -> io::Result<T>,
    ) -> T {
        if self.trouble.get().is_some() {
            return T::default();
        }
        action(&mut self.out).unwrap_or_else(|error| {
            let _ = self.trouble.set(error);
            T::default()
        })
    }
}

impl<W: Write> Write for Sink<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.swallow(|out| out.write_all(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.swallow(BufWriter::flush);
        Ok(())
    }
}

impl<W: Write + Seek> Seek for Sink<'_, W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        Ok(self.swallow(|out| out.seek(to)))
    }
}
