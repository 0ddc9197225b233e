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
