//! [`Picture`]: samples in their own type, so that copying pixels never changes a bit.

use half::f16;

use crate::base::error::{Error, Result};

/// What the samples of a picture mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Display-referred sRGB (8 and 16-bit colour files).
    Srgb,
    /// Linear light with sRGB primaries; values above 1 are allowed (EXR, float arrays).
    Linear,
    /// Numbers, not colours: height, roughness, normals.
    Data,
}

/// The samples, row by row, pixels interleaved, in the type in which they came.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// 8 bits, 0..=255.
    U8(Vec<u8>),
    /// 16 bits, 0..=65535.
    U16(Vec<u16>),
    /// Half floats.
    F16(Vec<f16>),
    /// Single floats.
    F32(Vec<f32>),
    /// Double floats.
    F64(Vec<f64>),
}

/// Runs `$body` with `$v` bound to the vector inside, whatever its type.
#[macro_export]
#[doc(hidden)]
macro_rules! with_samples {
    ($samples:expr, $v:ident => $body:expr) => {
        match $samples {
            $crate::image::picture::Samples::U8($v) => $body,
            $crate::image::picture::Samples::U16($v) => $body,
            $crate::image::picture::Samples::F16($v) => $body,
            $crate::image::picture::Samples::F32($v) => $body,
            $crate::image::picture::Samples::F64($v) => $body,
        }
    };
}

/// A type that samples can have.
pub trait Sample: Copy + Send + Sync + PartialEq + 'static {
    /// Full scale: 255, 65535, or 1 for floats.
    const SCALE: f64;
    /// As a float with full scale 1.
    fn to_unit(self) -> f64;
    /// From a float with full scale 1; integers round to nearest and saturate.
    fn from_unit(value: f64) -> Self;
    /// Wraps a vector of this type.
    fn wrap(samples: Vec<Self>) -> Samples;
    /// The samples, if they are of this type.
    fn slice(samples: &Samples) -> Option<&[Self]>;
}

macro_rules! integer_sample {
    ($t:ty, $variant:ident) => {
        impl Sample for $t {
            const SCALE: f64 = <$t>::MAX as f64;
            #[inline]
            fn to_unit(self) -> f64 {
                self as f64 / Self::SCALE
            }
            #[inline]
            fn from_unit(value: f64) -> Self {
                // What is not negative is rounded down as it becomes whole.
                (value * Self::SCALE + 0.5).clamp(0.0, Self::SCALE) as $t
            }
            fn wrap(samples: Vec<Self>) -> Samples {
                Samples::$variant(samples)
            }
            fn slice(samples: &Samples) -> Option<&[Self]> {
                if let Samples::$variant(v) = samples { Some(v) } else { None }
            }
        }
    };
}
integer_sample!(u8, U8);
integer_sample!(u16, U16);

macro_rules! float_sample {
    ($t:ty, $variant:ident, $to:expr, $from:expr) => {
        impl Sample for $t {
            const SCALE: f64 = 1.0;
            #[inline]
            fn to_unit(self) -> f64 {
                $to(self)
            }
            #[inline]
            fn from_unit(value: f64) -> Self {
                $from(value)
            }
            fn wrap(samples: Vec<Self>) -> Samples {
                Samples::$variant(samples)
            }
            fn slice(samples: &Samples) -> Option<&[Self]> {
                if let Samples::$variant(v) = samples { Some(v) } else { None }
            }
        }
    };
}
float_sample!(f16, F16, f16::to_f64, f16::from_f64);
float_sample!(f32, F32, f64::from, |v| v as f32);
float_sample!(f64, F64, |v| v, |v| v);

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        with_samples!(self, v => v.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes per sample.
    pub fn bytes_per_sample(&self) -> usize {
        match self {
            Self::U8(_) => 1,
            Self::U16(_) | Self::F16(_) => 2,
            Self::F32(_) => 4,
            Self::F64(_) => 8,
        }
    }

    /// Name of the type as numpy spells it.
    pub fn dtype(&self) -> &'static str {
        match self {
            Self::U8(_) => "uint8",
            Self::U16(_) => "uint16",
            Self::F16(_) => "float16",
            Self::F32(_) => "float32",
            Self::F64(_) => "float64",
        }
    }

    /// Whether the samples are floats.
    pub fn is_float(&self) -> bool {
        matches!(self, Self::F16(_) | Self::F32(_) | Self::F64(_))
    }

    /// Sample `i` as a float with full scale 1.
    #[inline]
    pub fn unit(&self, i: usize) -> f64 {
        with_samples!(self, v => v[i].to_unit())
    }
}

/// What comes along with a picture and must not be lost on the way through.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Meta {
    /// ICC profile that the samples are still in, to be written again.
    pub icc: Option<Vec<u8>>,
    /// Pixels per metre, horizontally and vertically.
    pub pixels_per_metre: Option<(u32, u32)>,
    /// What was done on reading (profile converted, orientation applied), one sentence each.
    pub notes: Vec<String>,
}

/// A picture: `height` x `width` x `channels` samples.
///
/// Channels: 1 grey, 2 grey and alpha, 3 RGB, 4 RGB and alpha, any other number: data.
/// Alpha is straight (not premultiplied).
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    height: usize,
    width: usize,
    channels: usize,
    samples: Samples,
    /// What the samples mean.
    pub encoding: Encoding,
    /// What came along.
    pub meta: Meta,
}

impl Picture {
    /// Most pixels a picture may have on a side.
    pub const MAX_SIDE: usize = 1 << 16;

    /// A picture from its samples.
    ///
    /// # Errors
    /// [`Error::BadPicture`] if a side is zero or larger than [`Picture::MAX_SIDE`], or the number
    /// of samples is not `height * width * channels`.
    pub fn new(
        height: usize,
        width: usize,
        channels: usize,
        samples: Samples,
        encoding: Encoding,
    ) -> Result<Self> {
        let bad = |reason: String| Error::BadPicture { what: "picture".into(), reason };
        if height == 0 || width == 0 || channels == 0 {
            return Err(bad(format!(
                "{width}x{height} pixels of {channels} channels hold nothing; give a picture with \
                 at least one pixel"
            )));
        }
        if height > Self::MAX_SIDE || width > Self::MAX_SIDE || channels > 1024 {
            return Err(bad(format!(
                "{width}x{height} pixels of {channels} channels are too many; at most {0}x{0} and \
                 1024 channels",
                Self::MAX_SIDE
            )));
        }
        if samples.len() != height * width * channels {
            return Err(bad(format!(
                "{} samples do not make {width}x{height} pixels of {channels} channels",
                samples.len()
            )));
        }
        Ok(Self { height, width, channels, samples, encoding, meta: Meta::default() })
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Samples per pixel.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The samples.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// The samples, given away.
    pub fn into_samples(self) -> Samples {
        self.samples
    }

    /// Bytes that the samples take.
    pub fn byte_len(&self) -> usize {
        self.samples.len() * self.samples.bytes_per_sample()
    }

    /// The channel that holds alpha, if there is one.
    pub fn alpha_channel(&self) -> Option<usize> {
        (self.encoding != Encoding::Data && matches!(self.channels, 2 | 4))
            .then_some(self.channels - 1)
    }

    /// Fails on NaN and infinite samples (transparent pixels are not looked at).
    ///
    /// # Errors
    /// [`Error::NotFinite`] with their number and the first position.
    pub fn ensure_finite(&self, what: &str) -> Result<()> {
        if !self.samples.is_float() {
            return Ok(());
        }
        let (mut count, mut first) = (0, None);
        for pixel in 0..self.height * self.width {
            let at = pixel * self.channels;
            let hidden = self.alpha_channel().is_some_and(|a| self.samples.unit(at + a) == 0.0);
            if hidden {
                continue;
            }
            let bad = (at..at + self.channels).filter(|&i| !self.samples.unit(i).is_finite());
            let bad = bad.count();
            count += bad;
            if bad > 0 {
                first.get_or_insert((pixel / self.width, pixel % self.width));
            }
        }
        match first {
            None => Ok(()),
            Some((y, x)) => Err(Error::NotFinite { what: what.to_owned(), count, y, x }),
        }
    }

    /// Fails unless this picture, called `what` in the message, has the sample type, the channels,
    /// the encoding and the colour profile of `first`.
    ///
    /// # Errors
    /// [`Error::BadPicture`].
    pub fn ensure_like(&self, first: &Self, what: &str) -> Result<()> {
        let shown = |p: &Self| {
            let encoding = match p.encoding {
                Encoding::Srgb => "sRGB",
                Encoding::Linear => "linear light",
                Encoding::Data => "data",
            };
            format!("{} of {} channels, {encoding}", p.samples.dtype(), p.channels)
        };
        let (own, wanted) = (shown(self), shown(first));
        let reason = if own != wanted {
            format!("it is {own}, the first is {wanted}; convert one of them")
        } else if self.meta.icc != first.meta.icc {
            "its colour profile is not that of the first; convert both to sRGB".to_owned()
        } else {
            return Ok(());
        };
        Err(Error::BadPicture { what: what.to_owned(), reason })
    }

    /// The same picture with other samples of any size and type; encoding and meta are kept.
    ///
    /// # Errors
    /// As [`Picture::new`].
    pub fn with_samples(
        &self,
        height: usize,
        width: usize,
        channels: usize,
        samples: Samples,
    ) -> Result<Self> {
        let mut picture = Self::new(height, width, channels, samples, self.encoding)?;
        picture.meta = self.meta.clone();
        Ok(picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn senseless_shapes_are_refused() {
        for (h, w, c, n) in [(0, 4, 1, 0), (4, 4, 0, 0), (2, 2, 1, 3), (1 << 17, 1, 1, 1 << 17)] {
            let result = Picture::new(h, w, c, Samples::U8(vec![0; n]), Encoding::Data);
            assert!(matches!(result, Err(Error::BadPicture { .. })), "{w}x{h}x{c}");
        }
    }

    #[test]
    fn nan_is_found_unless_it_is_transparent() {
        let mut v = vec![1.0_f32; 2 * 3 * 4];
        v[(3 + 2) * 4 + 1] = f32::NAN;
        let picture = |v: &[f32]| Picture::new(2, 3, 4, Samples::F32(v.to_vec()), Encoding::Linear);
        let error = picture(&v).expect("picture").ensure_finite("it").expect_err("NaN");
        assert!(matches!(error, Error::NotFinite { count: 1, y: 1, x: 2, .. }), "{error}");
        v[(3 + 2) * 4 + 3] = 0.0;
        assert!(picture(&v).expect("picture").ensure_finite("it").is_ok());
    }
}
