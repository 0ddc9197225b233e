//! [`PlaceCost`]: what it costs to copy from a place, besides how well it fits.

use rayon::prelude::*;

use crate::base::rng::Rng;
use crate::search::field::{Field, Pos};
use crate::search::source::Source;

/// Costs saturate here: sums with distances cannot overflow, nor reach those of unusable patches.
const MOST: f32 = (1 << 28) as f32;

/// Marks the cells that a cost says nothing about.
pub(crate) const ELSEWHERE: i32 = -1;

/// The largest of [`PlaceCost::random`].
pub const RANDOM_MOST: u32 = 1 << 10;

/// What it costs to copy from each place of a source, besides how well it fits: on a grid of cells
/// of a third of a patch, in squared codes.
#[derive(Debug, Clone)]
pub struct PlaceCost {
    cols: usize,
    shift: u32,
    cost: Vec<i32>,
}

impl PlaceCost {
    /// No cost anywhere.
    pub fn free(source: &Source) -> Self {
        let shift = cell_shift(source.patch);
        let cols = (source.cols() >> shift) + 1;
        Self { cols, shift, cost: vec![0; cols * ((source.rows() >> shift) + 1)] }
    }

    /// Costs drawn at random from 0 to [`RANDOM_MOST`], one for every square of the patch's side.
    ///
    /// # Determinism
    /// Depends on `seed` and the source's size alone.
    pub fn random(source: &Source, seed: u64) -> Self {
        const STAGE: u32 = 7;
        let per_row = source.cols().div_ceil(source.patch);
        Self::of_each(source, |pos| {
            let square = pos.y() / source.patch * per_row + pos.x() / source.patch;
            Rng::new(seed, STAGE, 0, square as u64).below(RANDOM_MOST + 1) as i32
        })
    }

    /// Spatial uniformity (Kaspar et al. 2015): the cost of using each source patch once more, `weight * occurrence / w_best`, where the
    /// occurrence (how many matched patches cover a pixel) is averaged over the patch.
    ///
    /// # Paper
    /// Moritz et al. 2017, eq. 6: `w_best = max(1, |T| / |S|) * N^2`. Counts are kept on a grid of
    /// cells of a third of a patch, which a patch average cannot tell from pixels.
    pub fn of_usage(field: &Field, source: &Source, weight: f32) -> Self {
        let mut usage = Self::free(source);
        let (shift, n) = (usage.shift, source.patch);
        let (cols, rows) = (usage.cols, (source.rows() >> shift) + 1);
        let cell = |pos: &Pos| (pos.y() >> shift) * cols + (pos.x() >> shift);
        let counts = |some: &[Pos]| {
            let mut count = vec![0u32; rows * cols];
            some.iter().for_each(|pos| count[cell(pos)] += 1);
            count
        };
        // A part for every thread: whole numbers have the same sum in any order.
        let part = field.pos.len().div_ceil(rayon::current_num_threads()).max(1);
        let count = field.pos.par_chunks(part).map(counts).reduce_with(|mut a, b| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        });
        let count = count.unwrap_or_else(|| counts(&[]));
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
                let cost = (sum / (reach * reach) as f32) as f64 * unit;
                *out = cost.min(f64::from(MOST)) as i32;
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

    /// This cost and `share` of another one for the same source.
    #[must_use]
    pub fn plus(mut self, share: f32, other: &Self) -> Self {
        for (cost, &more) in self.cost.iter_mut().zip(&other.cost) {
            *cost = (*cost as f32 + share * more as f32).min(MOST) as i32;
        }
        self
    }

    /// This cost and a further one for every patch of each picture of the source's atlas.
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
                    let cost = &mut self.cost[y * self.cols + x];
                    *cost = cost.saturating_add(costs[view.picture]).min(MOST as i32);
                }
            }
        }
        self
    }

    /// This cost, of the source `from`, for one of another size that shows the same.
    #[must_use]
    pub fn resized(&self, from: &Source, source: &Source) -> Self {
        let mut to = Self::free(source);
        if !source.atlas.is_plain() {
            let place = |cell: usize| (cell << to.shift) + (1 << to.shift) / 2;
            for i in 0..to.cost.len() {
                let (y, x) = (place(i / to.cols), place(i % to.cols));
                // The lines between views do not grow with them: each view for itself.
                let Some(at) = source.atlas.view_at(y, x) else { continue };
                let (fine, coarse) = (source.atlas.views()[at], from.atlas.views()[at]);
                let y = coarse.corner.0 + (y - fine.corner.0) * coarse.size.0 / fine.size.0;
                let x = coarse.corner.1 + (x - fine.corner.1) * coarse.size.1 / fine.size.1;
                let (row, col) = (y >> self.shift, x >> self.shift);
                let rows = self.cost.len() / self.cols;
                to.cost[i] = self.cost[row.min(rows - 1) * self.cols + col.min(self.cols - 1)];
            }
            return to;
        }
        let (from_rows, to_rows) = (self.cost.len() / self.cols, to.cost.len() / to.cols);
        for (i, cost) in to.cost.iter_mut().enumerate() {
            let y = (2 * (i / to.cols) + 1) * from_rows / (2 * to_rows);
            let x = (2 * (i % to.cols) + 1) * self.cols / (2 * to.cols);
            *cost = self.cost[y * self.cols + x];
        }
        to
    }

    /// The same cost everywhere in a cell, from the patch in its middle.
    pub(crate) fn of_each(source: &Source, cost: impl Fn(Pos) -> i32 + Sync) -> Self {
        let mut all = Self::free(source);
        let (shift, cols) = (all.shift, all.cols);
        let middle = |cell: usize, end: usize| ((cell << shift) + (1 << shift) / 2).min(end - 1);
        all.cost.par_iter_mut().enumerate().for_each(|(i, out)| {
            *out = cost(Pos::new(middle(i / cols, source.rows()), middle(i % cols, source.cols())));
        });
        all
    }

    /// How many cells there are.
    pub(crate) fn n_cells(&self) -> usize {
        self.cost.len()
    }

    /// By how much each cell's cost exceeds what a `share` of the cells (but those that are
    /// [`ELSEWHERE`]) do not exceed.
    pub(crate) fn excess_over(mut self, share: f64) -> Self {
        let mut sorted = self.cost.clone();
        sorted.retain(|&cost| cost != ELSEWHERE);
        sorted.sort_unstable();
        let at = (sorted.len().saturating_sub(1) as f64 * share) as usize;
        let common = sorted.get(at).copied().unwrap_or(0);
        self.cost.iter_mut().for_each(|cost| *cost = (*cost - common).max(0));
        self
    }

    /// The cost of copying the patch at `pos`.
    #[inline]
    pub fn of(&self, pos: Pos) -> i32 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::patch::MatchImage;

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
            let usage = PlaceCost::of_usage(&field, &source, WEIGHT as f32);
            let want = naive(&field, &source, WEIGHT);
            let mut ratios = Vec::new();
            // Away from the photo's border, where either average runs out of patches.
            for y in (rows / 3)..rows - 2 * patch {
                for x in 2 * patch..cols - 2 * patch {
                    ratios.push(f64::from(usage.of(Pos::new(y, x))) / want[y * cols + x]);
                }
            }
            let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
            let worst = ratios.iter().map(|r| (r / mean - 1.0).abs()).fold(0.0, f64::max);
            assert!(worst < 0.3, "patch {patch}: {worst:.3} off at worst");
        }
    }

    #[test]
    fn random_costs_are_those_of_squares() {
        let source = Source::new(MatchImage::new(150, 130), 11, None).expect("source");
        let (a, b) = (PlaceCost::random(&source, 1), PlaceCost::random(&source, 2));
        assert!(a.cost.iter().all(|&cost| (0..=RANDOM_MOST as i32).contains(&cost)));
        assert_eq!(a.of(Pos::new(23, 34)), a.of(Pos::new(31, 42)), "one square");
        let near = a.cost.iter().zip(&b.cost).filter(|(a, b)| (*a - *b).abs() < 50).count();
        assert!(near * 4 < a.cost.len(), "the seeds agree on {near} of {}", a.cost.len());
    }

    #[test]
    fn free_use_costs_nothing_and_even_use_its_weight() {
        for patch in [3, 5, 7, 11, 15, 21] {
            let side = 130 + patch - 1;
            let source = Source::new(MatchImage::new(side, side), patch, None).expect("source");
            let at = |i: usize| Pos::new(i / 130 % 130, i % 130);
            let pos = (0..2 * 130 * 130).map(at).collect();
            let field = Field { height: 260, width: 130, pos };
            let usage = PlaceCost::of_usage(&field, &source, 1000.0);
            assert_eq!(PlaceCost::free(&source).of(Pos::new(60, 60)), 0);
            for (y, x) in [(60, 60), (30, 90), (98, 40)] {
                let cost = usage.of(Pos::new(y, x));
                assert!(cost.abs_diff(1000) < 5, "patch {patch}: {cost} at {y}, {x}");
            }
        }
    }
}
