//! Cuts: where two overlapping pieces are joined so that it shows least.

mod flow;

use flow::{FORCED, Flow};

/// The path of least sum through `costs` (`rows` x `columns`), one cell a column, from column to
/// column at most a row up or down, by dynamic programming (Efros and Freeman 2001): the row in every
/// column. Cells of [`BARRED`] are not entered. Of equally good paths the one that ends, and then
/// comes, from the highest rows.
pub fn path(costs: &[u32], rows: usize, columns: usize) -> Vec<usize> {
    let mut sums: Vec<u64> = vec![0; rows * columns];
    for x in 0..columns {
        for y in 0..rows {
            let before = match x {
                0 => 0,
                _ => (y.saturating_sub(1)..(y + 2).min(rows))
                    .map(|y| sums[y * columns + x - 1])
                    .min()
                    .unwrap_or(0),
            };
            sums[y * columns + x] = before + u64::from(costs[y * columns + x]);
        }
    }
    let lowest = |x: usize, rows: std::ops::Range<usize>| {
        rows.min_by_key(|&y| sums[y * columns + x]).unwrap_or(0)
    };
    let mut path = vec![0; columns];
    for x in (0..columns).rev() {
        path[x] = match path.get(x + 1) {
            None => lowest(x, 0..rows),
            Some(&y) => lowest(x, y.saturating_sub(1)..(y + 2).min(rows)),
        };
    }
    path
}

/// Cost of a cell that no path should enter: more than any path through others.
pub const BARRED: u32 = 1 << 28;

/// A picture's pixels to be divided in two, an inside and an outside, at the least cost: pairs of
/// neighbours cost something if they are parted or both outside.
#[derive(Debug, Clone)]
pub struct Division {
    height: usize,
    width: usize,
    /// Of every pixel and the one on its right, and the one below: what it costs if neither is inside,
    /// if only the other is, if only the pixel itself is.
    pairs: [Vec<[i32; 3]>; 2],
    /// What it costs if a pixel is outside.
    outside: Vec<i32>,
    /// The side that a pixel is bound to.
    bound: Vec<Option<bool>>,
}

impl Division {
    /// A picture without any costs.
    pub fn new(height: usize, width: usize) -> Self {
        let n = height * width;
        let pairs = [vec![[0; 3]; n], vec![[0; 3]; n]];
        Self { height, width, pairs, outside: vec![0; n], bound: vec![None; n] }
    }

    /// Pixel (`y`, `x`) is to be on this side (`true`: the inside).
    pub fn bind(&mut self, (y, x): (usize, usize), inside: bool) {
        self.bound[y * self.width + x] = Some(inside);
    }

    /// The costs of pixel (`y`, `x`) and its neighbour on the right, or `below`: if neither is inside,
    /// if only the neighbour is, if only the pixel is. Both inside cost nothing. Both outside may cost
    /// no more than the other two together.
    pub fn pair(&mut self, (y, x): (usize, usize), below: bool, costs: [i32; 3]) {
        self.pairs[usize::from(below)][y * self.width + x] = costs;
    }

    /// Calls `each` with all pixels (y, x) that have a neighbour on the right (0) or below (1), and the
    /// costs of both.
    fn each_pair(&self, mut each: impl FnMut((usize, usize), usize, [i32; 3])) {
        for y in 0..self.height {
            for x in 0..self.width {
                let p = y * self.width + x;
                if x + 1 < self.width {
                    each((y, x), 0, self.pairs[0][p]);
                }
                if y + 1 < self.height {
                    each((y, x), 1, self.pairs[1][p]);
                }
            }
        }
    }

    /// The side of every pixel: whether it is inside. Of equally good divisions the one with the fewest
    /// pixels inside.
    pub fn solve(&self) -> Vec<bool> {
        self.solve_within(&self.bound)
    }

    /// The same with these pixels bound.
    fn solve_within(&self, bound: &[Option<bool>]) -> Vec<bool> {
        let mut flow = Flow::new(self.height, self.width);
        let width = self.width;
        self.each_pair(|(y, x), d, [none, other, own]| {
            let p = y * width + x;
            if bound[p].is_some() && bound[p + [1, width][d]].is_some() {
                return;
            }
            // E = none + (own - none) p - own q + (other + own - none) (1 - p) q, inside counting as 1.
            let p = flow.at(y, x);
            let q = flow.next(p, d as u8);
            flow.terminal[p] -= own - none;
            flow.terminal[q] += own;
            flow.arcs[q][d ^ 2] += other + own - none;
        });
        for y in 0..self.height {
            for x in 0..width {
                let (p, at) = (y * width + x, flow.at(y, x));
                let Some(inside) = bound[p] else {
                    flow.terminal[at] += self.outside[p];
                    continue;
                };
                let touches = (x > 0 && bound[p - 1].is_none())
                    || (x + 1 < width && bound[p + 1].is_none())
                    || (y > 0 && bound[p - width].is_none())
                    || (y + 1 < self.height && bound[p + width].is_none());
                // Those that touch nothing free are settled, and left out.
                flow.terminal[at] = match (touches, inside) {
                    (false, _) => 0,
                    (true, true) => FORCED,
                    (true, false) => -FORCED,
                };
            }
        }
        let inside = flow.solve();
        bound.iter().zip(inside).map(|(bound, inside)| bound.unwrap_or(inside)).collect()
    }

    /// Nearly the same in much less time: first the best division into squares of `step` pixels, then
    /// the best among those that differ from it only where squares of both sides touch.
    pub fn solve_by_steps(&self, step: usize) -> Vec<bool> {
        let (rows, columns) = (self.height.div_ceil(step), self.width.div_ceil(step));
        let squares: Vec<usize> = (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| y / step * columns + x / step))
            .collect();
        let mut coarse = Self::new(rows, columns);
        for ((&square, &cost), bound) in squares.iter().zip(&self.outside).zip(&self.bound) {
            coarse.outside[square] += cost;
            if bound.is_some() {
                coarse.bound[square] = *bound;
            }
        }
        self.each_pair(|(y, x), k, costs| {
            let p = y * self.width + x;
            let (a, b) = (squares[p], squares[p + [1, self.width][k]]);
            if a == b {
                coarse.outside[a] += costs[0];
            } else {
                let pair = &mut coarse.pairs[k][a];
                pair.iter_mut().zip(costs).for_each(|(sum, cost)| *sum += cost);
            }
        });
        let found = coarse.solve();
        // A square among its like.
        let settled: Vec<bool> = (0..found.len())
            .map(|q| {
                let near = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
                let mut around = near(q / columns, rows)
                    .flat_map(|y| near(q % columns, columns).map(move |x| y * columns + x));
                around.all(|other| found[other] == found[q])
            })
            .collect();
        let narrowed =
            |(bound, &q): (&Option<bool>, &usize)| bound.or(settled[q].then_some(found[q]));
        let bound: Vec<Option<bool>> = self.bound.iter().zip(&squares).map(narrowed).collect();
        self.solve_within(&bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The least sum of any path, by trying them all.
    fn least_path(costs: &[u32], rows: usize, columns: usize, x: usize, y: usize) -> u64 {
        let own = u64::from(costs[y * columns + x]);
        if x + 1 == columns {
            return own;
        }
        let next = y.saturating_sub(1)..(y + 2).min(rows);
        own + next.map(|y| least_path(costs, rows, columns, x + 1, y)).min().unwrap_or(0)
    }

    proptest! {
        #[test]
        fn no_path_is_cheaper(
            (rows, columns, costs) in (1..5usize, 1..7usize)
                .prop_flat_map(|(r, c)| (Just(r), Just(c), prop::collection::vec(0..50u32, r * c)))
        ) {
            let found = path(&costs, rows, columns);
            prop_assert!(found.windows(2).all(|w| w[0].abs_diff(w[1]) <= 1));
            let sum: u64 = found.iter().enumerate().map(|(x, y)| u64::from(costs[y * columns + x])).sum();
            let least = (0..rows).map(|y| least_path(&costs, rows, columns, 0, y)).min();
            prop_assert_eq!(Some(sum), least);
        }

        #[test]
        fn no_division_is_cheaper(
            (height, width, pairs, forced) in (1..4usize, 1..5usize).prop_flat_map(|(h, w)| (
                Just(h),
                Just(w),
                prop::collection::vec([0..20i32, 0..20i32, 0..20i32], 2 * h * w),
                prop::collection::vec(0..5u8, h * w),
            ))
        ) {
            let n = height * width;
            let mut division = Division::new(height, width);
            let mut all = Vec::new();
            for p in 0..n {
                let (y, x) = (p / width, p % width);
                for below in [false, true] {
                    if (below && y + 1 == height) || (!below && x + 1 == width) {
                        continue;
                    }
                    let [none, other, own] = pairs[2 * p + usize::from(below)];
                    let costs = [none.min(other + own), other, own];
                    division.pair((y, x), below, costs);
                    all.push((p, if below { p + width } else { p + 1 }, costs));
                }
            }
            for (p, f) in forced.iter().enumerate() {
                if *f < 2 {
                    division.bind((p / width, p % width), *f == 1);
                }
            }
            let cost = |inside: &dyn Fn(usize) -> bool| {
                let pairs = all.iter().map(|&(p, q, [none, other, own])| match (inside(p), inside(q)) {
                    (false, false) => none,
                    (false, true) => other,
                    (true, false) => own,
                    (true, true) => 0,
                });
                pairs.sum::<i32>()
            };
            let allowed = |inside: &dyn Fn(usize) -> bool| {
                (0..n).all(|p| forced[p] >= 2 || inside(p) == (forced[p] == 1))
            };
            let least = (0..1u32 << n)
                .filter(|bits| allowed(&|p| bits >> p & 1 == 1))
                .map(|bits| cost(&|p| bits >> p & 1 == 1))
                .min();
            let found = division.solve();
            prop_assert!(allowed(&|p| found[p]));
            prop_assert_eq!(Some(cost(&|p| found[p])), least);
            // By steps of one pixel nothing is given away; by two it still is what is allowed.
            let steps = division.solve_by_steps(1);
            prop_assert_eq!(Some(cost(&|p| steps[p])), least);
            let steps = division.solve_by_steps(2);
            prop_assert!(allowed(&|p| steps[p]) && Some(cost(&|p| steps[p])) >= least);
        }
    }
}
