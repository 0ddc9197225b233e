//! [`Ranks`]: the histogram of a channel.

use rayon::prelude::*;

use crate::method::noise::fit::Exemplar;
use crate::method::noise::shape::{KNOTS, Shape};
use crate::signal::normal;

/// Levels of a plane's histogram.
const STEPS_OF_VALUE: usize = 1 << 16;

/// A plane's histogram.
#[derive(Debug)]
pub(super) struct Ranks {
    least: f32,
    per_step: f64,
    /// How many samples there are of every step of value.
    counts: Vec<u32>,
    variance: f64,
    /// The histogram's values at the knots, of mean 0 and exactly the plane's variance.
    pub(super) knots: [f64; KNOTS.len()],
}

impl Ranks {
    /// Of the usable samples of a plane with mean 0 and this variance.
    pub(super) fn new(plane: &[f32], exemplar: &Exemplar, variance: f64) -> Self {
        let values =
            || plane.iter().enumerate().filter(|(i, _)| exemplar.counts(*i)).map(|(_, v)| *v);
        let (least, most) = values().fold((f32::MAX, f32::MIN), |(a, b), v| (a.min(v), b.max(v)));
        let per_step = (STEPS_OF_VALUE - 1) as f64 / f64::from(most - least).max(f64::MIN_POSITIVE);
        let counts = vec![0u32; STEPS_OF_VALUE];
        let mut ranks = Self { least, per_step, counts, variance, knots: [0.0; KNOTS.len()] };
        let mut sums = vec![0.0f64; STEPS_OF_VALUE];
        for v in values() {
            let step = ranks.step(v);
            ranks.counts[step] += 1;
            sums[step] += f64::from(v);
        }
        ranks.knots = knots(&ranks.counts, &sums, variance);
        ranks
    }

    /// For every step of value, a normally distributed number of the same rank and the plane's variance.
    fn normals(&self) -> Vec<f32> {
        let total = f64::from(self.counts.iter().sum::<u32>());
        let deviation = self.variance.sqrt();
        // Equal samples share the middle of their ranks.
        let mut below = 0.0;
        let rank = |&count: &u32| {
            let rank = below + 0.5 * f64::from(count);
            below += f64::from(count);
            rank
        };
        let ranks: Vec<f64> = self.counts.iter().map(rank).collect();
        let normal = |(&count, rank): (&u32, &f64)| {
            if count == 0 { 0.0 } else { (normal::quantile(rank / total) * deviation) as f32 }
        };
        self.counts.par_iter().zip(&ranks).map(normal).collect()
    }

    fn step(&self, value: f32) -> usize {
        (f64::from(value - self.least) * self.per_step).round() as usize
    }

    /// The samples replaced by normally distributed ones of the same ranks (section 5); those that are
    /// not usable are the mean.
    pub(super) fn gaussianised(&self, plane: &[f32], exemplar: &Exemplar) -> Vec<f32> {
        let normals = self.normals();
        let normal = |(i, &v): (usize, &f32)| {
            if exemplar.counts(i) { normals[self.step(v)] } else { 0.0 }
        };
        plane.par_iter().enumerate().map(normal).collect()
    }
}

/// Values at the knots: the mean of the samples whose ranks lie around each, then moved and stretched so
/// that mean and variance are right.
fn knots(counts: &[u32], sums: &[f64], variance: f64) -> [f64; KNOTS.len()] {
    let total = f64::from(counts.iter().sum::<u32>());
    // From half-way to the knot before to half-way to the one after, weighted towards the knot alone:
    // a narrow window where the distribution is dense, a wide one in the tails.
    let window = |i: usize| {
        let u = KNOTS[i];
        let half = |j: usize| 0.15 * (KNOTS[j] - u).abs();
        let from = if i == 0 { 0.0 } else { normal::cumulative(u - half(i - 1)) };
        let to = if i + 1 == KNOTS.len() { 1.0 } else { normal::cumulative(u + half(i + 1)) };
        (from * total, to * total)
    };
    let mut values: [f64; KNOTS.len()] = std::array::from_fn(|i| {
        let (from, to) = window(i);
        let (mut below, mut sum) = (0.0, 0.0);
        for (&count, &value) in counts.iter().zip(sums).filter(|(c, _)| **c > 0) {
            let count = f64::from(count);
            let inside = (to.min(below + count) - from.max(below)).max(0.0);
            sum += inside * value / count;
            below += count;
        }
        sum / (to - from)
    });
    for i in 1..values.len() {
        values[i] = values[i].max(values[i - 1]);
    }
    let (mean, got) = Shape::new(&values).moments();
    let gain = if got > 0.0 { (variance / got).sqrt() } else { 1.0 };
    values.map(|v| (v - mean) * gain)
}
