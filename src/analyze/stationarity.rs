//! Stationarity cost: how different the places of a texture are from each other.

use crate::signal::measure::Statistic;
use crate::signal::window::{Domain, Window};

/// Mean earth mover's distance between the local histograms of two places of the picture, over
/// all pairs of places, summed over the three channels (in the pixels' units); 0 for a picture
/// that is the same everywhere. `sigma` is the window's standard deviation in pixels. The cost that
/// all tiles report, so that they can be compared; [`Statistic::cost`] has the other measures.
///
/// # Paper
/// Moritz et al. 2017, eq. 1 with the histogram measure of eq. 3, of 128 bins over each channel's
/// range.
///
/// # Determinism
/// Same bytes for any thread count.
pub fn histogram_cost(pixels: &[[f32; 3]], domain: Domain, sigma: f64) -> f64 {
    Statistic::Histogram.cost(pixels, domain, &Window::even(sigma))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stain_costs_and_noise_does_not() {
        let domain = Domain { height: 64, width: 64, wrap_y: true, wrap_x: true };
        let noise = |i: usize| ((i * 7919) % 97) as f32 / 4.0;
        let even: Vec<[f32; 3]> = (0..4096).map(|i| [50.0 + noise(i), 0.0, 0.0]).collect();
        let mut stained = even.clone();
        for (i, px) in stained.iter_mut().enumerate() {
            if (i / 64) < 24 && (i % 64) < 24 {
                px[0] -= 20.0;
            }
        }
        let (even, stained) =
            (histogram_cost(&even, domain, 6.4), histogram_cost(&stained, domain, 6.4));
        assert!(stained > 5.0 * even, "stained {stained}, even {even}");
        // Two places differ by up to 20, and 2 p (1 - p) of the pairs lie on different sides.
        assert!((2.0..6.0).contains(&stained), "stained {stained}");
    }
}
