//! Distributions of code values: histograms, cumulative shares, quantiles.
//!
//! Values are *soft codes*: codes of the matching space (`0..=127`) with six bits of fraction, so
//! that means of codes lose nothing that matters and everything below is integer in, integer out.

use rayon::prelude::*;

/// Soft codes of one pixel: three colour channels and local contrast.
pub type Soft = [u16; 4];

/// Bits of fraction in a soft code.
pub const SOFT_BITS: u32 = 6;

/// Largest soft code.
pub const SOFT_MAX: u16 = 127 << SOFT_BITS;

/// Bins of a histogram: one per code.
pub const BINS: usize = 128;

/// The bin of a soft code and where in it the value lies, in `0..1`.
#[inline]
pub fn bin_of(v: u16) -> (usize, f32) {
    const WIDTH: f32 = (1 << SOFT_BITS) as f32;
    // The bin of code c holds the values that round to it.
    let v = v + (1 << (SOFT_BITS - 1));
    ((v >> SOFT_BITS) as usize, (v & ((1 << SOFT_BITS) - 1)) as f32 / WIDTH)
}

/// Value at the lower edge of a bin, in soft codes (-32 for the first).
#[inline]
pub fn edge(bin: f32) -> f32 {
    const WIDTH: f32 = (1 << SOFT_BITS) as f32;
    (bin - 0.5) * WIDTH
}

/// A cumulative distribution: `BINS + 1` shares from 0 to 1 at the bins' edges, linear between.
#[derive(Debug, Clone)]
pub struct Distribution {
    cdf: Vec<f32>,
}

impl Distribution {
    /// The distribution of bin masses; `None` if there is no mass.
    pub fn from_masses(masses: &[f64]) -> Option<Self> {
        assert_eq!(masses.len(), BINS, "one mass a bin");
        let total: f64 = masses.iter().sum();
        if total <= 0.0 {
            return None;
        }
        let mut sum = 0.0;
        let shares = masses.iter().map(|mass| {
            sum += mass;
            (sum / total) as f32
        });
        Some(Self { cdf: std::iter::once(0.0).chain(shares).collect() })
    }

    /// The distribution with these shares below the bins' edges.
    pub fn from_cumulative(cdf: Vec<f32>) -> Self {
        assert_eq!(cdf.len(), BINS + 1, "one share an edge");
        Self { cdf }
    }

    /// The distribution of these soft codes; `None` of none.
    pub fn of(values: impl Iterator<Item = u16>) -> Option<Self> {
        let mut masses = vec![0u64; BINS];
        values.for_each(|v| masses[bin_of(v).0] += 1);
        Self::from_masses(&masses.iter().map(|&m| m as f64).collect::<Vec<_>>())
    }

    /// The share of values below `v`.
    #[inline]
    pub fn share_below(&self, v: u16) -> f32 {
        let (bin, at) = bin_of(v);
        self.cdf[bin] + (self.cdf[bin + 1] - self.cdf[bin]) * at
    }

    /// The inverse, tabulated for speed.
    pub fn quantiles(&self) -> Quantiles {
        let mut bin = 0;
        let table = (0..=QUANTILES)
            .map(|i| {
                let u = i as f32 / QUANTILES as f32;
                // Empty bins hold no values; the least value is where the mass begins.
                while bin + 1 < BINS && (self.cdf[bin + 1] < u || self.cdf[bin + 1] <= 0.0) {
                    bin += 1;
                }
                let (below, above) = (self.cdf[bin], self.cdf[bin + 1]);
                let at = if above > below { (u - below) / (above - below) } else { 0.0 };
                edge(bin as f32 + at.clamp(0.0, 1.0))
            })
            .collect();
        Quantiles { table }
    }
}

/// How many pixels have each soft code.
#[derive(Debug)]
pub struct Counts(Vec<u32>);

impl Counts {
    /// Of channel `k`. Counts are integers: any order of work gives the same.
    pub fn of_channel(pixels: &[Soft], k: usize) -> Self {
        // A chunk has more pixels than there are counts to be added up.
        const CHUNK: usize = 1 << 15;
        let nothing = || vec![0; usize::from(SOFT_MAX) + 1];
        let count = |mut counts: Vec<u32>, chunk: &[Soft]| {
            chunk.iter().for_each(|px| counts[usize::from(px[k])] += 1);
            counts
        };
        let sum = |mut a: Vec<u32>, b: Vec<u32>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        };
        Self(pixels.par_chunks(CHUNK).fold(nothing, count).reduce(nothing, sum))
    }

    /// The distribution; `None` of no pixels.
    pub fn distribution(&self) -> Option<Distribution> {
        let mut masses = [0u64; BINS];
        (0..).zip(&self.0).for_each(|(v, &n)| masses[bin_of(v).0] += u64::from(n));
        Distribution::from_masses(&masses.map(|n| n as f64))
    }
}

/// Steps of a tabulated quantile function.
const QUANTILES: usize = 1024;

/// A tabulated quantile function, in soft codes.
#[derive(Debug, Clone)]
pub struct Quantiles {
    table: Vec<f32>,
}

impl Quantiles {
    /// The median of each quantile over several distributions.
    pub fn median(all: &[Self]) -> Option<Self> {
        let middle = all.len() / 2;
        let median = |i| {
            let mut values: Vec<f32> = all.iter().map(|q| q.table[i]).collect();
            *values.select_nth_unstable_by(middle, f32::total_cmp).1
        };
        (!all.is_empty()).then(|| Self { table: (0..=QUANTILES).map(median).collect() })
    }

    /// The quantiles of all values together of several distributions with these weights; `None` of
    /// none. One alone stays as it is.
    pub fn pooled(all: &[(Self, f64)]) -> Option<Self> {
        if let [(only, _)] = all {
            return Some(only.clone());
        }
        let mut masses = vec![0.0; BINS];
        for (quantiles, weight) in all {
            for pair in quantiles.table.windows(2) {
                masses[bin_of(rounded(f32::midpoint(pair[0], pair[1]))).0] += weight;
            }
        }
        Some(Distribution::from_masses(&masses)?.quantiles())
    }

    /// The value below which the share `u` in `0..=1` lies.
    #[inline]
    pub fn at(&self, u: f32) -> f32 {
        let at = u.clamp(0.0, 1.0) * QUANTILES as f32;
        let i = (at as usize).min(QUANTILES - 1);
        self.table[i] + (self.table[i + 1] - self.table[i]) * (at - i as f32)
    }

    /// For every soft code v that there is: the value `(1 - alpha) v + alpha Q(F_own(v))`, `Q` being
    /// these quantiles and `F_own` the distribution of what was counted. Codes that nothing has stay
    /// as they are.
    pub fn matching_table(&self, own: &Counts, alpha: f32) -> Vec<u16> {
        let Some(distribution) = own.distribution() else { return (0..=SOFT_MAX).collect() };
        let matched = |(v, &n): (u16, &u32)| {
            if n == 0 {
                return v;
            }
            let wanted = self.at(distribution.share_below(v));
            rounded(v as f32 + alpha * (wanted - v as f32))
        };
        (0..).zip(&own.0).map(matched).collect()
    }
}

/// The nearest soft code.
#[inline]
pub fn rounded(v: f32) -> u16 {
    // At 2^23 the last bit of a float is worth one: adding it rounds, and leaves the whole number
    // in the low bits. (A cast would check for NaN and overflow, which cannot be here.)
    const TO_WHOLE: f32 = (1 << 23) as f32;
    ((v.max(0.0) + TO_WHOLE).to_bits() & 0xffff).min(SOFT_MAX as u32) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(values: impl Iterator<Item = u16>) -> Counts {
        Counts::of_channel(&values.map(|v| [7, v, 0, SOFT_MAX]).collect::<Vec<_>>(), 1)
    }

    #[test]
    fn counts_are_of_every_code_and_make_the_same_distribution() {
        let pixels: Vec<Soft> = (0..100_000u32)
            .map(|i| [(i * 7919 % 3001) as u16, (i % 13) as u16, SOFT_MAX, 0])
            .collect();
        for k in 0..4 {
            let counts = Counts::of_channel(&pixels, k);
            for v in (0..=SOFT_MAX).step_by(7).chain([1, 12, SOFT_MAX]) {
                let n = pixels.iter().filter(|px| px[k] == v).count();
                assert_eq!(counts.0[usize::from(v)] as usize, n, "{v} of channel {k}");
            }
            let want = Distribution::of(pixels.iter().map(|px| px[k])).expect("some");
            assert_eq!(counts.distribution().expect("some").cdf, want.cdf, "channel {k}");
        }
        assert!(Counts::of_channel(&[], 0).distribution().is_none());
    }

    #[test]
    fn codes_that_nothing_has_stay_as_they_are() {
        let own = counts((0..1000).map(|i| 2000 + 2 * i));
        let wanted = Distribution::of((0..1000).map(|i| 100 + i)).expect("some").quantiles();
        let table = wanted.matching_table(&own, 1.0);
        for v in 0..=SOFT_MAX {
            let there = (2000..4000).contains(&v) && v % 2 == 0;
            assert_eq!(table[usize::from(v)] == v, !there, "{v} became {}", table[usize::from(v)]);
        }
    }

    #[test]
    fn quantiles_invert_the_distribution() {
        let skewed = || (0..5000u32).map(|i| ((i * 7919) % 5000).pow(2) / 3100).map(|v| v as u16);
        let distribution = Distribution::of(skewed()).expect("some");
        let quantiles = distribution.quantiles();
        for v in skewed() {
            let back = quantiles.at(distribution.share_below(v));
            assert!((back - v as f32).abs() < 64.0, "{v} came back as {back}");
        }
    }

    #[test]
    fn a_distribution_matched_to_itself_moves_by_less_than_a_code() {
        let values = || (0..3000u16).map(|i| 1000 + (i * 7) % 4000);
        let own = Distribution::of(values()).expect("some");
        let table = own.quantiles().matching_table(&counts(values()), 1.0);
        assert!(values().all(|v| table[v as usize].abs_diff(v) < 64), "moved");
    }

    #[test]
    fn matching_shifts_a_shifted_distribution() {
        let own = counts((0..1000).map(|i| 2000 + i));
        let wanted = Distribution::of((0..1000).map(|i| 4000 + 2 * i)).expect("some").quantiles();
        let table = wanted.matching_table(&own, 1.0);
        let half = wanted.matching_table(&own, 0.5);
        assert!(table[2500].abs_diff(5000) < 64, "{}", table[2500]);
        assert!(half[2500].abs_diff(3750) < 64, "{}", half[2500]);
    }

    #[test]
    fn pooling_is_the_distribution_of_all_values() {
        let (a, b) = (|| (0..2000).map(|i| 500 + i), || (0..1000).map(|i| 3000 + 4 * i));
        let of = |values: &mut dyn Iterator<Item = u16>| {
            Distribution::of(values).expect("some").quantiles()
        };
        let pooled = [(of(&mut a()), 2000.0), (of(&mut b()), 1000.0)];
        let pooled = Quantiles::pooled(&pooled).expect("some");
        let want = of(&mut a().chain(b()));
        for u in [0.05, 0.3, 0.6, 0.7, 0.9] {
            assert!(
                (pooled.at(u) - want.at(u)).abs() < 64.0,
                "{u}: {} {}",
                pooled.at(u),
                want.at(u)
            );
        }
        assert!(Quantiles::pooled(&[]).is_none());
    }

    #[test]
    fn rounding_is_to_the_nearest_inside_the_range() {
        let given = [-70.0, 0.0, 0.4, 0.6, 63.2, 8127.7, 8128.4, 9000.0];
        assert_eq!(given.map(rounded), [0, 0, 0, 1, 63, 8128, 8128, 8128]);
    }

    #[test]
    fn nothing_has_no_distribution_and_no_median() {
        assert!(Distribution::of(std::iter::empty()).is_none());
        assert!(Quantiles::median(&[]).is_none());
    }
}
