//! Sums of a plane over its overlap with a moved copy of itself.

use pulp::Arch;
use rayon::prelude::*;

/// Sums over the overlap for the vertical displacement dy: it has the plane's rows from dy on, and the
/// copy's first height - dy. From the largest displacement down to none every row is added once to
/// either.
#[derive(Debug, Clone)]
pub(super) struct Overlap {
    /// For every j from 0 to the width the sums of the plane's first j columns, of values and of their
    /// squares, and those of the copy's last j.
    ends: Vec<[f64; 4]>,
}

/// A row of overlaps: each has the sums `whole` and `sign` times `ends`, of the plane's values and
/// squares and of the copy's.
#[derive(Debug)]
pub(super) struct Side<'a> {
    pub(super) whole: [f64; 4],
    pub(super) sign: f64,
    pub(super) ends: &'a [[f64; 4]],
}

impl Overlap {
    /// Of a plane less its `mean`, for every band between two `edges` of vertical displacements that of all
    /// larger ones; and the sum of all squares. The last edge is the height, and from below the edges
    /// are the same as from above.
    pub(super) fn starts(plane: &[f32], mean: f64, edges: &[usize]) -> (Vec<Self>, f64) {
        let width = plane.len() / edges[edges.len() - 1];
        let rows = |i: usize| &plane[edges[i] * width..edges[i + 1] * width];
        let bands = 0..edges.len() - 1;
        let sums: Vec<Columns> =
            bands.into_par_iter().map(|i| Columns::of(rows(i), mean, width)).collect();
        // Of the bands below each and, as its mirror image lies above as many, of those above that.
        let (mut below, mut above) = (Columns::new(width), Columns::new(width));
        let mut starts = Vec::with_capacity(sums.len());
        for (last, first) in sums.iter().rev().zip(&sums) {
            let mut ends = vec![[0.0; 4]; width + 1];
            let columns = below.iter().zip(above.iter().rev());
            add_columns(&mut ends, columns.map(|((f, ff), (g, gg))| [f, ff, g, gg]));
            starts.push(Self { ends });
            below.add(last);
            above.add(first);
        }
        starts.reverse();
        (starts, below.squares.iter().sum())
    }

    /// Adds the rows of the displacement `dy`, of a plane less its `mean`.
    pub(super) fn add(&mut self, plane: &[f32], mean: f64, dy: usize) {
        let width = self.ends.len() - 1;
        let height = plane.len() / width;
        let row = |y: usize| plane[y * width..][..width].iter().map(move |&v| f64::from(v) - mean);
        let columns = row(dy).zip(row(height - 1 - dy).rev());
        add_columns(&mut self.ends, columns.map(|(f, g)| [f, f * f, g, g * g]));
    }

    /// Over all rows and columns that there are.
    fn whole(&self) -> [f64; 4] {
        self.ends.last().copied().unwrap_or_default()
    }

    /// For the horizontal displacements from 0 to the width less 1: without the plane's first columns
    /// and the copy's last.
    pub(super) fn to_the_right(&self) -> Side<'_> {
        let width = self.ends.len() - 1;
        Side { whole: self.whole(), sign: -1.0, ends: &self.ends[..width] }
    }

    /// For those from 1 less the width to -1: the plane's first columns and the copy's last.
    pub(super) fn to_the_left(&self) -> Side<'_> {
        let width = self.ends.len() - 1;
        Side { whole: [0.0; 4], sign: 1.0, ends: &self.ends[1..width] }
    }
}

/// Adds to the sums of every first few columns those of further rows, given column by column.
#[inline(always)]
fn add_columns(ends: &mut [[f64; 4]], columns: impl Iterator<Item = [f64; 4]>) {
    let mut sums = [0.0; 4];
    for (ends, column) in ends[1..].iter_mut().zip(columns) {
        for k in 0..4 {
            sums[k] += column[k];
            ends[k] += sums[k];
        }
    }
}

/// Sums of a band of rows of a plane, of values and of squares, column by column.
#[derive(Debug, Clone)]
struct Columns {
    values: Vec<f64>,
    squares: Vec<f64>,
}

impl Columns {
    fn new(width: usize) -> Self {
        Self { values: vec![0.0; width], squares: vec![0.0; width] }
    }

    fn of(rows: &[f32], mean: f64, width: usize) -> Self {
        let mut sums = Self::new(width);
        Arch::new().dispatch(|| {
            for row in rows.chunks(width) {
                let sums = sums.values.iter_mut().zip(&mut sums.squares);
                for (&v, (value, square)) in row.iter().zip(sums) {
                    let v = f64::from(v) - mean;
                    *value += v;
                    *square += v * v;
                }
            }
        });
        sums
    }

    fn add(&mut self, other: &Self) {
        self.values.iter_mut().zip(&other.values).for_each(|(sum, v)| *sum += v);
        self.squares.iter_mut().zip(&other.squares).for_each(|(sum, v)| *sum += v);
    }

    fn iter(&self) -> impl DoubleEndedIterator<Item = (f64, f64)> + ExactSizeIterator {
        self.values.iter().copied().zip(self.squares.iter().copied())
    }
}
