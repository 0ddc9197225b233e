//! [`Field`]: for every output position the source patch that is matched to it.

use rayon::prelude::*;

use crate::base::rng::Rng;
use crate::search::phase::Phase;
use crate::search::source::Source;

/// A patch position (its top left corner) in the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pos(u32);

impl Pos {
    /// Row and column, each below 65536.
    #[inline]
    pub fn new(y: usize, x: usize) -> Self {
        debug_assert!(y < 1 << 16 && x < 1 << 16, "position out of range");
        Self(((y as u32) << 16) | x as u32)
    }

    /// Row.
    #[inline]
    pub fn y(self) -> usize {
        (self.0 >> 16) as usize
    }

    /// Column.
    #[inline]
    pub fn x(self) -> usize {
        (self.0 & 0xffff) as usize
    }

    /// The position `dy` rows and `dx` columns away, if it is one of `source`.
    #[inline]
    pub fn shifted(self, dy: isize, dx: isize, source: &Source) -> Option<Self> {
        let y = self.y().wrapping_add_signed(dy);
        let x = self.x().wrapping_add_signed(dx);
        (y < source.rows() && x < source.cols()).then(|| Self::new(y, x))
    }
}

/// Nearest-neighbour field of an output of `height` x `width` pixels: the patch centred at output
/// pixel (y, x) looks like the source patch at `pos[y * width + x]`.
#[derive(Debug, Clone)]
pub struct Field {
    /// Rows.
    pub height: usize,
    /// Columns.
    pub width: usize,
    /// One position an output pixel, row by row.
    pub pos: Vec<Pos>,
}

impl Field {
    /// Random usable positions.
    ///
    /// # Determinism
    /// Depends on `seed` alone.
    pub fn random(height: usize, width: usize, source: &Source, seed: u64) -> Self {
        const STAGE: u32 = 1;
        let item = |i: usize| source.random(&mut Rng::new(seed, STAGE, 0, i as u64));
        Self { height, width, pos: (0..height * width).into_par_iter().map(item).collect() }
    }

    /// The field with every match moved to the nearest place in phase with its pixel, where that is
    /// usable.
    #[must_use]
    pub fn in_phase(self, phase: &Phase, source: &Source) -> Self {
        let item = |(i, pos): (usize, Pos)| {
            let near = phase.near(source, (i / self.width, i % self.width), pos);
            if source.is_usable(near) { near } else { pos }
        };
        Self { pos: self.pos.into_par_iter().enumerate().map(item).collect(), ..self }
    }

    /// The field of the next finer level, whose source is `source` and was `coarse`: each position
    /// keeps its view and its offset, scaled, so that regions that were copied in one piece stay in
    /// one piece.
    #[must_use]
    pub fn upsampled(
        &self,
        (height, width): (usize, usize),
        coarse: &Source,
        source: &Source,
        seed: u64,
    ) -> Self {
        const STAGE: u32 = 2;
        let half = (source.patch / 2) as isize;
        // Round(offset * fine / coarse) in integers, half away from zero.
        let scale = |offset: isize, fine: usize, coarse: usize| {
            let (fine, coarse) = (fine as isize, coarse as isize);
            let doubled = 2 * offset * fine;
            (doubled + doubled.signum() * coarse) / (2 * coarse)
        };
        let item = |i: usize| {
            let (y, x) = (i / width, i % width);
            let (cy, cx) =
                ((2 * y + 1) * self.height / (2 * height), (2 * x + 1) * self.width / (2 * width));
            let from = self.pos[cy * self.width + cx];
            // A usable patch lies in a view.
            let view = coarse.atlas.view_at(from.y(), from.x()).unwrap_or(0);
            let (y0, x0) = coarse.atlas.views()[view].corner;
            let dy = (from.y() - y0) as isize + half - cy as isize;
            let dx = (from.x() - x0) as isize + half - cx as isize;
            let ty = y as isize + scale(dy, height, self.height) - half;
            let tx = x as isize + scale(dx, width, self.width) - half;
            let view = &source.atlas.views()[view];
            let last = |side: usize| (side - source.patch) as isize;
            let pos = Pos::new(
                view.corner.0 + ty.clamp(0, last(view.size.0)) as usize,
                view.corner.1 + tx.clamp(0, last(view.size.1)) as usize,
            );
            if source.is_usable(pos) {
                pos
            } else {
                source.random(&mut Rng::new(seed, STAGE, height as u32, i as u64))
            }
        };
        Self { height, width, pos: (0..height * width).into_par_iter().map(item).collect() }
    }
}
