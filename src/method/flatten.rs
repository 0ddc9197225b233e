//! Light flattening: a photo divided by its own low frequencies, so that a slope of light or a
//! vignette does not leave only a part of it typical.

use rayon::prelude::*;

use crate::base::error::{Error, Result};
use crate::image::color::{ColorModel, MatchSpace, linear_from_srgb, srgb_from_linear};
use crate::image::mask::Mask;
use crate::image::picture::{Encoding, Picture, Sample, Samples};
use crate::signal::lowpass::LowPass;
use crate::with_samples;

/// Most that light is raised or lowered. Deeper shadows hold little but noise.
const LIMIT: f64 = 8.0;

/// Least radius: what is smaller than this share of the photo is texture.
const LEAST: f32 = 0.02;

/// Fails unless the reach, a share of the photo's shorter side, is 0 (off) or that of light.
///
/// # Errors
/// [`Error::Parameter`].
pub fn check_reach(reach: f32) -> Result<()> {
    if reach > 0.0 && reach < LEAST {
        let expected = format!("0 (off) or {LEAST} to 1; less is texture, not light");
        return Err(Error::parameter("flatten", expected, reach));
    }
    Ok(())
}

/// A flattened photo and what was done to it.
#[derive(Debug)]
pub struct Flat {
    /// The photo, in its own sample type.
    pub picture: Picture,
    /// Least and largest factor of light at a usable pixel.
    pub factors: (f64, f64),
    /// Share of the usable pixels' samples that were cut off at full scale (integers only).
    pub clipped: f64,
}

impl Flat {
    /// What was done with a window of `sigma` pixels, for people.
    pub fn note(&self, sigma: f64) -> String {
        let (low, high) = self.factors;
        format!(
            "light flattened over {sigma:.0} pixels: multiplied by {low:.2} to {high:.2}, {:.1} % of the \
             samples cut off at full scale",
            self.clipped * 100.0
        )
    }
}

/// Divides `photo` by its low frequencies (Gaussian window of standard deviation `sigma` pixels),
/// channel by channel and in linear light, so that a cast of colour goes as well. Each channel's
/// mean over the usable pixels stays what it was. Masked pixels (`usable` must mask those that are
/// not opaque) have no say in it; alpha is not touched.
///
/// # Errors
/// [`Error::Parameter`] for data, which is no light.
pub fn run(photo: &Picture, usable: Option<&Mask>, sigma: f64) -> Result<Flat> {
    let model = ColorModel::new(photo);
    if model.space() != MatchSpace::Lab {
        let expected = "0 for a picture of data, which holds no light";
        return Err(Error::parameter("flatten", expected, "a radius"));
    }
    let (h, w, c) = (photo.height(), photo.width(), photo.channels());
    let usable = usable.map(Mask::usable);
    let counts = |i: usize| usable.is_none_or(|u| u[i]);
    let pixels = model.averaging_pixels(photo);
    let low = LowPass::new(&pixels, (h, w), usable, sigma);
    // Sums row by row, and the rows in order: the same for any number of threads.
    let per_row = |value: &(dyn Fn(usize) -> [f64; 3] + Sync)| -> [f64; 3] {
        let row = |y: usize| {
            let mut sum = [0.0; 3];
            for i in (y * w..(y + 1) * w).filter(|&i| counts(i)) {
                sum.iter_mut().zip(value(i)).for_each(|(sum, v)| *sum += v);
            }
            sum
        };
        let rows: Vec<[f64; 3]> = (0..h).into_par_iter().map(row).collect();
        std::array::from_fn(|k| rows.iter().map(|row| row[k]).sum())
    };
    let n = (0..h * w).filter(|&i| counts(i)).count().max(1) as f64;
    let mean = per_row(&|i| pixels[i].map(f64::from)).map(|sum| sum / n);
    let factor = |i: usize| -> [f64; 3] {
        let Some(low) = low.at(i / w, i % w) else { return [1.0; 3] };
        std::array::from_fn(|k| {
            if mean[k] > 0.0 {
                mean[k] / low[k].clamp(mean[k] / LIMIT, mean[k] * LIMIT)
            } else {
                1.0
            }
        })
    };
    let flat_mean = per_row(&|i| {
        let factor = factor(i);
        std::array::from_fn(|k| f64::from(pixels[i][k]) * factor[k])
    });
    let keep: [f64; 3] =
        std::array::from_fn(|k| if flat_mean[k] > 0.0 { mean[k] * n / flat_mean[k] } else { 1.0 });
    let gain = |i: usize| -> [f64; 3] {
        let factor = factor(i);
        std::array::from_fn(|k| factor[k] * keep[k])
    };

    let alpha = photo.alpha_channel();
    let curve = Curve::new(photo.encoding);
    let (samples, clipped) =
        with_samples!(photo.samples(), v => multiplied(v, (w, c), alpha, &curve, &gain, &counts));
    let range = |i: usize| {
        gain(i)
            .into_iter()
            .fold((f64::MAX, 0.0), |(low, high): (f64, f64), g| (low.min(g), high.max(g)))
    };
    let factors = (0..h * w)
        .into_par_iter()
        .filter(|&i| counts(i))
        .map(range)
        .reduce(|| (f64::MAX, 0.0), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let colors = c - usize::from(alpha.is_some());
    let picture = photo.with_samples(h, w, c, samples)?;
    Ok(Flat { picture, factors, clipped: clipped as f64 / (n * colors as f64) })
}

/// The samples, each multiplied in linear light; and how many usable ones met full scale.
fn multiplied<T: Sample>(
    v: &[T],
    (w, c): (usize, usize),
    alpha: Option<usize>,
    curve: &Curve,
    gain: &(impl Fn(usize) -> [f64; 3] + Sync),
    counts: &(impl Fn(usize) -> bool + Sync),
) -> (Samples, usize) {
    let mut out = v.to_vec();
    let row = |(y, row): (usize, &mut [T])| {
        let mut clipped = 0;
        for (x, px) in row.chunks_exact_mut(c).enumerate() {
            let gain = gain(y * w + x);
            for k in (0..c).filter(|&k| Some(k) != alpha) {
                let value = curve.display(curve.linear(px[k].to_unit()) * gain[k]);
                let sample = T::from_unit(value);
                // A half float has an end; hidden pixels may be anything.
                if sample.to_unit().is_finite() {
                    px[k] = sample;
                }
                clipped += usize::from(T::SCALE > 1.0 && value > 1.0 && counts(y * w + x));
            }
        }
        clipped
    };
    let clipped = out.par_chunks_mut(w * c).enumerate().map(row).sum();
    (T::wrap(out), clipped)
}

/// An encoding's way to linear light and back, tabulated over `0..=1`: a power a sample would take
/// longer than the tile. The error is far below a step of 16 bits.
struct Curve {
    linear: Vec<f64>,
    display: Vec<f64>,
}

impl Curve {
    const STEPS: usize = 1 << 14;

    fn new(encoding: Encoding) -> Self {
        let table = |f: &dyn Fn(f64) -> f64| {
            let n = if encoding == Encoding::Srgb { Self::STEPS + 2 } else { 0 };
            (0..n).map(|i| f(i as f64 / Self::STEPS as f64)).collect()
        };
        // Over the root: the curve is steep at black.
        Self {
            linear: table(&linear_from_srgb),
            display: table(&|root| srgb_from_linear(root * root)),
        }
    }

    fn linear(&self, v: f64) -> f64 {
        if self.linear.is_empty() {
            v
        } else {
            interpolated(&self.linear, v).unwrap_or_else(|| linear_from_srgb(v))
        }
    }

    fn display(&self, v: f64) -> f64 {
        if self.display.is_empty() {
            return v;
        }
        interpolated(&self.display, v.sqrt()).unwrap_or_else(|| srgb_from_linear(v))
    }
}

/// `None` outside `0..=1`.
fn interpolated(table: &[f64], v: f64) -> Option<f64> {
    let at = (0.0..=1.0).contains(&v).then_some(v * Curve::STEPS as f64)?;
    let i = at as usize;
    Some(table[i] + (table[i + 1] - table[i]) * (at - i as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_agree_with_the_curves() {
        const STEP: f64 = 0.05 / 65_535.0;
        let curve = Curve::new(Encoding::Srgb);
        for i in 0..=100_000 {
            let v = f64::from(i) / 100_000.0;
            assert!((curve.linear(v) - linear_from_srgb(v)).abs() < STEP, "linear({v})");
            assert!((curve.display(v) - srgb_from_linear(v)).abs() < STEP, "display({v})");
        }
        assert!((curve.display(curve.linear(4.0)) - 4.0).abs() < 1e-9);
    }

    #[test]
    fn data_is_no_light() {
        let data = Picture::new(8, 8, 1, Samples::U8(vec![7; 64]), Encoding::Data).expect("data");
        assert!(matches!(run(&data, None, 3.0), Err(Error::Parameter { name: "flatten", .. })));
    }
}
