//! [`fit`]: noise whose bands differ along two directions, for wood, brushed metal and the like.
//!
//! Along each direction the spectrum is divided into octaves, and every pair of octaves is a band. So
//! grain of any length and width has bands of its own, which a division of octaves by angle, as of a
//! steerable pyramid, has only for grain a few times as long as wide.

use rayon::prelude::*;

use crate::method::noise::document::{Band, Channel};
use crate::method::noise::fit::{self, Analysis, least_squares, levels};
use crate::signal::wavelet_noise::Part;
use crate::signal::wavelet_noise::spectrum::{along_axis, octave};

/// Directions nearer to an axis than this, in degrees, are the axis: then pictures can go round.
const UPRIGHT: f64 = 2.0;

/// The least visible bands, which together have less than this share of all, are left out.
const LEFT_OUT: f64 = 0.01;

/// At most so many bands: every one costs time wherever the texture is evaluated.
const MOST_BANDS: usize = 40;

/// The result of [`fit`].
#[derive(Debug, Clone, PartialEq)]
pub struct Oriented {
    /// By how many degrees the first direction, across the grain, is turned from x towards y: within
    /// -90..=90.
    pub angle: f64,
    /// The bands.
    pub bands: Vec<Band>,
    /// The channels, with the rest of the fit.
    pub fit: fit::Fit,
}

/// Fits noise with bands that differ along two directions; otherwise as [`fit::fit`].
pub fn fit(analysis: &Analysis, shape: (usize, usize)) -> Oriented {
    let angle = angle(&analysis.spectra[0].power, shape);
    let levels = levels(shape) as usize;
    // What an octave along a direction (row) sees of noise with unit variance at a level (column).
    let turned = angle != 0.0;
    let (rows, cols) = shape;
    let leakage = [cols, rows].map(|n| {
        let of = |j: usize| along_axis(part(j, levels), j as u32, levels, turned, n);
        let columns: Vec<_> = (0..levels).map(of).collect();
        (0..levels)
            .map(|b| columns.iter().map(|column| column[b]).collect())
            .collect::<Vec<Vec<f64>>>()
    });
    let pairs: Vec<[usize; 2]> = (0..levels * levels).map(|i| [i % levels, i / levels]).collect();
    let powers: Vec<Vec<f64>> =
        (analysis.spectra.par_iter()).map(|s| powers(&s.power, shape, angle, levels)).collect();
    let solve = |chosen: &[[usize; 2]]| -> Vec<Vec<f64>> {
        let entry =
            |b: &[usize; 2], j: &[usize; 2]| leakage[0][b[0]][j[0]] * leakage[1][b[1]][j[1]];
        let matrix: Vec<Vec<f64>> =
            pairs.iter().map(|b| chosen.iter().map(|j| entry(b, j)).collect()).collect();
        powers.par_iter().map(|p| least_squares(&matrix, p, 0.01)).collect()
    };
    // Bands in the order of what is seen of them in all channels, until nearly all of it is there: their
    // contrast, and the finer the more, as fine grain is weak beside shades and yet what makes wood wood.
    let all = solve(&pairs);
    let seen = |i: usize| {
        let finest = pairs[i][0].min(pairs[i][1]);
        all.iter().map(|squares| squares[i]).sum::<f64>() / f64::from(1u32 << finest).sqrt()
    };
    let total: f64 = (0..pairs.len()).map(seen).sum();
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    order.sort_by(|&a, &b| seen(b).total_cmp(&seen(a)));
    let mut left = total;
    let enough = |&i: &usize| {
        let go_on = left > LEFT_OUT * total;
        left -= seen(i);
        go_on
    };
    let mut chosen: Vec<usize> = order.into_iter().take_while(enough).take(MOST_BANDS).collect();
    chosen.sort_unstable();
    let chosen: Vec<[usize; 2]> = chosen.into_iter().map(|i| pairs[i]).collect();
    let squares = solve(&chosen);
    let band =
        |j: &[usize; 2]| Band { levels: j.map(|j| j as u32), parts: j.map(|j| part(j, levels)) };
    let channels = squares.into_iter().zip(&analysis.spectra).map(|(squares, spectrum)| {
        // What was left out is shared among those that stay.
        let gain = spectrum.power.iter().sum::<f64>() / squares.iter().sum::<f64>().max(1e-30);
        let gain = gain.clamp(0.5, 2.0);
        let weights = squares.into_iter().map(|s| (s * gain).sqrt()).collect();
        Channel { weights, histogram: spectrum.histogram.clone() }
    });
    let fit = analysis.with_channels(channels.collect());
    Oriented { angle, bands: chosen.iter().map(band).collect(), fit }
}

/// Which frequencies of level `j` of `levels` are its.
fn part(j: usize, levels: usize) -> Part {
    match j {
        0 => Part::Fine,
        j if j + 1 == levels => Part::Low,
        _ => Part::Band,
    }
}

/// Direction in which the spectrum is widest, in degrees from x towards y: across the grain.
fn angle(power: &[f64], (rows, cols): (usize, usize)) -> f64 {
    let (mut cos, mut sin) = (0.0, 0.0);
    for (i, power) in power.iter().enumerate() {
        let (fx, fy) = frequency(i, (rows, cols));
        // Double angles: opposite frequencies are one direction.
        let square = fx * fx + fy * fy;
        if square > 0.0 {
            cos += power * (fx * fx - fy * fy) / square;
            sin += power * 2.0 * fx * fy / square;
        }
    }
    let degrees = 0.5 * libm::atan2(sin, cos).to_degrees();
    if degrees.abs() < UPRIGHT || (90.0 - degrees.abs()) < UPRIGHT { 0.0 } else { degrees }
}

/// Frequency of entry `i` of a spectrum, in cycles a pixel, with its sign.
fn frequency(i: usize, (rows, cols): (usize, usize)) -> (f64, f64) {
    let signed = |k: usize, n: usize| {
        if 2 * k > n { k as f64 / n as f64 - 1.0 } else { k as f64 / n as f64 }
    };
    (signed(i % cols, cols), signed(i / cols, rows))
}

/// Power in every pair of octaves along the two directions.
fn powers(power: &[f64], shape: (usize, usize), angle: f64, levels: usize) -> Vec<f64> {
    let (c, s) = (libm::cos(angle.to_radians()), libm::sin(angle.to_radians()));
    let mut sums = vec![0.0; levels * levels];
    for (i, power) in power.iter().enumerate() {
        let (fx, fy) = frequency(i, shape);
        let turned = [c * fx + s * fy, c * fy - s * fx];
        let [x, y] = turned.map(|f| octave(f.abs(), levels));
        sums[y * levels + x] += power;
    }
    // Of a spectrum that was computed powers may be a little below nothing.
    sums.into_iter().map(|p| p.max(0.0)).collect()
}
