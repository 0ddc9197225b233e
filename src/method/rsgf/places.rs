//! [`Places`]: which places of the photo can continue the output's pattern at a place of its own.

use crate::analyze::lattice::drift::Drift;
use crate::base::rng::Rng;
use crate::image::interpolate::PARTS;
use crate::signal::basis::{Basis, coefficients, combined};

/// How often a place is drawn before all are looked through.
const TRIES: u32 = 64;

/// From a pixel of the output to the place of the photo that is shown there, in [`PARTS`]: rows, columns.
pub(super) type Offset = [i64; 2];

/// A lattice in the photo and the same lattice in the output, where it may be a little stretched.
#[derive(Debug)]
pub(super) struct Places {
    source: Basis,
    output: Basis,
    /// How far the photo's cells lie beside the lattice.
    drift: Drift,
    /// The cells that reach into the photo, and some more: the first coefficients, how many.
    cells: [(i64, usize); 2],
    /// Whether places lie between pixels.
    subpixel: bool,
}

impl Places {
    /// The places of a photo of `height` x `width`.
    pub(super) fn new(
        [source, output]: [Basis; 2],
        drift: Drift,
        (height, width): (usize, usize),
        subpixel: bool,
    ) -> Self {
        let (w, h) = (width as f64, height as f64);
        let corners = [[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]].map(|c| coefficients(source, c));
        let cells = std::array::from_fn(|k| {
            let low = corners.iter().map(|c| c[k]).fold(f64::MAX, f64::min).floor() - 1.0;
            let high = corners.iter().map(|c| c[k]).fold(f64::MIN, f64::max).ceil() + 1.0;
            (low as i64, (high - low) as usize)
        });
        Self { source, output, drift, cells, subpixel }
    }

    fn len(&self) -> usize {
        self.cells[0].1 * self.cells[1].1
    }

    /// The place in the `i`th cell that continues the output's pixel (`y`, `x`).
    fn offset(&self, i: usize, (y, x): (f64, f64)) -> Offset {
        let [a, b] = coefficients(self.output, [x, y]);
        let [(first_a, _), (first_b, n_b)] = self.cells;
        let a = a - a.floor() + (first_a + (i / n_b) as i64) as f64;
        let b = b - b.floor() + (first_b + (i % n_b) as i64) as f64;
        let ([sx, sy], [dx, dy]) = (combined(self.source, a, b), self.drift.at(a, b));
        let (sx, sy) = (sx + dx, sy + dy);
        [sy - y, sx - x].map(|v| {
            if self.subpixel { (v * PARTS as f64).round() as i64 } else { v.round() as i64 * PARTS }
        })
    }

    /// All places for the output's pixel `at` that fit.
    fn all(&self, at: (f64, f64), fits: impl Fn(Offset) -> bool) -> Vec<Offset> {
        (0..self.len()).map(|i| self.offset(i, at)).filter(|&offset| fits(offset)).collect()
    }

    /// A random place for the output's pixel `at` that `fits`; `None` if there is none.
    pub(super) fn draw(
        &self,
        rng: &mut Rng,
        at: (f64, f64),
        fits: impl Fn(Offset) -> bool,
    ) -> Option<Offset> {
        let n = self.len() as u32;
        for _ in 0..TRIES {
            let offset = self.offset(rng.below(n) as usize, at);
            if fits(offset) {
                return Some(offset);
            }
        }
        // Few fit: draw from those.
        let all = self.all(at, fits);
        (!all.is_empty()).then(|| all[rng.below(all.len() as u32) as usize])
    }

    /// Up to `count` places for the output's pixel `at` that fit: all, or as many drawn at random.
    pub(super) fn several(
        &self,
        rng: &mut Rng,
        at: (f64, f64),
        count: usize,
        fits: impl Fn(Offset) -> bool,
    ) -> Vec<Offset> {
        if self.len() > 16 * count {
            return (0..count).map_while(|_| self.draw(rng, at, &fits)).collect();
        }
        let mut all = self.all(at, fits);
        for i in 0..count.min(all.len()) {
            let j = i + rng.below((all.len() - i) as u32) as usize;
            all.swap(i, j);
        }
        all.truncate(count);
        all
    }
}
