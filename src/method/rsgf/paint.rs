//! Samples and filled gaps become rows of the output.

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::image::interpolate::{Fraction, PARTS, fraction, nearest};
use crate::method::rsgf::grid::{Block, is_sample, nearest_side};
use crate::method::rsgf::sample::Samples;
use crate::method::rsgf::{Filled, Mosaic, Seam};

/// Some rows of the output.
#[derive(Debug)]
pub struct Strip {
    /// The first row.
    pub first: usize,
    /// The photo's row and column of every pixel, row by row.
    pub from: Vec<[u32; 2]>,
    /// How far beside it the pixel lies. Empty if nothing does.
    pub beside: Vec<Fraction>,
    /// What each pixel is mixed with: the photo's row and column, and how much of it in 255ths. Empty
    /// if nothing is mixed.
    pub mixed: Vec<([u32; 2], u8)>,
    /// How far beside that this lies.
    pub mixed_beside: Vec<Fraction>,
}

impl Mosaic<'_> {
    /// Puts samples and gaps together, the gaps in this order.
    pub(super) fn painted(
        &self,
        ctx: &Ctx,
        block_rows: std::ops::Range<usize>,
        samples: &Samples,
        filled: &[(Block, Filled)],
    ) -> Result<Strip> {
        let (height, width) = self.plan.size;
        let rows = block_rows.start as i64..block_rows.end as i64;
        let bottom = |r: i64| (self.rows.edge(r) as usize).min(height);
        let begin = bottom(rows.start);
        let mut from = vec![[0; 2]; (bottom(rows.end) - begin) * width];
        let mixes = self.plan.seam == Seam::Linear || self.plan.feather > 0;
        let mut mixed = vec![([0; 2], 0); if mixes { from.len() } else { 0 }];
        // A row of blocks each, so that they can be painted side by side.
        let mut bands = Vec::new();
        let (mut from_rest, mut mixed_rest) = (&mut from[..], &mut mixed[..]);
        for r in rows {
            let n = (bottom(r + 1) - bottom(r)) * width;
            let (own, rest) = from_rest.split_at_mut(n);
            from_rest = rest;
            let (own_mixed, rest) = mixed_rest.split_at_mut(if mixes { n } else { 0 });
            mixed_rest = rest;
            bands.push((r, own, own_mixed));
        }
        bands.into_par_iter().try_for_each(|(r, from, mixed)| {
            let top = bottom(r) as i64;
            let rows = top..bottom(r + 1) as i64;
            for c in 0..self.columns.blocks as i64 {
                self.paint_samples(samples, [r, c], &rows, from);
            }
            for (place, mixed) in from.iter().zip(mixed.iter_mut()) {
                *mixed = unmixed(*place);
            }
            for (block, gap) in filled.iter().filter(|([row, _], _)| row.abs_diff(r) <= 1) {
                let [wy, wx] = self.window(*block);
                let window = self.lenses(*block).window();
                for (y, line) in (wy..).zip(0..window.0).filter(|(y, _)| rows.contains(y)) {
                    let columns = wx.max(0)..(wx + window.1 as i64).min(width as i64);
                    for x in columns {
                        let i = line * window.1 + (x - wx) as usize;
                        let share = gap.shares[i];
                        if share == 0 {
                            continue;
                        }
                        let k = (y - top) as usize * width + x as usize;
                        let (old, new) = (from[k], gap.places[i].map(|v| v as u32));
                        from[k] = if share >= 128 { new } else { old };
                        if mixes {
                            mixed[k] = match share {
                                255 => unmixed(new),
                                128..255 => (old, 255 - share),
                                _ => (new, share),
                            };
                        }
                    }
                }
            }
            ctx.step(0)
        })?;
        let split = |place: &mut [u32; 2]| {
            let beside = place.map(|v| fraction(v.into()));
            *place = place.map(|v| nearest(v.into()) as u32);
            beside
        };
        let whole = from.par_iter_mut().map(split);
        let whole_mixed = mixed.par_iter_mut().map(|(place, _)| split(place));
        let (beside, mixed_beside) = if self.plan.subpixel {
            (whole.collect(), whole_mixed.collect())
        } else {
            whole.for_each(drop);
            whole_mixed.for_each(drop);
            (Vec::new(), Vec::new())
        };
        Ok(Strip { first: begin, from, beside, mixed, mixed_beside })
    }

    /// A block of one sample, or a gap's of the four around it as far as they reach.
    fn paint_samples(
        &self,
        samples: &Samples,
        block: Block,
        rows: &std::ops::Range<i64>,
        from: &mut [[u32; 2]],
    ) {
        let width = self.plan.size.1;
        let [y0, x0] = self.corner(block);
        let size = self.lenses(block).size;
        let sample = is_sample(block).then(|| samples.at(self, block));
        let around = if sample.is_none() { self.around(samples, block) } else { [[0; 2]; 4] };
        for y in y0..(y0 + size.0 as i64).min(rows.end) {
            for x in x0..(x0 + size.1 as i64).min(width as i64) {
                let at = ((y - y0) as usize, (x - x0) as usize);
                let [oy, ox] = sample.unwrap_or_else(|| around[nearest_side(size, at) as usize]);
                from[(y - rows.start) as usize * width + x as usize] =
                    [(y * PARTS + oy) as u32, (x * PARTS + ox) as u32];
            }
        }
    }
}

/// A place mixed with nothing: it is not even known where that would come from. A whole pixel, as such are
/// the quickest to read.
fn unmixed(place: [u32; 2]) -> ([u32; 2], u8) {
    (place.map(|v| (nearest(v.into()) * PARTS) as u32), 0)
}
