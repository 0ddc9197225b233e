//! Sums of a plane over its overlap with a moved copy of itself.

use std::ops::Range;

/// Sums over the overlap, of values and of their squares, for the vertical displacement dy: it has the
/// plane's rows from dy on, and the copy's first height - dy. From the largest displacement down to
/// none every row is added once to either.
#[derive(Debug, Clone)]
pub(super) struct Overlap {
    /// Of the plane: over the first j columns, for every j from 0 to the width.
    still: Vec<[f64; 2]>,
    /// Of the copy: over the first width - j columns.
    moved: Vec<[f64; 2]>,
}

/// A row of overlaps: one of picture and copy has the sums `part`, the other `whole` less `rest`.
#[derive(Debug)]
pub(super) struct Side<'a> {
    pub(super) whole: [f64; 2],
    pub(super) rest: &'a [[f64; 2]],
    pub(super) part: &'a [[f64; 2]],
}

impl Overlap {
    /// Of nothing yet.
    pub(super) fn new(width: usize) -> Self {
        let zeros = vec![[0.0; 2]; width + 1];
        Self { still: zeros.clone(), moved: zeros }
    }

    /// Adds the rows of the displacement `dy`, of a plane less its `mean`.
    pub(super) fn add(&mut self, plane: &[f32], mean: f64, dy: usize) {
        let (still, moved) = rows(plane, mean, self.width(), dy);
        self.add_columns(still.zip(moved).map(|(f, g)| [[f, f * f], [g, g * g]]));
    }

    /// Adds those of several displacements.
    pub(super) fn add_all(&mut self, plane: &[f32], mean: f64, displacements: Range<usize>) {
        let zeros = || vec![0.0; self.width()];
        let (mut f, mut ff, mut g, mut gg) = (zeros(), zeros(), zeros(), zeros());
        for dy in displacements {
            let (still, moved) = rows(plane, mean, self.width(), dy);
            for ((sum, square), v) in f.iter_mut().zip(&mut ff).zip(still) {
                *sum += v;
                *square += v * v;
            }
            for ((sum, square), v) in g.iter_mut().zip(&mut gg).zip(moved) {
                *sum += v;
                *square += v * v;
            }
        }
        let sums = f.into_iter().zip(ff).zip(g.into_iter().zip(gg));
        self.add_columns(sums.map(|((f, ff), (g, gg))| [[f, ff], [g, gg]]));
    }

    fn add_columns(&mut self, columns: impl Iterator<Item = [[f64; 2]; 2]>) {
        let width = self.width();
        let (still, moved) = (&mut self.still[1..], &mut self.moved[..width]);
        let mut sums = [[0.0; 2]; 2];
        for ((column, still), moved) in columns.zip(still).zip(moved.iter_mut().rev()) {
            add(&mut sums[0], column[0]);
            add(&mut sums[1], column[1]);
            add(still, sums[0]);
            add(moved, sums[1]);
        }
    }

    /// Adds what another has.
    pub(super) fn join(&mut self, other: &Self) {
        self.still.iter_mut().zip(&other.still).for_each(|(to, &from)| add(to, from));
        self.moved.iter_mut().zip(&other.moved).for_each(|(to, &from)| add(to, from));
    }

    fn width(&self) -> usize {
        self.still.len() - 1
    }

    /// Over all rows and columns that there are.
    pub(super) fn whole(&self) -> [f64; 2] {
        self.still[self.width()]
    }

    /// For the horizontal displacements from 0 to the width less 1: the plane's last columns, the copy's
    /// first.
    pub(super) fn to_the_right(&self) -> Side<'_> {
        let width = self.width();
        Side { whole: self.whole(), rest: &self.still[..width], part: &self.moved[..width] }
    }

    /// For those from 1 less the width to -1: the plane's first columns, the copy's last.
    pub(super) fn to_the_left(&self) -> Side<'_> {
        let width = self.width();
        Side { whole: self.moved[0], rest: &self.moved[1..width], part: &self.still[1..width] }
    }
}

/// A plane's row `dy`, and the copy's row that then comes in.
fn rows(
    plane: &[f32],
    mean: f64,
    width: usize,
    dy: usize,
) -> (impl Iterator<Item = f64>, impl Iterator<Item = f64>) {
    let height = plane.len() / width;
    let row = |y: usize| plane[y * width..][..width].iter().map(move |&v| f64::from(v) - mean);
    (row(dy), row(height - 1 - dy))
}

#[inline]
fn add(to: &mut [f64; 2], from: [f64; 2]) {
    to[0] += from[0];
    to[1] += from[1];
}
