//! A lattice fitted to all peaks that belong to it.

use super::Candidate;
use super::field::Field;
use super::pairs::{goodness, multiples, summit};
use crate::signal::basis::{Basis, area, combined, dot, reduced};

/// Multiples up to this coefficient take part in the first fit, the second, and so on: near peaks
/// must be hit before the far ones can be.
const GROWTH: [f64; 4] = [1.0, 2.0, 4.0, 100.0];

/// A peak is looked for this far from where it should be, as a share of the shorter vector, and in
/// pixels at least and at most.
const NEAR: f64 = 0.2;
const NEAR_PIXELS: (f64, f64) = (2.0, 12.0);

/// The basis fitted to the peaks by least squares, weighted with correlation and overlap, reduced.
/// Unchanged where the peaks do not determine it.
pub(super) fn fitted(field: &Field, basis: Basis) -> Basis {
    let mut fit = basis;
    for most in GROWTH {
        let near = (NEAR * dot(fit[0], fit[0]).min(dot(fit[1], fit[1])).sqrt())
            .clamp(NEAR_PIXELS.0, NEAR_PIXELS.1) as isize;
        // Normal equations: of the coefficients, and with the two components of the peaks.
        let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
        let mut sums = [[0.0; 2]; 2];
        multiples(field, fit, |[a, b], at, overlap| {
            if a.abs() > most || b.abs() > most {
                return;
            }
            let Some((peak, value)) = peak(field, at, near) else { return };
            let weight = value * overlap;
            aa += weight * a * a;
            ab += weight * a * b;
            bb += weight * b * b;
            for k in 0..2 {
                sums[0][k] += weight * a * peak[k];
                sums[1][k] += weight * b * peak[k];
            }
        });
        let det = aa * bb - ab * ab;
        if det <= 1e-6 * (aa + bb).powi(2) {
            return basis;
        }
        let solve = |k: usize| {
            let [p, q] = [sums[0][k], sums[1][k]];
            [(bb * p - ab * q) / det, (aa * q - ab * p) / det]
        };
        let (x, y) = (solve(0), solve(1));
        fit = [[x[0], y[0]], [x[1], y[1]]];
        if area(fit) < 0.5 * area(basis) {
            return basis;
        }
    }
    reduced(fit)
}

/// The candidate with its basis fitted; as it was, if that is no better.
pub(super) fn improved(field: &Field, candidate: Candidate) -> Candidate {
    match goodness(field, fitted(field, candidate.basis), None, &mut Vec::new()) {
        Some(fit) if fit.goodness >= candidate.goodness => fit,
        _ => candidate,
    }
}

/// The highest correlation within `near` of a displacement, if it is a local maximum, and its value.
pub(super) fn peak(field: &Field, at: [f64; 2], near: isize) -> Option<([f64; 2], f64)> {
    let (x0, y0) = (at[0].round() as isize, at[1].round() as isize);
    let margin = (near + 1) as f64;
    if !field.covers([at[0].abs() + margin, at[1].abs() + margin]) {
        return None;
    }
    let (mut best, mut value) = ((0, 0), f64::NEG_INFINITY);
    for dy in -near..=near {
        for dx in -near..=near {
            let v = field.correlation(y0 + dy, x0 + dx);
            if v > value {
                (best, value) = ((dy, dx), v);
            }
        }
    }
    let inside = best.0.abs() < near && best.1.abs() < near;
    (inside && value > 0.0).then(|| (summit(field, y0 + best.0, x0 + best.1), value))
}

/// The basis fitted to a field of another scale, where `scale` says what its pixels are in those
/// of the basis; `None` if the fit went astray.
pub(super) fn sharpened(field: &Field, basis: Basis, scale: [f64; 2]) -> Option<Basis> {
    let there = basis.map(|v| [v[0] * scale[0], v[1] * scale[1]]);
    let fit = fitted(field, there);
    // In coefficients of the old basis the new vectors are nearly (1, 0) and (0, 1) again.
    let near = |v: [f64; 2], want: [f64; 2]| {
        let off = combined(there, want[0], want[1]);
        let length = dot(there[0], there[0]).sqrt();
        libm::hypot(v[0] - off[0], v[1] - off[1]) < 0.05 * length
    };
    (near(fit[0], [1.0, 0.0]) && near(fit[1], [0.0, 1.0]))
        .then(|| fit.map(|v| [v[0] / scale[0], v[1] / scale[1]]))
}
