//! [`PlaneNoise`], [`SolidNoise`]: a block of scattered points at a time, with the CPU's widest
//! instructions. All give the same bits, as no product and sum are joined.

use std::sync::Arc;

use pulp::{Simd, WithSimd};

use crate::method::noise::evaluate::{Evaluator, Filtered, position};
use crate::signal::wavelet_noise::{BLOCK, Places, Solid, Torus};

/// Positions along every axis of a block of points; beyond the last the origin.
pub(super) fn axes<const N: usize>(points: impl Iterator<Item = [f64; N]>) -> [[f64; BLOCK]; N] {
    let mut axes = [[0.0; BLOCK]; N];
    for (i, point) in points.enumerate() {
        axes.iter_mut().zip(point).for_each(|(axis, at)| axis[i] = at);
    }
    axes
}

/// Adds the noise at points of the plane, in the directions of the noise, to a block for every channel.
pub(super) struct PlaneNoise<'a> {
    pub(super) evaluator: &'a Evaluator,
    pub(super) filtered: &'a [Filtered],
    pub(super) points: &'a [[f64; BLOCK]; 2],
    pub(super) noise: &'a mut [[f32; BLOCK]],
}

impl WithSimd for PlaneNoise<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { evaluator, filtered, points: [xs, ys], noise } = self;
        let mut places = [const { Places::NONE }; 2];
        for ((channel, filtered), noise) in evaluator.channels.iter().zip(filtered).zip(noise) {
            for (t, &weight) in filtered.weights.iter().enumerate() {
                if weight != 0.0 {
                    let ([dx, dy, _], [jx, jy]) = (channel.offsets[t], evaluator.terms[t].levels);
                    places[0].set(Torus::SIDE, |i| position(xs[i], dx, jx));
                    places[1].set(Torus::SIDE, |i| position(ys[i], dy, jy));
                    evaluator.tori[t].add_block(&places, weight, noise);
                }
            }
        }
    }
}

/// Adds the noise at points in space to a block for every channel.
pub(super) struct SolidNoise<'a> {
    pub(super) evaluator: &'a Evaluator,
    pub(super) filtered: &'a [Filtered],
    /// Of each term, and by what its noise is multiplied.
    pub(super) solids: &'a [Arc<Solid>],
    pub(super) gains: &'a [f32],
    pub(super) points: &'a [[f64; BLOCK]; 3],
    /// Unit normals at the points of a surface.
    pub(super) normals: Option<&'a [[f64; 3]]>,
    pub(super) noise: &'a mut [[f32; BLOCK]],
}

impl WithSimd for SolidNoise<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { evaluator, filtered, solids, gains, points, normals, noise } = self;
        let [xs, ys, zs] = points;
        let mut places = [const { Places::NONE }; 3];
        for ((channel, filtered), noise) in evaluator.channels.iter().zip(filtered).zip(noise) {
            for (t, &weight) in filtered.weights.iter().enumerate() {
                if weight == 0.0 {
                    continue;
                }
                let ([dx, dy, dz], level) = (channel.offsets[t], evaluator.terms[t].levels[0]);
                let at = |i: usize| {
                    [(xs, dx), (ys, dy), (zs, dz)].map(|(axis, by)| position(axis[i], by, level))
                };
                if let Some(normals) = normals {
                    for (i, (sum, normal)) in noise.iter_mut().zip(normals).enumerate() {
                        *sum += weight * gains[t] * solids[t].projected(at(i), *normal);
                    }
                } else {
                    places[0].set(Solid::SIDE, |i| position(xs[i], dx, level));
                    places[1].set(Solid::SIDE, |i| position(ys[i], dy, level));
                    places[2].set(Solid::SIDE, |i| position(zs[i], dz, level));
                    solids[t].add_block(&places, weight * gains[t], noise);
                }
            }
        }
    }
}
