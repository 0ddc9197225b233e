//! [`Flow`]: maximum flow over the pixels of a picture.

use std::collections::VecDeque;

/// What flow arcs between neighbouring pixels still take. Around the picture lie pixels that nothing leads to:
/// every one of the picture has four neighbours.
#[derive(Debug)]
pub(super) struct Flow {
    height: usize,
    width: usize,
    /// From a pixel to the next in every direction, wrapping.
    steps: [usize; 4],
    /// From a pixel to the one on the right, below, left, above.
    pub(super) arcs: Vec<[i32; 4]>,
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
        // What lies on the right of a row lies on the left of the next, too.
        let stride = width + 1;
        let n = (height + 2) * stride;
        let steps = [1, stride, 1usize.wrapping_neg(), stride.wrapping_neg()];
        Self { height, width, steps, arcs: vec![[0; 4]; n], terminal: vec![0; n] }
    }

    /// The index of a pixel.
    pub(super) fn at(&self, y: usize, x: usize) -> usize {
        (y + 1) * (self.width + 1) + x
    }

    /// The pixel in a direction.
    #[inline]
    pub(super) fn next(&self, p: usize, d: Direction) -> usize {
        p.wrapping_add(self.steps[d as usize])
    }

    /// The source's side of a least cut, by maximum flow with two search trees (Boykov and Kolmogorov
    /// 2004).
    pub(super) fn solve(mut self) -> Vec<bool> {
        let n = self.terminal.len();
        let mut trees = Trees {
            nodes: vec![Node { parent: FREE, is_sink: false, waits: false, depth: 0, stamp: 0 }; n],
            active: VecDeque::new(),
            orphans: VecDeque::new(),
            now: 0,
        };
        for p in 0..n {
            if self.terminal[p] != 0 {
                let node = &mut trees.nodes[p];
                node.parent = ROOT;
                node.is_sink = self.terminal[p] < 0;
                node.depth = 1;
                trees.wait(p);
            }
        }
        while let Some(&p) = trees.active.front() {
            let bridge =
                if trees.nodes[p].parent == FREE { None } else { self.grow(&mut trees, p) };
            let Some((p, d, q)) = bridge else {
                trees.active.pop_front();
                trees.nodes[p].waits = false;
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

    /// What can still be reached from the source: the inside, row by row.
    fn reached(&self) -> Vec<bool> {
        let mut inside: Vec<bool> = self.terminal.iter().map(|&t| t > 0).collect();
        let mut open: Vec<usize> = (0..inside.len()).filter(|&p| inside[p]).collect();
        while let Some(p) = open.pop() {
            for d in Self::DIRECTIONS {
                let q = self.next(p, d);
                if self.arcs[p][d as usize] > 0 && !inside[q] {
                    inside[q] = true;
                    open.push(q);
                }
            }
        }
        (0..self.height).flat_map(|y| inside[self.at(y, 0)..][..self.width].to_vec()).collect()
    }

    /// Lets the tree grow around active pixel `p` until it touches the other one: the arc from the
    /// source's tree to the sink's.
    fn grow(&self, trees: &mut Trees, p: usize) -> Option<(usize, Direction, usize)> {
        let is_sink = trees.nodes[p].is_sink;
        for d in Self::DIRECTIONS {
            let q = self.next(p, d);
            let open =
                if is_sink { self.arcs[q][(d ^ 2) as usize] } else { self.arcs[p][d as usize] };
            if open <= 0 {
                continue;
            }
            if trees.nodes[q].parent == FREE {
                trees.nodes[q].parent = d ^ 2;
                trees.nodes[q].is_sink = is_sink;
                trees.nodes[q].depth = trees.nodes[p].depth + 1;
                trees.nodes[q].stamp = trees.nodes[p].stamp;
                trees.wait(q);
            } else if trees.nodes[q].is_sink != is_sink {
                return Some(if is_sink { (q, d ^ 2, p) } else { (p, d, q) });
            } else if trees.nodes[q].stamp <= trees.nodes[p].stamp
                && trees.nodes[q].depth > trees.nodes[p].depth + 1
            {
                // A shorter way to the root.
                trees.nodes[q].parent = d ^ 2;
                trees.nodes[q].depth = trees.nodes[p].depth + 1;
                trees.nodes[q].stamp = trees.nodes[p].stamp;
            }
        }
        None
    }

    /// Pushes what the path over this arc takes.
    fn augment(&mut self, trees: &mut Trees, (p, d, q): (usize, Direction, usize)) {
        let mut most = self.arcs[p][d as usize];
        for (end, is_sink) in [(p, false), (q, true)] {
            let mut at = end;
            while trees.nodes[at].parent != ROOT {
                let up = trees.nodes[at].parent;
                let next = self.next(at, up);
                most = most.min(if is_sink {
                    self.arcs[at][up as usize]
                } else {
                    self.arcs[next][(up ^ 2) as usize]
                });
                at = next;
            }
            most = most.min(self.terminal[at].abs());
        }
        self.push(p, d, q, most);
        for (end, is_sink) in [(p, false), (q, true)] {
            let mut at = end;
            while trees.nodes[at].parent != ROOT {
                let up = trees.nodes[at].parent;
                let next = self.next(at, up);
                let left = if is_sink {
                    self.push(at, up, next, most);
                    self.arcs[at][up as usize]
                } else {
                    self.push(next, up ^ 2, at, most);
                    self.arcs[next][(up ^ 2) as usize]
                };
                if left == 0 {
                    trees.nodes[at].parent = ORPHAN;
                    trees.orphans.push_back(at);
                }
                at = next;
            }
            self.terminal[at] += if is_sink { most } else { -most };
            if self.terminal[at] == 0 {
                trees.nodes[at].parent = ORPHAN;
                trees.orphans.push_back(at);
            }
        }
    }

    fn push(&mut self, p: usize, d: Direction, q: usize, flow: i32) {
        self.arcs[p][d as usize] -= flow;
        self.arcs[q][(d ^ 2) as usize] += flow;
    }

    /// Finds a new parent in its tree for a pixel, or sets it free.
    fn adopt(&self, trees: &mut Trees, p: usize) {
        let is_sink = trees.nodes[p].is_sink;
        let mut best: Option<(u32, Direction)> = None;
        for d in Self::DIRECTIONS {
            let q = self.next(p, d);
            let open =
                if is_sink { self.arcs[p][d as usize] } else { self.arcs[q][(d ^ 2) as usize] };
            if open <= 0 || trees.nodes[q].is_sink != is_sink || trees.nodes[q].parent >= ORPHAN {
                continue;
            }
            if let Some(depth) = self.depth(trees, q)
                && best.is_none_or(|(least, _)| depth < least)
            {
                best = Some((depth, d));
            }
        }
        if let Some((depth, d)) = best {
            trees.nodes[p].parent = d;
            trees.nodes[p].depth = depth + 1;
            trees.nodes[p].stamp = trees.now;
            return;
        }
        trees.nodes[p].parent = FREE;
        for d in Self::DIRECTIONS {
            let q = self.next(p, d);
            if trees.nodes[q].parent == FREE || trees.nodes[q].is_sink != is_sink {
                continue;
            }
            let open =
                if is_sink { self.arcs[p][d as usize] } else { self.arcs[q][(d ^ 2) as usize] };
            if open > 0 {
                trees.wait(q);
            }
            if trees.nodes[q].parent == d ^ 2 {
                trees.nodes[q].parent = ORPHAN;
                trees.orphans.push_back(q);
            }
        }
    }

    /// How far a pixel is from its root; `None` if its tree hangs on an orphan.
    fn depth(&self, trees: &mut Trees, p: usize) -> Option<u32> {
        let (mut at, mut steps) = (p, 0);
        let root = loop {
            if trees.nodes[at].stamp == trees.now {
                break steps + trees.nodes[at].depth;
            }
            match trees.nodes[at].parent {
                ROOT => {
                    trees.nodes[at].stamp = trees.now;
                    trees.nodes[at].depth = 1;
                    break steps + 1;
                }
                ORPHAN | FREE => return None,
                up => at = self.next(at, up),
            }
            steps += 1;
        };
        // What was walked is known from now on.
        let (mut at, mut depth) = (p, root);
        while trees.nodes[at].stamp != trees.now {
            trees.nodes[at].stamp = trees.now;
            trees.nodes[at].depth = depth;
            depth -= 1;
            at = self.next(at, trees.nodes[at].parent);
        }
        Some(root)
    }
}

/// A pixel of a tree.
#[derive(Debug, Clone)]
struct Node {
    /// The direction of the parent, or [`ROOT`], [`ORPHAN`], [`FREE`].
    parent: u8,
    is_sink: bool,
    /// Whether it is one of the active.
    waits: bool,
    /// The distance from the root, as it was at the time of `stamp`.
    depth: u32,
    stamp: u32,
}

/// The trees of residual arcs that grow from the source and towards the sink.
#[derive(Debug)]
struct Trees {
    nodes: Vec<Node>,
    /// Pixels around which the tree may grow, each once.
    active: VecDeque<usize>,
    orphans: VecDeque<usize>,
    now: u32,
}

impl Trees {
    fn wait(&mut self, p: usize) {
        if !self.nodes[p].waits {
            self.nodes[p].waits = true;
            self.active.push_back(p);
        }
    }
}
