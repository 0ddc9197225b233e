//! Random sampling and gap filling: near-regular textures of any size from patches of a photo that
//! lie where its lattice says.

mod gap;
mod grid;
mod places;

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::analyze::lattice::drift::Drift;
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::rng::Rng;
use crate::image::color::ColorModel;
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::search::cut::{self, Division};
use crate::search::patch::MatchImage;
use crate::search::patch::codes::Codes;
use crate::signal::basis::Basis;
use crate::signal::resample::resized;
use gap::Frame;
use grid::{Axis, Block, Lenses, Side, is_sample, nearest_side};
use places::{Offset, Places};

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

/// What is to be made.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Height and width of the output.
    pub size: (usize, usize),
    /// Whether it repeats.
    pub tileable: bool,
    /// Side of a block.
    pub block: usize,
    /// How far patches reach over their block.
    pub border: usize,
    /// The lattice in the photo, and in the output.
    pub source: Basis,
    /// The lattice in the output, where it may be a little stretched.
    pub output: Basis,
    /// How far from their place on the lattice gap patches may lie.
    pub tolerance: usize,
    /// How many places on the lattice are tried for a gap.
    pub candidates: usize,
    /// How patches are joined.
    pub seam: Seam,
}

/// The photo in the matching space.
#[derive(Debug)]
pub struct Exemplar {
    image: MatchImage,
    /// How far its cells lie beside the lattice.
    drift: Drift,
    /// How many pixels above and left of each are not usable; `None` if all are.
    unusable: Option<Vec<u32>>,
}

impl Exemplar {
    /// The photo, and where it may be used.
    pub fn new(photo: &Picture, mask: Option<&Mask>, lattice: Option<Basis>) -> Self {
        let size = (photo.height(), photo.width());
        let model = ColorModel::new(photo);
        let pixels = model.averaging_pixels(photo);
        let usable = mask.map(Mask::usable);
        let codes = Codes::covering(&[(&pixels, usable)], model.space());
        let image = codes.image(&pixels, size, model.space());
        let unusable = usable.map(|usable| {
            let (h, w) = size;
            let mut sums = vec![0; (h + 1) * (w + 1)];
            for y in 0..h {
                let mut row = 0;
                for x in 0..w {
                    row += u32::from(!usable[y * w + x]);
                    sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
                }
            }
            sums
        });
        let drift = lattice.map_or_else(Drift::none, |basis| {
            Drift::measured(basis, size, |scale| {
                let to = [size.0, size.1].map(|n| (n as f64 * scale).round().max(1.0) as usize);
                let small = resized(&pixels, size, (to[0], to[1]));
                codes.image(&small, (to[0], to[1]), model.space())
            })
        });
        Self { image, drift, unusable }
    }

    /// Whether a window with this top left corner can be copied.
    fn fits(&self, [y, x]: Offset, (height, width): (usize, usize)) -> bool {
        let (h, w) = (self.image.height() as i64, self.image.width() as i64);
        if y < 0 || x < 0 || y + height as i64 > h || x + width as i64 > w {
            return false;
        }
        let Some(sums) = &self.unusable else { return true };
        let at = |y: usize, x: usize| sums[y * (w as usize + 1) + x];
        let (y, x) = (y as usize, x as usize);
        at(y + height, x + width) + at(y, x) == at(y + height, x) + at(y, x + width)
    }
}

/// Some rows of the output.
#[derive(Debug)]
pub struct Strip {
    /// The first row.
    pub first: usize,
    /// The photo's row and column of every pixel, row by row.
    pub from: Vec<[u32; 2]>,
    /// What each pixel is mixed with: the photo's row and column, and how much of it in 255ths. Empty
    /// if nothing is mixed.
    pub mixed: Vec<([u32; 2], u8)>,
}

/// A filled gap.
#[derive(Debug)]
struct Filled {
    offset: Offset,
    /// How much of every pixel of the window is the gap's, in 255ths.
    share: Vec<u8>,
}

/// Side of the squares in which seams are first looked for. Larger is faster and finds fewer detours.
const STEP: usize = 4;

const SAMPLE_STAGE: u32 = 0x5247_0001;
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
        let axis = |side| Axis::new(side, plan.block, plan.tileable);
        Self {
            exemplar,
            plan,
            places: Places::new(plan.source, plan.output, exemplar.drift.clone(), size),
            rows: axis(plan.size.0),
            columns: axis(plan.size.1),
        }
    }

    /// How many rows of blocks there are.
    pub fn block_rows(&self) -> usize {
        self.rows.blocks
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
        Lenses { size: (height, width), border: self.plan.border }
    }

    fn rng(&self, ctx: &Ctx, stage: u32, [r, c]: Block) -> Rng {
        Rng::new(ctx.seed, stage, 0, ((r as u64) << 32) | (c as u64 & 0xffff_ffff))
    }

    /// The middle of a block.
    fn middle(&self, block: Block) -> (f64, f64) {
        let [y, x] = self.corner(block);
        let (height, width) = self.lenses(block).size;
        (y as f64 + height as f64 / 2.0, x as f64 + width as f64 / 2.0)
    }

    /// The window's corner in the photo.
    fn window_at(&self, block: Block, offset: Offset) -> Offset {
        let [y, x] = self.corner(block);
        let border = self.plan.border as i64;
        [y + offset[0] - border, x + offset[1] - border]
    }

    /// Whether a patch of a block can be copied from there.
    fn fits(&self, block: Block, offset: Offset) -> bool {
        self.exemplar.fits(self.window_at(block, offset), self.lenses(block).window())
    }

    /// Random sampling (paper, sec. 4.1).
    fn sample(&self, ctx: &Ctx, block: Block) -> Result<Offset> {
        let own = self.own(block);
        let mut rng = self.rng(ctx, SAMPLE_STAGE, own);
        let drawn = self.places.draw(&mut rng, self.middle(own), |o| self.fits(own, o));
        let Some(offset) = drawn else { return Err(self.nowhere(own)) };
        Ok(self.moved(own, block, offset))
    }

    /// What a block's offset is for the same block one round away.
    fn moved(&self, from: Block, to: Block, [y, x]: Offset) -> Offset {
        let (a, b) = (self.corner(from), self.corner(to));
        [y + a[0] - b[0], x + a[1] - b[1]]
    }

    fn nowhere(&self, block: Block) -> Error {
        let (height, width) = self.lenses(block).window();
        Error::BadPicture {
            what: "the photo".into(),
            reason: format!(
                "its usable part has no {width}x{height} pixels at some place of the lattice; choose \
                 a smaller block or use more of the photo"
            ),
        }
    }

    /// The offsets of the samples around a gap, in the order of [`Side::ALL`].
    fn around(&self, ctx: &Ctx, block: Block) -> Result<[Offset; 4]> {
        let mut offsets = [[0; 2]; 4];
        for (offset, side) in offsets.iter_mut().zip(Side::ALL) {
            *offset = self.sample(ctx, side.beyond(block))?;
        }
        Ok(offsets)
    }

    /// The colour that the photo has at a pixel of a block's window under an offset.
    fn color(&self, block: Block, offset: Offset, (y, x): (usize, usize)) -> Option<[u8; 4]> {
        let [oy, ox] = self.window_at(block, offset);
        let (y, x) = (usize::try_from(oy + y as i64).ok()?, usize::try_from(ox + x as i64).ok()?);
        let image = &self.exemplar.image;
        (y < image.height() && x < image.width()).then(|| image.pixel(y, x))
    }

    /// Gap filling (paper, sec. 4.2): the offset of the patch whose frame fits best.
    fn fill(&self, ctx: &Ctx, block: Block) -> Result<Offset> {
        let lenses = self.lenses(block);
        let neighbors = self.around(ctx, block)?;
        let image = &self.exemplar.image;
        let frame = Frame::new(&lenses, |side, at| {
            self.color(block, neighbors[side as usize], at).unwrap_or_default()
        });
        let mut rng = self.rng(ctx, GAP_STAGE, block);
        let fits = |o: Offset| self.fits(block, o);
        let places = self.places.several(&mut rng, self.middle(block), self.plan.candidates, fits);
        let at: Vec<Offset> = places.iter().map(|&o| self.window_at(block, o)).collect();
        let window = lenses.window();
        let nearest =
            gap::nearest_in_color(ctx.simd, image, &frame, &at, self.plan.tolerance, |p| {
                self.exemplar.fits(p, window)
            });
        let Some(place) = nearest else { return Err(self.nowhere(block)) };
        let [wy, wx] = self.window_at(block, [0, 0]);
        Ok([place[0] - wy, place[1] - wx])
    }

    /// How much of every pixel of its window a gap takes, in 255ths: fading or cut along its sides.
    fn share_by_side(&self, ctx: &Ctx, block: Block, offset: Offset) -> Result<Vec<u8>> {
        let lenses = self.lenses(block);
        let window = lenses.window();
        let mut share: Vec<u8> = pixels(window)
            .map(|at| match lenses.at(at) {
                Some((_, depth)) => (127.5 * (depth + 1.0)).round() as u8,
                None if lenses.is_own(at) => 255,
                None => 0,
            })
            .collect();
        if self.plan.seam == Seam::Cut {
            let neighbors = self.around(ctx, block)?;
            for (side, neighbor) in Side::ALL.into_iter().zip(neighbors) {
                let between = |at| {
                    let color = |offset| self.color(block, offset, at).unwrap_or_default();
                    difference(color(offset), color(neighbor))
                };
                self.cut(&lenses, side, between, &mut share);
            }
        }
        Ok(share)
    }

    /// The same by graph cut (Kwatra et al. 2003): what lies there already is `old`, an offset for
    /// every pixel of the window.
    fn share_by_graph(&self, block: Block, offset: Offset, old: &[Offset]) -> Vec<u8> {
        let lenses = self.lenses(block);
        let (height, width) = lenses.window();
        let color = |offset: Offset, at| self.color(block, offset, at);
        // How visible a seam between two patches is at a pixel. Where one ends, nobody knows.
        let step = |a: Offset, b: Offset, at: (usize, usize)| {
            color(a, at).zip(color(b, at)).map_or(0, |(a, b)| visible(a, b))
        };
        let own: Vec<i32> =
            pixels((height, width)).map(|at| step(old[at.0 * width + at.1], offset, at)).collect();
        let mut division = Division::new(height, width);
        for at in pixels((height, width)) {
            for below in [false, true] {
                let next = if below { (at.0 + 1, at.1) } else { (at.0, at.1 + 1) };
                if next.0 == height || next.1 == width {
                    continue;
                }
                let (p, q) = (at.0 * width + at.1, next.0 * width + next.1);
                let (a, b) = (old[p], old[q]);
                let costs = if a == b {
                    [0, own[p] + own[q], own[p] + own[q]]
                } else {
                    let none = step(a, b, at) + step(a, b, next);
                    let other = own[p] + step(a, offset, next);
                    let this = step(b, offset, at) + own[q];
                    // Less only where a patch ends.
                    [none.min(other + this), other, this]
                };
                division.pair(at, below, costs);
            }
        }
        for at in pixels((height, width)) {
            let rim = at.0 == 0 || at.1 == 0 || at.0 + 1 == height || at.1 + 1 == width;
            if rim || lenses.is_core(at) {
                division.bind(at, !rim);
            }
        }
        division
            .solve_by_steps(STEP)
            .into_iter()
            .map(|inside| if inside { 255 } else { 0 })
            .collect()
    }

    /// Joins a gap and its neighbour by the path of least difference.
    fn cut(
        &self,
        lenses: &Lenses,
        side: Side,
        difference: impl Fn((usize, usize)) -> u32,
        share: &mut [u8],
    ) {
        let b = self.plan.border;
        let (height, width) = lenses.size;
        let along = if matches!(side, Side::Top | Side::Bottom) { width } else { height };
        // From the neighbour inwards, along the side.
        let pixel = |j: usize, i: usize| match side {
            Side::Top => (j, b + i),
            Side::Bottom => (height + 2 * b - 1 - j, b + i),
            Side::Left => (b + i, j),
            Side::Right => (b + i, width + 2 * b - 1 - j),
        };
        let rows = 2 * b + 1;
        let mut costs = vec![cut::BARRED; rows * along];
        for i in 0..along {
            let reach = b.min(i).min(along - 1 - i);
            for p in b - reach..=b + reach {
                let behind = p.checked_sub(1).map_or(0, |j| difference(pixel(j, i)));
                let ahead = if p < 2 * b { difference(pixel(p, i)) } else { 0 };
                costs[p * along + i] = behind + ahead;
            }
        }
        let path = cut::path(&costs, rows, along);
        for (i, p) in path.into_iter().enumerate() {
            let reach = b.min(i).min(along - 1 - i);
            for j in b - reach..b + reach {
                let (y, x) = pixel(j, i);
                share[y * lenses.window().1 + x] = if j >= p { 255 } else { 0 };
            }
        }
    }

    /// The rows of the output that some rows of blocks cover.
    ///
    /// # Errors
    /// [`Error::BadPicture`] if nothing fits at some place, [`Error::Cancelled`].
    pub fn strip(&self, ctx: &Ctx, block_rows: std::ops::Range<usize>) -> Result<Strip> {
        let (first, last) = (block_rows.start as i64, block_rows.end as i64);
        let columns = self.columns.blocks as i64;
        // The gaps that reach in, and those that these have to know. Beyond a border that does not wrap
        // there are none: samples alone reach the border.
        let around = |range: std::ops::Range<i64>, axis: &Axis| {
            let all = 0..axis.blocks as i64;
            if axis.wraps { range } else { range.start.max(all.start)..range.end.min(all.end) }
        };
        let gaps: Vec<Block> = around(first - 2..last + 2, &self.rows)
            .flat_map(|r| around(-2..columns + 2, &self.columns).map(move |c| [r, c]))
            .filter(|&block| !is_sample(block))
            .collect();
        let offsets = gaps.par_iter().map(|&block| {
            let own = self.own(block);
            let offset = self.moved(own, block, self.fill(ctx, own)?);
            ctx.step(1)?;
            Ok((block, Filled { offset, share: Vec::new() }))
        });
        let mut gaps: BTreeMap<Block, Filled> = offsets.collect::<Result<_>>()?;
        if self.plan.seam == Seam::Graph {
            // First the gaps of every other row: their windows do not overlap. Then the others, which
            // see what the first have come to.
            for turn in [0, 1] {
                let shares = gaps.par_iter().filter(|([r, _], _)| r.rem_euclid(2) == turn).map(
                    |(&block, gap)| {
                        let old = self.old(ctx, block, &gaps)?;
                        ctx.step(1)?;
                        Ok((block, self.share_by_graph(block, gap.offset, &old)))
                    },
                );
                for (block, share) in shares.collect::<Result<Vec<_>>>()? {
                    if let Some(gap) = gaps.get_mut(&block) {
                        gap.share = share;
                    }
                }
            }
        } else {
            gaps.par_iter_mut().try_for_each(|(&block, gap)| {
                gap.share = self.share_by_side(ctx, block, gap.offset)?;
                ctx.step(1)
            })?;
        }
        let (height, width) = self.plan.size;
        let begin = self.rows.edge(first) as usize;
        let end = (self.rows.edge(last) as usize).min(height);
        let mut from = vec![[0; 2]; (end - begin) * width];
        let mixes = self.plan.seam == Seam::Linear;
        let mut mixed = vec![([0; 2], 0); if mixes { from.len() } else { 0 }];
        let place = |[oy, ox]: Offset, [y, x]: [i64; 2]| [(y + oy) as u32, (x + ox) as u32];
        let inside = |[y, x]: [i64; 2]| {
            let inside = (begin as i64..end as i64).contains(&y) && (0..width as i64).contains(&x);
            inside.then(|| (y as usize - begin) * width + x as usize)
        };
        for block in (first..last).flat_map(|r| (0..columns).map(move |c| [r, c])) {
            let [y0, x0] = self.corner(block);
            let size = self.lenses(block).size;
            let sample = is_sample(block).then(|| self.sample(ctx, block)).transpose()?;
            let around = if sample.is_none() { self.around(ctx, block)? } else { [[0; 2]; 4] };
            for (y, x) in pixels(size) {
                let at = [y0 + y as i64, x0 + x as i64];
                let offset = sample.unwrap_or_else(|| around[nearest_side(size, (y, x)) as usize]);
                if let Some(k) = inside(at) {
                    from[k] = place(offset, at);
                    if mixes {
                        mixed[k] = (from[k], 0);
                    }
                }
            }
        }
        for turn in [0, 1] {
            for (&block, gap) in gaps.iter().filter(|([r, _], _)| r.rem_euclid(2) == turn) {
                let [wy, wx] = self.window_at(block, [0, 0]);
                let window = self.lenses(block).window();
                for ((y, x), &share) in pixels(window).zip(&gap.share) {
                    let at = [wy + y as i64, wx + x as i64];
                    let Some(k) = inside(at).filter(|_| share > 0) else { continue };
                    let (old, new) = (from[k], place(gap.offset, at));
                    from[k] = if share >= 128 { new } else { old };
                    if mixes {
                        mixed[k] = if share >= 128 { (old, 255 - share) } else { (new, share) };
                    }
                }
            }
        }
        Ok(Strip { first: begin, from, mixed })
    }

    /// What lies in a gap's window before the gap is joined: samples, and gaps that were.
    fn old(&self, ctx: &Ctx, block: Block, gaps: &BTreeMap<Block, Filled>) -> Result<Vec<Offset>> {
        let lenses = self.lenses(block);
        let window = lenses.window();
        let b = self.plan.border;
        let around = self.around(ctx, block)?;
        let [wy, wx] = self.window_at(block, [0, 0]);
        let mut old: Vec<Offset> = pixels(window)
            .map(|(y, x)| {
                let beyond = |i: usize, n: usize| {
                    if i < b { -1 } else { i64::from(i >= b + n) }
                };
                let [dr, dc] = [beyond(y, lenses.size.0), beyond(x, lenses.size.1)];
                let side = match [dr, dc] {
                    [-1, 0] => Side::Top,
                    [1, 0] => Side::Bottom,
                    [0, -1] => Side::Left,
                    [0, 1] => Side::Right,
                    _ => {
                        // In this gap or in one at a corner.
                        let there = [block[0] + dr, block[1] + dc];
                        let [cy, cx] = self.corner(there);
                        let at = ((wy + y as i64 - cy) as usize, (wx + x as i64 - cx) as usize);
                        let side = nearest_side(self.lenses(there).size, at);
                        let sample = side.beyond(there);
                        Side::ALL.into_iter().find(|s| s.beyond(block) == sample).unwrap_or(side)
                    }
                };
                around[side as usize]
            })
            .collect();
        if block[0].rem_euclid(2) == 0 {
            return Ok(old);
        }
        for corner in [[-1, -1], [-1, 1], [1, -1], [1, 1]] {
            let there = [block[0] + corner[0], block[1] + corner[1]];
            let Some(gap) = gaps.get(&there) else { continue };
            let [cy, cx] = self.window_at(there, [0, 0]);
            let size = self.lenses(there).window();
            for ((y, x), &share) in pixels(size).zip(&gap.share) {
                let (y, x) = (cy + y as i64 - wy, cx + x as i64 - wx);
                let inside = |i: i64, n: usize| (0..n as i64).contains(&i);
                if share > 0 && inside(y, window.0) && inside(x, window.1) {
                    old[y as usize * window.1 + x as usize] = gap.offset;
                }
            }
        }
        Ok(old)
    }
}

/// The pixels of a rectangle, row by row.
fn pixels((height, width): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    (0..height).flat_map(move |y| (0..width).map(move |x| (y, x)))
}

/// Squared difference of two colours.
fn difference(a: [u8; 4], b: [u8; 4]) -> u32 {
    a.iter().zip(b).map(|(&a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
}

/// How much the eye is caught by one colour in place of another; a metric.
fn visible(a: [u8; 4], b: [u8; 4]) -> i32 {
    a.iter().zip(b).map(|(&a, b)| i32::from(a.abs_diff(b))).sum()
}
