//! Seams: the delivered picture copies single pixels; this places the borders between the copied
//! pieces where they do not show.

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::search::atlas::Atlas;
use crate::search::patch::MatchImage;
use crate::search::patchmatch::{Wrap, neighbor};

/// One output pixel's source pixel (row, column).
pub type From = [u32; 2];

/// What the seams are moved on: the pixels to copy from, which may be copied, and what the output
/// should look like.
#[derive(Debug)]
pub struct Canvas<'a> {
    /// The exemplar's codes.
    pub source: &'a MatchImage,
    /// The pictures in it.
    pub atlas: &'a Atlas,
    /// Where it may be used (`None`: everywhere).
    pub usable: Option<&'a [bool]>,
    /// Output pixels that stay as they are (`None`: none).
    pub fixed: Option<&'a [bool]>,
    /// The voted output (codes), `height` x `width`.
    pub target: &'a MatchImage,
    /// Which axes of the output wrap.
    pub wrap: Wrap,
}

/// Moves the borders between pieces: every pixel at a border may continue a neighbour's piece if
/// that lowers the energy: squared difference to `target`, plus for each pair of neighbours from
/// different pieces the squared differences of both pieces on both pixels (Kwatra et al. 2003,
/// eq. 1, squared).
///
/// # Determinism
/// Pixels are updated in the two colours of a chequerboard, each from the other: same bytes for
/// any thread count. (Across the seam of a wrapped axis of odd length two pixels of one colour
/// meet; both then read the values from before.)
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn settle(ctx: &Ctx, canvas: &Canvas<'_>, from: &mut [From], sweeps: u32) -> Result<()> {
    let (h, w) = (canvas.target.height(), canvas.target.width());
    let mut other = vec![[0; 2]; from.len()];
    let (mut from, mut next) = (from, &mut other[..]);
    // An even number of times back and forth.
    for sweep in 0..2 * sweeps {
        next.par_chunks_mut(w).enumerate().try_for_each(|(y, row)| {
            let line = |d: isize| neighbor(y, d, h, canvas.wrap.y).map(|y| &from[y * w..][..w]);
            let (above, own, below) = (line(-1), &from[y * w..][..w], line(1));
            row.copy_from_slice(own);
            let inside = |x: usize| {
                let [sy, sx] = own[x];
                let is = |line: Option<&[From]>, dy: u32| {
                    line.is_none_or(|line| line[x] == [sy.wrapping_add(dy), sx])
                };
                (x > 0 && own[x - 1] == [sy, sx.wrapping_sub(1)])
                    && (x + 1 < w && own[x + 1] == [sy, sx + 1])
                    && is(above, u32::MAX)
                    && is(below, 1)
            };
            for x in ((y + sweep as usize) % 2..w).step_by(2) {
                let fixed = canvas.fixed.is_some_and(|fixed| fixed[y * w + x]);
                if !fixed && !inside(x) {
                    row[x] = canvas.best(from, h, w, y, x);
                }
            }
            ctx.step(0)
        })?;
        std::mem::swap(&mut from, &mut next);
    }
    Ok(())
}

impl Canvas<'_> {
    #[inline]
    fn best(&self, from: &[From], h: usize, w: usize, y: usize, x: usize) -> From {
        const STEPS: [(isize, isize); 4] = [(-1, 0), (0, -1), (0, 1), (1, 0)];
        let own = from[y * w + x];
        // What each neighbour's piece has at this pixel.
        let mut pieces = [None; 4];
        let mut border = false;
        for (piece, (dy, dx)) in pieces.iter_mut().zip(STEPS) {
            let ny = neighbor(y, dy, h, self.wrap.y);
            let nx = neighbor(x, dx, w, self.wrap.x);
            let (Some(ny), Some(nx)) = (ny, nx) else { continue };
            let there = from[ny * w + nx];
            border |= shifted(own, dy, dx) != Some(there);
            *piece = Some(there);
        }
        if !border {
            return own;
        }
        let mut best = (self.energy(own, &pieces, &STEPS, (y, x), i32::MAX), own);
        for (i, (dy, dx)) in STEPS.into_iter().enumerate() {
            let Some(candidate) = pieces[i].and_then(|p| shifted(p, -dy, -dx)) else { continue };
            if candidate == best.1 || !self.may_use(candidate) {
                continue;
            }
            let energy = self.energy(candidate, &pieces, &STEPS, (y, x), best.0);
            if energy < best.0 {
                best = (energy, candidate);
            }
        }
        best.1
    }

    fn may_use(&self, [y, x]: From) -> bool {
        let (y, x) = (y as usize, x as usize);
        y < self.source.height()
            && x < self.source.width()
            && self.usable.is_none_or(|u| u[y * self.source.width() + x])
    }

    #[inline]
    fn energy(
        &self,
        here: From,
        pieces: &[Option<From>; 4],
        steps: &[(isize, isize); 4],
        (y, x): (usize, usize),
        enough: i32,
    ) -> i32 {
        let color = |[y, x]: From| self.source.pixel(y as usize, x as usize);
        let own = color(here);
        let mut energy = difference(own, self.target.pixel(y, x));
        for (piece, &(dy, dx)) in pieces.iter().zip(steps) {
            if energy >= enough {
                return energy;
            }
            let Some(there) = *piece else { continue };
            let continued = shifted(here, dy, dx);
            if continued == Some(there) {
                continue;
            }
            // A piece that ends at the photo's border cannot be compared beyond it: as bad as the
            // comparison on this side alone can tell, twice.
            let beyond =
                continued.filter(|&p| self.inside(p)).map(|p| difference(color(p), color(there)));
            let behind = shifted(there, -dy, -dx)
                .filter(|&p| self.inside(p))
                .map(|p| difference(color(p), own));
            energy += SEAM
                * match (beyond, behind) {
                    (Some(a), Some(b)) => a + b,
                    (Some(a), None) | (None, Some(a)) => 2 * a,
                    (None, None) => difference(own, color(there)),
                };
        }
        energy
    }

    fn inside(&self, [y, x]: From) -> bool {
        self.atlas.view_at(y as usize, x as usize).is_some()
    }
}

/// Weight of a seam against the difference to the voted output. Less leaves specks where pieces
/// meet; more lets the pieces drift away from what the search found.
const SEAM: i32 = 2;

/// The position `dy`, `dx` away, if not negative.
#[inline]
fn shifted([y, x]: From, dy: isize, dx: isize) -> Option<From> {
    Some([y.checked_add_signed(dy as i32)?, x.checked_add_signed(dx as i32)?])
}

/// Squared difference of two colours (the fourth code is contrast and does not count).
#[inline]
fn difference(a: [u8; 4], b: [u8; 4]) -> i32 {
    (0..3)
        .map(|k| {
            let d = a[k] as i32 - b[k] as i32;
            d * d
        })
        .sum()
}
