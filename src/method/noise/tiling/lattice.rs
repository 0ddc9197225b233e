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

/// A vertex of the triangle around a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Vertex {
    /// Its number.
    pub(super) index: usize,
    /// Where it lies, in whole pixels.
    pub(super) at: [f64; 2],
    /// Barycentric coordinate of the point: 1 at the vertex, 0 on the other side of the triangle.
    pub(super) weight: f32,
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

    /// The corners of the triangle around a point; and of its sides 01, 02 and 12, which lead along
    /// `NEIGHBOURS` in this order, the corner where each begins.
    pub(super) fn triangle(&self, [x, y]: [f64; 2]) -> ([Vertex; 3], [usize; 3]) {
        let v = y / self.cell[1];
        let u = x / self.cell[0] - 0.5 * v;
        let (i, j) = (u.floor(), v.floor());
        let (fu, fv) = (u - i, v - j);
        let (i, j) = (i as i64, j as i64);
        let (corners, weights, begins) = if fu + fv < 1.0 {
            ([[i, j], [i + 1, j], [i, j + 1]], [1.0 - fu - fv, fu, fv], [0, 0, 1])
        } else {
            let corners = [[i + 1, j + 1], [i, j + 1], [i + 1, j]];
            (corners, [fu + fv - 1.0, 1.0 - fu, 1.0 - fv], [1, 2, 2])
        };
        let corners = std::array::from_fn(|k| {
            let (index, at) = self.vertex(corners[k][0], corners[k][1]);
            Vertex { index, at, weight: weights[k] as f32 }
        });
        (corners, begins.map(|k: usize| corners[k].index))
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
        fn weights_are_barycentric(x in -1e4..1e4f64, y in -1e4..1e4f64, a in 1u32..60, b in 1u32..90) {
            let lattice = Lattice::endless([2 * a, b], 32);
            let (corners, _) = lattice.triangle([x, y]);
            let sum = |of: &dyn Fn(&Vertex) -> f64| -> f64 {
                corners.iter().map(|c| f64::from(c.weight) * of(c)).sum()
            };
            prop_assert!((sum(&|_| 1.0) - 1.0).abs() < 1e-5);
            prop_assert!((sum(&|c| c.at[0]) - x).abs() < 1e-2);
            prop_assert!((sum(&|c| c.at[1]) - y).abs() < 1e-2);
            for corner in corners {
                prop_assert!(corner.weight >= 0.0);
                let alone = lattice.weight([x - corner.at[0], y - corner.at[1]]);
                prop_assert!((alone - f64::from(corner.weight)).abs() < 1e-5);
            }
        }

        #[test]
        fn sides_begin_where_the_neighbours_say(x in -500.0..500.0f64, y in -500.0..500.0f64) {
            let lattice = Lattice::endless([20, 17], 32);
            let (corners, begins) = lattice.triangle([x, y]);
            for (k, pair) in [[0, 1], [0, 2], [1, 2]].into_iter().enumerate() {
                let [from, to] = if corners[pair[0]].index == begins[k] { pair } else { [pair[1], pair[0]] };
                prop_assert_eq!(corners[from].index, begins[k]);
                let [right, down] = NEIGHBOURS[k];
                let way = [20.0 * (right as f64 + 0.5 * down as f64), 17.0 * down as f64];
                let is = [0, 1].map(|axis| corners[to].at[axis] - corners[from].at[axis]);
                prop_assert_eq!(is, way);
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
            // A sixteenth keeps sums exact, so that a point stays in its triangle.
            let [x, y] = [x, y].map(|v| (16.0 * v).round() / 16.0 + 1e-3);
            let way = [f64::from(right) * period[0], f64::from(down) * period[1]];
            let (here, begins) = lattice.triangle([x, y]);
            let (there, others) = lattice.triangle([x + way[0], y + way[1]]);
            prop_assert_eq!(begins, others);
            for (here, there) in here.iter().zip(there) {
                prop_assert!(here.index < lattice.len());
                prop_assert_eq!(here.index, there.index);
                prop_assert!((here.weight - there.weight).abs() < 1e-4);
                for ((here, there), way) in here.at.iter().zip(there.at).zip(way) {
                    // Whole pixels for a period of whole pixels.
                    prop_assert!((there - here - way).abs() < 1e-6);
                    prop_assert!((here - here.round()).abs() < 1e-6);
                }
            }
        }
    }
}
