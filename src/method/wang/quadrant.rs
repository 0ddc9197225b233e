//! A quarter of a tile: the samples of the two edges that it touches, joined.

use crate::method::wang::{Offset, Samples};
use crate::search::cut::Division;
use crate::search::patch::MatchImage;

/// Side of the squares in which a cut is first looked for.
const STEP: usize = 4;

/// A quarter of a tile, between a corner of it and its middle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quadrant {
    /// Height and width of the tile.
    tile: (usize, usize),
    is_lower: bool,
    is_right: bool,
}

impl Quadrant {
    /// All four, row by row.
    pub(super) fn all(tile: (usize, usize)) -> [Self; 4] {
        [(false, false), (false, true), (true, false), (true, true)]
            .map(|(is_lower, is_right)| Self { tile, is_lower, is_right })
    }

    /// Row and column of its first pixel.
    pub(super) fn corner(&self) -> (usize, usize) {
        let (h, w) = self.tile;
        (if self.is_lower { h / 2 } else { 0 }, if self.is_right { w / 2 } else { 0 })
    }

    /// Its height and width.
    pub(super) fn size(&self) -> (usize, usize) {
        let ((h, w), (y, x)) = (self.tile, self.corner());
        (if self.is_lower { h - y } else { h / 2 }, if self.is_right { w - x } else { w / 2 })
    }

    /// From the tile's pixels to the photo's, if the tile shows the sample of its horizontal edge. A
    /// sample lies to both sides of its edge; its offset is where the tile below it begins.
    pub(super) fn horizontal(&self, [y, x]: Offset) -> Offset {
        [if self.is_lower { y - self.tile.0 as i64 } else { y }, x]
    }

    /// The same of its vertical edge, whose offset is where the tile on the right begins.
    pub(super) fn vertical(&self, [y, x]: Offset) -> Offset {
        [y, if self.is_right { x - self.tile.1 as i64 } else { x }]
    }

    /// The photo's pixels, row by row, of this quadrant with edges of these colours. Along the edges it
    /// shows their samples; from the corner to the middle runs the cut where it shows least. And how much
    /// it shows.
    pub(super) fn joined(
        &self,
        image: &MatchImage,
        samples: &Samples,
        (horizontal, vertical): (usize, usize),
    ) -> (Vec<[u32; 2]>, i64) {
        let (h, w) = self.size();
        let (top, left) = self.corner();
        let across = self.horizontal(samples.horizontal[horizontal]);
        let down = self.vertical(samples.vertical[vertical]);
        let from = |[y, x]: Offset, p: usize| {
            [(y + (top + p / w) as i64) as u32, (x + (left + p % w) as i64) as u32]
        };
        let apart: Vec<i32> =
            (0..h * w).map(|p| difference(image, from(across, p), from(down, p))).collect();
        let mut division = Division::new(h, w);
        for p in 0..h * w {
            let (y, x) = (p / w, p % w);
            for (below, q, ends) in [(false, p + 1, x + 1 == w), (true, p + w, y + 1 == h)] {
                if !ends {
                    let both = apart[p] + apart[q];
                    division.pair((y, x), below, [0, both, both]);
                }
            }
        }
        // The tile's edge, and its middle line, beyond which the sample goes on in the next quadrant.
        let (edge_y, middle_y) = if self.is_lower { (h - 1, 0) } else { (0, h - 1) };
        let (edge_x, middle_x) = if self.is_right { (w - 1, 0) } else { (0, w - 1) };
        (0..w).for_each(|x| division.bind((middle_y, x), false));
        (0..h).for_each(|y| division.bind((y, edge_x), false));
        (0..w).for_each(|x| division.bind((edge_y, x), true));
        (0..h).for_each(|y| division.bind((y, middle_x), true));
        let inside = division.solve_by_steps(STEP);
        let parted = |p: usize, q: usize| {
            if inside[p] == inside[q] { 0 } else { i64::from(apart[p] + apart[q]) }
        };
        let shown = (0..h * w).map(|p| {
            let right = if (p + 1) % w > 0 { parted(p, p + 1) } else { 0 };
            right + if p + w < h * w { parted(p, p + w) } else { 0 }
        });
        let pixels = (0..h * w).map(|p| from(if inside[p] { across } else { down }, p)).collect();
        (pixels, shown.sum())
    }
}

/// How much the eye is caught by one pixel in place of another.
#[inline]
pub(super) fn difference(image: &MatchImage, a: [u32; 2], b: [u32; 2]) -> i32 {
    let at = |[y, x]: [u32; 2]| image.pixel(y as usize, x as usize);
    at(a).iter().zip(at(b)).map(|(&a, b)| i32::from(a.abs_diff(b))).sum()
}
