//! [`SigmaMap`]: the reach of the stationarity measure at every pixel of the tile.

use crate::base::error::{Error, Result};
use crate::image::picture::Picture;

/// Least and greatest sigma, as of the parameter.
const RANGE: std::ops::RangeInclusive<f64> = 0.01..=1.0;

/// Sigma at every pixel of a tile, as a fraction of its shorter side.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmaMap {
    height: usize,
    width: usize,
    values: Vec<f32>,
}

impl SigmaMap {
    /// Reads the first channel of a picture of the tile's size. Floats are sigma itself, 0.01 to 1.
    /// Integers are grey levels, evenly spaced to the eye: black is 0.01, half of full scale 0.1 (the
    /// default sigma), white 1; in between `0.01 * 100^v`.
    ///
    /// # Errors
    /// [`Error::NotFinite`]; [`Error::BadPicture`] for floats out of range, or integers that are 0
    /// everywhere (a picture that was never painted).
    pub fn from_picture(picture: &Picture) -> Result<Self> {
        const WHAT: &str = "the sigma map";
        picture.ensure_finite(WHAT)?;
        let (c, samples) = (picture.channels(), picture.samples());
        let n = picture.height() * picture.width();
        let sample = |i: usize| samples.unit(i * c);
        let bad = |reason: String| Error::BadPicture { what: WHAT.into(), reason };
        if samples.is_float() {
            if let Some(i) = (0..n).find(|&i| !RANGE.contains(&sample(i))) {
                let (y, x, value) = (i / picture.width(), i % picture.width(), sample(i));
                return Err(bad(format!(
                    "it holds {value} at row {y}, column {x}; floats are sigma itself, 0.01 to 1"
                )));
            }
        } else if (0..n).all(|i| sample(i) == 0.0) {
            return Err(bad("it is black everywhere; paint where sigma is to be larger".into()));
        }
        let sigma = |i: usize| {
            let v = sample(i);
            if samples.is_float() { v as f32 } else { (0.01 * libm::pow(100.0, v)) as f32 }
        };
        let values = (0..n).map(sigma).collect();
        Ok(Self { height: picture.height(), width: picture.width(), values })
    }

    /// Fails unless the map has the size of the tile.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`].
    pub fn ensure_size(&self, height: usize, width: usize) -> Result<()> {
        if (self.height, self.width) == (height, width) {
            return Ok(());
        }
        Err(Error::SizeMismatch {
            what: "the sigma map".into(),
            got_w: self.width,
            got_h: self.height,
            want_w: width,
            want_h: height,
            remedy: "a sigma map must have the size of the tile".into(),
        })
    }

    /// Height and width in pixels.
    pub fn size(&self) -> (usize, usize) {
        (self.height, self.width)
    }

    /// Sigma at every pixel, row by row.
    pub fn values(&self) -> &[f32] {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::picture::{Encoding, Samples};

    fn read(samples: Samples) -> Result<SigmaMap> {
        SigmaMap::from_picture(&Picture::new(1, 2, 1, samples, Encoding::Data).expect("picture"))
    }

    #[test]
    fn floats_are_sigma_and_grey_levels_are_even_steps() {
        let map = read(Samples::F32(vec![0.02, 0.7])).expect("a map");
        assert_eq!(map.values(), [0.02, 0.7]);
        let map = read(Samples::U8(vec![0, 255])).expect("a map");
        assert_eq!(map.values(), [0.01, 1.0]);
        let map = read(Samples::U16(vec![32768, 16384])).expect("a map");
        assert!((map.values()[0] - 0.1).abs() < 1e-4, "{:?}", map.values());
        assert!((map.values()[1] - 0.0316).abs() < 1e-4, "{:?}", map.values());
    }

    #[test]
    fn what_is_no_sigma_is_refused() {
        let said = |samples| read(samples).expect_err("refused").to_string();
        let zero = said(Samples::F32(vec![0.1, 0.0]));
        assert!(zero.starts_with("the sigma map: it holds 0 at row 0, column 1"), "{zero}");
        assert!(said(Samples::F64(vec![1.5, 0.1])).contains("0.01 to 1"));
        assert!(said(Samples::U8(vec![0, 0])).contains("black everywhere"));
        let error = read(Samples::F32(vec![0.1, f32::NAN])).expect_err("refused");
        assert!(matches!(error, Error::NotFinite { .. }), "{error}");
    }
}
