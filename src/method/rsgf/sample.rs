//! Random sampling: which piece of the photo each sample shows.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::image::interpolate::nearest;
use crate::method::rsgf::frame::{self, Frame};
use crate::method::rsgf::grid::{Block, Side, is_sample};
use crate::method::rsgf::places::Offset;
use crate::method::rsgf::{Mosaic, rng};

const DRAW_STAGE: u32 = 0x5247_0001;
const AGREE_STAGE: u32 = 0x5247_0003;

/// The blocks diagonally beside one: the samples nearest to a sample.
const DIAGONALS: [Block; 4] = [[-1, -1], [-1, 1], [1, -1], [1, 1]];

/// The offsets of samples, by their blocks of the first round.
#[derive(Debug)]
pub(super) struct Samples(BTreeMap<Block, Offset>);

impl Samples {
    /// The offset of a sample.
    pub(super) fn at(&self, mosaic: &Mosaic, block: Block) -> Offset {
        let own = mosaic.own(block);
        mosaic.moved(own, block, self.0[&own])
    }
}

impl Mosaic<'_> {
    /// The samples in these rows of blocks and around these gaps.
    ///
    /// Each is drawn at random (paper, sec. 4.1). With more than one candidate those of odd rows are
    /// then chosen to agree with the drawn ones of even rows, and at last those of even rows to agree with
    /// these: what is shown remains a matter of chance, but cells of other sizes or colours come to lie
    /// beside their like.
    pub(super) fn samples(
        &self,
        ctx: &Ctx,
        block_rows: Range<usize>,
        gaps: &[Block],
    ) -> Result<Samples> {
        let columns = 0..self.columns.blocks as i64;
        let inside = (block_rows.start as i64..block_rows.end as i64)
            .flat_map(|r| columns.clone().map(move |c| [r, c]))
            .filter(|&block| is_sample(block));
        let around = gaps.iter().flat_map(|&gap| Side::ALL.map(|side| side.beyond(gap)));
        let wanted: BTreeSet<Block> = inside.chain(around).map(|block| self.own(block)).collect();
        let every = |blocks: &BTreeSet<Block>, one: &(dyn Fn(Block) -> Result<Offset> + Sync)| {
            let found = blocks.par_iter().map(|&block| {
                ctx.step(0)?;
                Ok((block, one(block)?))
            });
            found.collect::<Result<BTreeMap<_, _>>>().map(Samples)
        };
        let draw = |block| self.drawn(ctx, block);
        if self.plan.sample_candidates == 1 {
            return every(&wanted, &draw);
        }
        let (even, mut odd): (BTreeSet<_>, BTreeSet<_>) =
            wanted.into_iter().partition(|[r, _]| r.rem_euclid(2) == 0);
        let diagonal =
            |blocks: &BTreeSet<Block>| blocks.iter().flat_map(|&b| self.diagonal(b)).collect();
        let beside: BTreeSet<Block> = diagonal(&even);
        odd.extend(beside);
        let drawn = every(&diagonal(&odd), &draw)?;
        let mut samples = every(&odd, &|block| self.agreeing(ctx, block, &drawn))?;
        let last = every(&even, &|block| self.agreeing(ctx, block, &samples))?;
        samples.0.extend(last.0);
        Ok(samples)
    }

    /// The samples diagonally beside a sample, in the first round.
    fn diagonal(&self, [r, c]: Block) -> [Block; 4] {
        DIAGONALS.map(|[dr, dc]| self.own([r + dr, c + dc]))
    }

    /// A random place for a sample.
    fn drawn(&self, ctx: &Ctx, block: Block) -> Result<Offset> {
        let mut rng = rng(ctx, DRAW_STAGE, block);
        let drawn = self.places.draw(&mut rng, self.middle(block), |o| self.fits(block, o, 0));
        drawn.ok_or_else(|| self.nowhere(block))
    }

    /// Of several random places the one that is most like its diagonal neighbours where their windows
    /// reach over each other, around the four corners. Three quarters of what it differs by from the
    /// mean of all these places are taken off: what agrees best with four is near their mean, which
    /// spreads less than they do, so rare bricks would die out. (Half would do for colours that are
    /// normally distributed; with all of it a dark brick came twice as often.)
    fn agreeing(&self, ctx: &Ctx, block: Block, samples: &Samples) -> Result<Offset> {
        let image = &self.exemplar.image;
        let [wy, wx] = self.window(block);
        let neighbours = DIAGONALS.map(|[dr, dc]| {
            let there = [block[0] + dr, block[1] + dc];
            let offset = samples.at(self, there);
            let ([top, left], (height, width)) = (self.window(there), self.lenses(there).window());
            let columns = left - wx..left - wx + width as i64;
            (top - wy..top - wy + height as i64, columns, self.window_at(block, offset))
        });
        let wanted = Frame::new(self.lenses(block).window(), |(y, x)| {
            let at = (y as i64, x as i64);
            let reaches =
                neighbours.iter().find(|(ys, xs, _)| ys.contains(&at.0) && xs.contains(&at.1));
            let (_, _, [oy, ox]) = reaches?;
            Some(image.pixel((nearest(*oy) + at.0) as usize, (nearest(*ox) + at.1) as usize))
        });
        let mut rng = rng(ctx, AGREE_STAGE, block);
        let fits = |o: Offset| self.fits(block, o, 0);
        let count = self.plan.sample_candidates;
        let places = self.places.several(&mut rng, self.middle(block), count, fits);
        let windows: Vec<Offset> = places.iter().map(|&o| self.window_at(block, o)).collect();
        let how = (ctx.simd, self.plan.matching);
        let common = wanted.mean(image, &windows);
        let costs = |frame: &Frame| frame::costs(how, image, frame, &windows, false);
        let costs = costs(&wanted).into_iter().zip(costs(&common));
        let costs: Vec<i64> =
            costs.map(|(own, common)| 4 * own as i64 - 3 * common as i64).collect();
        let best = (0..places.len()).min_by_key(|&i| costs[i]);
        best.map(|i| places[i]).ok_or_else(|| self.nowhere(block))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::ctx::Simd;
    use crate::image::picture::{Encoding, Picture, Samples as Values};
    use crate::method::rsgf::{Exemplar, Matching, Plan, Seam};
    use crate::search::patchmatch::Wrap;

    /// A photo of noise: no two cells are alike.
    fn exemplar() -> Exemplar {
        let mut rng = crate::base::rng::Rng::new(5, 0, 0, 0);
        let values = (0..60 * 64 * 3).map(|_| rng.below(256) as u8).collect();
        let photo = Picture::new(60, 64, 3, Values::U8(values), Encoding::Data).expect("valid");
        Exemplar::new(Simd::default(), &photo, None, None)
    }

    fn plan(wraps: bool, sample_candidates: usize) -> Plan {
        let basis = [[8.0, 0.0], [2.0, 6.0]];
        Plan {
            size: (72, 96),
            wrap: Wrap { y: wraps, x: wraps },
            block: 12,
            border: 5,
            lattices: [basis, basis],
            sample_candidates,
            candidates: 4,
            tolerance: 0,
            subpixel: false,
            matching: Matching::Color,
            deform: 0,
            seam: Seam::Cut,
            feather: 0,
        }
    }

    /// Four times what a sample and those diagonally beside it differ by, pixel by pixel of the output, less
    /// three times what it differs by from the mean of all these places.
    fn disagreement(
        mosaic: &Mosaic,
        block: Block,
        offset: Offset,
        all: &[Offset],
        others: &Samples,
    ) -> i64 {
        let windows = |block: Block| (mosaic.window(block), mosaic.lenses(block).window());
        let code = |[oy, ox]: Offset, y: i64, x: i64| {
            let (y, x) = (y + nearest(oy), x + nearest(ox));
            mosaic.exemplar.image.pixel(y as usize, x as usize).map(i64::from)
        };
        let mut sum = 0;
        for [dr, dc] in DIAGONALS {
            let there = [block[0] + dr, block[1] + dc];
            let other = others.at(mosaic, there);
            let (([ay, ax], (ah, aw)), ([by, bx], (bh, bw))) = (windows(block), windows(there));
            for y in ay.max(by)..(ay + ah as i64).min(by + bh as i64) {
                for x in ax.max(bx)..(ax + aw as i64).min(bx + bw as i64) {
                    let (own, other) = (code(offset, y, x), code(other, y, x));
                    for k in 0..4 {
                        let mean: f64 = all.iter().map(|&o| code(o, y, x)[k] as f64).sum();
                        let mean = (mean / all.len() as f64 + 0.5).floor() as i64;
                        sum += 4 * (own[k] - other[k]).pow(2) - 3 * (own[k] - mean).pow(2);
                    }
                }
            }
        }
        sum
    }

    #[test]
    fn samples_agree_as_well_as_any_with_those_beside_them() {
        let (exemplar, ctx) = (exemplar(), Ctx::new(3, 1).expect("pool"));
        for wraps in [false, true] {
            // So many that all are looked at.
            let plan = plan(wraps, 10_000);
            let mosaic = Mosaic::new(&exemplar, &plan);
            let gaps = mosaic.gaps(0..mosaic.block_rows());
            let samples = mosaic.samples(&ctx, 0..mosaic.block_rows(), &gaps).expect("all fit");
            let even = samples.0.iter().filter(|([r, _], _)| r.rem_euclid(2) == 0);
            let mut compared = 0;
            for (&block, &chosen) in even {
                let mut rng = rng(&ctx, 1, block);
                let fits = |o: Offset| mosaic.fits(block, o, 0);
                let all = mosaic.places.several(&mut rng, mosaic.middle(block), 10_000, fits);
                let cost = |o: Offset| disagreement(&mosaic, block, o, &all, &samples);
                let least = all.iter().map(|&o| cost(o)).min();
                assert_eq!(Some(cost(chosen)), least, "{block:?}");
                compared += 1;
            }
            assert!(compared > 10, "{compared}");
        }
    }

    #[test]
    fn one_candidate_is_the_one_drawn() {
        let (exemplar, ctx) = (exemplar(), Ctx::new(3, 1).expect("pool"));
        let plan = plan(true, 1);
        let mosaic = Mosaic::new(&exemplar, &plan);
        let samples = mosaic.samples(&ctx, 0..2, &[]).expect("all fit");
        assert_eq!(samples.0.len(), 2 * mosaic.columns.blocks / 2);
        for (&block, &offset) in &samples.0 {
            assert_eq!(mosaic.drawn(&ctx, block).expect("fits"), offset, "{block:?}");
        }
    }
}
