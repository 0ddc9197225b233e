//! Random sampling and gap filling: near-regular textures of any size from patches of a photo that
//! lie where its lattice says.

mod deform;
mod exemplar;
mod frame;
mod grid;
mod paint;
mod places;
mod sample;
mod seam;
mod subpixel;

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::rng::Rng;
use crate::image::interpolate::{PARTS, nearest};
use crate::search::patchmatch::Wrap;
use crate::signal::basis::Basis;
pub use exemplar::Exemplar;
use frame::Frame;
use grid::{Axis, Block, Lenses, Side, is_sample, nearest_side};
pub use paint::Strip;
use places::{Offset, Places};
use sample::Samples;

/// How two patches are joined where they overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seam {
    /// By the division of least visible difference, wherever the patches overlap (graph cut).
    Graph,
    /// By the path of least visible difference along each side (minimum-error boundary cut).
    Cut,
    /// Faded into each other, as in the paper.
    Linear,
}

/// By what a gap's patch is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Matching {
    /// Squared differences of colours.
    Color,
    /// Normalized cross-correlation.
    Correlation,
}

/// What is to be made.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Height and width of the output.
    pub size: (usize, usize),
    /// On which axes it repeats.
    pub wrap: Wrap,
    /// Side of a block.
    pub block: usize,
    /// How far patches reach over their block; at most half of it.
    pub border: usize,
    /// The lattice in the photo, and in the output, where it may be a little stretched.
    pub lattices: [Basis; 2],
    /// How many places on the lattice are tried for a sample: of these the one that agrees best with the
    /// samples around it is taken. With 1 it is drawn, as in the paper.
    pub sample_candidates: usize,
    /// How many places on the lattice are tried for a gap.
    pub candidates: usize,
    /// How far from its place on the lattice a gap's patch may lie.
    pub tolerance: usize,
    /// Whether pieces lie where the lattice says, between pixels, or at the nearest ones.
    pub subpixel: bool,
    /// By what it is chosen.
    pub matching: Matching,
    /// How far it may be bent to meet its neighbours.
    pub deform: usize,
    /// How it is joined to them.
    pub seam: Seam,
    /// How far the sides of a cut are faded into each other.
    pub feather: usize,
}

/// A place of the photo in [`PARTS`]: row, column. Whole pixels but for [`Plan::subpixel`].
type Place = [i32; 2];

/// A filled gap: of every pixel of its window, row by row, what of the photo it shows and how much of
/// the gap is in it, in 255ths.
#[derive(Debug)]
struct Filled {
    places: Vec<Place>,
    shares: Vec<u8>,
}

const GAP_STAGE: u32 = 0x5247_0002;

/// Everything that a run shares.
#[derive(Debug)]
pub struct Mosaic<'a> {
    exemplar: &'a Exemplar,
    plan: &'a Plan,
    places: Places,
    rows: Axis,
    columns: Axis,
}

impl<'a> Mosaic<'a> {
    /// The blocks of an output.
    pub fn new(exemplar: &'a Exemplar, plan: &'a Plan) -> Self {
        let size = (exemplar.image.height(), exemplar.image.width());
        Self {
            exemplar,
            plan,
            places: Places::new(plan.lattices, exemplar.drift.clone(), size, plan.subpixel),
            rows: Axis::new(plan.size.0, plan.block, plan.wrap.y),
            columns: Axis::new(plan.size.1, plan.block, plan.wrap.x),
        }
    }

    /// How many rows of blocks there are.
    pub fn block_rows(&self) -> usize {
        self.rows.blocks
    }

    /// Steps of progress that [`strip`](Self::strip) counts for these rows of blocks.
    pub fn work(&self, block_rows: std::ops::Range<usize>) -> u64 {
        2 * self.gaps(block_rows).len() as u64
    }

    fn own(&self, [r, c]: Block) -> Block {
        [self.rows.own(r), self.columns.own(c)]
    }

    fn corner(&self, [r, c]: Block) -> [i64; 2] {
        [self.rows.edge(r), self.columns.edge(c)]
    }

    fn lenses(&self, [r, c]: Block) -> Lenses {
        let height = (self.rows.edge(r + 1) - self.rows.edge(r)) as usize;
        let width = (self.columns.edge(c + 1) - self.columns.edge(c)) as usize;
        Lenses { size: (height, width), border: self.plan.border.min(height / 2).min(width / 2) }
    }

    /// The middle of a block.
    fn middle(&self, block: Block) -> (f64, f64) {
        let [y, x] = self.corner(block);
        let (height, width) = self.lenses(block).size;
        (y as f64 + height as f64 / 2.0, x as f64 + width as f64 / 2.0)
    }

    /// The window's corner in the output.
    fn window(&self, block: Block) -> [i64; 2] {
        let border = self.lenses(block).border as i64;
        self.corner(block).map(|v| v - border)
    }

    /// The window's corner in the photo under an offset.
    fn window_at(&self, block: Block, offset: Offset) -> Offset {
        let [y, x] = self.window(block);
        [y * PARTS + offset[0], x * PARTS + offset[1]]
    }

    /// Whether a patch of a block can be copied from there.
    fn fits(&self, block: Block, offset: Offset, margin: usize) -> bool {
        self.exemplar.fits(self.window_at(block, offset), self.lenses(block).window(), margin)
    }

    /// What a block's offset is for the same block one round away.
    fn moved(&self, from: Block, to: Block, [y, x]: Offset) -> Offset {
        let (a, b) = (self.corner(from), self.corner(to));
        [y + (a[0] - b[0]) * PARTS, x + (a[1] - b[1]) * PARTS]
    }

    fn nowhere(&self, block: Block) -> Error {
        let (height, width) = self.lenses(block).window();
        Error::BadPicture {
            what: "the photo".into(),
            reason: format!(
                "at some place of the lattice it has no usable {width}x{height} pixels (a block and \
                 its border); choose a smaller block or use more of the photo"
            ),
        }
    }

    /// The offsets of the samples around a gap, in the order of [`Side::ALL`].
    fn around(&self, samples: &Samples, block: Block) -> [Offset; 4] {
        Side::ALL.map(|side| samples.at(self, side.beyond(block)))
    }

    /// Gap filling (paper, sec. 4.2): the offset of the patch whose frame fits best.
    fn fill(&self, ctx: &Ctx, samples: &Samples, block: Block) -> Result<Offset> {
        let lenses = self.lenses(block);
        let window = lenses.window();
        let image = &self.exemplar.image;
        let corners = self.around(samples, block).map(|o| self.window_at(block, o));
        let frame = Frame::new(window, |(y, x)| {
            let (side, _) = lenses.at((y, x))?;
            let [wy, wx] = corners[side as usize];
            Some(image.pixel((nearest(wy) + y as i64) as usize, (nearest(wx) + x as i64) as usize))
        });
        let mut rng = rng(ctx, GAP_STAGE, block);
        let (candidates, bend) = (self.plan.candidates, self.plan.deform);
        let fits = |o: Offset| self.fits(block, o, bend);
        let places = self.places.several(&mut rng, self.middle(block), candidates, fits);
        let places: Vec<Offset> = places.iter().map(|&o| self.window_at(block, o)).collect();
        let how = (ctx.simd, self.plan.matching);
        let found = frame::nearest(how, image, &frame, &places, self.plan.tolerance, |place| {
            self.exemplar.fits(place, window, bend)
        });
        let mut found = found.ok_or_else(|| self.nowhere(block))?;
        if self.plan.subpixel && self.plan.tolerance > 0 {
            let refined = subpixel::refined(image, &lenses, &corners, found);
            found = if self.exemplar.fits(refined, window, bend) { refined } else { found };
        }
        let [wy, wx] = self.window_at(block, [0, 0]);
        Ok([found[0] - wy, found[1] - wx])
    }

    /// The gaps that reach into these rows of blocks, and those that these have to know. Beyond a border
    /// that does not wrap there are none: samples alone reach over it.
    fn gaps(&self, block_rows: std::ops::Range<usize>) -> Vec<Block> {
        let within = |range: std::ops::Range<i64>, axis: &Axis| {
            let all = 0..axis.blocks as i64;
            if axis.wraps { range } else { range.start.max(all.start)..range.end.min(all.end) }
        };
        let rows = within(block_rows.start as i64 - 2..block_rows.end as i64 + 2, &self.rows);
        let columns = within(-2..self.columns.blocks as i64 + 2, &self.columns);
        rows.flat_map(|r| columns.clone().map(move |c| [r, c])).filter(|&b| !is_sample(b)).collect()
    }

    /// Fills gaps that do not reach into each other.
    fn filled(
        &self,
        ctx: &Ctx,
        samples: &Samples,
        blocks: &[(Block, Offset)],
        before: &BTreeMap<Block, Filled>,
    ) -> Result<Vec<(Block, Filled)>> {
        let one = |&(block, offset): &(Block, Offset)| {
            let (image, lenses) = (&self.exemplar.image, self.lenses(block));
            let old = self.old(samples, block, before);
            let corner = self.window_at(block, offset).map(|v| v as i32);
            let places = deform::bent(image, &lenses, corner, &old, self.plan.deform);
            // The windows' rims are not the gap's, and stay so.
            let reach = self.plan.feather.min(lenses.border.saturating_sub(1));
            let feathered = |cut: Vec<u8>| seam::feathered(&lenses, &cut, reach);
            let shares = match self.plan.seam {
                Seam::Graph => feathered(seam::cut_by_graph(image, &lenses, &places, &old)),
                Seam::Cut => feathered(seam::cut_along_sides(image, &lenses, &places, &old)),
                Seam::Linear => seam::faded(&lenses),
            };
            ctx.step(1)?;
            Ok((block, Filled { places, shares }))
        };
        blocks.par_iter().map(one).collect()
    }

    /// What lies in a gap's window before the gap is joined: samples, and the gaps `before`.
    fn old(&self, samples: &Samples, block: Block, before: &BTreeMap<Block, Filled>) -> Vec<Place> {
        let lenses = self.lenses(block);
        let window = lenses.window();
        let around = self.around(samples, block);
        let [wy, wx] = self.window(block);
        let beyond = |i: usize, n: usize| match i.checked_sub(lenses.border) {
            None => -1,
            Some(i) => i64::from(i >= n),
        };
        let place = |(y, x): (usize, usize)| {
            let (oy, ox) = (wy + y as i64, wx + x as i64);
            let side = match [beyond(y, lenses.size.0), beyond(x, lenses.size.1)] {
                [-1, 0] => Side::Top,
                [1, 0] => Side::Bottom,
                [0, -1] => Side::Left,
                [0, 1] => Side::Right,
                [dr, dc] => {
                    // In this gap or in one at a corner: the sample that is nearest there.
                    let there = [block[0] + dr, block[1] + dc];
                    let [cy, cx] = self.corner(there);
                    let at = ((oy - cy) as usize, (ox - cx) as usize);
                    let sample = nearest_side(self.lenses(there).size, at).beyond(there);
                    Side::ALL.into_iter().find(|s| s.beyond(block) == sample).unwrap_or(Side::Top)
                }
            };
            let [dy, dx] = around[side as usize];
            [(oy * PARTS + dy) as i32, (ox * PARTS + dx) as i32]
        };
        let mut old: Vec<Place> = pixels(window).map(place).collect();
        for corner in [[-1, -1], [-1, 1], [1, -1], [1, 1]] {
            let there = [block[0] + corner[0], block[1] + corner[1]];
            let Some(gap) = before.get(&there) else { continue };
            let [gy, gx] = self.window(there);
            let size = self.lenses(there).window();
            let all = pixels(size).zip(gap.places.iter().zip(&gap.shares));
            for ((y, x), (&place, _)) in all.filter(|(_, (_, share))| **share >= 128) {
                let (y, x) = (gy + y as i64 - wy, gx + x as i64 - wx);
                if (0..window.0 as i64).contains(&y) && (0..window.1 as i64).contains(&x) {
                    old[y as usize * window.1 + x as usize] = place;
                }
            }
        }
        old
    }

    /// The rows of the output that some rows of blocks cover. All strips together are the whole, however
    /// it is divided.
    ///
    /// # Errors
    /// [`Error::BadPicture`] if nothing fits at some place, [`Error::Cancelled`].
    pub fn strip(&self, ctx: &Ctx, block_rows: std::ops::Range<usize>) -> Result<Strip> {
        let gaps = self.gaps(block_rows.clone());
        let samples = self.samples(ctx, block_rows.clone(), &gaps)?;
        let offsets = gaps.par_iter().map(|&block| {
            let own = self.own(block);
            let offset = self.moved(own, block, self.fill(ctx, &samples, own)?);
            ctx.step(1)?;
            Ok((block, offset))
        });
        let offsets: Vec<(Block, Offset)> = offsets.collect::<Result<_>>()?;
        // First the gaps of every other row: they do not reach into each other. Then the others, which
        // see what the first have come to, where seams may go anywhere.
        let (mut first, mut second) = (offsets.clone(), offsets);
        first.retain(|([r, _], _)| r.rem_euclid(2) == 0);
        second.retain(|([r, _], _)| r.rem_euclid(2) == 1);
        let first: BTreeMap<Block, Filled> =
            self.filled(ctx, &samples, &first, &BTreeMap::new())?.into_iter().collect();
        let before = if self.plan.seam == Seam::Graph { &first } else { &BTreeMap::new() };
        let second = self.filled(ctx, &samples, &second, before)?;
        let filled: Vec<(Block, Filled)> = first.into_iter().chain(second).collect();
        self.painted(ctx, block_rows, &samples, &filled)
    }
}

/// Random numbers for one block.
fn rng(ctx: &Ctx, stage: u32, [r, c]: Block) -> Rng {
    Rng::new(ctx.seed, stage, 0, ((r as u64) << 32) | (c as u64 & 0xffff_ffff))
}

/// The pixels of a rectangle, row by row.
fn pixels((height, width): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    (0..height).flat_map(move |y| (0..width).map(move |x| (y, x)))
}
