//! Whether the cells of a lattice differ in turns.

use crate::signal::basis::{Basis, area, coefficients};

/// A cell is looked at in so many parts along either vector, fewer if they would be smaller than
/// [`FINEST`] pixels.
const PARTS: usize = 6;
const FINEST: f64 = 2.5;

/// How sure it must be that cells differ in turns: so much of what they differ by is explained, and so many
/// standard deviations more than by chance. Measured: walls of random colors reach 0.12 and 12 deviations,
/// and 0.15 and 22 if their courses are drawn in whole pixels; photographs of cells that differ begin at 0.11
/// and 38, textures made of them at 0.06 and 75.
const SURE: Share = Share { explained: 0.05, deviations: 30.0 };

/// The same where the colors repeat so, and nowhere between: few cells may do.
const LIKELY: Share = Share { explained: 0.15, deviations: 1.5 };

/// Turns of so many cells are looked for; more, step by step.
const TURNS: [i32; 2] = [2, 3];

/// Of a lattice's cells, the colours in their parts.
pub(super) struct Cells {
    /// Indices along the two vectors.
    at: Vec<[i32; 2]>,
    /// For each cell the means of all planes in all parts, less those of all cells.
    means: Vec<f64>,
    /// Values of a cell.
    length: usize,
}

/// How far cells of a group are alike.
#[derive(Debug, Clone, Copy)]
struct Share {
    /// The share of the variance that the groups explain, less what they would by chance (omega squared).
    explained: f64,
    /// By how many standard deviations of chance they explain more.
    deviations: f64,
}

impl Share {
    fn reaches(self, least: Self) -> bool {
        self.explained >= least.explained && self.deviations >= least.deviations
    }
}

impl Cells {
    /// Those that lie in the picture, `planes` of `h` x `w` pixels, of which `usable` count.
    pub(super) fn new(
        planes: &[Vec<f32>],
        (h, w): (usize, usize),
        usable: Option<&[bool]>,
        basis: Basis,
    ) -> Self {
        let parts = basis.map(|v| ((libm::hypot(v[0], v[1]) / FINEST) as usize).clamp(1, PARTS));
        // All cells that the picture has a part of.
        let corners = [[0.0, 0.0], [w as f64, 0.0], [0.0, h as f64], [w as f64, h as f64]]
            .map(|corner| coefficients(basis, corner));
        let least = [0, 1].map(|k| corners.iter().fold(f64::MAX, |m, c| m.min(c[k])).floor());
        let most = [0, 1].map(|k| corners.iter().fold(f64::MIN, |m, c| m.max(c[k])).floor());
        let count = [0, 1].map(|k| (most[k] - least[k]) as usize + 1);
        let length = parts[0] * parts[1] * planes.len();
        let mut sums = vec![0.0; count[0] * count[1] * length];
        let mut weights = vec![0.0; count[0] * count[1] * parts[0] * parts[1]];
        let across = coefficients(basis, [1.0, 0.0]);
        for y in 0..h {
            let first = coefficients(basis, [0.5, y as f64 + 0.5]);
            for x in 0..w {
                let i = y * w + x;
                if usable.is_some_and(|u| !u[i]) {
                    continue;
                }
                // Along a vector the index of the cell, and of the part in it.
                let [a, b] = [0, 1].map(|k| {
                    let at = (first[k] + across[k] * x as f64 - least[k]).max(0.0);
                    let cell = (at as usize).min(count[k] - 1);
                    (cell, (((at - cell as f64) * parts[k] as f64) as usize).min(parts[k] - 1))
                });
                let (cell, part) = (a.0 * count[1] + b.0, a.1 * parts[1] + b.1);
                weights[cell * parts[0] * parts[1] + part] += 1.0;
                for (k, plane) in planes.iter().enumerate() {
                    sums[cell * length + part * planes.len() + k] += f64::from(plane[i]);
                }
            }
        }
        let (mut at, mut means) = (Vec::new(), Vec::new());
        // Those that lie in it whole, but for a part of a part.
        let full = area(basis) / (parts[0] * parts[1]) as f64;
        for (cell, (sums, weights)) in
            sums.chunks(length).zip(weights.chunks(parts[0] * parts[1])).enumerate()
        {
            if weights.iter().all(|&n| n > 0.0 && n >= 0.5 * full) {
                at.push([(cell / count[1]) as i32, (cell % count[1]) as i32]);
                means.extend(sums.iter().enumerate().map(|(i, s)| s / weights[i / planes.len()]));
            }
        }
        let n = at.len() as f64;
        for k in 0..length {
            let mean = means.iter().skip(k).step_by(length).sum::<f64>() / n;
            means.iter_mut().skip(k).step_by(length).for_each(|v| *v -= mean);
        }
        Self { at, means, length }
    }

    fn values(&self, cell: usize) -> &[f64] {
        &self.means[cell * self.length..][..self.length]
    }

    /// What is explained by the groups of cells that `coarser` moves into each other: two vectors in
    /// multiples of the cells'. `None` if a group has fewer than two cells.
    ///
    /// An analysis of variance. Under chance the ratio of variances is about that of two chi-squared
    /// variables, with as many degrees of freedom a cell as the cells have dimensions (Satterthwaite). To
    /// count these takes longer than all else, and is left out where the share is below `least`.
    fn explained(&self, coarser: [[i32; 2]; 2], least: f64) -> Option<Share> {
        let [[p, q], [r, s]] = coarser;
        let times = (p * s - q * r).abs();
        // Coefficients of the coarser lattice times `times`, of which whole multiples are nothing.
        let group = |[i, j]: [i32; 2]| {
            let (a, b) = ((i * s - j * r).rem_euclid(times), (j * p - i * q).rem_euclid(times));
            (a * times + b) as usize
        };
        let groups = (times * times) as usize;
        let mut counts = vec![0.0; groups];
        let mut sums = vec![0.0; groups * self.length];
        for (cell, &at) in self.at.iter().enumerate() {
            let group = group(at);
            counts[group] += 1.0;
            let sums = &mut sums[group * self.length..][..self.length];
            sums.iter_mut().zip(self.values(cell)).for_each(|(sum, v)| *sum += v);
        }
        if counts.iter().filter(|&&n| n >= 2.0).count() < times as usize {
            return None;
        }
        let (n, k) = (self.at.len() as f64, f64::from(times));
        let total: f64 = self.means.iter().map(|v| v * v).sum();
        let between: f64 = sums
            .chunks(self.length)
            .zip(&counts)
            .filter(|(_, n)| **n > 0.0)
            .map(|(sums, n)| sums.iter().map(|s| s * s).sum::<f64>() / n)
            .sum();
        let within = (total - between).max(1e-12 * total) / (n - k);
        if within <= 0.0 {
            return None;
        }
        let explained = (between - (k - 1.0) * within) / (total + within);
        if explained < least {
            return Some(Share { explained, deviations: 0.0 });
        }
        let rest: Vec<f64> = self
            .at
            .iter()
            .enumerate()
            .flat_map(|(cell, &at)| {
                let group = group(at);
                let (sums, n) = (&sums[group * self.length..][..self.length], counts[group]);
                self.values(cell).iter().zip(sums).map(move |(v, sum)| v - sum / n)
            })
            .collect();
        let dimensions = dimensions(&rest, self.length);
        let ratio = between / (k - 1.0) / within;
        let spread = (2.0 / dimensions * (1.0 / (k - 1.0) + 1.0 / (n - k))).sqrt();
        Some(Share { explained, deviations: (ratio - 1.0) / spread })
    }

    /// Whether the cells differ in turns by the groups of `coarser`; `None` if they are too few to say.
    pub(super) fn differ(&self, coarser: [[i32; 2]; 2]) -> Option<bool> {
        let least = SURE.explained.min(LIKELY.explained);
        let share = self.explained(coarser, least)?;
        Some(share.reaches(LIKELY) || share.reaches(SURE))
    }

    /// The turns in which the cells surely differ most.
    pub(super) fn turns(&self) -> Option<[[i32; 2]; 2]> {
        let all = TURNS
            .into_iter()
            .flat_map(|n| (0..n).map(move |b| [[n, 0], [b, 1]]).chain([[[1, 0], [0, n]]]));
        all.filter_map(|coarser| {
            let share = self.explained(coarser, SURE.explained)?;
            share.reaches(SURE).then_some((share.explained, coarser))
        })
        .reduce(|a, b| if b.0 > a.0 { b } else { a })
        .map(|(_, coarser)| coarser)
    }
}

/// The number of dimensions that vectors, one after another, extend in: the squared sum of their
/// covariance's eigenvalues over the sum of the squares.
fn dimensions(vectors: &[f64], length: usize) -> f64 {
    let mut covariance = vec![0.0; length * length];
    for v in vectors.chunks(length) {
        for (row, &a) in covariance.chunks_mut(length).zip(v) {
            row.iter_mut().zip(v).for_each(|(sum, b)| *sum += a * b);
        }
    }
    let trace: f64 = covariance.iter().step_by(length + 1).sum();
    let squares: f64 = covariance.iter().map(|v| v * v).sum();
    if squares > 0.0 { trace * trace / squares } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;

    const SIZE: (usize, usize) = (230, 250);

    /// Slanted cells of random shades with a darker corner, and what the shade of a cell is raised by.
    fn drawn(seed: u64, basis: Basis, raised: impl Fn(i32, i32) -> f64) -> Cells {
        let value = |i: usize| {
            let c = coefficients(basis, [(i % SIZE.1) as f64 + 0.5, (i / SIZE.1) as f64 + 0.5]);
            let [a, b] = c.map(|c| c.floor() as i32);
            let mut rng = Rng::new(seed, 0, a as u32, b as u64);
            let corner =
                if c[0] - c[0].floor() < 0.3 && c[1] - c[1].floor() < 0.3 { 0.5 } else { 0.0 };
            (f64::from(rng.below(1000)) / 1000.0 + raised(a, b) - corner) as f32
        };
        let plane = (0..SIZE.0 * SIZE.1).map(value).collect();
        Cells::new(&[plane], SIZE, None, basis)
    }

    const SLANTED: Basis = [[16.0, 3.0], [-5.0, 14.0]];

    #[test]
    fn cells_are_the_means_of_their_parts() {
        let (h, w) = (24, 36);
        let plane: Vec<f32> = (0..h * w).map(|i| ((i * i) % 97) as f32).collect();
        let planes = [plane.clone(), plane.iter().map(|v| 1.0 - v).collect()];
        let cells = Cells::new(&planes, (h, w), None, [[12.0, 0.0], [0.0, 8.0]]);
        assert_eq!(cells.at.len(), 9);
        // 12 pixels in 4 parts, 8 in 3 of unequal numbers of rows.
        assert_eq!(cells.length, 4 * 3 * 2);
        let naive = |at: [i32; 2], a: usize, b: usize, k: usize| {
            let inside = |i: &usize| {
                let (y, x) = (i / w, i % w);
                x / 12 == at[0] as usize
                    && y / 8 == at[1] as usize
                    && x % 12 / 3 == a
                    && (2 * (y % 8) + 1) * 3 / 16 == b
            };
            let all: Vec<f64> =
                (0..h * w).filter(inside).map(|i| f64::from(planes[k][i])).collect();
            all.iter().sum::<f64>() / all.len() as f64
        };
        for a in 0..4 {
            for b in 0..3 {
                for k in 0..2 {
                    let each: Vec<f64> = cells.at.iter().map(|&at| naive(at, a, b, k)).collect();
                    let mean = each.iter().sum::<f64>() / 9.0;
                    for (cell, value) in each.iter().enumerate() {
                        let got = cells.values(cell)[(a * 3 + b) * 2 + k];
                        assert!((got - (value - mean)).abs() < 1e-4, "{got} {value} {mean}");
                    }
                }
            }
        }
    }

    #[test]
    fn masked_cells_do_not_count() {
        let plane = vec![0.0; 24 * 36];
        let usable: Vec<bool> = (0..24 * 36).map(|i| i % 36 >= 13).collect();
        let cells = Cells::new(&[plane], (24, 36), Some(&usable), [[12.0, 0.0], [0.0, 8.0]]);
        // Nothing is left of the first column of cells; of the second column's parts two thirds at least.
        assert_eq!(cells.at.iter().filter(|at| at[0] == 0).count(), 0);
        assert_eq!(cells.at.len(), 6);
    }

    #[test]
    fn the_share_is_that_of_an_analysis_of_variance() {
        let cells =
            drawn(3, SLANTED, |a, b| if (a + 2 * b).rem_euclid(3) == 1 { 0.4 } else { 0.0 });
        for coarser in [[[3, 0], [1, 1]], [[3, 0], [2, 1]], [[1, 0], [0, 3]], [[2, 1], [0, 2]]] {
            let [[p, q], [r, s]] = coarser;
            // Cells are of a group if what is between them is a whole multiple.
            let same = |x: [i32; 2], y: [i32; 2]| {
                (-40..=40).any(|a: i32| {
                    (-40..=40)
                        .any(|b: i32| [a * p + b * r, a * q + b * s] == [x[0] - y[0], x[1] - y[1]])
                })
            };
            let n = cells.at.len();
            let group: Vec<Vec<usize>> = (0..n)
                .map(|i| (0..n).filter(|&j| same(cells.at[i], cells.at[j])).collect())
                .collect();
            let k = f64::from((p * s - q * r).abs());
            let (mut total, mut within) = (0.0, 0.0);
            for (i, group) in group.iter().enumerate() {
                for v in 0..cells.length {
                    let mean =
                        group.iter().map(|&j| cells.values(j)[v]).sum::<f64>() / group.len() as f64;
                    total += cells.values(i)[v].powi(2);
                    within += (cells.values(i)[v] - mean).powi(2);
                }
            }
            let error = within / (n as f64 - k);
            let want = (total - within - (k - 1.0) * error) / (total + error);
            let got = cells.explained(coarser, f64::MIN).expect("enough cells").explained;
            assert!((got - want).abs() < 1e-9, "{coarser:?}: {got}, not {want}");
        }
    }

    #[test]
    fn by_chance_cells_differ_by_a_few_deviations() {
        let all: Vec<Share> = (0..60)
            .filter_map(|seed| {
                drawn(seed, SLANTED, |_, _| 0.0).explained([[2, 0], [1, 1]], f64::MIN)
            })
            .collect();
        assert_eq!(all.len(), 60);
        let mean = all.iter().map(|s| s.deviations).sum::<f64>() / 60.0;
        let spread = all.iter().map(|s| s.deviations.powi(2)).sum::<f64>() / 60.0;
        assert!(mean.abs() < 0.5 && (0.4..2.0).contains(&spread), "{mean} {spread}");
        assert!(all.iter().map(|s| s.explained).sum::<f64>().abs() < 60.0 * 0.005);
    }

    #[test]
    fn turns_are_found_and_chance_is_not() {
        for seed in 0..5 {
            assert_eq!(drawn(seed, SLANTED, |_, _| 0.0).turns(), None);
            let board = drawn(seed, SLANTED, |a, b| f64::from((a + b).rem_euclid(2)));
            assert_eq!(board.turns(), Some([[2, 0], [1, 1]]), "seed {seed}");
            let rows = drawn(seed, SLANTED, |_, b| f64::from(u8::from(b.rem_euclid(3) == 0)));
            assert_eq!(rows.turns(), Some([[1, 0], [0, 3]]), "seed {seed}");
            assert_eq!(board.differ([[2, 0], [1, 1]]), Some(true));
            assert_eq!(board.differ([[2, 0], [0, 1]]), Some(false));
        }
        // Two cells in all say nothing.
        let few = drawn(0, [[120.0, 0.0], [0.0, 200.0]], |_, _| 0.0);
        assert_eq!(few.differ([[2, 0], [0, 1]]), None);
    }
}
