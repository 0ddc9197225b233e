//! [`Flow`]: maximum flow over the pixels of a picture.

use std::collections::VecDeque;

/// What flow arcs between neighbouring pixels still take.
#[derive(Debug)]
pub(super) struct Flow {
    height: usize,
    width: usize,
    /// From a pixel to the one on the right, below, left, above.
    pub(super) arcs: [Vec<i32>; 4],
    /// The flow that a pixel still takes from the source (positive) or gives to the sink (negative).
    pub(super) terminal: Vec<i32>,
}

/// Towards the right, below, left, above; the opposite of `d` is `d ^ 2`.
pub(super) type Direction = u8;
/// A root: its parent is the source or the sink.
const ROOT: u8 = 4;
/// No parent at present.
const ORPHAN: u8 = 5;
/// In no tree.
const FREE: u8 = 6;

/// More than all other costs together.
pub(super) const FORCED: i32 = 1 << 29;

impl Flow {
    pub(super) const DIRECTIONS: [Direction; 4] = [0, 1, 2, 3];

    pub(super) fn new(height: usize, width: usize) -> Self {
        let arcs = std::array::from_fn(|_| vec![0; height * width]);
        Self { height, width, arcs, terminal: vec![0; height * width] }
    }

    /// The pixel in a direction, if there is one.
    #[inline]
    pub(super) fn next(&self, p: usize, d: Direction) -> Option<usize> {
        match d {
            0 => (p % self.width + 1 < self.width).then_some(p + 1),
            1 => (p + self.width < self.height * self.width).then_some(p + self.width),
            2 => (!p.is_multiple_of(self.width)).then(|| p - 1),
            _ => p.checked_sub(self.width),
        }
    }

    /// The source's side of a least cut, by maximum flow with two search trees (Boykov and Kolmogorov
    /// 2004).
    pub(super) fn solve(mut self) -> Vec<bool> {
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
