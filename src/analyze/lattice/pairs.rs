//! Pairs of displacements, and how well a picture repeats by them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::Candidate;
use super::field::{Field, floor};
use crate::signal::basis::{Basis, Vector, area, combined, directed, dot};

/// Preference for small cells among equally good ones. The paper's.
const ALPHA: f64 = 1.12;

/// Peaks that are paired, by their excess. Pairs grow with the square.
const PEAKS: usize = 400;

/// Candidates that are fitted and compared again.
const FINALISTS: usize = 32;

/// Smallest number of cells in the picture: about two by two.
const CELLS: f64 = 3.5;

/// Smallest area of a cell and shortest vector, in pixels of the reduced picture.
const SMALLEST_AREA: f64 = 16.0;
const SHORTEST: f64 = 3.0;

/// Longest component of a vector, as a share of the side: twice that about fits.
const LONGEST: f64 = 0.55;

/// The multiples within this distance count, as a multiple of the root of the cell's area: about
/// the 24 (of one half-plane) nearest. Farther ones agree less where rows drift or the camera
/// stood askew, and are no evidence against the lattice.
const DISTANCE: f64 = 3.95;

/// Smallest overlap at which a correlation counts.
const OVERLAP: f64 = 0.16;

/// So many multiples count half: few may agree by chance.
const PRIOR: f64 = 3.0;

/// The candidates, best first, at most [`FINALISTS`].
///
/// # Paper
/// Near-Regular Texture Synthesis by Random Sampling and Gap Filling (2011), sec. 3.3. Past it:
/// see the constants, and [`goodness`].
pub(super) fn best(field: &Field, shortest: f64) -> Vec<Candidate> {
    search(field, shortest, true)
}

/// With `prune`, a pair is given up once it cannot be among the finalists any more.
fn search(field: &Field, shortest: f64, prune: bool) -> Vec<Candidate> {
    let shortest = shortest.max(SHORTEST);
    let peaks = peaks(field, shortest);
    let prune = prune.then(|| Prune::new(field, shortest));
    // What is given up depends on which pairs were looked at before, and so on the threads; the finalists
    // do not.
    let with = |i: usize| {
        let v1 = peaks[i];
        let mut scratch = Vec::new();
        let mut found = Vec::new();
        for v2 in seconds(v1, &peaks[i + 1..]) {
            if let Some(candidate) = goodness(field, [v1, v2], prune.as_ref(), &mut scratch) {
                insert(&mut found, candidate);
            }
        }
        found
    };
    let found: Vec<Vec<Candidate>> =
        (0..peaks.len()).into_par_iter().with_max_len(1).map(with).collect();
    let mut finalists = Vec::new();
    found.into_iter().flatten().for_each(|candidate| insert(&mut finalists, candidate));
    finalists
}

/// Inserts a candidate after those that are as good, if it is among the best.
fn insert(finalists: &mut Vec<Candidate>, candidate: Candidate) {
    let at = finalists.partition_point(|c| c.goodness >= candidate.goodness);
    if at < FINALISTS {
        finalists.insert(at, candidate);
        finalists.truncate(FINALISTS);
    }
}

/// What `peaks` may be beside `v1`, one for each pixel, column by column.
fn seconds(v1: Vector, peaks: &[Vector]) -> impl Iterator<Item = Vector> {
    let keyed = |v: Vector| (v.map(|c| nearest(c) as i32), v);
    let mut all: Vec<_> = peaks.iter().filter_map(|&v2| second(v1, v2)).map(keyed).collect();
    all.sort_unstable_by(|(key_a, a), (key_b, b)| {
        key_a.cmp(key_b).then(a[0].total_cmp(&b[0])).then(a[1].total_cmp(&b[1]))
    });
    all.dedup_by_key(|(key, _)| *key);
    all.into_iter().map(|(_, v)| v)
}

/// The nearest whole number, halves away from 0. Without the call that `f64::round` is where the processor is
/// not known.
#[inline]
fn nearest(v: f64) -> f64 {
    (v + 0.5f64.copysign(v)) as i64 as f64
}

/// `v2` less the multiple of `v1` that is nearest to it; `None` if it is then the shorter one.
fn second(v1: Vector, v2: Vector) -> Option<Vector> {
    let times = nearest(dot(v1, v2) / dot(v1, v1));
    let v2 = directed([v2[0] - times * v1[0], v2[1] - times * v1[1]]);
    // Peaks are as exact as a tenth of a pixel; of equally long ones neither is the shorter.
    (dot(v2, v2) >= 0.98 * dot(v1, v1)).then_some(v2)
}

/// Local maxima of the correlation in 5 x 5 displacements that exceed the ridges through them,
/// between pixels; at most [`PEAKS`], shortest first.
fn peaks(field: &Field, shortest: f64) -> Vec<Vector> {
    let limit = [LONGEST * field.size[0], LONGEST * field.size[1]];
    let [reach_y, reach_x] = field.reach();
    let mut found: Vec<(f64, Vector)> = Vec::new();
    for y in -(reach_y - 2)..=reach_y - 2 {
        for x in 0..=reach_x - 2 {
            let long = (x as f64) > limit[1] || (y.abs() as f64) > limit[0];
            if (x == 0 && y <= 0) || long || ((x * x + y * y) as f64) < shortest * shortest {
                continue;
            }
            let (value, excess) = (field.correlation(y, x), field.excess(y, x));
            if value <= 0.0 || excess <= 0.0 {
                continue;
            }
            let higher = |dy: isize, dx: isize| {
                let other = field.correlation(y + dy, x + dx);
                // Of a plateau the first counts.
                other > value || (other == value && (dy, dx) < (0, 0))
            };
            if (-2..=2).all(|dy| (-2..=2).all(|dx| !higher(dy, dx))) {
                found.push((excess, summit(field, y, x)));
            }
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1[1].total_cmp(&b.1[1])));
    found.truncate(PEAKS);
    let mut peaks: Vec<Vector> = found.into_iter().map(|(_, v)| directed(v)).collect();
    peaks.sort_by(|a, b| {
        dot(*a, *a).total_cmp(&dot(*b, *b)).then(a[0].total_cmp(&b[0])).then(a[1].total_cmp(&b[1]))
    });
    peaks
}

/// The top of the parabolas through a maximum and its neighbors.
pub(super) fn summit(field: &Field, y: isize, x: isize) -> Vector {
    let offset = |before: f64, middle: f64, after: f64| {
        let bend = before - 2.0 * middle + after;
        if bend < -1e-9 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
    };
    let at = |dy, dx| field.correlation(y + dy, x + dx);
    [
        x as f64 + offset(at(0, -1), at(0, 0), at(0, 1)),
        y as f64 + offset(at(-1, 0), at(0, 0), at(1, 0)),
    ]
}

/// No excess and no correlation beyond `shortest` is larger than these.
fn bounds(field: &Field, shortest: f64) -> [f64; 2] {
    let [reach_y, reach_x] = field.reach();
    let mut highest = [0.0f64; 2];
    for y in -reach_y..=0 {
        for x in -reach_x..=reach_x {
            // Between displacements up to the diagonal of a pixel nearer.
            if ((x * x + y * y) as f64).sqrt() + 1.5 >= shortest {
                highest[0] = highest[0].max(field.excess(y, x));
                highest[1] = highest[1].max(field.correlation(y, x));
            }
        }
    }
    highest
}

/// Calls `each` with the multiples of a basis that count, of one half-plane: their coefficients, displacements
/// and overlaps.
pub(super) fn multiples(field: &Field, basis: Basis, mut each: impl FnMut([f64; 2], Vector, f64)) {
    let [v1, v2] = basis;
    let cell = area(basis);
    let distance = DISTANCE * cell.sqrt();
    let length = dot(v1, v1).sqrt();
    // Rows of multiples of v1, `cell / length` apart.
    let rows = (distance * length / cell) as i32;
    let slant = dot(v1, v2) / (length * length);
    for b in 0..=rows {
        let b = f64::from(b);
        let middle = -b * slant;
        let half = (distance * distance - (b * cell / length).powi(2)).max(0.0).sqrt() / length;
        let first = if b == 0.0 { 1 } else { -floor(half - middle) };
        for a in first..=floor(middle + half) {
            let a = a as f64;
            let v = combined(basis, a, b);
            let overlap = field.overlap(v);
            if overlap >= OVERLAP && field.covers(v) {
                each([a, b], v, overlap);
            }
        }
    }
}

/// When to give a pair up: no multiple has more excess and correlation than there is anywhere, and enough
/// better pairs are known.
pub(super) struct Prune {
    /// The most excess and correlation.
    bounds: [f64; 2],
    /// The goodnesses of the best pairs yet, best first.
    best: Mutex<Vec<f64>>,
    /// Bits of the last of them to the power 0.5 / [`ALPHA`]; of 0 until there are [`FINALISTS`].
    needed: AtomicU64,
    /// By what [`Prune::needed`] multiplies it, by the highest bits of a cell's area.
    by_area: Vec<f64>,
}

impl Prune {
    /// Of areas [`Prune::by_area`] looks at so many bits: exponent, and five of the mantissa.
    const SHIFT: u32 = 47;

    fn new(field: &Field, shortest: f64) -> Self {
        let pixels = field.size[0] * field.size[1];
        let steps = Self::step(SMALLEST_AREA)..=Self::step(pixels.max(SMALLEST_AREA));
        // That of the smallest cell of a step, as it falls with the number of cells.
        let factor = |step: u64| {
            let cells = pixels / f64::from_bits(step << Self::SHIFT);
            libm::pow(cells, -(ALPHA - 1.0) * 0.5 / ALPHA) * (1.0 - 1e-9)
        };
        Self {
            bounds: bounds(field, shortest),
            best: Mutex::default(),
            needed: AtomicU64::new(0f64.to_bits()),
            by_area: steps.map(factor).collect(),
        }
    }

    fn step(area: f64) -> u64 {
        area.to_bits() >> Self::SHIFT
    }

    /// Takes the goodness of a pair into account.
    fn note(&self, goodness: f64) {
        let mut best = self.best.lock().unwrap_or_else(PoisonError::into_inner);
        let at = best.partition_point(|&other| other >= goodness);
        best.insert(at, goodness);
        best.truncate(FINALISTS);
        if best.len() == FINALISTS {
            let needed = libm::pow(best[FINALISTS - 1], 0.5 / ALPHA);
            self.needed.store(needed.to_bits(), Ordering::Relaxed);
        }
    }

    /// The strength that a pair of this cell needs; a little less, so that rounding gives nothing up.
    fn needed(&self, cell: f64) -> f64 {
        let step = Self::step(cell) - Self::step(SMALLEST_AREA);
        f64::from_bits(self.needed.load(Ordering::Relaxed)) * self.by_area[step as usize]
    }
}

/// How well the picture repeats by a basis; `None` if it does not, or was given up.
///
/// The strength is the root of the product of the mean correlation at the multiples and of the mean
/// by which they exceed the ridges, less its standard error, times n / (n + 3). The goodness is its
/// square to the power [`ALPHA`] times the number of cells to the power `ALPHA` - 1.
///
/// # Paper
/// Eq. 9 is this with the mean correlation for the square of the strength. In a wall of bricks the rows alone
/// correlate so well that any displacement along them is good by that; the excess is what says where
/// the joints are. The standard error rules out lattices that live from one displacement, such as a
/// copied piece of the picture.
///
/// # Pruning
/// The multiples not yet looked at cannot add more than `bounds`; the standard error only lowers.
/// So a pair is given up only if it would not be among the finalists.
pub(super) fn goodness(
    field: &Field,
    basis: Basis,
    prune: Option<&Prune>,
    scratch: &mut Vec<(Vector, f64)>,
) -> Option<Candidate> {
    let cell = area(basis);
    let cells = field.size[0] * field.size[1] / cell;
    let long =
        |v: Vector| v[0].abs() > LONGEST * field.size[1] || v[1].abs() > LONGEST * field.size[0];
    if cell < SMALLEST_AREA || cells < CELLS || basis.into_iter().any(long) {
        return None;
    }
    scratch.clear();
    let mut total = 0.0;
    multiples(field, basis, |_, v, overlap| {
        scratch.push((v, overlap));
        total += overlap;
    });
    let n = scratch.len() as f64;
    if n < 3.0 {
        return None;
    }
    let strength = |excess: f64, correlation: f64| {
        (excess.max(0.0) * correlation.max(0.0)).sqrt() * n / (n + PRIOR)
    };
    let needed = prune.map(|p| (p.bounds, p.needed(cell)));
    let (mut excess, mut squares, mut correlation, mut left) = (0.0, 0.0, 0.0, total);
    for &(v, weight) in &*scratch {
        let (c, e) = field.sample(v);
        excess += weight * e;
        squares += weight * e * e;
        correlation += weight * c;
        left -= weight;
        let most = |sum: f64, bound: f64| (sum + left.max(0.0) * bound) / total;
        if let Some((bounds, needed)) = needed
            && strength(most(excess, bounds[0]), most(correlation, bounds[1])) < needed
        {
            return None;
        }
    }
    let (excess, correlation) = (excess / total, correlation / total);
    let error = ((squares / total - excess * excess).max(0.0) / (n - 1.0)).sqrt();
    let strength = strength(excess - error, correlation);
    let goodness = libm::pow(strength * strength, ALPHA) * libm::pow(cells, ALPHA - 1.0);
    if goodness <= 0.0 {
        return None;
    }
    prune.inspect(|prune| prune.note(goodness));
    Some(Candidate { basis, goodness, strength, correlation })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use crate::signal::autocorrelation::Autocorrelation;

    /// Noise, or noise that repeats every 9 x 11 pixels with as much noise on top.
    fn field(seed: u64, periodic: bool) -> Field {
        let (h, w) = (70, 80);
        let mut rng = Rng::new(seed, 0, 0, 0);
        let mut noise = || rng.below(1000) as f32 / 1000.0;
        let cell: Vec<f32> = (0..9 * 11).map(|_| noise()).collect();
        let value = |i: usize| if periodic { cell[i / w % 9 * 11 + i % w % 11] } else { 0.0 };
        let plane: Vec<f32> = (0..h * w).map(|i| value(i) + noise()).collect();
        Field::new(&Autocorrelation::new(&[plane], (h, w)))
    }

    #[test]
    fn pruning_changes_nothing() {
        for seed in 0..4 {
            for periodic in [false, true] {
                let field = field(seed, periodic);
                let (pruned, all) = (search(&field, 3.0, true), search(&field, 3.0, false));
                assert!(all.len() == FINALISTS, "{} candidates", all.len());
                assert_eq!(pruned, all, "seed {seed}, periodic {periodic}");
            }
        }
    }

    #[test]
    fn pruning_gives_pairs_up() {
        let field = field(1, true);
        let prune = Prune::new(&field, 3.0);
        let best = best(&field, 3.0)[0];
        (0..FINALISTS).for_each(|_| prune.note(best.goodness));
        let try_it = |basis: Basis| goodness(&field, basis, Some(&prune), &mut Vec::new());
        assert!(try_it([[9.4, 4.0], [-4.0, 9.4]]).is_none());
        assert_eq!(try_it(best.basis), Some(best));
        // Of the smallest area of a step, which is a 32nd smaller at most.
        let needed = prune.needed(area(best.basis));
        assert!(needed <= best.strength && needed > 0.998 * best.strength, "{needed} {best:?}");
    }

    #[test]
    fn nearest_and_seconds() {
        for v in [0.0, 0.49, 0.5, 1.5, 2.5, 7.3, 1e6 + 0.5] {
            assert_eq!([nearest(v), nearest(-v)], [v.round(), (-v).round()]);
        }
        // The second falls onto the first's pixel, the next two are then the shorter ones.
        let peaks = [[3.0, 4.0], [3.2, 4.1], [9.0, 1.0], [1.0, 0.2], [1.0, 9.0]];
        let found: Vec<Vector> = seconds([1.5, 0.0], &peaks).collect();
        assert_eq!(found, [[-0.5, 9.0], [0.0, 4.0]]);
    }

    #[test]
    fn multiples_are_those_of_one_half_plane_near_enough() {
        let field = field(2, false);
        let basis = [[11.0, 2.0], [-3.0, 9.0]];
        let mut got = Vec::new();
        multiples(&field, basis, |_, v, overlap| {
            assert_eq!(overlap, field.overlap(v));
            got.push(v);
        });
        let far = DISTANCE * DISTANCE * area(basis);
        let mut count = 0;
        for a in -20..=20 {
            for b in -20..=20 {
                let v = combined(basis, f64::from(a), f64::from(b));
                let near = dot(v, v) <= far && field.covers(v) && field.overlap(v) >= OVERLAP;
                if near && (b > 0 || (b == 0 && a > 0)) {
                    count += 1;
                    assert!(got.contains(&v), "{a}, {b}");
                }
            }
        }
        assert_eq!(count, got.len());
    }
}
