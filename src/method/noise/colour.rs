//! [`Colours`]: from noise to the channels of pixels, with the CPU's widest instructions. All give the same
//! bits, as no product and sum are joined.

use pulp::{Simd, WithSimd};

use crate::method::noise::evaluate::{Evaluator, Filtered};
use crate::method::noise::shape::Shape;
use crate::signal::wavelet_noise::BLOCK;

/// Makes pixels of the independent channels' noise.
pub(super) struct Colours<'a> {
    pub(super) evaluator: &'a Evaluator,
    pub(super) filtered: &'a [Filtered],
    /// A line for every independent channel, at least as long as there are pixels; afterwards the channels'
    /// values.
    pub(super) noise: &'a mut [f32],
    /// All channels of a pixel, then of the next.
    pub(super) out: &'a mut [f32],
}

impl WithSimd for Colours<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { evaluator, filtered, noise, out } = self;
        let length = noise.len() / evaluator.channels.len();
        let count = out.len() / evaluator.channels();
        for (c, line) in noise.chunks_exact_mut(length).enumerate() {
            if let Some(shape) = &evaluator.channels[c].shape {
                let (line, f) = (&mut line[..count], &filtered[c]);
                line.iter_mut().for_each(|value| *value *= f.per_deviation);
                if f.lost == 0.0 {
                    shape.apply(simd, line);
                } else {
                    line.iter_mut().for_each(|value| *value = mean(shape, *value, f.lost));
                }
            }
        }
        for (k, out) in out.chunks_mut(BLOCK * evaluator.channels()).enumerate() {
            for (channel, (mean, row)) in evaluator.mean.iter().zip(&evaluator.matrix).enumerate() {
                let mut sums = [*mean; BLOCK];
                for (line, factor) in noise.chunks_exact(length).zip(row) {
                    let values = &line[k * BLOCK..count];
                    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += factor * value);
                }
                let pixels = out.chunks_exact_mut(evaluator.channels());
                pixels.zip(sums).for_each(|(pixel, sum)| pixel[channel] = sum);
            }
        }
    }
}

/// The mean of the shape over what a filter took away, which is normally distributed around `u`: by three
/// places of Gauss-Hermite quadrature.
fn mean(shape: &Shape, u: f32, lost: f32) -> f32 {
    let side = 1.732_050_8 * lost;
    (shape.at(u - side) + shape.at(u + side)) * (1.0 / 6.0) + shape.at(u) * (2.0 / 3.0)
}
