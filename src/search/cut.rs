//! Cuts: where two overlapping pieces are joined so that it shows least.

use std::collections::VecDeque;

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

    /// Every pixel, its neighbour on the right (0), then below (1), and their costs.
    fn neighbors(&self) -> impl Iterator<Item = (usize, usize, usize, [i32; 3])> + '_ {
        let n = self.height * self.width;
        let right = (0..n).filter(|p| p % self.width + 1 < self.width).map(|p| (p, p + 1));
        let below = (0..n.saturating_sub(self.width)).map(|p| (p, p + self.width));
        let right = right.zip(std::iter::repeat(0)).chain(below.zip(std::iter::repeat(1)));
        right.map(|((p, q), k)| (p, q, k, self.pairs[k][p]))
    }

    /// The side of every pixel: whether it is inside. Of equally good divisions the one with the fewest
    /// pixels inside.
    pub fn solve(&self) -> Vec<bool> {
        self.solve_within(&self.bound)
    }

    /// The same with these pixels bound.
    fn solve_within(&self, bound: &[Option<bool>]) -> Vec<bool> {
        let mut flow = Flow::new(self.height, self.width);
        for (p, cost) in self.outside.iter().enumerate() {
            flow.terminal[p] += cost;
        }
        for (p, q, d, [none, other, own]) in self.neighbors() {
            if bound[p].is_some() && bound[q].is_some() {
                continue;
            }
            // E = none + (own - none) p - own q + (other + own - none) (1 - p) q, inside counting as 1.
            flow.terminal[p] -= own - none;
            flow.terminal[q] += own;
            flow.arcs[d ^ 2][q] += other + own - none;
        }
        // Those that touch nothing free are settled, and left out.
        let touches = |p: usize| {
            Flow::DIRECTIONS.iter().any(|&d| flow.next(p, d).is_some_and(|q| bound[q].is_none()))
        };
        let terminal = bound.iter().enumerate().map(|(p, bound)| match bound {
            None => flow.terminal[p],
            Some(inside) if touches(p) => {
                if *inside {
                    FORCED
                } else {
                    -FORCED
                }
            }
            Some(_) => 0,
        });
        flow.terminal = terminal.collect();
        let inside = flow.solve();
        bound.iter().zip(inside).map(|(bound, inside)| bound.unwrap_or(inside)).collect()
    }

    /// Nearly the same in much less time: first the best division into squares of `step` pixels, then
    /// the best among those that differ from it only where squares of both sides touch.
    pub fn solve_by_steps(&self, step: usize) -> Vec<bool> {
        let (rows, columns) = (self.height.div_ceil(step), self.width.div_ceil(step));
        let square = |p: usize| p / self.width / step * columns + p % self.width / step;
        let mut coarse = Self::new(rows, columns);
        for (p, &cost) in self.outside.iter().enumerate() {
            coarse.outside[square(p)] += cost;
        }
        for (p, bound) in self.bound.iter().enumerate() {
            if bound.is_some() {
                coarse.bound[square(p)] = *bound;
            }
        }
        for (p, q, k, costs) in self.neighbors() {
            let (a, b) = (square(p), square(q));
            if a == b {
                coarse.outside[a] += costs[0];
            } else {
                let pair = &mut coarse.pairs[k][a];
                pair.iter_mut().zip(costs).for_each(|(sum, cost)| *sum += cost);
            }
        }
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
        let narrowed = |(p, bound): (usize, &Option<bool>)| {
            let q = square(p);
            bound.or(settled[q].then_some(found[q]))
        };
        let bound: Vec<Option<bool>> = self.bound.iter().enumerate().map(narrowed).collect();
        self.solve_within(&bound)
    }
}

/// What flow arcs between neighbouring pixels still take.
#[derive(Debug)]
struct Flow {
    height: usize,
    width: usize,
    /// From a pixel to the one on the right, below, left, above.
    arcs: [Vec<i32>; 4],
    /// The flow that a pixel still takes from the source (positive) or gives to the sink (negative).
    terminal: Vec<i32>,
}

/// Towards the right, below, left, above; the opposite of `d` is `d ^ 2`.
type Direction = u8;
/// A root: its parent is the source or the sink.
const ROOT: u8 = 4;
/// No parent at present.
const ORPHAN: u8 = 5;
/// In no tree.
const FREE: u8 = 6;

/// More than all other costs together.
const FORCED: i32 = 1 << 29;

impl Flow {
    const DIRECTIONS: [Direction; 4] = [0, 1, 2, 3];

    fn new(height: usize, width: usize) -> Self {
        let arcs = std::array::from_fn(|_| vec![0; height * width]);
        Self { height, width, arcs, terminal: vec![0; height * width] }
    }

    /// The pixel in a direction, if there is one.
    #[inline]
    fn next(&self, p: usize, d: Direction) -> Option<usize> {
        match d {
            0 => (p % self.width + 1 < self.width).then_some(p + 1),
            1 => (p + self.width < self.height * self.width).then_some(p + self.width),
            2 => (!p.is_multiple_of(self.width)).then(|| p - 1),
            _ => p.checked_sub(self.width),
        }
    }

    /// The source's side of a least cut, by maximum flow with two search trees (Boykov and Kolmogorov
    /// 2004).
    fn solve(mut self) -> Vec<bool> {
        let n = self.height * self.width;
        let mut trees = Trees {
            parent: vec![FREE; n],
            is_sink: vec![false; n],
            depth: vec![0; n],
            stamp: vec![0; n],
            active: VecDeque::new(),
            waits: vec![false; n],
            orphans: VecDeque::new(),
            now: 0,
        };
        for p in 0..n {
            if self.terminal[p] != 0 {
                trees.parent[p] = ROOT;
                trees.is_sink[p] = self.terminal[p] < 0;
                trees.depth[p] = 1;
                trees.wait(p);
            }
        }
        while let Some(&p) = trees.active.front() {
            let bridge = if trees.parent[p] == FREE { None } else { self.grow(&mut trees, p) };
            let Some((p, d, q)) = bridge else {
                trees.active.pop_front();
                trees.waits[p] = false;
                continue;
            };
            trees.now += 1;
            self.augment(&mut trees, (p, d, q));
            while let Some(orphan) = trees.orphans.pop_front() {
                self.adopt(&mut trees, orphan);
            }
        }
        self.reached()
    }

    /// What can still be reached from the source: the inside.
    fn reached(&self) -> Vec<bool> {
        let mut inside: Vec<bool> = self.terminal.iter().map(|&t| t > 0).collect();
        let mut open: Vec<usize> = (0..inside.len()).filter(|&p| inside[p]).collect();
        while let Some(p) = open.pop() {
            for d in Self::DIRECTIONS {
                let Some(q) = self.next(p, d) else { continue };
                if self.arcs[d as usize][p] > 0 && !inside[q] {
                    inside[q] = true;
                    open.push(q);
                }
            }
        }
        inside
    }

    /// Lets the tree grow around active pixel `p` until it touches the other one: the arc from the
    /// source's tree to the sink's.
    fn grow(&self, trees: &mut Trees, p: usize) -> Option<(usize, Direction, usize)> {
        let is_sink = trees.is_sink[p];
        for d in Self::DIRECTIONS {
            let Some(q) = self.next(p, d) else { continue };
            let open =
                if is_sink { self.arcs[(d ^ 2) as usize][q] } else { self.arcs[d as usize][p] };
            if open <= 0 {
                continue;
            }
            if trees.parent[q] == FREE {
                trees.parent[q] = d ^ 2;
                trees.is_sink[q] = is_sink;
                trees.depth[q] = trees.depth[p] + 1;
                trees.stamp[q] = trees.stamp[p];
                trees.wait(q);
            } else if trees.is_sink[q] != is_sink {
                return Some(if is_sink { (q, d ^ 2, p) } else { (p, d, q) });
            } else if trees.stamp[q] <= trees.stamp[p] && trees.depth[q] > trees.depth[p] + 1 {
                // A shorter way to the root.
                trees.parent[q] = d ^ 2;
                trees.depth[q] = trees.depth[p] + 1;
                trees.stamp[q] = trees.stamp[p];
            }
        }
        None
    }

    /// Pushes what the path over this arc takes.
    fn augment(&mut self, trees: &mut Trees, (p, d, q): (usize, Direction, usize)) {
        let mut most = self.arcs[d as usize][p];
        for (end, is_sink) in [(p, false), (q, true)] {
            let mut at = end;
            while trees.parent[at] != ROOT {
                let up = trees.parent[at];
                let next = self.next(at, up).unwrap_or(at);
                most = most.min(if is_sink {
                    self.arcs[up as usize][at]
                } else {
                    self.arcs[(up ^ 2) as usize][next]
                });
                at = next;
            }
            most = most.min(self.terminal[at].abs());
        }
        self.push(p, d, q, most);
        for (end, is_sink) in [(p, false), (q, true)] {
            let mut at = end;
            while trees.parent[at] != ROOT {
                let up = trees.parent[at];
                let next = self.next(at, up).unwrap_or(at);
                let left = if is_sink {
                    self.push(at, up, next, most);
                    self.arcs[up as usize][at]
                } else {
                    self.push(next, up ^ 2, at, most);
                    self.arcs[(up ^ 2) as usize][next]
                };
                if left == 0 {
                    trees.parent[at] = ORPHAN;
                    trees.orphans.push_back(at);
                }
                at = next;
            }
            self.terminal[at] += if is_sink { most } else { -most };
            if self.terminal[at] == 0 {
                trees.parent[at] = ORPHAN;
                trees.orphans.push_back(at);
            }
        }
    }

    fn push(&mut self, p: usize, d: Direction, q: usize, flow: i32) {
        self.arcs[d as usize][p] -= flow;
        self.arcs[(d ^ 2) as usize][q] += flow;
    }

    /// Finds a new parent in its tree for a pixel, or sets it free.
    fn adopt(&self, trees: &mut Trees, p: usize) {
        let is_sink = trees.is_sink[p];
        let mut best: Option<(u32, Direction)> = None;
        for d in Self::DIRECTIONS {
            let Some(q) = self.next(p, d) else { continue };
            let open =
                if is_sink { self.arcs[d as usize][p] } else { self.arcs[(d ^ 2) as usize][q] };
            if open <= 0 || trees.is_sink[q] != is_sink || trees.parent[q] >= ORPHAN {
                continue;
            }
            if let Some(depth) = self.depth(trees, q)
                && best.is_none_or(|(least, _)| depth < least)
            {
                best = Some((depth, d));
            }
        }
        if let Some((depth, d)) = best {
            trees.parent[p] = d;
            trees.depth[p] = depth + 1;
            trees.stamp[p] = trees.now;
            return;
        }
        trees.parent[p] = FREE;
        for d in Self::DIRECTIONS {
            let Some(q) = self.next(p, d) else { continue };
            if trees.parent[q] == FREE || trees.is_sink[q] != is_sink {
                continue;
            }
            let open =
                if is_sink { self.arcs[d as usize][p] } else { self.arcs[(d ^ 2) as usize][q] };
            if open > 0 {
                trees.wait(q);
            }
            if trees.parent[q] == d ^ 2 {
                trees.parent[q] = ORPHAN;
                trees.orphans.push_back(q);
            }
        }
    }

    /// How far a pixel is from its root; `None` if its tree hangs on an orphan.
    fn depth(&self, trees: &mut Trees, p: usize) -> Option<u32> {
        let (mut at, mut steps) = (p, 0);
        let root = loop {
            if trees.stamp[at] == trees.now {
                break steps + trees.depth[at];
            }
            match trees.parent[at] {
                ROOT => {
                    trees.stamp[at] = trees.now;
                    trees.depth[at] = 1;
                    break steps + 1;
                }
                ORPHAN | FREE => return None,
                up => at = self.next(at, up)?,
            }
            steps += 1;
        };
        // What was walked is known from now on.
        let (mut at, mut depth) = (p, root);
        while trees.stamp[at] != trees.now {
            trees.stamp[at] = trees.now;
            trees.depth[at] = depth;
            depth -= 1;
            at = self.next(at, trees.parent[at])?;
        }
        Some(root)
    }
}

/// The trees of residual arcs that grow from the source and towards the sink.
#[derive(Debug)]
struct Trees {
    /// The direction of the parent, or [`ROOT`], [`ORPHAN`], [`FREE`].
    parent: Vec<u8>,
    is_sink: Vec<bool>,
    /// The distance from the root, as it was at the time of `stamp`.
    depth: Vec<u32>,
    stamp: Vec<u32>,
    /// Pixels around which the tree may grow, each once.
    active: VecDeque<usize>,
    waits: Vec<bool>,
    orphans: VecDeque<usize>,
    now: u32,
}

impl Trees {
    fn wait(&mut self, p: usize) {
        if !self.waits[p] {
            self.waits[p] = true;
            self.active.push_back(p);
        }
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
            // By steps of one pixel nothing is given away; by two it is allowed and no worse than squares.
            let steps = division.solve_by_steps(1);
            prop_assert_eq!(Some(cost(&|p| steps[p])), least);
        }
    }
}
