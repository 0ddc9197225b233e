//! [`Table`]: which part of the input lies at which vertex.
//!
//! Heitz and Neyret draw them at random. Here each is the best of many random ones: the one that differs
//! least from its neighbours where they are blended, among those that are not used already. So shapes go
//! on from tile to tile, and evaluation costs no more.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::base::rng::Rng;
use crate::method::noise::tiling::blend::powers;
use crate::method::noise::tiling::lattice::{Lattice, NEIGHBOURS};

/// Which part of the input lies at every vertex, and how alike neighbours are.
///
/// In JSON the five bytes of all vertices in base 64.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Table {
    /// Steps along x and y from the first place to that of the vertex.
    pub choices: Vec<[u8; 2]>,
    /// Correlation with the next vertex in the row, in the row below to the right, and there to the left,
    /// where they overlap: 255 is 1, and opposites count as 0.
    pub alike: Vec<[u8; 3]>,
}

impl From<Table> for String {
    fn from(table: Table) -> Self {
        let vertices = table.choices.iter().zip(&table.alike);
        let bytes: Vec<u8> =
            vertices.flat_map(|([x, y], [a, b, c])| [*x, *y, *a, *b, *c]).collect();
        STANDARD.encode(bytes)
    }
}

impl TryFrom<String> for Table {
    type Error = String;

    fn try_from(text: String) -> std::result::Result<Self, String> {
        let bytes = STANDARD.decode(text).map_err(|e| format!("its table is damaged ({e})"))?;
        if bytes.len() % 5 != 0 {
            return Err(format!("its table has {} bytes, not five for each vertex", bytes.len()));
        }
        let (choices, alike) =
            bytes.chunks_exact(5).map(|v| ([v[0], v[1]], [v[2], v[3], v[4]])).unzip();
        Ok(Self { choices, alike })
    }
}

/// Where in the input a vertex may lie: `first`, `first + step`, ...
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Places {
    /// The first along x and y.
    pub first: [u32; 2],
    /// Pixels from one to the next.
    pub step: [u32; 2],
    /// How many.
    pub count: [u32; 2],
}

impl Places {
    /// All that leave a cell around a vertex within an input of this size, thinned out to 256.
    pub fn new(size: [u32; 2], cell: [u32; 2]) -> Option<Self> {
        // A pixel more, for interpolation.
        let first = cell.map(|n| n.saturating_add(1));
        let mut places = Self { first, step: [1; 2], count: [1; 2] };
        for axis in 0..2 {
            let rest = size[axis].checked_sub(first[axis].saturating_mul(2))?;
            places.step[axis] = rest.div_ceil(255).max(1);
            places.count[axis] = rest / places.step[axis] + 1;
        }
        Some(places)
    }

    /// The place of a choice: the corner of a pixel, which lies to the right and below.
    pub fn at(&self, choice: [u8; 2]) -> [f64; 2] {
        self.pixel(choice).map(f64::from)
    }

    fn pixel(&self, choice: [u8; 2]) -> [i32; 2] {
        std::array::from_fn(|k| (self.first[k] + self.step[k] * u32::from(choice[k])) as i32)
    }
}

/// What a table is chosen for.
pub(super) struct Search<'a> {
    pub(super) lattice: &'a Lattice,
    pub(super) places: Places,
    pub(super) sharpness: u32,
    /// The input small, a little blurred, and as it is.
    pub(super) coarse: Plane,
    pub(super) smooth: Plane,
    pub(super) exact: Plane,
    pub(super) seed: u32,
}

/// Channels that are compared: the strongest.
const COMPARED: usize = 4;

/// The input at full size or smaller, each channel as strong as it is in the texture.
pub(super) struct Plane {
    /// How often it was halved.
    level: u32,
    rows: usize,
    cols: usize,
    pixels: Vec<[f32; COMPARED]>,
}

impl Plane {
    /// Of the channels' planes, the strongest first.
    pub(super) fn new(level: u32, (rows, cols): (usize, usize), planes: &[Vec<f32>]) -> Self {
        let pixel = |i| std::array::from_fn(|c| planes.get(c).map_or(0.0, |plane| plane[i]));
        Self { level, rows, cols, pixels: (0..rows * cols).map(pixel).collect() }
    }

    /// The pixel that holds one of the input at full size, or the nearest one.
    #[inline]
    fn at(&self, [x, y]: [i32; 2]) -> [f32; COMPARED] {
        let clamped = |v: i32, n: usize| ((v >> self.level).max(0) as usize).min(n - 1);
        self.pixels[clamped(y, self.rows) * self.cols + clamped(x, self.cols)]
    }
}

/// Random places that are tried for a vertex in each pass.
const TRIED: usize = 512;

/// How many of them, those that fit best by a few samples, are looked at closely.
const CLOSELY: usize = 24;

/// How often all vertices are chosen.
const PASSES: u32 = 3;

/// Samples of an overlap.
const SAMPLES: usize = 96;

/// The first of them, which are spread over all of it.
const FEW: usize = 16;

/// Share of the greatest weight below which an overlap does not matter.
const FAINT: f64 = 0.03;

/// How much a place that is used as often as on average costs more than one that is not, in the median
/// cost of places.
const USED: f32 = 0.5;

/// The stream of random numbers.
const STAGE: u32 = 0x7ab1e;

/// Places of an overlap, from the vertex, and their weights, whose sum is 1.
type Overlap = Vec<([i32; 2], f32)>;

/// What a neighbour shows at places from a vertex, and their weights.
type Shown = Vec<([i32; 2], f32, [f32; COMPARED])>;

/// A vertex' neighbour: its place in the input, the way to it, and which overlap they share.
struct Beside {
    place: [i32; 2],
    way: [i32; 2],
    overlap: usize,
    /// Whether the overlap is seen from the neighbour.
    turned: bool,
}

/// Steps of progress that [`choose`] takes.
pub(super) fn steps(lattice: &Lattice) -> u64 {
    u64::from(PASSES) * (lattice.len() as u64).div_ceil(lattice.columns() as u64)
}

/// Chooses a table, a step of progress to each row of each pass.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub(super) fn choose(ctx: &Ctx, search: &Search) -> Result<Table> {
    let vertices = search.lattice.len();
    let overlaps = NEIGHBOURS.map(|way| search.overlap(way));
    let mut chosen: Vec<Option<[u8; 2]>> = vec![None; vertices];
    let mut usage = Usage::new(search);
    for pass in 0..PASSES {
        for vertex in 0..vertices {
            let place = search.lattice.place(vertex);
            if place[0] == 0 {
                ctx.step(1)?;
            }
            let beside = search.beside(vertex, &chosen);
            if let Some(before) = chosen[vertex].take() {
                usage.add(before, -1.0);
                chosen[vertex] = Some(before);
            }
            let choice = search.best(pass, vertex, &beside, chosen[vertex], &overlaps, &usage);
            usage.add(choice, 1.0);
            chosen[vertex] = Some(choice);
        }
    }
    let alike = (0..vertices).map(|vertex| search.alike(vertex, &chosen, &overlaps)).collect();
    Ok(Table { choices: chosen.into_iter().flatten().collect(), alike })
}

impl Search<'_> {
    /// The places where a vertex and its neighbour along `way` are blended with each other.
    fn overlap(&self, way: [i64; 2]) -> Overlap {
        let [a, b] = self.lattice.cell();
        let to = [a * (way[0] as f64 + 0.5 * way[1] as f64), b * way[1] as f64];
        let weight = |[x, y]: [f64; 2]| {
            let w = [[x, y], [x - to[0], y - to[1]]]
                .map(|at| powers(self.lattice.weight(at) as f32, self.sharpness));
            let [w, v] = w.map(f64::from);
            if w > 0.0 && v > 0.0 { w * v / (w * w + v * v) } else { 0.0 }
        };
        // Evenly over the rhombus of both triangles: Roberts' R2 sequence.
        let mut places: Overlap = Vec::with_capacity(SAMPLES);
        let mut k = 0.0;
        while places.len() < SAMPLES && k < 1e5 {
            k += 1.0;
            let (s, t) = ((k * 0.754_877_666_246_693) % 1.0, (k * 0.569_840_290_998_053_3) % 1.0);
            let at = [to[0] * 0.5 + a * (2.0 * s - 1.0), to[1] * 0.5 + b * (2.0 * t - 1.0)]
                .map(f64::round);
            let w = weight(at);
            if w > FAINT * 0.5 {
                places.push((at.map(|v| v as i32), w as f32));
            }
        }
        let sum: f32 = places.iter().map(|(_, w)| w).sum();
        places.iter_mut().for_each(|(_, w)| *w /= sum);
        places
    }

    /// The neighbours of a vertex that have been chosen.
    fn beside(&self, vertex: usize, chosen: &[Option<[u8; 2]>]) -> Vec<Beside> {
        let [i, j] = self.lattice.place(vertex);
        let (_, here) = self.lattice.vertex(i, j);
        let both = NEIGHBOURS.iter().enumerate().flat_map(|(k, way)| [(k, 1, way), (k, -1, way)]);
        let one = |(overlap, sign, way): (usize, i64, &[i64; 2])| {
            let (index, there) = self.lattice.vertex(i + sign * way[0], j + sign * way[1]);
            let place = self.places.pixel(chosen[index].filter(|_| index != vertex)?);
            let way = std::array::from_fn(|k| (there[k] - here[k]).round() as i32);
            Some(Beside { place, way, overlap, turned: sign < 0 })
        };
        both.filter_map(one).collect()
    }

    /// The best of many choices for a vertex.
    fn best(
        &self,
        pass: u32,
        vertex: usize,
        beside: &[Beside],
        before: Option<[u8; 2]>,
        overlaps: &[Overlap; 3],
        usage: &Usage,
    ) -> [u8; 2] {
        let mut rng = Rng::new(u64::from(self.seed), STAGE, pass, vertex as u64);
        let count = self.places.count;
        let random = |rng: &mut Rng| count.map(|n| rng.below(n) as u8);
        let tried: Vec<[u8; 2]> = (0..TRIED).map(|_| random(&mut rng)).collect();
        let shown = |plane: &Plane, samples: usize| -> Vec<Shown> {
            let one = |b: &Beside| shown(plane, b, &overlaps[b.overlap], samples);
            beside.iter().map(one).collect()
        };
        let (few, all) = (shown(&self.coarse, FEW), shown(&self.smooth, SAMPLES));
        let roughly = |choice: [u8; 2]| cost(&self.coarse, self.places.pixel(choice), &few);
        let closely = |choice: [u8; 2]| cost(&self.smooth, self.places.pixel(choice), &all);
        let mut tried: Vec<Tried> = tried
            .into_par_iter()
            .with_min_len(64)
            .map(|choice| (roughly(choice), choice))
            .collect();
        let (_, &mut (median, _), _) =
            tried.select_nth_unstable_by(TRIED / 2, |a, b| by_cost(*a, *b));
        let per_use = USED * median / usage.mean();
        let total = |choice: [u8; 2], cost: f32| cost + per_use * usage.at(choice);
        tried.iter_mut().for_each(|(cost, choice)| *cost = total(*choice, *cost));
        tried.select_nth_unstable_by(CLOSELY, |a, b| by_cost(*a, *b));
        let kept = tried[..CLOSELY].iter().map(|&(_, choice)| choice).chain(before);
        let kept = kept.map(|choice| (choice, total(choice, closely(choice))));
        let mut best = kept.reduce(|a, b| if b.1 < a.1 { b } else { a }).unwrap_or(([0; 2], 0.0));
        // Downhill from there: lines join by single pixels.
        for by in [4i32, 2, 1] {
            let middle = best.0;
            for way in [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]] {
                let moved: [i32; 2] = std::array::from_fn(|k| i32::from(middle[k]) + by * way[k]);
                if (0..2).all(|k| (0..count[k] as i32).contains(&moved[k])) {
                    let choice = moved.map(|v| v as u8);
                    let total = total(choice, closely(choice));
                    if total < best.1 {
                        best = (choice, total);
                    }
                }
            }
        }
        best.0
    }

    /// Correlation with the three neighbours ahead.
    fn alike(&self, vertex: usize, chosen: &[Option<[u8; 2]>], overlaps: &[Overlap; 3]) -> [u8; 3] {
        let mut alike = [0; 3];
        // A vertex that is its own neighbour is not there.
        for beside in self.beside(vertex, chosen).iter().filter(|b| !b.turned) {
            let [x, y] = self.places.pixel(chosen[vertex].unwrap_or([0; 2]));
            let (mut products, mut squares) = (0.0f32, [0.0f32; 2]);
            let overlap = &overlaps[beside.overlap];
            for ([dx, dy], weight, theirs) in shown(&self.exact, beside, overlap, SAMPLES) {
                for (a, b) in self.exact.at([x + dx, y + dy]).iter().zip(theirs) {
                    products += weight * a * b;
                    squares[0] += weight * a * a;
                    squares[1] += weight * b * b;
                }
            }
            let size = (squares[0] * squares[1]).sqrt();
            let correlation = if size > 0.0 { products / size } else { 0.0 };
            alike[beside.overlap] = (255.0 * correlation.clamp(0.0, 1.0)).round() as u8;
        }
        alike
    }
}

/// What a neighbour shows at the first samples of an overlap.
fn shown(plane: &Plane, beside: &Beside, overlap: &Overlap, samples: usize) -> Shown {
    let one = |&(at, weight): &([i32; 2], f32)| {
        let (mine, theirs): ([i32; 2], [i32; 2]) = if beside.turned {
            (std::array::from_fn(|k| at[k] + beside.way[k]), at)
        } else {
            (at, std::array::from_fn(|k| at[k] - beside.way[k]))
        };
        (mine, weight, plane.at(std::array::from_fn(|k| beside.place[k] + theirs[k])))
    };
    overlap.iter().take(samples).map(one).collect()
}

/// Mean square difference from the neighbours of what lies at a place of the input.
fn cost(plane: &Plane, [x, y]: [i32; 2], shown: &[Shown]) -> f32 {
    let mut sum = 0.0;
    for shown in shown {
        let (mut squares, mut weights) = (0.0, 0.0);
        for ([dx, dy], weight, theirs) in shown {
            let mine = plane.at([x + dx, y + dy]);
            let [a, b, c, d] =
                std::array::from_fn(|k| (mine[k] - theirs[k]) * (mine[k] - theirs[k]));
            squares += weight * ((a + b) + (c + d));
            weights += weight;
        }
        // Tiles that go round after a few pixels may not overlap anywhere.
        sum += if weights > 0.0 { squares / weights } else { 0.0 };
    }
    sum
}

/// A choice and what it costs.
type Tried = (f32, [u8; 2]);

/// By cost, and as the sort is unstable, by choice.
fn by_cost(a: Tried, b: Tried) -> std::cmp::Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
}

/// How often places are used.
struct Usage {
    /// Around each node of a coarse grid over the places.
    nodes: Vec<f32>,
    columns: usize,
    rows: usize,
    /// Choices from a node to the next.
    spacing: [f32; 2],
    total: f32,
}

impl Usage {
    fn new(search: &Search) -> Self {
        // Half a cell apart.
        let steps = |axis: usize| {
            0.5 * search.lattice.cell()[axis] as f32 / search.places.step[axis] as f32
        };
        let spacing = [steps(0), steps(1)].map(|n| n.max(1.0));
        let nodes =
            |axis: usize| ((search.places.count[axis] - 1) as f32 / spacing[axis]) as usize + 2;
        let (columns, rows) = (nodes(0), nodes(1));
        Self { nodes: vec![0.0; columns * rows], columns, rows, spacing, total: 0.0 }
    }

    /// The four nodes around a choice and its share in each.
    fn around(&self, choice: [u8; 2]) -> [(usize, f32); 4] {
        let at: [f32; 2] = std::array::from_fn(|k| f32::from(choice[k]) / self.spacing[k]);
        let (x, y) = (at[0] as usize, at[1] as usize);
        let (tx, ty) = (at[0] - x as f32, at[1] - y as f32);
        let node = |x: usize, y: usize| y * self.columns + x;
        [
            (node(x, y), (1.0 - tx) * (1.0 - ty)),
            (node(x + 1, y), tx * (1.0 - ty)),
            (node(x, y + 1), (1.0 - tx) * ty),
            (node(x + 1, y + 1), tx * ty),
        ]
    }

    fn add(&mut self, choice: [u8; 2], by: f32) {
        for (node, share) in self.around(choice) {
            self.nodes[node] += by * share;
        }
        self.total += by;
    }

    fn at(&self, choice: [u8; 2]) -> f32 {
        self.around(choice).iter().map(|&(node, share)| share * self.nodes[node]).sum()
    }

    /// Of all places.
    fn mean(&self) -> f32 {
        (self.total / ((self.columns - 1) * (self.rows - 1)) as f32).max(1e-3)
    }
}
