//! [`Lattice`]: triangles over the plane, and the vertices around a point.

/// A triangular lattice that goes round: vertex (i, j) is vertex (i + columns, j), and
/// (i - shear, j + rows).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lattice {
    /// Distance of vertices in a row, and of rows, in pixels of the photo. A row is half the former to the
    /// right of the one above it.
    cell: [f64; 2],
    columns: i64,
    rows: i64,
    shear: i64,
}

/// A triangle: column and row of its cell, and whether it is the half that touches the row before.
pub(super) type Triangle = (i64, i64, bool);

/// The corners of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Corners {
    /// Their numbers.
    pub(super) index: [usize; 3],
    /// Where they lie, in whole pixels.
    pub(super) at: [[f64; 2]; 3],
    /// Of the sides 01, 02 and 12, which lead along [`NEIGHBOURS`] in this order, the number of the corner
    /// where each begins.
    pub(super) begins: [usize; 3],
}

/// Steps along the lattice to three neighbours; the other three are opposite.
pub(super) const NEIGHBOURS: [[i64; 2]; 3] = [[1, 0], [0, 1], [-1, 1]];

impl Lattice {
    /// Of `side` x `side` vertices that goes round along its own axes.
    pub(super) fn endless(cell: [u32; 2], side: usize) -> Self {
        Self { cell: cell.map(f64::from), columns: side as i64, rows: side as i64, shear: 0 }
    }

    /// That goes round with a picture's sides, with cells that are at most `cell`.
    pub(super) fn fitting(cell: [u32; 2], period: [f64; 2]) -> Self {
        let [a, b] = cell.map(f64::from);
        let columns = (period[0] / a).ceil().max(1.0);
        // Two rows are as far right as the next column but one: their number is even.
        let rows = 2.0 * (period[1] / (2.0 * b)).ceil().max(1.0);
        Self {
            cell: [period[0] / columns, period[1] / rows],
            columns: columns as i64,
            rows: rows as i64,
            shear: rows as i64 / 2,
        }
    }

    /// Number of vertices.
    pub(super) fn len(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    /// Number of vertices in a row.
    pub(super) fn columns(&self) -> i64 {
        self.columns
    }

    /// Number and place of vertex (`i`, `j`).
    pub(super) fn vertex(&self, i: i64, j: i64) -> (usize, [f64; 2]) {
        let (turns, row) = (j.div_euclid(self.rows), j.rem_euclid(self.rows));
        let along = i + turns * self.shear;
        let (around, column) = (along.div_euclid(self.columns), along.rem_euclid(self.columns));
        let [a, b] = self.cell;
        let rest = (turns * (self.rows - 2 * self.shear)) as f64;
        let at = [
            // Whole pixels, and exactly a period apart: so pixels of the photo stay pixels.
            (a * (column as f64 + 0.5 * row as f64)).round()
                + a * ((around * self.columns) as f64 + 0.5 * rest),
            (b * row as f64).round() + b * (turns * self.rows) as f64,
        ];
        ((row * self.columns + column) as usize, at)
    }

    /// Column and row of vertex `index`.
    pub(super) fn place(&self, index: usize) -> [i64; 2] {
        [index as i64 % self.columns, index as i64 / self.columns]
    }

    /// The triangle around a point, and the point's barycentric coordinates: 1 at a corner, 0 on the
    /// side across.
    #[inline]
    pub(super) fn triangle(&self, [x, y]: [f64; 2]) -> (Triangle, [f32; 3]) {
        let v = y / self.cell[1];
        let u = x / self.cell[0] - 0.5 * v;
        let (i, j) = (u.floor(), v.floor());
        let (fu, fv) = (u - i, v - j);
        let first = fu + fv < 1.0;
        let weights =
            if first { [1.0 - fu - fv, fu, fv] } else { [fu + fv - 1.0, 1.0 - fu, 1.0 - fv] };
        ((i as i64, j as i64, first), weights.map(|w| w as f32))
    }

    /// The corners of a triangle, in the order of the coordinates.
    pub(super) fn corners(&self, (i, j, first): Triangle) -> Corners {
        let (corners, begins) = if first {
            ([[i, j], [i + 1, j], [i, j + 1]], [0, 0, 1])
        } else {
            ([[i + 1, j + 1], [i, j + 1], [i + 1, j]], [1, 2, 2])
        };
        let corners = corners.map(|[i, j]| self.vertex(i, j));
        let index = corners.map(|(index, _)| index);
        Corners { index, at: corners.map(|(_, at)| at), begins: begins.map(|k: usize| index[k]) }
    }

    /// The weight of a vertex at a point that lies (x, y) from it.
    pub(super) fn weight(&self, [x, y]: [f64; 2]) -> f64 {
        let v = y / self.cell[1];
        let u = x / self.cell[0] - 0.5 * v;
        (1.0 - u.abs().max(v.abs()).max((u + v).abs())).max(0.0)
    }

    /// Distance of vertices in a row, and of rows.
    pub(super) fn cell(&self) -> [f64; 2] {
        self.cell
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn weights_are_barycentric(
            x in -1e4..1e4f64, y in -1e4..1e4f64, a in 1u32..60, b in 1u32..90,
        ) {
            let lattice = Lattice::endless([2 * a, b], 32);
            let (triangle, weights) = lattice.triangle([x, y]);
            let corners = lattice.corners(triangle);
            let sum = |of: [f64; 3]| -> f64 {
                weights.iter().zip(of).map(|(w, v)| f64::from(*w) * v).sum()
            };
            prop_assert!((sum([1.0; 3]) - 1.0).abs() < 1e-5);
            prop_assert!((sum(corners.at.map(|at| at[0])) - x).abs() < 1e-2);
            prop_assert!((sum(corners.at.map(|at| at[1])) - y).abs() < 1e-2);
            for (weight, at) in weights.iter().zip(corners.at) {
                prop_assert!(*weight >= 0.0);
                let alone = lattice.weight([x - at[0], y - at[1]]);
                prop_assert!((alone - f64::from(*weight)).abs() < 1e-5);
            }
        }

        #[test]
        fn sides_begin_where_the_neighbours_say(x in -500.0..500.0f64, y in -500.0..500.0f64) {
            let lattice = Lattice::endless([20, 17], 32);
            let Corners { index, at, begins } = lattice.corners(lattice.triangle([x, y]).0);
            for (k, [a, b]) in [[0, 1], [0, 2], [1, 2]].into_iter().enumerate() {
                let [from, to] = if index[a] == begins[k] { [a, b] } else { [b, a] };
                prop_assert_eq!(index[from], begins[k]);
                let [right, down] = NEIGHBOURS[k];
                let way = [20.0 * (right as f64 + 0.5 * down as f64), 17.0 * down as f64];
                prop_assert_eq!([0, 1].map(|axis| at[to][axis] - at[from][axis]), way);
            }
        }

        #[test]
        fn a_fitting_lattice_goes_round(
            width in 1u32..300, height in 1u32..300, x in -500.0..500.0f64, y in -500.0..500.0f64,
            right in -3i32..4, down in -3i32..4,
        ) {
            let period = [f64::from(width), f64::from(height)];
            let lattice = Lattice::fitting([40, 34], period);
            let [a, b] = lattice.cell();
            prop_assert!(a <= 40.0 && b <= 34.0);
            let way = [f64::from(right) * period[0], f64::from(down) * period[1]];
            let (triangle, weights) = lattice.triangle([x, y]);
            // At its very edge rounding decides in which a point lies.
            prop_assume!(weights.iter().all(|w| *w > 1e-6));
            let (other, others) = lattice.triangle([x + way[0], y + way[1]]);
            let (here, there) = (lattice.corners(triangle), lattice.corners(other));
            prop_assert_eq!(here.begins, there.begins);
            prop_assert_eq!(here.index, there.index);
            for k in 0..3 {
                prop_assert!(here.index[k] < lattice.len());
                prop_assert!((weights[k] - others[k]).abs() < 1e-4);
                for ((here, there), way) in here.at[k].iter().zip(there.at[k]).zip(way) {
                    // Whole pixels for a period of whole pixels.
                    prop_assert!((there - here - way).abs() < 1e-6);
                    prop_assert!((here - here.round()).abs() < 1e-6);
                }
            }
        }
    }
}
