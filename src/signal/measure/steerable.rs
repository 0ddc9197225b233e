//! Local histograms of oriented filters' responses: how strongly edges and lines of each direction
//! stand out is made the same everywhere.

use rayon::prelude::*;

use crate::signal::histogram::{SOFT_BITS, Soft, rounded};
use crate::signal::measure::histogram::{mapping, plane_cost};
use crate::signal::measure::{Wanted, project_channels};
use crate::signal::steerable::{rebuilt, responses};
use crate::signal::window::{Domain, Window};

/// Colour channels. The fourth, local contrast, is such a response itself (of all directions
/// together) and is treated like one.
const COLORS: usize = 3;

/// The soft code of no response: the middle of a bin, for most responses are near it.
const ZERO: u16 = 63 << SOFT_BITS;

/// Earth mover's distance between the histograms of two places, summed over the twelve responses.
pub(super) fn cost(pixels: &[[f32; 3]], domain: Domain, window: &Window) -> f64 {
    let of_channel = |k: usize| {
        let plane: Vec<f32> = pixels.iter().map(|px| px[k]).collect();
        let cost = |band: &Vec<f32>| plane_cost(|i| band[i], band.len(), domain, window);
        responses(&plane, domain).iter().map(cost).sum::<f64>()
    };
    (0..COLORS).map(of_channel).sum()
}

/// Each response moves towards one whose local histogram is the same everywhere; the picture is put
/// together from the responses and what they leave over.
pub(super) fn project(pixels: &mut [Soft], domain: Domain, window: &Window, share: f32) {
    project_channels(pixels, COLORS..4, domain, window, share, |code, sigma| {
        mapping(code, domain, sigma)
    });
    for k in 0..COLORS {
        let first = pixels[0][k];
        if pixels.iter().all(|px| px[k] == first) {
            continue;
        }
        let plane: Vec<f32> = pixels.iter().map(|px| f32::from(px[k])).collect();
        let changes = responses(&plane, domain).map(|mut band| {
            turn_into_change(&mut band, domain, window, share);
            band
        });
        let picture = rebuilt(&plane, &changes, domain);
        pixels.par_iter_mut().zip(picture).for_each(|(px, v)| px[k] = rounded(v));
    }
}

/// Replaces a response by what it has to change so that it is the same everywhere.
fn turn_into_change(band: &mut [f32], domain: Domain, window: &Window, share: f32) {
    let most = band.iter().fold(0f32, |most, v| most.max(v.abs()));
    if most <= 0.0 {
        return;
    }
    let scale = f32::from(ZERO) / most;
    let codes: Vec<u16> = band.par_iter().map(|v| rounded(f32::from(ZERO) + v * scale)).collect();
    let wanted = Wanted::new(window, |sigma| mapping(|i| codes[i], domain, sigma));
    let share = share / scale;
    band.par_chunks_mut(domain.width)
        .zip(codes.par_chunks(domain.width))
        .enumerate()
        .for_each_init(Vec::new, |blended, (y, (row, codes))| {
            wanted.row(y, |x| codes[x], blended, row);
            for (v, &code) in row.iter_mut().zip(codes) {
                *v = share * (*v - f32::from(code));
            }
        });
}
