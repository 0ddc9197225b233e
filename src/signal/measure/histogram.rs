//! Local histograms: the whole distribution of each channel is made the same everywhere.

use rayon::prelude::*;

use crate::signal::histogram::{SOFT_BITS, SOFT_MAX, Soft, rounded};
use crate::signal::localhist::{EDGES, LocalDistributions, mean_distance};
use crate::signal::measure::{Mapping, at_places, project_channels};
use crate::signal::window::{Domain, Window};

/// Earth mover's distance between the histograms of two places, summed over the channels.
pub(super) fn cost(pixels: &[[f32; 3]], domain: Domain, window: &Window) -> f64 {
    let cost = |k: usize| plane_cost(|i| pixels[i][k], pixels.len(), domain, window);
    let costs: Vec<f64> = (0..3).into_par_iter().map(cost).collect();
    costs.iter().sum()
}

/// The same of one value a pixel, of 128 bins over the range of the values.
pub(super) fn plane_cost(
    value: impl Fn(usize) -> f32 + Sync,
    n: usize,
    domain: Domain,
    window: &Window,
) -> f64 {
    let ends = (f32::MAX, f32::MIN);
    let (low, high) = (0..n).map(&value).fold(ends, |(l, h), v| (l.min(v), h.max(v)));
    if low >= high {
        return 0.0;
    }
    let scale = SOFT_MAX as f32 / (high - low);
    let code = |i: usize| Some(rounded((value(i) - low) * scale));
    let places = at_places(EDGES, domain, window, |sigma| {
        let local = LocalDistributions::new(code, domain, sigma);
        local.into_parts()
    });
    let codes = f64::from(SOFT_MAX >> SOFT_BITS);
    mean_distance(&places) * f64::from(high - low) / codes
}

/// Each channel's value c moves towards `G^-1(F_x(c))`, `F_x` the local distribution around its
/// pixel, `G` the global one.
pub(super) fn project(pixels: &mut [Soft], domain: Domain, window: &Window, share: f32) {
    project_channels(pixels, 0..4, domain, window, share, |code, sigma| {
        mapping(code, domain, sigma)
    });
}

/// What makes the local distributions of these codes global.
pub(super) fn mapping(code: impl Fn(usize) -> u16 + Sync, domain: Domain, sigma: f64) -> Mapping {
    let local = LocalDistributions::new(|i| Some(code(i)), domain, sigma);
    let quantiles = local.global().expect("some pixels").quantiles();
    let (grid, shares) = local.into_parts();
    Mapping { grid, tables: shares.into_par_iter().map(|share| quantiles.at(share)).collect() }
}
