//! [`Drift`]: how far a photo's cells lie beside the places that its lattice gives them.

use rayon::prelude::*;

use crate::base::ctx::Simd;
use crate::search::patch::{Kernel, MatchImage, WithKernel, squares, with_kernel};
use crate::signal::basis::{Basis, Vector, area, coefficients, combined};

/// Square roots of a cell's area, in pixels, at which cells are compared, coarse to fine, and by how many
/// pixels each may be off there. The coarse look allows an eighth of a cell: more could as well be the
/// next brick.
pub const LOOKS: [(f64, i64); 2] = [(24.0, 3), (64.0, 2)];

/// How often the mean cell is made anew from cells put into place, in each look.
const ROUNDS: usize = 2;

/// A cell that is this much farther off than the median of those around it, as a share of the root of
/// its area, is taken for damaged rather than displaced.
const OUTLIER: f64 = 0.04;

/// A displacement for every cell of a lattice.
#[derive(Debug, Clone, PartialEq)]
pub struct Drift {
    /// The cells: the first coefficients and how many.
    cells: [(i64, usize); 2],
    /// To the right and downwards, in pixels of the photo; row by row of the first coefficient.
    of: Vec<Vector>,
}

impl Drift {
    /// None at all.
    pub fn none() -> Self {
        Self { cells: [(0, 1); 2], of: vec![[0.0; 2]] }
    }

    /// The displacements of the cells of a photo of `height` x `width`. `look(scale)` is the photo in
    /// codes, reduced by that factor at most 1; what is not usable there does not matter much, as cells
    /// that are unlike the mean cell are not believed.
    ///
    /// Each cell is moved to where it is most like the mean of all cells, by squared differences; that
    /// mean is then made of the moved cells, and so on.
    ///
    /// # Determinism
    /// Sums of integers; same bytes for any thread count and SIMD level.
    pub fn measured(
        simd: Simd,
        basis: Basis,
        (height, width): (usize, usize),
        mut look: impl FnMut(f64) -> MatchImage,
    ) -> Self {
        let root = area(basis).sqrt();
        let corners =
            [[0.0, 0.0], [width as f64, 0.0], [0.0, height as f64], [width as f64, height as f64]];
        let corners = corners.map(|c| coefficients(basis, c));
        let cells = std::array::from_fn(|k| {
            let low = corners.iter().map(|c| c[k]).fold(f64::MAX, f64::min).floor();
            let high = corners.iter().map(|c| c[k]).fold(f64::MIN, f64::max).ceil();
            (low as i64, (high - low) as usize + 1)
        });
        let mut drift = Self { cells, of: vec![[0.0; 2]; cells[0].1 * cells[1].1] };
        let mut last = 0.0;
        for (side, reach) in LOOKS {
            let scale = (side / root).min(1.0);
            if scale == last {
                break;
            }
            last = scale;
            let image = look(scale);
            let scale =
                [image.width() as f64 / width as f64, image.height() as f64 / height as f64];
            for _ in 0..ROUNDS {
                drift.improve(simd, basis, &image, scale, reach, OUTLIER * root);
            }
        }
        drift
    }

    /// The displacement at a place given by its coefficients, between those of the cells around it.
    pub fn at(&self, a: f64, b: f64) -> Vector {
        let along = |v: f64, (first, n): (i64, usize)| {
            let v = (v - first as f64).clamp(0.0, (n - 1) as f64);
            let low = (v as usize).min(n.saturating_sub(2));
            (low, (low + 1).min(n - 1), v - low as f64)
        };
        let ((a0, a1, fa), (b0, b1, fb)) = (along(a, self.cells[0]), along(b, self.cells[1]));
        let at = |a: usize, b: usize| self.of[a * self.cells[1].1 + b];
        std::array::from_fn(|k| {
            let near = at(a0, b0)[k] * (1.0 - fb) + at(a0, b1)[k] * fb;
            let far = at(a1, b0)[k] * (1.0 - fb) + at(a1, b1)[k] * fb;
            near * (1.0 - fa) + far * fa
        })
    }

    /// How far the cells are displaced, in pixels: the root of the mean square, and the most.
    pub fn extent(&self) -> (f64, f64) {
        let squares = self.of.iter().map(|v| v[0] * v[0] + v[1] * v[1]);
        let most = squares.clone().fold(0.0, f64::max);
        ((squares.sum::<f64>() / self.of.len() as f64).sqrt(), most.sqrt())
    }

    /// One round: the mean cell, and every cell's place against it.
    fn improve(
        &mut self,
        simd: Simd,
        basis: Basis,
        image: &MatchImage,
        scale: [f64; 2],
        reach: i64,
        outlier: f64,
    ) {
        let size = std::array::from_fn(|k| {
            ((basis[0][k].abs() + basis[1][k].abs()) * scale[k]).ceil().max(2.0) as usize
        });
        let [w, h] = size;
        let n_b = self.cells[1].1;
        let corner = |i: usize, of: Vector| {
            let (a, b) = ((i / n_b) as i64 + self.cells[0].0, (i % n_b) as i64 + self.cells[1].0);
            let [x, y] = combined(basis, a as f64, b as f64);
            // The window has the node in its middle.
            let x = ((x + of[0]) * scale[0] - w as f64 / 2.0).round() as i64;
            let y = ((y + of[1]) * scale[1] - h as f64 / 2.0).round() as i64;
            let fits = |p: i64, side: usize, all: usize| {
                p >= reach && p + side as i64 + reach <= all as i64
            };
            (fits(x, w, image.width()) && fits(y, h, image.height())).then_some([x, y])
        };
        let corners: Vec<Option<[i64; 2]>> =
            self.of.iter().enumerate().map(|(i, &of)| corner(i, of)).collect();
        let whole: Vec<[i64; 2]> = corners.iter().flatten().copied().collect();
        if whole.len() < 2 {
            return;
        }
        let row = |y: i64, x: i64| image.codes_from(image.at(y as usize, x as usize), 4 * w);
        let mut mean = vec![0u8; 4 * w * h];
        mean.par_chunks_mut(4 * w).enumerate().for_each(|(dy, mean)| {
            let mut sums = vec![0u32; mean.len()];
            for &[x, y] in &whole {
                let codes = row(y + dy as i64, x);
                sums.iter_mut().zip(codes).for_each(|(sum, &code)| *sum += u32::from(code));
            }
            let n = whole.len() as u32;
            mean.iter_mut().zip(sums).for_each(|(mean, sum)| *mean = ((sum + n / 2) / n) as u8);
        });
        let found = |corner: &Option<[i64; 2]>| {
            let corner = (*corner)?;
            let side = (2 * reach + 1) as usize;
            let costs =
                with_kernel(simd, 1, Costs { image, mean: &mean, row: 4 * w, corner, reach });
            let best = (0..costs.len()).min_by_key(|&i| costs[i])?;
            let (by, bx) = (best / side, best % side);
            // Beyond what was looked at there may be better: it is not known.
            if by == 0 || bx == 0 || by + 1 == side || bx + 1 == side {
                return None;
            }
            let vertex = |step: usize| {
                let [before, here, after] =
                    [best - step, best, best + step].map(|i| costs[i] as f64);
                let bend = before + after - 2.0 * here;
                if bend > 0.0 { 0.5 * (before - after) / bend } else { 0.0 }
            };
            let x = (bx as i64 - reach) as f64 + vertex(1);
            let y = (by as i64 - reach) as f64 + vertex(side);
            Some([x, y])
        };
        let shifts: Vec<Option<Vector>> = corners.par_iter().map(found).collect();
        let moved = |i: usize| -> Option<Vector> {
            let ([x, y], [dx, dy]) = (corners[i]?, shifts[i]?);
            let (a, b) = ((i / n_b) as i64 + self.cells[0].0, (i % n_b) as i64 + self.cells[1].0);
            let [px, py] = combined(basis, a as f64, b as f64);
            let x = (x as f64 + dx + w as f64 / 2.0) / scale[0] - px;
            let y = (y as f64 + dy + h as f64 / 2.0) / scale[1] - py;
            Some([x, y])
        };
        let moved: Vec<Option<Vector>> = (0..self.of.len()).map(moved).collect();
        self.of = settled(&moved, self.cells[1].1, outlier);
    }
}

/// A displacement for every cell: its own if it is like those around it, else their median; cells
/// without one take that of the nearest rows and columns.
fn settled(moved: &[Option<Vector>], columns: usize, outlier: f64) -> Vec<Vector> {
    let rows = moved.len() / columns;
    let around = |i: usize, reach: usize| -> Option<Vector> {
        let (r, c) = (i / columns, i % columns);
        let near = |at: usize, n: usize| at.saturating_sub(reach)..(at + reach + 1).min(n);
        let all = near(r, rows).flat_map(|r| near(c, columns).map(move |c| r * columns + c));
        let all: Vec<Vector> = all.filter_map(|j| moved[j]).collect();
        let median = |k: usize| {
            let mut values: Vec<f64> = all.iter().map(|v| v[k]).collect();
            values.sort_unstable_by(f64::total_cmp);
            let n = values.len();
            0.5 * (values[(n - 1) / 2] + values[n / 2])
        };
        (!all.is_empty()).then(|| [median(0), median(1)])
    };
    let one = |i: usize| {
        let median = (1..=rows.max(columns)).find_map(|reach| around(i, reach)).unwrap_or_default();
        match moved[i] {
            Some(own) if (own[0] - median[0]).abs().max((own[1] - median[1]).abs()) <= outlier => {
                own
            }
            _ => median,
        }
    };
    (0..moved.len()).into_par_iter().map(one).collect()
}

/// How unlike the mean cell (codes, `row` a row) the picture is around a corner: the sum of squared differences for
/// every displacement by at most `reach` rows and columns, row by row.
struct Costs<'a> {
    image: &'a MatchImage,
    mean: &'a [u8],
    row: usize,
    corner: [i64; 2],
    reach: i64,
}

impl WithKernel for Costs<'_> {
    type Output = Vec<u64>;

    #[inline(always)]
    fn run<K: Kernel>(self, _: K) -> Vec<u64> {
        let Self { image, mean, row, corner: [x, y], reach } = self;
        let mut costs = Vec::new();
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let mut cost = 0;
                for (i, mean) in mean.chunks_exact(row).enumerate() {
                    let at = image.at((y + dy) as usize + i, (x + dx) as usize);
                    cost += squares(mean, image.codes_from(at, row)) as u64;
                }
                costs.push(cost);
            }
        }
        costs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use crate::signal::basis::dot;

    const CELL: (i64, i64) = (20, 24);
    const BASIS: Basis = [[24.0, 0.0], [0.0, 20.0]];

    /// Rows of cells of one pattern with noise; every three rows lie further to the right or back, and
    /// one cell is something else.
    fn photo(height: usize, width: usize) -> MatchImage {
        let mut image = MatchImage::new(height, width);
        image.fill_rows(|y, row| {
            let y = y as i64;
            for (x, px) in (0..).zip(row.iter_mut()) {
                let inside = x - shift(y);
                let key = inside.rem_euclid(CELL.1) / 3 * 100 + y.rem_euclid(CELL.0) / 3;
                let mut rng = Rng::new(1, 0, 0, key as u64);
                let mut noise = Rng::new(2, 0, y as u32, x as u64);
                let mut code = || (rng.below(100) + noise.below(20)) as u8;
                *px = [code(), code(), code(), 0];
                if (101..119).contains(&y) && (101..123).contains(&x) {
                    *px = [noise.below(128) as u8, 0, 127, 0];
                }
            }
        });
        image
    }

    /// How far to the right row `y` lies.
    fn shift(y: i64) -> i64 {
        [0, 1, 2, 1][(y / (3 * CELL.0)) as usize % 4]
    }

    #[test]
    fn rows_of_cells_are_found_where_they_lie() {
        let drift = Drift::measured(Simd::default(), BASIS, (240, 264), |scale| {
            assert_eq!(scale, 1.0, "cells as small as these are looked at as they are");
            photo(240, 264)
        });
        // The middle of each three rows, from left to right; the mean cell lies anywhere.
        let at = |row: usize, column: usize| drift.at(column as f64, row as f64);
        for column in 1..10 {
            let first = at(2, column);
            for (row, want) in [(5, 1.0), (8, 2.0), (11, 1.0)] {
                let here = at(row, column);
                let off = [here[0] - first[0] - want, here[1] - first[1]];
                assert!(
                    dot(off, off).sqrt() < 0.4,
                    "row {row}, column {column}: {here:?} {first:?}"
                );
            }
        }
        let (root, most) = drift.extent();
        assert!(root > 0.3 && most < 2.5, "{root} {most}");
        // Half way between two cells it is the mean of theirs.
        let (a, b, between) = (at(3, 4), at(4, 4), drift.at(4.0, 3.5));
        assert!((0..2).all(|k| (between[k] - 0.5 * (a[k] + b[k])).abs() < 1e-12));
    }

    #[test]
    fn outliers_and_unknown_cells_take_what_is_around_them() {
        let all = |v: f64| vec![Some([v, -v]); 35];
        let mut moved = all(1.0);
        moved[17] = Some([9.0, 0.0]);
        moved[0] = None;
        assert_eq!(settled(&moved, 7, 2.0), vec![[1.0, -1.0]; 35]);
        assert_eq!(settled(&[None; 35], 7, 2.0), vec![[0.0; 2]; 35]);
        let mut near = all(1.0);
        near[17] = Some([2.5, -1.0]);
        assert_eq!(settled(&near, 7, 2.0)[17], [2.5, -1.0], "not far enough to be wrong");
    }
}
