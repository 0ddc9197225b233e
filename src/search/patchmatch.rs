//! PatchMatch on the torus: propagation and random search, parallel and reproducible.
//!
//! The rows of the output are cut into bands of a fixed height. Inside a band the field is
//! updated in place, in scan order, as in the original algorithm; what lies outside is read from
//! the previous pass. The bands do not depend on the number of threads, so neither does the result.

use rayon::prelude::*;

use crate::base::ctx::{Ctx, Simd};
use crate::base::error::Result;
use crate::base::rng::Rng;
use crate::search::field::{Field, Pos};
use crate::search::patch::{Kernel, MatchImage, WithKernel, with_kernel};
use crate::search::source::Source;

/// Rows of a band. Fewer rows: more parallel work, slower propagation between bands.
const BAND: usize = 32;

/// Most random candidates a pixel.
const MAX_RANDOM: usize = 16;

/// Which axes of the output wrap around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wrap {
    /// Vertically: the top continues the bottom.
    pub y: bool,
    /// Horizontally: the left edge continues the right one.
    pub x: bool,
}

/// How one pass searches.
#[derive(Debug, Clone, Copy)]
pub struct Search {
    /// Number of the pass: its parity gives the scan direction, and it keys the random numbers.
    pub pass: u32,
    /// Radius of the widest random search in pixels; 0 means the whole source.
    pub radius: usize,
    /// Number of random candidates a pixel, at most 16; each has half the radius of the one before.
    pub n_random: u32,
}

/// How often each place of the source is used, as a cost (Kaspar et al. 2015, spatial uniformity).
#[derive(Debug, Clone)]
pub struct Usage {
    cols: usize,
    shift: u32,
    cost: Vec<i32>,
}

impl Usage {
    /// No cost anywhere.
    pub fn free(source: &Source) -> Self {
        let shift = cell_shift(source.patch);
        let cols = (source.cols() >> shift) + 1;
        Self { cols, shift, cost: vec![0; cols * ((source.rows() >> shift) + 1)] }
    }

    /// The cost of using each source patch once more: `weight * occurrence / w_best`, where the
    /// occurrence (how many matched patches cover a pixel) is averaged over the patch.
    ///
    /// # Paper
    /// Moritz et al. 2017, eq. 6: `w_best = max(1, |T| / |S|) * N^2`. Counts are kept on a grid of
    /// cells of a third of a patch, which a patch average cannot tell from pixels.
    pub fn of(field: &Field, source: &Source, weight: f32) -> Self {
        let mut usage = Self::free(source);
        let (shift, n) = (usage.shift, source.patch);
        let (cols, rows) = (usage.cols, (source.rows() >> shift) + 1);
        let mut count = vec![0u32; rows * cols];
        for pos in &field.pos {
            count[(pos.y() >> shift) * cols + (pos.x() >> shift)] += 1;
        }
        // The box of "covers the pixel" and the box of "averaged over the patch" make a tent.
        let reach = (n >> shift).max(1);
        let tent = |v: &[f32], out: &mut [f32]| {
            for (i, out) in out.iter_mut().enumerate() {
                let mut sum = v[i] * reach as f32;
                for d in 1..reach {
                    let weight = (reach - d) as f32;
                    sum += weight * (if i >= d { v[i - d] } else { 0.0 });
                    sum += weight * (if i + d < v.len() { v[i + d] } else { 0.0 });
                }
                *out = sum / (reach * reach) as f32;
            }
        };
        let mut horizontal = vec![0f32; rows * cols];
        horizontal.par_chunks_mut(cols).zip(count.par_chunks(cols)).for_each(|(out, count)| {
            let count: Vec<f32> = count.iter().map(|&c| c as f32).collect();
            tent(&count, out);
        });
        // Patches per cell; in units of one use of each pixel, every cell holds 4^shift of them.
        let w_best = (field.pos.len() as f64 / source.n_usable() as f64).max(1.0);
        let unit = weight as f64 / (w_best * f64::from(1u32 << (2 * shift)));
        usage.cost.par_chunks_mut(cols).enumerate().for_each(|(y, out)| {
            for (x, out) in out.iter_mut().enumerate() {
                let at = |y: usize| horizontal[y * cols + x];
                let mut sum = at(y) * reach as f32;
                for d in 1..reach {
                    let weight = (reach - d) as f32;
                    sum += weight * (if y >= d { at(y - d) } else { 0.0 });
                    sum += weight * (if y + d < rows { at(y + d) } else { 0.0 });
                }
                // Saturates: sums with distances cannot overflow, nor reach those of unusable patches.
                let cost = (sum / (reach * reach) as f32) as f64 * unit;
                *out = cost.min(f64::from(1 << 28)) as i32;
            }
        });
        usage
    }

    /// The mean of this cost and an earlier one for the same source. Costs that jump from pass to
    /// pass drive all pixels from one place to the next together; averaged, they settle.
    #[must_use]
    pub fn averaged(mut self, earlier: &Self) -> Self {
        for (cost, &before) in self.cost.iter_mut().zip(&earlier.cost) {
            *cost = cost.midpoint(before);
        }
        self
    }

    /// The same with a further cost for every patch of each picture of the source's atlas.
    #[must_use]
    pub fn with_picture_costs(mut self, source: &Source, costs: &[i32]) -> Self {
        let cells = |from: usize, len: usize| {
            // The cells that begin in the view; one that reaches over its end is hardly used.
            let cell = 1 << self.shift;
            from.div_ceil(cell)..(from + len).div_ceil(cell)
        };
        let rows = self.cost.len() / self.cols;
        for view in source.atlas.views() {
            for y in cells(view.corner.0, view.size.0).filter(|&y| y < rows) {
                for x in cells(view.corner.1, view.size.1).filter(|&x| x < self.cols) {
                    self.cost[y * self.cols + x] += costs[view.picture];
                }
            }
        }
        self
    }

    #[inline]
    fn cost(&self, pos: Pos) -> i32 {
        self.cost[(pos.y() >> self.shift) * self.cols + (pos.x() >> self.shift)]
    }
}

/// Cells of 4 pixels for patches of 8 and more, of 2 from 4 on, else of 1.
fn cell_shift(patch: usize) -> u32 {
    match patch {
        0..4 => 0,
        4..8 => 1,
        _ => 2,
    }
}

/// One pass over the field: every output position takes the best of its own match, the
/// neighbours' matches shifted by one, and random positions around the best.
///
/// `target` is the output in the matching space with an apron of `patch - 1`: the patch of output
/// pixel (y, x) has its top left corner at (y, x). The score that is minimized is the squared
/// patch distance plus `usage`. Counts `field.height` units of progress.
///
/// # Determinism
/// Same bytes for any thread count and SIMD level.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn pass(
    ctx: &Ctx,
    target: &MatchImage,
    source: &Source,
    usage: &Usage,
    wrap: Wrap,
    search: Search,
    field: &mut Field,
) -> Result<()> {
    let mut next = field.pos.clone();
    let band = Band { target, source, usage, wrap, search, field, seed: ctx.seed };
    // Every other pair of passes the bands are shifted by half: no row is always at an edge.
    let head = if search.pass % 4 < 2 { 0 } else { (BAND / 2).min(field.height) };
    let (first, rest) = next.split_at_mut(head * field.width);
    let bands = std::iter::once((0, first)).filter(|(_, rows)| !rows.is_empty());
    let rest = rest.chunks_mut(BAND * field.width).enumerate();
    let bands: Vec<_> = bands.chain(rest.map(|(i, rows)| (head + i * BAND, rows))).collect();
    bands.into_par_iter().try_for_each(|(y0, rows)| {
        with_kernel(ctx.simd, source.patch, BandJob { band: &band, ctx, y0, rows })
    })?;
    field.pos = next;
    Ok(())
}

struct BandJob<'a, 'b> {
    band: &'a Band<'a>,
    ctx: &'a Ctx,
    y0: usize,
    rows: &'b mut [Pos],
}

impl WithKernel for BandJob<'_, '_> {
    type Output = Result<()>;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> Result<()> {
        self.band.scan(kernel, self.ctx, self.y0, self.rows)
    }
}

struct Band<'a> {
    target: &'a MatchImage,
    source: &'a Source,
    usage: &'a Usage,
    wrap: Wrap,
    search: Search,
    field: &'a Field,
    seed: u64,
}

impl Band<'_> {
    /// Updates the rows from `y0` on in place.
    #[inline(always)]
    fn scan<K: Kernel>(&self, kernel: K, ctx: &Ctx, y0: usize, rows: &mut [Pos]) -> Result<()> {
        let (height, width) = (self.field.height, self.field.width);
        let n_rows = rows.len() / width;
        let backward = self.search.pass % 2 == 1;
        let d: isize = if backward { -1 } else { 1 };
        let radii = self.radii();
        let mut query = kernel.query();
        let mut candidates = [Pos::new(0, 0); 3 + MAX_RANDOM];
        let mut distances = [0; 3 + MAX_RANDOM];
        // The distances of the matches in the row that the scan has just left.
        let mut row_distances = vec![0; width];
        let mut random = vec![Pos::new(0, 0); width * radii.len()];
        for step in 0..n_rows {
            let row = if backward { n_rows - 1 - step } else { step };
            let y = y0 + row;
            // The row that the scan has just left, or the last pass left beyond the band.
            let above: Option<Vec<Pos>> = neighbor(y, -d, height, self.wrap.y).map(|ny| {
                let inside = ny >= y0 && ny < y0 + n_rows;
                let from =
                    if inside { &rows[(ny - y0) * width..] } else { &self.field.pos[ny * width..] };
                from[..width].to_vec()
            });
            let row = &mut rows[row * width..(row + 1) * width];
            // Drawn for the whole row ahead: the search need not wait for the dice.
            let items = (y * width..).zip(row.iter());
            for ((item, own), out) in items.zip(random.chunks_exact_mut(radii.len().max(1))) {
                self.random_candidates(*own, &radii, item, out);
            }
            let end = if backward { 0 } else { width - 1 };
            let mut beside = self.wrap.x.then(|| row[end]);
            for at in 0..width {
                let x = if backward { width - 1 - at } else { at };
                kernel.hold(&mut query, self.target, self.target.at(y, x));
                let own = row[x];
                candidates[0] = own;
                let mut n = 1;
                // The index of a candidate, which is added if it is new.
                let mut add = |pos: Pos| {
                    candidates[..n].iter().position(|&p| p == pos).unwrap_or_else(|| {
                        candidates[n] = pos;
                        n += 1;
                        n - 1
                    })
                };
                beside.and_then(|p| p.shifted(0, d, self.source)).map(&mut add);
                let above = above.as_ref().and_then(|row| row[x].shifted(d, 0, self.source));
                let known = above.map(|pos| (add(pos), pos)).filter(|_| step > 0);
                for &pos in &random[x * radii.len()..][..radii.len()] {
                    candidates[n] = pos;
                    n += 1;
                }
                // A match that moved by a row along with its pixel has lost one row of differences
                // and won another: no need to sum the others again.
                let known = known.map_or(usize::MAX, |(i, pos)| {
                    distances[i] = self.moved(kernel, row_distances[x], (y, x), pos, backward);
                    debug_assert_eq!(
                        distances[i],
                        self.distance(kernel, &query, pos),
                        "moved to {pos:?}"
                    );
                    i
                });
                // All are scored before any is chosen: nothing waits for a comparison, and the
                // memory of one patch is fetched while another is multiplied. The first of equals
                // wins.
                let mut best = i64::MAX;
                for (i, &candidate) in candidates[..n].iter().enumerate() {
                    if i != known {
                        distances[i] = self.distance(kernel, &query, candidate);
                    }
                    let score = self.score(candidate, distances[i]);
                    best = best.min((i64::from(score) << 8) | i as i64);
                }
                let best = (best & 0xff) as usize;
                row[x] = candidates[best];
                row_distances[x] = distances[best];
                beside = Some(row[x]);
            }
            ctx.step(width as u64)?;
        }
        Ok(())
    }

    /// The distance of the target's patch at (`y`, `x`) from the source's at `pos`, from that of the
    /// two patches one row before (in scan direction).
    #[inline(always)]
    fn moved<K: Kernel>(
        &self,
        kernel: K,
        before: i32,
        (y, x): (usize, usize),
        pos: Pos,
        backward: bool,
    ) -> i32 {
        // Forward, the row below the patch enters and its top leaves; backward, its top enters
        // and the row below it leaves.
        let n = self.source.patch;
        let (enter, leave) = if backward { (0, n) } else { (n - 1, usize::MAX) };
        let rows = |image: &MatchImage, y: usize, x: usize| {
            [enter, leave].map(|row| image.at(y.wrapping_add(row), x))
        };
        let (target, source) = (self.target, &self.source.image);
        let change = kernel
            .row_change((target, rows(target, y, x)), (source, rows(source, pos.y(), pos.x())));
        before + change
    }

    /// Radius of each random candidate.
    fn radii(&self) -> Vec<i32> {
        let whole = self.source.rows().max(self.source.cols());
        let widest = if self.search.radius == 0 { whole } else { self.search.radius.min(whole) };
        let n = self.search.n_random.min(MAX_RANDOM as u32);
        (0..n).map(|i| (widest as i32 >> i).max(1)).collect()
    }

    /// Positions around `own`, one a radius.
    #[inline(always)]
    fn random_candidates(&self, own: Pos, radii: &[i32], item: usize, out: &mut [Pos]) {
        const STAGE: u32 = 3;
        let mut rng = Rng::new(self.seed, STAGE, self.search.pass, item as u64);
        let (rows, cols) = (self.source.rows() as i32, self.source.cols() as i32);
        let (y, x) = (own.y() as i32, own.x() as i32);
        for (&radius, out) in radii.iter().zip(out) {
            let (y_low, y_high) = ((y - radius).max(0), (y + radius).min(rows - 1));
            let (x_low, x_high) = ((x - radius).max(0), (x + radius).min(cols - 1));
            let y = y_low + rng.below((y_high - y_low + 1) as u32) as i32;
            let x = x_low + rng.below((x_high - x_low + 1) as u32) as i32;
            *out = Pos::new(y as usize, x as usize);
        }
    }

    /// Squared distance of the held patch from the source's at `pos`.
    #[inline(always)]
    fn distance<K: Kernel>(&self, kernel: K, query: &K::Query, pos: Pos) -> i32 {
        kernel.distance(query, &self.source.image, self.source.at(pos))
    }

    /// Squared distance plus the usage cost. Unusable patches score beyond all others: every field
    /// starts with usable ones, and keeps them.
    #[inline(always)]
    fn score(&self, pos: Pos, distance: i32) -> i32 {
        if self.source.is_usable(pos) { distance + self.usage.cost(pos) } else { i32::MAX }
    }
}

/// Index `d` beside `i` among `n`, around the end if `wrap`.
#[inline(always)]
pub(crate) fn neighbor(i: usize, d: isize, n: usize, wrap: bool) -> Option<usize> {
    let j = i as isize + d;
    if (0..n as isize).contains(&j) {
        Some(j as usize)
    } else if wrap {
        Some(j.rem_euclid(n as isize) as usize)
    } else {
        None
    }
}

/// Squared distance between every output patch and its match, in squared codes.
pub fn distances(simd: Simd, target: &MatchImage, source: &Source, field: &Field) -> Vec<i32> {
    struct Distances<'a>(&'a MatchImage, &'a Source, &'a Field, usize);
    impl WithKernel for Distances<'_> {
        type Output = Vec<i32>;
        #[inline(always)]
        fn run<K: Kernel>(self, kernel: K) -> Vec<i32> {
            let Self(target, source, field, y) = self;
            let mut query = kernel.query();
            (0..field.width)
                .map(|x| {
                    kernel.hold(&mut query, target, target.at(y, x));
                    let pos = field.pos[y * field.width + x];
                    kernel.distance(&query, &source.image, source.at(pos))
                })
                .collect()
        }
    }
    (0..field.height)
        .into_par_iter()
        .flat_map_iter(|y| with_kernel(simd, source.patch, Distances(target, source, field, y)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Occurrence by its definition: how many matched patches cover each pixel, averaged over the
    /// patch at every position, over `w_best`.
    fn naive(field: &Field, source: &Source, weight: f64) -> Vec<f64> {
        let (n, w) = (source.patch, source.image.width());
        let mut covers = vec![0.0; source.image.height() * w];
        for pos in &field.pos {
            (0..n * n).for_each(|i| covers[(pos.y() + i / n) * w + pos.x() + i % n] += 1.0);
        }
        let ratio = field.pos.len() as f64 / (source.rows() * source.cols()) as f64;
        let w_best = ratio.max(1.0) * (n * n) as f64;
        let cost = |i: usize| {
            let (y, x) = (i / source.cols(), i % source.cols());
            let sum: f64 = (0..n * n).map(|i| covers[(y + i / n) * w + x + i % n]).sum();
            weight * sum / (n * n) as f64 / w_best
        };
        (0..source.rows() * source.cols()).map(cost).collect()
    }

    /// Cells instead of pixels, and a tent of whole cells instead of one of `patch` pixels, come
    /// near the definition (up to a factor, see below) where the use of the photo changes over
    /// some patches.
    #[test]
    fn usage_is_about_the_average_occurrence() {
        const WEIGHT: f64 = 100_000.0;
        for patch in [3, 5, 7, 9, 11, 15, 21] {
            let source = Source::new(MatchImage::new(150, 160), patch, None).expect("source");
            let (rows, cols) = (source.rows(), source.cols());
            // Six patches a position on average, twice as many at the bottom as in the middle.
            let draw = |i: usize| {
                let mut rng = Rng::new(1, 9, 0, i as u64);
                let y = rng.below(rows as u32).max(rng.below(rows as u32));
                Pos::new(y as usize, rng.below(cols as u32) as usize)
            };
            let (height, width) = (300, 400);
            let pos = (0..height * width).map(draw).collect();
            let field = Field { height, width, pos };
            let usage = Usage::of(&field, &source, WEIGHT as f32);
            let want = naive(&field, &source, WEIGHT);
            let mut ratios = Vec::new();
            // Away from the photo's border, where either average runs out of patches.
            for y in (rows / 3)..rows - 2 * patch {
                for x in 2 * patch..cols - 2 * patch {
                    ratios.push(f64::from(usage.cost(Pos::new(y, x))) / want[y * cols + x]);
                }
            }
            let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
            let worst = ratios.iter().map(|r| (r / mean - 1.0).abs()).fold(0.0, f64::max);
            assert!(worst < 0.3, "patch {patch}: {worst:.3} off at worst");
        }
    }

    #[test]
    fn free_use_costs_nothing_and_even_use_its_weight() {
        for patch in [3, 5, 7, 11, 15, 21] {
            let side = 130 + patch - 1;
            let source = Source::new(MatchImage::new(side, side), patch, None).expect("source");
            let at = |i: usize| Pos::new(i / 130 % 130, i % 130);
            let pos = (0..2 * 130 * 130).map(at).collect();
            let field = Field { height: 260, width: 130, pos };
            let usage = Usage::of(&field, &source, 1000.0);
            assert_eq!(Usage::free(&source).cost(Pos::new(60, 60)), 0);
            for (y, x) in [(60, 60), (30, 90), (98, 40)] {
                let cost = usage.cost(Pos::new(y, x));
                assert!(cost.abs_diff(1000) < 5, "patch {patch}: {cost} at {y}, {x}");
            }
        }
    }
}
