//! [`Places`]: where a block of points lies on a torus.

use super::{low_bits, spline_weights};

/// Points that are evaluated at a time.
pub const BLOCK: usize = 64;

/// Values that follow the last of a line: with these, four may be read from any place.
pub(super) const BEYOND: usize = 3;

/// Where a block of points lies along an axis of a torus: the first of each one's three coefficients, and
/// their weights.
#[derive(Debug, Clone)]
pub struct Places {
    pub(super) first: [u32; BLOCK],
    pub(super) weights: [[f32; BLOCK]; 3],
}

impl Places {
    /// All of them at the first coefficient.
    pub const NONE: Self = Self { first: [0; BLOCK], weights: [[0.0; BLOCK]; 3] };

    /// Moves the points to these positions, within 2^50 of 0, on a torus of `n` coefficients, a power of two.
    #[inline(always)]
    pub fn set(&mut self, n: usize, position: impl Fn(usize) -> f64) {
        debug_assert!(n.is_power_of_two(), "{n}");
        let [w0, w1, w2] = &mut self.weights;
        for i in 0..BLOCK {
            let (first, weights) = spline_weights(position(i));
            self.first[i] = low_bits(first) & (n as u32 - 1);
            [w0[i], w1[i], w2[i]] = weights;
        }
    }
}
