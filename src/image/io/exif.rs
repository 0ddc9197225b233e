//! The two things of EXIF that matter here: orientation and resolution.

use crate::image::picture::{Sample, Samples};
use crate::with_samples;

/// Orientation (1..=8; 1 if absent or nonsense) and pixels per metre of an EXIF block, which is a
/// small TIFF file, with or without the `Exif` head of JPEG.
pub(super) fn parse(block: &[u8]) -> (u8, Option<(u32, u32)>) {
    let block = block.strip_prefix(b"Exif\0\0").unwrap_or(block);
    let reader = match block.get(..4) {
        Some(b"II*\0") => Reader { block, little: true },
        Some(b"MM\0*") => Reader { block, little: false },
        _ => return (1, None),
    };
    reader.first_directory().unwrap_or((1, None))
}

struct Reader<'a> {
    block: &'a [u8],
    little: bool,
}

impl Reader<'_> {
    fn u16(&self, at: usize) -> Option<u16> {
        let bytes = self.block.get(at..at.checked_add(2)?)?.try_into().ok()?;
        Some(if self.little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    }

    fn u32(&self, at: usize) -> Option<u32> {
        let bytes = self.block.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if self.little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    fn rational(&self, at: usize) -> Option<f64> {
        Some(self.u32(at)? as f64 / self.u32(at + 4)? as f64)
    }

    fn first_directory(&self) -> Option<(u8, Option<(u32, u32)>)> {
        let start = self.u32(4)? as usize;
        let (mut orientation, mut x, mut y, mut unit) = (1, None, None, 2);
        for i in 0..self.u16(start)? as usize {
            let entry = start + 2 + 12 * i;
            let Some(tag) = self.u16(entry) else { break };
            let offset = || self.u32(entry + 8).map(|at| at as usize);
            match tag {
                0x0112 => orientation = self.u16(entry + 8).unwrap_or(1),
                0x011A => x = offset().and_then(|at| self.rational(at)),
                0x011B => y = offset().and_then(|at| self.rational(at)),
                0x0128 => unit = self.u16(entry + 8).unwrap_or(2),
                _ => {}
            }
        }
        let orientation = u8::try_from(orientation).ok().filter(|o| (1..=8).contains(o));
        Some((orientation.unwrap_or(1), per_metre(x.zip(y), unit)))
    }
}

/// Pixels per metre from pixels per `unit` as EXIF and TIFF number it: 2 inch, 3 centimetre.
/// Resolutions that nobody means (no unit, below one pixel per inch) come out as `None`.
pub(super) fn per_metre(resolution: Option<(f64, f64)>, unit: u16) -> Option<(u32, u32)> {
    let scale = match unit {
        2 => 1.0 / 0.0254,
        3 => 100.0,
        _ => return None,
    };
    let convert = |v: f64| {
        let v = (v * scale).round();
        (v >= 39.0 && v <= f64::from(u32::MAX)).then_some(v as u32)
    };
    let (x, y) = resolution?;
    convert(x).zip(convert(y))
}

/// The samples turned so that the first row is the top and the first column the left, and their
/// new height and width. `orientation` is EXIF's.
pub(super) fn upright(
    samples: Samples,
    (height, width, channels): (usize, usize, usize),
    orientation: u8,
) -> (usize, usize, Samples) {
    if !(2..=8).contains(&orientation) {
        return (height, width, samples);
    }
    let size = (height, width, channels);
    let turned = with_samples!(&samples, v => turn(v, size, orientation));
    if orientation >= 5 { (width, height, turned) } else { (height, width, turned) }
}

fn turn<T: Sample>(v: &[T], (h, w, c): (usize, usize, usize), orientation: u8) -> Samples {
    let (out_h, out_w) = if orientation >= 5 { (w, h) } else { (h, w) };
    let mut out = Vec::with_capacity(v.len());
    for y in 0..out_h {
        for x in 0..out_w {
            let (from_y, from_x) = match orientation {
                2 => (y, w - 1 - x),
                3 => (h - 1 - y, w - 1 - x),
                4 => (h - 1 - y, x),
                5 => (x, y),
                6 => (h - 1 - x, y),
                7 => (h - 1 - x, w - 1 - y),
                _ => (x, w - 1 - y),
            };
            let at = (from_y * w + from_x) * c;
            out.extend_from_slice(&v[at..at + c]);
        }
    }
    T::wrap(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// EXIF's own definition: where the stored row 0 and column 0 are in the upright picture.
    #[test]
    fn every_orientation_puts_row_and_column_where_exif_says() {
        // 2 rows, 3 columns:  0 1 2 / 3 4 5
        let want: [(u8, usize, &[u8]); 8] = [
            (1, 2, &[0, 1, 2, 3, 4, 5]),
            (2, 2, &[2, 1, 0, 5, 4, 3]),
            (3, 2, &[5, 4, 3, 2, 1, 0]),
            (4, 2, &[3, 4, 5, 0, 1, 2]),
            (5, 3, &[0, 3, 1, 4, 2, 5]),
            (6, 3, &[3, 0, 4, 1, 5, 2]),
            (7, 3, &[5, 2, 4, 1, 3, 0]),
            (8, 3, &[2, 5, 1, 4, 0, 3]),
        ];
        for (orientation, height, pixels) in want {
            let (h, w, out) = upright(Samples::U8((0..6).collect()), (2, 3, 1), orientation);
            assert_eq!((h, w), (height, 6 / height), "orientation {orientation}");
            assert_eq!(out, Samples::U8(pixels.to_vec()), "orientation {orientation}");
        }
    }

    #[test]
    fn reads_both_byte_orders_and_survives_every_truncation() {
        let big = b"MM\0*\0\0\0\x08\0\x04\
            \x01\x12\0\x03\0\0\0\x01\0\x06\0\0\
            \x01\x1a\0\x05\0\0\0\x01\0\0\0\x3e\
            \x01\x1b\0\x05\0\0\0\x01\0\0\0\x3e\
            \x01\x28\0\x03\0\0\0\x01\0\x03\0\0\0\0\0\0\0\0\0\x64\0\0\0\x01";
        assert_eq!(parse(big), (6, Some((10000, 10000))));
        let little = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x08\0\0\0\0\0\0\0";
        assert_eq!(parse(little), (8, None));
        for n in 0..big.len() {
            let (orientation, _) = parse(&big[..n]);
            assert!((1..=8).contains(&orientation), "{n} bytes");
        }
    }
}
