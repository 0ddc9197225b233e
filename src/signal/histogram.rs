//! Histograms of one channel, their distribution functions and quantiles.

/// Equal bins over a closed interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bins {
    /// Lower end of the first bin.
    pub low: f32,
    /// Width of a bin.
    pub width: f32,
    /// Number of bins.
    pub n: usize,
}

impl Bins {
    /// `n` bins from the least to the largest of the values; one value gives bins of width 1.
    pub fn covering(values: impl Iterator<Item = f32>, n: usize) -> Self {
        let (low, high) =
            values.fold((f32::MAX, f32::MIN), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return Self { low: 0.0, width: 1.0, n };
        }
        let width = (high - low) / n as f32;
        Self { low, width: if width > 0.0 { width } else { 1.0 }, n }
    }

    /// The bin of `v` (the ends for values outside) and where in it `v` lies, in `0..=1`.
    #[inline]
    pub fn place(&self, v: f32) -> (usize, f32) {
        let at = ((v - self.low) / self.width).clamp(0.0, self.n as f32);
        let bin = (at as usize).min(self.n - 1);
        (bin, at - bin as f32)
    }
}

/// A cumulative distribution: `n + 1` values from 0 to 1 at the bins' edges, linear between.
#[derive(Debug, Clone)]
pub struct Distribution {
    bins: Bins,
    cdf: Vec<f32>,
}

impl Distribution {
    /// The distribution of bin masses (any positive total).
    pub fn from_masses(bins: Bins, masses: &[f64]) -> Self {
        assert_eq!(masses.len(), bins.n, "one mass a bin");
        let total: f64 = masses.iter().sum();
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        let mut sum = 0.0;
        let mut cdf = vec![0.0];
        for mass in masses {
            sum += mass;
            cdf.push((sum * scale) as f32);
        }
        if total <= 0.0 {
            cdf[bins.n] = 1.0;
        }
        Self { bins, cdf }
    }

    /// The distribution with these shares below the bins' edges.
    pub fn from_cumulative(bins: Bins, cdf: Vec<f32>) -> Self {
        assert_eq!(cdf.len(), bins.n + 1, "one share an edge");
        Self { bins, cdf }
    }

    /// The distribution of these values.
    pub fn of(values: impl Iterator<Item = f32>, bins: Bins) -> Self {
        let mut masses = vec![0u64; bins.n];
        values.for_each(|v| masses[bins.place(v).0] += 1);
        let masses: Vec<f64> = masses.iter().map(|&m| m as f64).collect();
        Self::from_masses(bins, &masses)
    }

    /// The share of values below `v`.
    #[inline]
    pub fn share_below(&self, v: f32) -> f32 {
        let (bin, at) = self.bins.place(v);
        self.cdf[bin] + (self.cdf[bin + 1] - self.cdf[bin]) * at
    }

    /// The inverse, tabulated for speed.
    pub fn quantiles(&self) -> Quantiles {
        const STEPS: usize = 1024;
        let mut bin = 0;
        let table = (0..=STEPS)
            .map(|i| {
                let u = i as f32 / STEPS as f32;
                while bin + 1 < self.bins.n && self.cdf[bin + 1] < u {
                    bin += 1;
                }
                // Empty bins at the start hold no values: their end is the least value.
                if i == 0 {
                    while bin + 1 < self.bins.n && self.cdf[bin + 1] <= 0.0 {
                        bin += 1;
                    }
                }
                let (below, above) = (self.cdf[bin], self.cdf[bin + 1]);
                let at = if above > below {
                    ((u - below) / (above - below)).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                self.bins.low + (bin as f32 + at) * self.bins.width
            })
            .collect();
        Quantiles { table }
    }
}

/// A tabulated quantile function.
#[derive(Debug, Clone)]
pub struct Quantiles {
    table: Vec<f32>,
}

impl Quantiles {
    /// The median of each quantile over several distributions.
    pub fn median(all: &[Self]) -> Self {
        assert!(!all.is_empty(), "a median of nothing");
        let table = (0..all[0].table.len())
            .map(|i| {
                let mut values: Vec<f32> = all.iter().map(|q| q.table[i]).collect();
                let middle = values.len() / 2;
                *values.select_nth_unstable_by(middle, f32::total_cmp).1
            })
            .collect();
        Self { table }
    }

    /// The value below which the share `u` in `0..=1` lies.
    #[inline]
    pub fn at(&self, u: f32) -> f32 {
        let last = self.table.len() - 1;
        let at = u.clamp(0.0, 1.0) * last as f32;
        let i = (at as usize).min(last - 1);
        self.table[i] + (self.table[i + 1] - self.table[i]) * (at - i as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_invert_the_distribution() {
        let values: Vec<f32> = (0..5000).map(|i| ((i * 7919) % 5000) as f32 / 50.0).collect();
        let skewed: Vec<f32> = values.iter().map(|v| v * v / 100.0).collect();
        let bins = Bins::covering(skewed.iter().copied(), 256);
        let distribution = Distribution::of(skewed.iter().copied(), bins);
        let quantiles = distribution.quantiles();
        for v in skewed {
            let back = quantiles.at(distribution.share_below(v));
            assert!((back - v).abs() < 2.0 * bins.width, "{v} came back as {back}");
        }
    }

    #[test]
    fn a_constant_stays_itself() {
        let bins = Bins::covering([3.5; 10].into_iter(), 64);
        let distribution = Distribution::of([3.5; 10].into_iter(), bins);
        let back = distribution.quantiles().at(distribution.share_below(3.5));
        assert!((back - 3.5).abs() < 1e-6, "came back as {back}");
    }
}
