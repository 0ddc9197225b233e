//! What a texture looks like, whatever lies where.

use crate::signal::window::{Domain, Grid};

/// Windows in which a picture is looked at, as fractions of its shorter side: from what is grain in
/// a tile to what fills a quarter of it.
const WINDOWS: [f64; 4] = [1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0];

/// Quantiles that stand for a distribution.
const QUANTILES: usize = 64;

/// Distributions of local statistics: the mean and the standard deviation of each channel under
/// Gaussian windows of four sizes. Where in the picture something lies does not matter, how
/// different its places are does.
#[derive(Debug, Clone, PartialEq)]
pub struct Appearance {
    /// Quantile functions, one after the other.
    quantiles: Vec<f64>,
}

impl Appearance {
    /// Of a picture of `domain`'s size, in any units.
    ///
    /// # Paper
    /// Moritz et al. 2017, Sec. 4.4 leaves the histograms open; those of the colours themselves
    /// hardly change when a stain is spread, those of local statistics do.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    pub fn of(pixels: &[[f32; 3]], domain: Domain) -> Self {
        assert_eq!(pixels.len(), domain.height * domain.width, "pixels do not fill the picture");
        let side = domain.height.min(domain.width) as f64;
        let mut quantiles = Vec::with_capacity(WINDOWS.len() * 6 * QUANTILES);
        for window in WINDOWS {
            let grid = Grid::new(domain, window * side);
            let terms = |px: &[f32; 3]| {
                let [a, b, c] = px.map(f64::from);
                [1.0, a, b, c, a * a, b * b, c * c]
            };
            let sums = grid.spread(
                7,
                |i| Some(terms(&pixels[i])),
                |sums: &mut [f64], terms, weight| {
                    let all = sums.iter_mut().zip(terms);
                    all.for_each(|(sum, term)| *sum += f64::from(weight) * term);
                },
            );
            let sums = grid.blurred(&sums, 7);
            let cells = || sums.chunks_exact(7);
            for k in 0..3 {
                let mean = |sums: &[f64]| sums[1 + k] / sums[0];
                let deviation = |sums: &[f64]| {
                    let mean = mean(sums);
                    (sums[4 + k] / sums[0] - mean * mean).max(0.0).sqrt()
                };
                quantiles.extend(quantile_function(cells().map(mean).collect()));
                quantiles.extend(quantile_function(cells().map(deviation).collect()));
            }
        }
        Self { quantiles }
    }

    /// The typical one of several: their distributions' barycentre.
    ///
    /// # Panics
    /// If there is none.
    pub fn typical(all: &[Self]) -> Self {
        let mean =
            |i| all.iter().map(|one: &Self| one.quantiles[i]).sum::<f64>() / all.len() as f64;
        Self { quantiles: (0..all[0].quantiles.len()).map(mean).collect() }
    }

    /// How different two textures look: the earth mover's distance between the distributions of
    /// each statistic, added up over statistics and channels, mean over the windows; in the pixels'
    /// units.
    pub fn distance(&self, other: &Self) -> f64 {
        let pairs = self.quantiles.iter().zip(&other.quantiles);
        let sum: f64 = pairs.map(|(a, b)| (a - b).abs()).sum();
        sum / (QUANTILES * WINDOWS.len()) as f64
    }
}

/// The distribution of some values at evenly spaced shares, between values linearly.
fn quantile_function(mut values: Vec<f64>) -> impl Iterator<Item = f64> {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len() - 1;
    (0..QUANTILES).map(move |i| {
        let at = (i as f64 + 0.5) / QUANTILES as f64 * last as f64;
        let low = at as usize;
        values[low] + (values[(low + 1).min(last)] - values[low]) * (at - low as f64)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOMAIN: Domain = Domain { height: 64, width: 96, wrap_y: true, wrap_x: true };

    fn noise(i: usize) -> f32 {
        ((i * 7919) % 97) as f32 / 4.0
    }

    /// Noise with `n` stains of 16 x 16 pixels, 20 darker, the whole moved by `(dy, dx)`.
    fn stained(n: usize, (dy, dx): (usize, usize)) -> Vec<[f32; 3]> {
        let at = |i: usize| {
            let (y, x) = ((i / 96 + dy) % 64, (i % 96 + dx) % 96);
            let dark = y < 16 && x / 32 < n && x % 32 < 16;
            [50.0 + noise(y * 96 + x) - if dark { 20.0 } else { 0.0 }, 10.0, -3.0]
        };
        (0..64 * 96).map(at).collect()
    }

    fn look(n: usize, by: (usize, usize)) -> Appearance {
        Appearance::of(&stained(n, by), DOMAIN)
    }

    #[test]
    fn what_lies_elsewhere_looks_the_same_and_what_is_stained_does_not() {
        let (clean, one, two) = (look(0, (0, 0)), look(1, (0, 0)), look(2, (0, 0)));
        let moved = look(1, (23, 41));
        assert!(one.distance(&moved) < 0.1 * one.distance(&clean));
        assert!(clean.distance(&two) > 1.5 * clean.distance(&one));
        assert!(clean.distance(&clean).abs() < 1e-12);
        assert!((one.distance(&two) - two.distance(&one)).abs() < 1e-12);
    }

    #[test]
    fn a_shift_of_all_colours_is_its_own_size() {
        let pixels = stained(1, (0, 0));
        let brighter: Vec<[f32; 3]> =
            pixels.iter().map(|p| [p[0] + 5.0, p[1], p[2] - 2.0]).collect();
        let distance = Appearance::of(&pixels, DOMAIN).distance(&Appearance::of(&brighter, DOMAIN));
        assert!((distance - 7.0).abs() < 1e-3, "{distance}");
    }

    #[test]
    fn a_window_that_sees_all_has_the_pictures_own_statistics() {
        // The mean of the means is the mean; the deviation in a window of a quarter of the side is
        // nearly that of the whole picture of white noise.
        let look = Appearance::of(&stained(0, (0, 0)), DOMAIN);
        let last = &look.quantiles[look.quantiles.len() - 6 * QUANTILES..];
        let values: Vec<f64> = (0..64 * 96).map(|i| 50.0 + f64::from(noise(i))).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
        let median = |n: usize| last[n * QUANTILES + QUANTILES / 2];
        assert!((median(0) - mean).abs() < 0.2, "{} {mean}", median(0));
        assert!((median(1) - variance.sqrt()).abs() < 0.2, "{} {}", median(1), variance.sqrt());
    }

    #[test]
    fn the_typical_one_lies_between() {
        let (clean, two) = (look(0, (0, 0)), look(2, (0, 0)));
        let between = Appearance::typical(&[clean.clone(), two.clone()]);
        let half = clean.distance(&two) / 2.0;
        assert!((between.distance(&clean) - half).abs() < 1e-9);
        assert!((between.distance(&two) - half).abs() < 1e-9);
    }
}
