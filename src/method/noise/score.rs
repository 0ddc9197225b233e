//! [`Structure`]: what of a photo noise cannot hold.
//!
//! Noise has the photo's histogram and its power at every frequency. What it lacks is all that lies in the
//! phases: edges, stones, blades of grass. Where there are such, octaves of the photo have rare strong
//! values, and places of much detail beside places of little; noise has neither.

use rayon::prelude::*;

use crate::signal::power::transform_even;
use crate::signal::wavelet_noise::spectrum::signs;

/// What noise cannot hold of a photo's strongest channel. Each is about 0 for noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Structure {
    /// Excess kurtosis of the octaves: mean over them, weighted by their power.
    pub kurtosis: f64,
    /// By how much local power varies over each octave, as a share of its mean, more than noise's does:
    /// mean as before.
    pub patchiness: f64,
    /// Share of each octave's power that lies in other directions than if all were alike: mean as before.
    pub anisotropy: f64,
    /// How strongly the photo repeats: the most by which its correlation with itself, going straight away
    /// from no displacement, rises again; 1 is from opposite to alike.
    pub periodicity: f64,
}

/// How much local power varies over octaves of noise, and how unlike directions are: by chance.
const OF_NOISE: (f64, f64) = (0.25, 0.05);

/// Kurtosis of one octave counts up to here: a single spark is not the whole picture.
const MOST_KURTOSIS: f64 = 5.0;

/// Side of the middle of a large photo that is looked at.
const SIDE: usize = 1024;

/// Directions that are told apart.
const DIRECTIONS: usize = 8;

impl Structure {
    /// Nothing that noise lacks.
    pub const NONE: Self =
        Self { kurtosis: 0.0, patchiness: 0.0, anisotropy: 0.0, periodicity: 0.0 };

    /// Of a plane whose histogram was made normal, and its spectrum.
    pub(super) fn of(plane: &[f32], shape: (usize, usize), power: &[f64]) -> Self {
        let (kurtosis, patchiness) = of_octaves(plane, shape);
        let periodicity = periodicity(&transform_even(power, shape, |c| c), shape);
        Self { kurtosis, patchiness, anisotropy: anisotropy(power, shape), periodicity }
    }

    /// How well isotropic noise fits, in 0..=1. The scale is chosen by eye: from 0.5 on the noise can be
    /// taken for the photo at a glance.
    pub fn isotropic_fit(&self) -> f64 {
        libm::exp(-self.kurtosis - 2.0 * self.patchiness - 3.0 * self.anisotropy)
    }

    /// The same of noise with directions, which is patchy itself: its grain is long.
    pub fn oriented_fit(&self) -> f64 {
        let patchiness = (self.patchiness - 0.4 * self.anisotropy).max(0.0);
        libm::exp(-self.kurtosis - 2.0 * patchiness - 0.5 * self.anisotropy)
    }

    /// The same of tiling and blending, which keeps all but what lies across borders, and falls out of
    /// step with what repeats.
    pub fn tiling_fit(&self) -> f64 {
        let rest = libm::exp(-0.18 * self.kurtosis - 0.36 * self.patchiness);
        rest * (1.0 - self.periodicity)
    }
}

/// Kurtosis and patchiness.
fn of_octaves(plane: &[f32], (rows, cols): (usize, usize)) -> (f64, f64) {
    let (height, width) = (rows.min(SIDE), cols.min(SIDE));
    let (top, left) = ((rows - height) / 2, (cols - width) / 2);
    let mut smooth: Vec<f32> =
        (top..top + height).flat_map(|y| &plane[y * cols + left..][..width]).copied().collect();
    // Of the coarsest some dozen waves fit in.
    let octaves = height.min(width).ilog2().saturating_sub(4).max(1);
    let (mut powers, mut kurtoses, mut patches) = (0.0, 0.0, 0.0);
    for octave in 0..octaves {
        let step = 1usize << octave;
        let smoother = blurred(&smooth, (height, width), step);
        let squares: Vec<f32> =
            smooth.par_iter().zip(&smoother).map(|(a, b)| (a - b) * (a - b)).collect();
        let around = blurred(&squares, (height, width), step);
        let around = blurred(&around, (height, width), 2 * step);
        // Without the border, which is mirrored.
        let border = (2 * step).min(height.min(width) / 4);
        let inner = |values: &[f32], power: i32| {
            let lines = (border..height - border).into_par_iter().map(|y| {
                let line = &values[y * width + border..(y + 1) * width - border];
                line.iter().map(|&v| f64::from(v).powi(power)).sum::<f64>()
            });
            // In this order on any number of threads.
            let sums: Vec<f64> = lines.collect();
            sums.iter().sum::<f64>() / ((height - 2 * border) * (width - 2 * border)) as f64
        };
        let power = inner(&squares, 1);
        let mean = inner(&around, 1);
        if power > 0.0 && mean > 0.0 {
            let kurtosis = inner(&squares, 2) / (power * power) - 3.0;
            let varies = (inner(&around, 2) / (mean * mean) - 1.0).max(0.0).sqrt();
            powers += power;
            kurtoses += power * kurtosis.clamp(0.0, MOST_KURTOSIS);
            patches += power * (varies - OF_NOISE.0).max(0.0);
        }
        smooth = smoother;
    }
    if powers > 0.0 { (kurtoses / powers, patches / powers) } else { (0.0, 0.0) }
}

/// A plane blurred by the cubic B-spline's taps, `step` samples apart, along both axes.
pub(super) fn blurred(plane: &[f32], (height, width): (usize, usize), step: usize) -> Vec<f32> {
    const TAPS: [f32; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];
    let mirrored = |i: usize, k: usize, n: usize| {
        let at = (i + k * step) as i64 - 2 * step as i64;
        let at = if at < 0 { -at } else { at } as usize;
        if at >= n { (2 * n - 2).saturating_sub(at).min(n - 1) } else { at }
    };
    let mut across = vec![0.0; plane.len()];
    across.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(to, from)| {
        // Away from the ends nothing is mirrored.
        let (first, end) = (2 * step, width.saturating_sub(2 * step).max(2 * step));
        for x in (0..first.min(width)).chain(end..width) {
            to[x] = TAPS.iter().enumerate().map(|(k, t)| t * from[mirrored(x, k, width)]).sum();
        }
        for x in first..end {
            let at = &from[x - first..];
            to[x] = TAPS.iter().enumerate().map(|(k, t)| t * at[k * step]).sum();
        }
    });
    let mut out = vec![0.0; plane.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, to)| {
        for (k, tap) in TAPS.into_iter().enumerate() {
            let from = &across[mirrored(y, k, height) * width..][..width];
            to.iter_mut().zip(from).for_each(|(to, v)| *to += tap * v);
        }
    });
    out
}

/// How much correlation rises again on any way straight out, up to a third of the shorter side.
fn periodicity(correlation: &[f64], (rows, cols): (usize, usize)) -> f64 {
    const WAYS: u32 = 180;
    let variance = correlation[0];
    if variance <= 0.0 {
        return 0.0;
    }
    let along = |way: u32| {
        let angle = std::f64::consts::PI * f64::from(way) / f64::from(WAYS);
        let (s, c) = (libm::sin(angle), libm::cos(angle));
        let (mut least, mut rise) = (f64::MAX, 0.0f64);
        for r in 0..rows.min(cols) / 3 {
            let around =
                |v: f64, n: usize| (v * r as f64).round().rem_euclid(n as f64) as usize % n;
            let here = correlation[around(s, rows) * cols + around(c, cols)];
            least = least.min(here);
            rise = rise.max(here - least);
        }
        // From opposite to alike would be 2.
        0.5 * rise / variance
    };
    (0..WAYS).map(along).fold(0.0, f64::max).clamp(0.0, 1.0)
}

/// How unlike the directions of each octave are.
fn anisotropy(power: &[f64], (rows, cols): (usize, usize)) -> f64 {
    // Below, too few waves fit in to tell.
    let octaves = rows.min(cols).ilog2().saturating_sub(3).max(1) as usize;
    // Between a direction and the next; x does not fall below 0, as opposite frequencies are one wave.
    let bounds: [f64; DIRECTIONS] = std::array::from_fn(|k| {
        let turns = (k as f64 + 0.5) / DIRECTIONS as f64 - 0.5;
        libm::tan(turns * std::f64::consts::PI)
    });
    let row = |(r, line): (usize, &[f64])| {
        let (mut sums, mut counts) =
            (vec![[0.0; DIRECTIONS]; octaves], vec![[0.0; DIRECTIONS]; octaves]);
        let turned = if 2 * r > rows { r as f64 - rows as f64 } else { r as f64 };
        let fy = turned / rows as f64;
        for (q, power) in line[..=cols / 2].iter().enumerate() {
            let fx = q as f64 / cols as f64;
            let square = fx * fx + fy * fy;
            let (mut octave, mut lower) = (0, 0.0625);
            while square <= lower && octave < octaves {
                (octave, lower) = (octave + 1, lower / 4.0);
            }
            if square <= 0.25 && octave < octaves {
                let direction = bounds.iter().filter(|b| fy >= **b * fx).count() % DIRECTIONS;
                sums[octave][direction] += power * signs(q, cols);
                counts[octave][direction] += signs(q, cols);
            }
        }
        (sums, counts)
    };
    // A row's share, then all rows in order.
    let shares: Vec<_> = power.par_chunks(cols).enumerate().map(row).collect();
    let mut sums = vec![[0.0; DIRECTIONS]; octaves];
    let mut counts = vec![[0.0; DIRECTIONS]; octaves];
    for (more, of) in &shares {
        for (all, share) in [(&mut sums, more), (&mut counts, of)] {
            let all = all.as_flattened_mut().iter_mut();
            all.zip(share.as_flattened()).for_each(|(all, share)| *all += share);
        }
    }
    let (mut powers, mut unlike) = (0.0, 0.0);
    for (sums, counts) in sums.iter().zip(&counts) {
        let means: Vec<f64> = sums.iter().zip(counts).map(|(s, c)| s / c.max(1.0)).collect();
        let (power, total) = (sums.iter().sum::<f64>(), means.iter().sum::<f64>());
        if total > 0.0 {
            let even = 1.0 / DIRECTIONS as f64;
            let off = means.iter().map(|m| (m / total - even).abs()).sum::<f64>() / 2.0;
            powers += power;
            unlike += power * (off - OF_NOISE.1).max(0.0);
        }
    }
    if powers > 0.0 { unlike / powers } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::power::power_spectrum;
    use crate::signal::wavelet_noise::{Detail, Part, Torus};

    fn structure(plane: &[f32], shape: (usize, usize)) -> Structure {
        Structure::of(plane, shape, &power_spectrum(plane, shape))
    }

    #[test]
    fn noise_has_none_and_spots_have() {
        let n = 256;
        let torus = Torus::new((n, n), Detail::Round);
        let at = |i: usize| (i % n) as f64 / 2.0;
        let noise: Vec<f32> = (0..n * n).map(|i| torus.at(at(i), (i / n) as f64 / 2.0)).collect();
        let of_noise = structure(&noise, (n, n));
        assert!(of_noise.isotropic_fit() > 0.6, "{of_noise:?}");
        // The same noise, where it is strong.
        let spots: Vec<f32> = noise.iter().map(|v| (v - 1.5).max(0.0)).collect();
        let of_spots = structure(&spots, (n, n));
        assert!(of_spots.isotropic_fit() < 0.2, "{of_spots:?}");
    }

    #[test]
    fn a_chequer_repeats_and_noise_does_not() {
        let n = 192;
        let torus = Torus::new((n, n), Detail::Round);
        // Of a single band alone correlation rises again: several.
        let band = |i: usize, step: f64| torus.at((i % n) as f64 / step, (i / n) as f64 / step);
        let noise: Vec<f32> = (0..n * n)
            .map(|i| [1.0, 2.0, 4.0, 8.0].map(|step| band(i, step)).iter().sum())
            .collect();
        let of_noise = structure(&noise, (n, n)).periodicity;
        assert!(of_noise < 0.2, "{of_noise}");
        let chequer: Vec<f32> = (0..n * n)
            .map(|i| 2.0 * (((i % n) / 12 + (i / n) / 12) % 2) as f32 + 0.1 * noise[i])
            .collect();
        let of_chequer = structure(&chequer, (n, n)).periodicity;
        assert!(of_chequer > 0.7, "{of_chequer}");
    }

    #[test]
    fn grain_has_directions() {
        let n = 256;
        let torus = Torus::new((n, n), Detail::Axes([Part::Band, Part::Low]));
        let grain: Vec<f32> =
            (0..n * n).map(|i| torus.at((i % n) as f64 / 2.0, (i / n) as f64 / 16.0)).collect();
        let structure = structure(&grain, (n, n));
        assert!(structure.anisotropy > 0.4, "{structure:?}");
        assert!(structure.oriented_fit() > 2.0 * structure.isotropic_fit(), "{structure:?}");
    }
}
