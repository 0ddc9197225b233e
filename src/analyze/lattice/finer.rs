//! Whether a lattice is only a part of a finer one.

use super::Candidate;
use super::field::Field;
use super::pairs::{goodness, multiples};
use super::refine::{fitted, peak};
use crate::signal::basis::{Basis, Vector, combined, dot, reduced};

/// How many times as many points a finer lattice has; others come step by step.
const TIMES: [u8; 4] = [2, 3, 5, 7];

/// By so many standard errors the points between may agree less: the lattice was chosen among many, for
/// points that agree more by chance.
const CHANCE: f64 = 2.3;

/// At least so much of what the lattice's own points exceed the ridges by, those between do. Few points
/// that differ much among themselves prove nothing.
const SHARE: f64 = 0.6;

/// A peak is looked for this far around where it should be, in pixels.
const NEAR: isize = 2;

/// The lattice, or the finest that contains it and whose further points agree as well, but for chance.
///
/// Bricks of random colours agree by chance a little more at some displacements than at others. The best
/// of all pairs are then two of those, of a lattice that has only every third brick, say, although the
/// others agree as well as bricks of such colours can. Where cells differ in turns, as the fields of a
/// chessboard do, the points between agree less, and all alike.
///
/// Vectors of the finer lattice are `shortest` at least, and peaks: next to a wide one all agrees.
pub(super) fn finest(field: &Field, candidate: Candidate, shortest: f64) -> Candidate {
    let mut found = candidate;
    let is_peak = |v: Vector| {
        let Some((top, _)) = peak(field, v, NEAR) else { return false };
        let off = [top[0] - v[0], top[1] - v[1]];
        dot(v, v) >= shortest * shortest && dot(off, off) <= 1.0
    };
    let finer = |of: Candidate| {
        let all = TIMES.into_iter().flat_map(|times| containing(of.basis, times));
        all.filter_map(|basis| {
            let basis = fitted(field, reduced(basis));
            if !basis.into_iter().all(is_peak) {
                return None;
            }
            let finer = goodness(field, basis, None, &mut Vec::new())?;
            agrees(field, of.basis, basis).then_some(finer)
        })
        .reduce(|a, b| if b.goodness > a.goodness { b } else { a })
    };
    while let Some(finer) = finer(found) {
        found = finer;
    }
    found
}

/// The lattices that have `times` as many points, a prime number, and those of `basis` among them.
fn containing(basis: Basis, times: u8) -> impl Iterator<Item = Basis> {
    let n = f64::from(times);
    let first = move |b: u8| [combined(basis, 1.0 / n, f64::from(b) / n), basis[1]];
    (0..times).map(first).chain([[basis[0], combined(basis, 0.0, 1.0 / n)]])
}

/// Whether the points of `finer` that `basis` does not have agree as well as its own.
fn agrees(field: &Field, basis: Basis, finer: Basis) -> bool {
    let (mut own, mut between) = (Sums::default(), Sums::default());
    let det = basis[0][0] * basis[1][1] - basis[0][1] * basis[1][0];
    multiples(field, finer, |_, v, overlap| {
        let a = (v[0] * basis[1][1] - v[1] * basis[1][0]) / det;
        let b = (basis[0][0] * v[1] - basis[0][1] * v[0]) / det;
        // Points between are a seventh off at least; fitting moved them a little.
        let whole = |c: f64| (c - c.round()).abs() < 0.5 / f64::from(TIMES[3]);
        let sums = if whole(a) && whole(b) { &mut own } else { &mut between };
        sums.add(overlap, field.sample(v).1);
    });
    if own.n < 3.0 || between.n < 3.0 {
        return false;
    }
    let variance =
        (own.n * own.variance() + between.n * between.variance()) / (own.n + between.n - 2.0);
    let error = (variance * (1.0 / own.n + 1.0 / between.n)).sqrt();
    let least = (own.mean() - CHANCE * error).max(SHARE * own.mean());
    between.mean() >= least
}

/// Sums over the multiples of a lattice.
#[derive(Debug, Default, Clone, Copy)]
struct Sums {
    n: f64,
    weights: f64,
    values: f64,
    squares: f64,
}

impl Sums {
    fn add(&mut self, weight: f64, value: f64) {
        self.n += 1.0;
        self.weights += weight;
        self.values += weight * value;
        self.squares += weight * value * value;
    }

    fn mean(&self) -> f64 {
        self.values / self.weights
    }

    fn variance(&self) -> f64 {
        (self.squares / self.weights - self.mean() * self.mean()).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use crate::signal::autocorrelation::Autocorrelation;
    use crate::signal::basis::area;

    /// Squares of 10 pixels, 12 apart, lighter than what is between, of random shades; `turns` darker and
    /// lighter in turns, like a chessboard.
    fn squares(seed: u64, turns: f64) -> Field {
        let (h, w) = (240, 260);
        let shade = |row: usize, column: usize| {
            let mut rng = Rng::new(seed, 0, row as u32, column as u64);
            let side = if (row + column).is_multiple_of(2) { turns } else { -turns };
            1.0 + side + 0.4 * f64::from(rng.below(1000)) / 1000.0
        };
        let value = |i: usize| {
            let (y, x) = (i / w, i % w);
            if y % 12 < 10 && x % 12 < 10 { shade(y / 12, x / 12) as f32 } else { 0.0 }
        };
        Field::new(&Autocorrelation::new(&[(0..h * w).map(value).collect()], (h, w)))
    }

    fn found(field: &Field, basis: Basis) -> Basis {
        let candidate = goodness(field, basis, None, &mut Vec::new()).expect("it repeats");
        finest(field, candidate, 3.0).basis
    }

    #[test]
    fn lattices_that_contain_a_lattice() {
        let basis = [[9.0, 1.0], [2.0, 11.0]];
        for times in TIMES {
            let all: Vec<Basis> = containing(basis, times).collect();
            assert_eq!(all.len(), usize::from(times) + 1);
            for (i, finer) in all.iter().enumerate() {
                let n = f64::from(times);
                assert!((area(*finer) * n - area(basis)).abs() < 1e-9);
                let det = finer[0][0] * finer[1][1] - finer[0][1] * finer[1][0];
                for v in basis {
                    let a = (v[0] * finer[1][1] - v[1] * finer[1][0]) / det;
                    let b = (finer[0][0] * v[1] - finer[0][1] * v[0]) / det;
                    assert!((a - a.round()).abs() < 1e-9 && (b - b.round()).abs() < 1e-9);
                }
                // No two are the same: one's first vectors are not all points of another.
                for other in &all[..i] {
                    let det = other[0][0] * other[1][1] - other[0][1] * other[1][0];
                    let off = |v: [f64; 2]| {
                        let a = (v[0] * other[1][1] - v[1] * other[1][0]) / det;
                        let b = (other[0][0] * v[1] - other[0][1] * v[0]) / det;
                        (a - a.round()).abs().max((b - b.round()).abs())
                    };
                    assert!(off(finer[0]).max(off(finer[1])) > 0.1);
                }
            }
        }
    }

    #[test]
    fn every_other_square_is_not_the_lattice() {
        for seed in 0..3 {
            let field = squares(seed, 0.0);
            for coarse in [[[12.0, 12.0], [12.0, -12.0]], [[36.0, 0.0], [0.0, 24.0]]] {
                let basis = found(&field, coarse);
                assert!((area(basis) - 144.0).abs() < 3.0, "seed {seed}: {basis:?}");
            }
        }
    }

    #[test]
    fn a_chessboard_keeps_its_two_colors() {
        for seed in 0..3 {
            let basis = found(&squares(seed, 0.15), [[12.0, 12.0], [12.0, -12.0]]);
            assert!((area(basis) - 288.0).abs() < 6.0, "seed {seed}: {basis:?}");
        }
    }
}
