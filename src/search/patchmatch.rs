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
use crate::search::phase::Phase;
use crate::search::place_cost::PlaceCost;
use crate::search::source::Source;

/// Most rows of a band. Fewer rows: more parallel work, slower propagation between bands.
const BAND: usize = 32;

/// Stage of the random candidates.
const RANDOM: u32 = 3;

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
    /// The lattice that random candidates are moved to; what is in phase stays so when it propagates.
    pub phase: Option<Phase>,
}

/// One pass over the field: every output position takes the best of its own match, the
/// neighbours' matches shifted by one, and random positions around the best.
///
/// `target` is the output in the matching space with an apron of `patch - 1`: the patch of output
/// pixel (y, x) has its top left corner at (y, x). The score that is minimized is the squared
/// patch distance plus `place_cost`. Counts `field.height` units of progress.
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
    place_cost: &PlaceCost,
    wrap: Wrap,
    search: Search,
    field: &mut Field,
) -> Result<()> {
    let mut next: Vec<Pos> = field.pos.par_iter().copied().collect();
    let band = Band { target, source, place_cost, wrap, search, field, seed: ctx.seed };
    // Every other pair of passes the bands are shifted by half: no row is always at an edge.
    let height = band_height(field.height);
    let head = if search.pass % 4 < 2 { 0 } else { height / 2 };
    let (first, rest) = next.split_at_mut(head * field.width);
    let bands = std::iter::once((0, first)).filter(|(_, rows)| !rows.is_empty());
    let rest = rest.chunks_mut(height * field.width).enumerate();
    let bands: Vec<_> = bands.chain(rest.map(|(i, rows)| (head + i * height, rows))).collect();
    bands.into_par_iter().with_max_len(1).try_for_each(|(y0, rows)| {
        with_kernel(ctx.simd, source.patch, BandJob { band: &band, ctx, y0, rows })
    })?;
    field.pos = next;
    Ok(())
}

/// Rows of a band of a field of this many rows: as many as let an even number of bands be of one height.
fn band_height(rows: usize) -> usize {
    rows.div_ceil(2 * rows.div_ceil(2 * BAND))
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
    place_cost: &'a PlaceCost,
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
        let mut candidates = [Pos::new(0, 0); 3];
        let mut distances = [0; 3];
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
            self.random_candidates(row, y, &radii, &mut random);
            if let Some(phase) = &self.search.phase {
                for (i, pos) in random.iter_mut().enumerate() {
                    *pos = phase.near(self.source, (y, i % width), *pos);
                }
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
                let i = (best & 0xff) as usize;
                let (mut best, mut found, mut distance) =
                    ((best >> 8) as i32, candidates[i], distances[i]);
                // Most random ones are much worse, which a part of the patch shows.
                for &pos in random.iter().skip(x).step_by(width) {
                    if !self.source.is_usable(pos) {
                        continue;
                    }
                    let limit = best - self.place_cost.of(pos);
                    let image = &self.source.image;
                    let other = kernel.distance_below(&query, image, self.source.at(pos), limit);
                    if other < limit {
                        (best, found, distance) = (best - limit + other, pos, other);
                    }
                }
                row[x] = found;
                row_distances[x] = distance;
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

    /// Positions around those of row `y`: a row of them for every radius.
    #[inline(always)]
    fn random_candidates(&self, row: &[Pos], y: usize, radii: &[i32], out: &mut [Pos]) {
        let draws = Rng::new(self.seed, RANDOM, self.search.pass, y as u64);
        let last = [self.source.rows() as i32 - 1, self.source.cols() as i32 - 1];
        for (i, (&radius, out)) in radii.iter().zip(out.chunks_exact_mut(row.len())).enumerate() {
            for (x, (own, out)) in row.iter().zip(out).enumerate() {
                let bits = draws.nth((i * row.len() + x) as u64);
                // One of those from `low` to `high`, by 32 bits.
                let within = |at: usize, last: i32, bits: u64| {
                    let (low, high) = ((at as i32 - radius).max(0), (at as i32 + radius).min(last));
                    low as usize + ((bits * (high - low + 1) as u64) >> 32) as usize
                };
                let y = within(own.y(), last[0], bits >> 32);
                *out = Pos::new(y, within(own.x(), last[1], bits & 0xffff_ffff));
            }
        }
    }

    /// Squared distance of the held patch from the source's at `pos`.
    #[inline(always)]
    fn distance<K: Kernel>(&self, kernel: K, query: &K::Query, pos: Pos) -> i32 {
        kernel.distance(query, &self.source.image, self.source.at(pos))
    }

    /// Squared distance plus the place's cost. Unusable patches score beyond all others: every field
    /// starts with usable ones, and keeps them.
    #[inline(always)]
    fn score(&self, pos: Pos, distance: i32) -> i32 {
        if self.source.is_usable(pos) { distance + self.place_cost.of(pos) } else { i32::MAX }
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
