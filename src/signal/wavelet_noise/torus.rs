//! [`Torus`]: wavelet noise on the plane.

use super::filters::hold;
use std::sync::{Arc, OnceLock};

use super::fourier::{Strength, filter};
use super::places::{BEYOND, BLOCK, Places};
use super::{Detail, SPLINE_PRODUCTS, quantised, spline_weights, white, wrapped};

/// A torus of coefficients of wavelet noise on the plane, whose unit of length is one coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct Torus {
    rows: usize,
    cols: usize,
    integers: Vec<i16>,
    /// The integers, scaled: the first two rows follow the last, and the first columns every row's last, so
    /// that no neighbour lies beyond an end.
    values: Vec<f32>,
    scale: f32,
}

/// Rising positions on an axis of a torus: for each, which three neighbouring coefficients count, and how
/// much.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// The coefficients that any position needs: the first, and how many, round the torus.
    start: usize,
    span: usize,
    /// The last one may go on with positions at `start` that count for nothing.
    blocks: Vec<RowBlock>,
}

/// Positions of a [`Row`] that are worked on at a time.
#[derive(Debug, Clone, Default)]
struct RowBlock {
    /// The first of each position's three coefficients, counted from the row's start.
    first: [u32; AT_ONCE],
    weights: [[f32; AT_ONCE]; 3],
}

const AT_ONCE: usize = 8;

impl RowBlock {
    /// Weighted sums of coefficients, from the row's start.
    #[inline(always)]
    fn sums(&self, coefficients: &[f32]) -> [f32; AT_ONCE] {
        // Gathered first, so that the sums are made for all at once.
        let mut values = [[0.0; AT_ONCE]; 3];
        for (i, &first) in self.first.iter().enumerate() {
            let three = &coefficients[first as usize..][..3];
            (0..3).for_each(|k| values[k][i] = three[k]);
        }
        let ([v0, v1, v2], [w0, w1, w2]) = (&values, &self.weights);
        std::array::from_fn(|i| (w0[i] * v0[i] + w1[i] * v1[i]) + w2[i] * v2[i])
    }
}

impl Row {
    /// Of these positions, on a torus of `n` coefficients.
    pub fn new(positions: impl Iterator<Item = f64>, n: usize) -> Self {
        let (firsts, weights): (Vec<f64>, Vec<[f32; 3]>) = positions.map(spline_weights).unzip();
        let (Some(&least), Some(&most)) = (firsts.first(), firsts.last()) else {
            return Self::default();
        };
        let mut blocks = vec![RowBlock::default(); firsts.len().div_ceil(AT_ONCE)];
        for (i, (first, weights)) in firsts.into_iter().zip(weights).enumerate() {
            let (block, i) = (&mut blocks[i / AT_ONCE], i % AT_ONCE);
            block.first[i] = wrapped(first - least, n);
            (0..3).for_each(|k| block.weights[k][i] = weights[k]);
        }
        // All of them at most, and two again so that three always follow each other.
        let span = (most - least + 3.0).min((n + 2) as f64) as usize;
        Self { start: wrapped(least, n) as usize, span, blocks }
    }
}

impl Torus {
    /// Side of the torus of textures that need not tile.
    pub const SIDE: usize = 256;

    /// The coefficients of textures that need not tile: [`Torus::SIDE`] rows and columns. Made once in a
    /// process.
    pub fn shared(detail: Detail) -> Arc<Self> {
        static MADE: [OnceLock<Arc<Torus>>; Detail::COUNT] =
            [const { OnceLock::new() }; Detail::COUNT];
        let side = (Self::SIDE, Self::SIDE);
        MADE[detail.index()].get_or_init(|| Arc::new(Self::new(side, detail))).clone()
    }

    /// The coefficients of an even number of `rows` and of `cols` (at least 2 each), drawn once and for
    /// all.
    pub fn new((rows, cols): (usize, usize), detail: Detail) -> Self {
        let coefficients = if detail == Detail::Square {
            square((rows, cols))
        } else {
            let mut plane = white_plane((rows, cols), 2);
            let (x, y) = (detail.frequencies(0, cols), detail.frequencies(1, rows));
            filter(&mut plane, [rows, cols], Strength::Kept, |[down, across]| {
                detail.amplitude([&x[across], &y[down]]).unwrap_or(1.0)
            });
            plane
        };
        Self::of(&coefficients, (rows, cols))
    }

    /// Others, drawn from a stream of random numbers, in which all waves are as strong as they are in noise
    /// on average; the mean is nothing. Where only a few waves go round, drawn strengths would leave
    /// stripes by chance.
    pub fn even((rows, cols): (usize, usize), detail: Detail, stream: u32) -> Self {
        let mut plane = white_plane((rows, cols), stream);
        let (x, y) = (detail.frequencies(0, cols), detail.frequencies(1, rows));
        filter(&mut plane, [rows, cols], Strength::Even, |[down, across]| {
            let mean = down + across == 0;
            if mean { 0.0 } else { detail.power([&x[across], &y[down]]).max(0.0).sqrt() }
        });
        Self::of(&plane, (rows, cols))
    }

    /// Of these coefficients.
    fn of(coefficients: &[f64], (rows, cols): (usize, usize)) -> Self {
        assert!(rows >= 2 && cols >= 2 && rows % 2 == 0 && cols % 2 == 0, "{rows}x{cols}");
        let (integers, scale) =
            quantised(coefficients, |integers| variance(integers, (rows, cols)));
        let mut values = Vec::with_capacity((rows + 2) * (cols + BEYOND));
        for row in integers.chunks_exact(cols).cycle().take(rows + 2) {
            values.extend(row.iter().cycle().take(cols + BEYOND).map(|&v| f32::from(v) * scale));
        }
        Self { rows, cols, integers, values, scale }
    }

    /// Numbers of rows and columns.
    pub fn shape(&self) -> (usize, usize) {
        (self.rows, self.cols)
    }

    /// The coefficients as the format has them, row by row.
    pub fn integers(&self) -> &[i16] {
        &self.integers
    }

    /// By what an integer is multiplied to become a coefficient of noise of unit variance.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// The noise at position (x, y): of mean 0 and, over all positions, variance 1.
    #[inline]
    pub fn at(&self, x: f64, y: f64) -> f32 {
        let (left, wx) = spline_weights(x);
        let (top, wy) = spline_weights(y);
        let (x, y) = (wrapped(left, self.cols) as usize, wrapped(top, self.rows) as usize);
        let [v0, v1, v2] = [0, 1, 2].map(|k| {
            let [a, b, c] = [0, 1, 2].map(|j| self.row(y + j)[x + k]);
            wx[k] * ((wy[0] * a + wy[1] * b) + wy[2] * c)
        });
        (v0 + v1) + v2
    }

    /// A row of values and those beyond its end.
    fn row(&self, y: usize) -> &[f32] {
        let stride = self.cols + BEYOND;
        &self.values[y * stride..][..stride]
    }

    /// Adds `weight` times the noise at a block of points to `sums`: the same bits as [`Torus::at`] gives.
    #[inline(always)]
    pub fn add_block(&self, [xs, ys]: &[Places; 2], weight: f32, sums: &mut [f32; BLOCK]) {
        let stride = self.cols + BEYOND;
        // Along y, four columns at a time, of which the last has no weight.
        let mut columns = [[0.0; 4]; BLOCK];
        let [w0, w1, w2] = &ys.weights;
        for i in 0..BLOCK {
            let at = ys.first[i] as usize * stride + xs.first[i] as usize;
            let a = &self.values[at..][..4];
            let b = &self.values[at + stride..][..4];
            let c = &self.values[at + 2 * stride..][..4];
            for k in 0..4 {
                columns[i][k] = (w0[i] * a[k] + w1[i] * b[k]) + w2[i] * c[k];
            }
        }
        let [w0, w1, w2] = &xs.weights;
        for (i, (sum, v)) in sums.iter_mut().zip(&columns).enumerate() {
            *sum += weight * ((w0[i] * v[0] + w1[i] * v[1]) + w2[i] * v[2]);
        }
    }

    /// Adds `weight` times the noise at the positions of `xs` and height `y` to `sums`: the same bits as
    /// [`Torus::at`] gives. `combined` is scratch space.
    #[inline(always)]
    pub fn add_row(
        &self,
        xs: &Row,
        y: f64,
        weight: f32,
        combined: &mut Vec<f32>,
        sums: &mut [f32],
    ) {
        let (top, wy) = spline_weights(y);
        let top = wrapped(top, self.rows) as usize;
        let rows = [0, 1, 2].map(|k| &self.row(top + k)[..self.cols]);
        combined.clear();
        let mut at = xs.start;
        while combined.len() < xs.span {
            let run = (xs.span - combined.len()).min(self.cols - at);
            let [a, b, c] = rows.map(|row| &row[at..at + run]);
            let columns = a.iter().zip(b).zip(c);
            combined.extend(columns.map(|((a, b), c)| (wy[0] * a + wy[1] * b) + wy[2] * c));
            at = 0;
        }
        let (blocks, rest) = sums.as_chunks_mut::<AT_ONCE>();
        let (whole, last) = xs.blocks.split_at(blocks.len().min(xs.blocks.len()));
        let add = |(sum, value): (&mut f32, f32)| *sum += weight * value;
        for (sums, block) in blocks.iter_mut().zip(whole) {
            sums.iter_mut().zip(block.sums(combined)).for_each(add);
        }
        for block in last.iter().take(1) {
            rest.iter_mut().zip(block.sums(combined)).for_each(add);
        }
    }
}

fn white_plane((rows, cols): (usize, usize), stream: u32) -> Vec<f64> {
    let index = |i: usize| ((i / cols) as u32) << 16 | (i % cols) as u32;
    (0..rows * cols).map(|i| f64::from(white(stream, index(i)))).collect()
}

/// Coefficients of Cook and DeRose's noise: a sum of two, each white noise without what half the
/// resolution holds. The second is moved by an odd number of coefficients along both axes, so that its
/// pairs of coefficients that share one of half the resolution lie elsewhere. (Cook and DeRose move a
/// copy of the first: then everything is there twice.)
fn square((rows, cols): (usize, usize)) -> Vec<f64> {
    let [first, second] = [0, 1].map(|stream| {
        let white = white_plane((rows, cols), stream);
        let held = held(&held(&white, cols, true), cols, false);
        white.iter().zip(&held).map(|(w, h)| w - h).collect::<Vec<_>>()
    });
    let moved = |i: usize, n: usize| (i + ((n / 2) | 1)) % n;
    let both = |i: usize| first[i] + second[moved(i / cols, rows) * cols + moved(i % cols, cols)];
    (0..rows * cols).map(both).collect()
}

/// What half the resolution along x, or along y, can hold of a plane.
fn held(plane: &[f64], cols: usize, along_x: bool) -> Vec<f64> {
    let mut out = plane.to_vec();
    let mut half = Vec::new();
    if along_x {
        out.chunks_exact_mut(cols).for_each(|line| hold(line, &mut half));
    } else {
        let mut line = Vec::new();
        for x in 0..cols {
            line.clear();
            line.extend(out[x..].iter().step_by(cols));
            hold(&mut line, &mut half);
            out[x..].iter_mut().step_by(cols).zip(&line).for_each(|(o, v)| *o = *v);
        }
    }
    out
}

/// Variance of the spline surface over these coefficients, averaged over all positions: sums of integers.
fn variance(integers: &[i16], (rows, cols): (usize, usize)) -> f64 {
    let around = |i: usize, n: usize| (i + n * 2 - 2) % n;
    // Filtered by the spline's products with itself, along x and then y: 120^2 * 2^15 is below 2^31.
    let products = SPLINE_PRODUCTS.map(|p| p as i32);
    let sum = |v: [i32; 5]| (0..5).map(|k| products[k] * v[k]).sum::<i32>();
    let mut across = Vec::with_capacity(integers.len());
    for row in integers.chunks_exact(cols) {
        let longer: Vec<i32> = (0..cols + 4).map(|x| i32::from(row[around(x, cols)])).collect();
        across.extend((0..cols).map(|x| sum(std::array::from_fn(|k| longer[x + k]))));
    }
    let mut total = 0i128;
    for (y, row) in integers.chunks_exact(cols).enumerate() {
        let lines: [&[i32]; 5] =
            std::array::from_fn(|k| &across[around(y + k, rows) * cols..][..cols]);
        let filtered = |x: usize| i64::from(sum(lines.map(|line| line[x])));
        let products = row.iter().enumerate().map(|(x, &v)| i64::from(v) * filtered(x));
        total += i128::from(products.sum::<i64>());
    }
    let mean = integers.iter().map(|&v| i64::from(v)).sum::<i64>() as f64 / integers.len() as f64;
    total as f64 / (120.0 * 120.0 * integers.len() as f64) - mean * mean
}

#[cfg(test)]
mod tests {
    use super::super::Part;
    use super::*;

    fn positions(n: usize, step: f64) -> impl Iterator<Item = (f64, f64)> {
        (0..n * n).map(move |i| ((i / n) as f64 * step, (i % n) as f64 * step))
    }

    #[test]
    fn its_variance_is_one_and_its_mean_nothing() {
        let oriented = Detail::Axes([Part::Low, Part::Band]);
        for detail in [Detail::Square, Detail::Round, Detail::RoundFine, oriented] {
            for shape in [(256, 256), (16, 48), (4, 4)] {
                let torus = Torus::new(shape, detail);
                let n = 4 * shape.0.max(shape.1);
                let all: Vec<f64> = positions(n, 0.25)
                    .map(|(x, y)| f64::from(torus.at(x + 0.125, y + 0.125)))
                    .collect();
                let mean = all.iter().sum::<f64>() / all.len() as f64;
                let square =
                    all.iter().map(|v| v * v).sum::<f64>() / all.len() as f64 - mean * mean;
                assert!((square - 1.0).abs() < 0.02, "{detail:?} {shape:?}: {square}");
                if detail != oriented {
                    assert!(mean.abs() < 0.01, "{detail:?} {shape:?}: {mean}");
                }
            }
        }
    }

    #[test]
    fn a_row_has_the_same_bits_as_its_points() {
        let torus = Torus::new((16, 24), Detail::Square);
        for step in [0.0, 0.01, 0.37, 1.0, 3.1] {
            let xs = |i: usize| i as f64 * step - 50.3;
            let row = Row::new((0..400).map(xs), 24);
            for y in [-31.25, 0.0, 0.5, 7.77, 1e6] {
                let mut sums = vec![0.0; 400];
                torus.add_row(&row, y, 0.7, &mut Vec::new(), &mut sums);
                for (i, &sum) in sums.iter().enumerate() {
                    assert_eq!(sum, 0.0 + 0.7 * torus.at(xs(i), y), "at {i}");
                }
            }
        }
    }

    #[test]
    fn a_block_has_the_same_bits_as_its_points() {
        let torus = Torus::new((16, 64), Detail::Square);
        let x = |i: usize| i as f64 * 0.37 - 2e9;
        let y = |i: usize| 15.0 - (i * i) as f64 * 0.25;
        let mut places = [const { Places::NONE }; 2];
        places[0].set(64, x);
        places[1].set(16, y);
        let mut sums = [0.5; BLOCK];
        torus.add_block(&places, 0.7, &mut sums);
        for (i, &sum) in sums.iter().enumerate() {
            assert_eq!(sum, 0.5 + 0.7 * torus.at(x(i), y(i)), "point {i}");
        }
    }

    #[test]
    fn even_strengths_leave_no_direction() {
        for detail in [Detail::Square, Detail::Round] {
            let torus = Torus::even((4, 4), detail, 5);
            let c: Vec<f64> = torus.integers().iter().map(|&v| f64::from(v)).collect();
            // One wave round: the coefficients against its cosine and sine.
            let power = |stride: usize| {
                let part = |phase: usize| {
                    let sign = |i: usize| [1.0, 0.0, -1.0, 0.0][(i / stride + phase) % 4];
                    (0..16).map(|i| c[i] * sign(i)).sum::<f64>()
                };
                part(0).powi(2) + part(1).powi(2)
            };
            let (across, down) = (power(1), power(4));
            assert!((across / down - 1.0).abs() < 1e-2, "{detail:?}: {across} {down}");
            assert!(c.iter().sum::<f64>().abs() <= 8.0);
            assert_ne!(torus, Torus::even((4, 4), detail, 6));
        }
    }

    #[test]
    fn it_goes_round() {
        let torus = Torus::new((6, 10), Detail::Square);
        for (x, y) in positions(12, 0.7) {
            assert_eq!(torus.at(x, y), torus.at(x + 10.0 * 8.0, y - 6.0 * 16.0));
        }
    }

    #[test]
    fn all_cells_are_alike() {
        // Without the second part of the sum the pairs of coefficients that share one of half the resolution show.
        let torus = Torus::new((256, 256), Detail::Square);
        let variance = |dx: f64, dy: f64| {
            let square = |(x, y): (f64, f64)| f64::from(torus.at(x + dx, y + dy)).powi(2);
            positions(128, 2.0).map(square).sum::<f64>() / (128.0 * 128.0)
        };
        for (x, y) in [(0.5, 0.5), (0.0, 0.5), (0.0, 0.0)] {
            let all = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
                .map(|(i, j)| variance(x + i, y + j));
            let most = all.into_iter().fold(0.0, f64::max);
            let least = all.into_iter().fold(f64::MAX, f64::min);
            assert!(most < 1.1 * least, "{x} {y}: {all:?}");
        }
    }

    #[test]
    fn the_coefficients_never_change() {
        // Documents made by older versions depend on them.
        let side = (Torus::SIDE, Torus::SIDE);
        let upright = Detail::Axes([Part::Fine, Part::Low]);
        let sums = [Detail::Square, Detail::Round, Detail::RoundFine, upright].map(|detail| {
            let torus = Torus::new(side, detail);
            (torus.integers().iter())
                .fold(0u32, |sum, &v| super::super::hash(sum ^ v as u16 as u32))
        });
        assert_eq!(sums, [2_869_209_762, 2_483_746_438, 2_215_425_495, 434_750_818]);
        let values = [Detail::Square, Detail::Round, Detail::RoundFine, upright].map(|detail| {
            let torus = Torus::new(side, detail);
            (0..1000).fold(torus.scale().to_bits(), |sum, i| {
                let value = torus.at(f64::from(i) * 3.7 - 2e3, f64::from(i * i) * 0.71);
                super::super::hash(sum ^ value.to_bits())
            })
        });
        assert_eq!(values, [1_270_492_417, 1_488_887_137, 2_748_157_639, 861_491_236]);
    }
}
