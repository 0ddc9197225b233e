//! Light flattening: a photo divided by its own low frequencies, so that a slope of light or a
//! vignette does not leave only a part of it typical.

use rayon::prelude::*;

use crate::base::error::{Error, Result};
use crate::image::color::{ColorModel, MatchSpace, SrgbTables};
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
    let low = LowPass::new(|i| pixels[i], (h, w), usable, sigma);
    // Sums row by row, and the rows in order: the same for any number of threads.
    let means = |value: &(dyn Fn(usize) -> [f64; 3] + Sync), n: f64| -> [f64; 3] {
        let row = |y: usize| {
            let mut sum = [0.0; 3];
            for i in (y * w..(y + 1) * w).filter(|&i| counts(i)) {
                sum.iter_mut().zip(value(i)).for_each(|(sum, v)| *sum += v);
            }
            sum
        };
        let rows: Vec<[f64; 3]> = (0..h).into_par_iter().map(row).collect();
        std::array::from_fn(|k| rows.iter().map(|row| row[k]).sum::<f64>() / n)
    };
    let n = (0..h * w).filter(|&i| counts(i)).count().max(1) as f64;
    let mean = means(&|i| pixels[i].map(f64::from), n);
    // What light is multiplied by, before the means are what they were.
    let mut gains = vec![[0.0; 3]; h * w];
    gains.par_chunks_mut(w).enumerate().for_each(|(y, gains)| {
        low.row(y, |x, low| {
            gains[x] = low.map_or([1.0; 3], |low| {
                let gain = |k: usize| mean[k] / low[k].clamp(mean[k] / LIMIT, mean[k] * LIMIT);
                std::array::from_fn(|k| if mean[k] > 0.0 { gain(k) } else { 1.0 })
            });
        });
    });
    let flat_mean = means(&|i| std::array::from_fn(|k| f64::from(pixels[i][k]) * gains[i][k]), n);
    let keep: [f64; 3] =
        std::array::from_fn(|k| if flat_mean[k] > 0.0 { mean[k] / flat_mean[k] } else { 1.0 });
    // The least and the largest of each channel, where the picture counts.
    let kept = |(y, gains): (usize, &mut [[f64; 3]])| {
        let (mut least, mut largest) = ([f64::MAX; 3], [0.0; 3]);
        for (x, gain) in gains.iter_mut().enumerate() {
            let counts = counts(y * w + x);
            for k in 0..3 {
                gain[k] *= keep[k];
                if counts {
                    least[k] = if gain[k] < least[k] { gain[k] } else { least[k] };
                    largest[k] = if gain[k] > largest[k] { gain[k] } else { largest[k] };
                }
            }
        }
        (least, largest)
    };
    let ends: Vec<([f64; 3], [f64; 3])> = gains.par_chunks_mut(w).enumerate().map(kept).collect();
    let factors = (
        ends.iter().flat_map(|row| row.0).fold(f64::MAX, f64::min),
        ends.iter().flat_map(|row| row.1).fold(0.0, f64::max),
    );

    let alpha = photo.alpha_channel();
    let curve = (photo.encoding == Encoding::Srgb).then(SrgbTables::get);
    let (samples, clipped) =
        with_samples!(photo.samples(), v => multiplied(v, (w, c), alpha, curve, &gains, &counts));
    let colors = c - usize::from(alpha.is_some());
    let picture = photo.with_samples(h, w, c, samples)?;
    Ok(Flat { picture, factors, clipped: clipped as f64 / (n * colors as f64) })
}

/// The samples, each multiplied in linear light; and how many usable ones met full scale.
fn multiplied<T: Sample>(
    v: &[T],
    (w, c): (usize, usize),
    alpha: Option<usize>,
    curve: Option<&SrgbTables>,
    gains: &[[f64; 3]],
    counts: &(impl Fn(usize) -> bool + Sync),
) -> (Samples, usize) {
    let mut out = v.to_vec();
    let row = |(y, row): (usize, &mut [T])| {
        let mut clipped = 0;
        for (x, px) in row.chunks_exact_mut(c).enumerate() {
            let gain = gains[y * w + x];
            for k in (0..c).filter(|&k| Some(k) != alpha) {
                let value = px[k].to_unit();
                let value = match curve {
                    None => value * gain[k],
                    Some(curve) => curve.display(curve.linear(value) * gain[k]),
                };
                let sample = T::from_unit(value);
                // A half float has an end; hidden pixels may be anything.
                if T::SCALE > 1.0 || sample.to_unit().is_finite() {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_is_no_light() {
        let data = Picture::new(8, 8, 1, Samples::U8(vec![7; 64]), Encoding::Data).expect("data");
        assert!(matches!(run(&data, None, 3.0), Err(Error::Parameter { name: "flatten", .. })));
    }
}
