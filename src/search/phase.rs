//! [`Phase`]: which places of a source continue the lattice that the output repeats in.

use crate::search::field::Pos;
use crate::search::source::Source;
use crate::signal::basis::{Basis, Vector, combined, dot, dual};

/// How far from its place in the cell a match may lie, as a share of the shorter vector, or of the
/// distance of rows: bricks are not laid to the pixel.
const TOLERANCE: f64 = 0.03;

/// The same in pixels, at least: positions are whole pixels.
const TOLERANCE_PIXELS: f64 = 1.0;

/// A lattice in a source and the same lattice in the output, where it may be a little stretched: a
/// match is in phase if it lies at the same place of a cell as its pixel does. Or only rows of a
/// lattice: then at the same distance from a row, wherever along it; and of two families of rows, from
/// either.
#[derive(Debug, Clone, Copy)]
pub struct Phase {
    /// The displacements in the source, in its pixels, by which a match stays in phase; of rows the
    /// one across them, and none.
    source: Basis,
    /// What gives the coefficients of a place in the source, and of one in the output.
    of_source: Basis,
    of_output: Basis,
    /// From a patch's corner to its middle.
    half: f64,
    /// Square of the distance that counts as in phase.
    tolerance: f64,
}

impl Phase {
    /// The lattice of the vectors `source` in the source's pixels and `output` in the output's, for
    /// patches of side `patch`. `None` if two vectors are parallel.
    pub fn new(source: Basis, output: Basis, patch: usize) -> Option<Self> {
        let shorter = source.map(|v| dot(v, v).sqrt()).into_iter().fold(f64::MAX, f64::min);
        Some(Self::within(shorter, source, [dual(source)?, dual(output)?], patch))
    }

    /// Rows of which the displacement v leads over the first vector . v in the source, and over the
    /// second . v in the output; of one family, or of two. `None` if there are none, or both parallel.
    pub fn rows(rows: &[(Vector, Vector)], patch: usize) -> Option<Self> {
        let none = [0.0; 2];
        let (across, source, output) = match *rows {
            [(source, output)] => {
                let square = dot(source, source);
                let across = [source.map(|v| v / square), none];
                (square > 1e-18).then_some((across, [source, none], [output, none]))?
            }
            [(a, in_a), (b, in_b)] => {
                let area = a[0] * b[1] - a[1] * b[0];
                let across = [[b[1] / area, -b[0] / area], [-a[1] / area, a[0] / area]];
                (area.abs() > 1e-18).then_some((across, [a, b], [in_a, in_b]))?
            }
            _ => return None,
        };
        // The closest rows.
        let most = source.map(|k| dot(k, k).sqrt()).into_iter().fold(0.0, f64::max);
        Some(Self::within(most.recip(), across, [source, output], patch))
    }

    fn within(
        period: f64,
        source: Basis,
        [of_source, of_output]: [Basis; 2],
        patch: usize,
    ) -> Self {
        let tolerance = (TOLERANCE * period).max(TOLERANCE_PIXELS);
        let half = (patch / 2) as f64;
        Self { source, of_source, of_output, half, tolerance: tolerance * tolerance }
    }

    /// The place in phase with output pixel (`y`, `x`) that is nearest to `pos` (nearly: by rounding
    /// coefficients); `pos` itself if it is in phase, or if the source has no such place around it.
    #[inline(never)]
    pub fn near(&self, source: &Source, (y, x): (usize, usize), pos: Pos) -> Pos {
        let center = [pos.x() as f64 + self.half, pos.y() as f64 + self.half];
        let there = self.of_source.map(|k| dot(k, center));
        let here = self.of_output.map(|k| dot(k, [x as f64, y as f64]));
        // By how much of a cell it is off.
        let off: [f64; 2] = std::array::from_fn(|k| {
            let apart = there[k] - here[k];
            apart - apart.round()
        });
        let moved = |a: f64, b: f64| combined(self.source, off[0] + a, off[1] + b);
        let [dx, dy] = moved(0.0, 0.0);
        if dx * dx + dy * dy <= self.tolerance {
            return pos;
        }
        // The nearest first; at the source's border a cell farther in.
        for [a, b] in [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1], [1, -1], [-1, 1]]
        {
            let [dx, dy] = moved(f64::from(a), f64::from(b));
            let (px, py) = ((pos.x() as f64 - dx).round(), (pos.y() as f64 - dy).round());
            let inside = |p: f64, n: usize| p >= 0.0 && p < n as f64;
            if inside(px, source.cols()) && inside(py, source.rows()) {
                return Pos::new(py as usize, px as usize);
            }
        }
        pos
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::patch::MatchImage;
    use proptest::prelude::*;

    fn source() -> Source {
        Source::new(MatchImage::new(200, 240), 11, None).expect("a source")
    }

    /// How far `pos` is from the nearest of all places in phase, by trying them all.
    fn off(source: Basis, output: Basis, (y, x): (usize, usize), pos: Pos) -> f64 {
        // The output's pixel in cells, and from there all places of the source.
        let area = output[0][0] * output[1][1] - output[0][1] * output[1][0];
        let (fx, fy) = (x as f64, y as f64);
        let a = (fx * output[1][1] - fy * output[1][0]) / area;
        let b = (fy * output[0][0] - fx * output[0][1]) / area;
        let mut least = f64::MAX;
        for i in -60..=60 {
            for j in -60..=60 {
                let (a, b) = (a + f64::from(i), b + f64::from(j));
                let to_x = a * source[0][0] + b * source[1][0] - (pos.x() as f64 + 5.0);
                let to_y = a * source[0][1] + b * source[1][1] - (pos.y() as f64 + 5.0);
                least = least.min(to_x.hypot(to_y));
            }
        }
        least
    }

    proptest! {
        #[test]
        fn what_is_found_is_in_phase_and_near(
            (y, x) in (0..160usize, 0..160usize),
            (py, px) in (0..190usize, 0..230usize),
            (angle, skew, longer) in (-0.5..0.5f64, -0.4..0.4f64, 1.0..1.5f64),
        ) {
            let v1 = [30.0 * angle.cos(), 30.0 * angle.sin()];
            let v2 = [longer * (-v1[1] + skew * v1[0]), longer * (v1[0] + skew * v1[1])];
            let lattice = [v1, v2];
            // The output's is stretched a little.
            let output = lattice.map(|[x, y]| [1.02 * x, 0.99 * y]);
            let phase = Phase::new(lattice, output, 11).expect("a lattice");
            let source = source();
            let pos = Pos::new(py, px);
            let near = phase.near(&source, (y, x), pos);
            // Rounded to pixels.
            prop_assert!(off(lattice, output, (y, x), near) <= 1.0, "{pos:?} {near:?}");
            let moved = (near.x() as f64 - px as f64).hypot(near.y() as f64 - py as f64);
            let inner = (60..130).contains(&py) && (60..170).contains(&px);
            // A cell's half diagonal; at the border a cell farther.
            prop_assert!(moved <= if inner { 45.0 } else { 130.0 }, "{pos:?} {near:?}");
            // And it stays.
            prop_assert_eq!(phase.near(&source, (y, x), near), near);
        }
    }

    proptest! {
        #[test]
        fn in_rows_only_the_way_across_is_held(
            (y, x) in (0..160usize, 0..160usize),
            (py, px) in (0..190usize, 0..230usize),
            (angle, apart) in (-3.2..3.2f64, 12.0..40.0f64),
        ) {
            // Rows with this normal; the output's are stretched and lean a little.
            let normal = [angle.cos() / apart, angle.sin() / apart];
            let output = [1.02 * normal[0] + 0.01 / apart, 0.98 * normal[1]];
            let phase = Phase::rows(&[(normal, output)], 11).expect("rows");
            let source = source();
            let near = phase.near(&source, (y, x), Pos::new(py, px));
            let row = |pos: Pos| (pos.x() as f64 + 5.0) * normal[0] + (pos.y() as f64 + 5.0) * normal[1];
            let off = |pos| {
                let off: f64 = row(pos) - (x as f64 * output[0] + y as f64 * output[1]);
                off - off.round()
            };
            // In a corner the nearest row and those beside it may all lie outside: it stays.
            let outside = [-1.0, 0.0, 1.0].into_iter().all(|rows| {
                let by = (off(Pos::new(py, px)) + rows) * apart * apart;
                let (x, y) = (px as f64 - by * normal[0], py as f64 - by * normal[1]);
                !((-0.5..229.5).contains(&x) && (-0.5..189.5).contains(&y))
            });
            if outside {
                prop_assert_eq!(near, Pos::new(py, px));
                return Ok(());
            }
            // Rounded to pixels.
            prop_assert!(off(near).abs() * apart <= 1.25, "{near:?} is off by {}", off(near));
            let moved = [near.x() as f64 - px as f64, near.y() as f64 - py as f64];
            let along = (moved[1] * normal[0] - moved[0] * normal[1]) * apart;
            prop_assert!(along.abs() <= 1.0, "{moved:?} leads along the row");
            let inner = (40..150).contains(&py) && (40..190).contains(&px);
            let most = if inner { 0.5 } else { 1.5 };
            prop_assert!(moved[0].hypot(moved[1]) <= most * apart + 1.0, "{moved:?}");
            prop_assert_eq!(phase.near(&source, (y, x), near), near);
        }
    }

    #[test]
    fn two_families_of_rows_are_the_lattice_of_their_crossings() {
        let lattice = [[40.0, 3.0], [11.0, 30.0]];
        let whole = Phase::new(lattice, lattice, 11).expect("a lattice");
        let families = dual(lattice).expect("a lattice").map(|k| (k, k));
        let rows = Phase::rows(&families, 11).expect("rows");
        let source = source();
        for (i, (y, x)) in [(0, 0), (17, 90), (133, 41), (88, 88)].into_iter().enumerate() {
            let pos = Pos::new(20 * i + 63, 25 * i + 71);
            let [a, b] = [&whole, &rows].map(|phase| phase.near(&source, (y, x), pos));
            assert!(a.y().abs_diff(b.y()) <= 1 && a.x().abs_diff(b.x()) <= 1, "{a:?}, {b:?}");
        }
    }

    #[test]
    fn neighbours_in_phase_agree() {
        let phase = Phase::new([[40.0, 0.0], [20.0, 30.0]], [[40.0, 0.0], [20.0, 30.0]], 11);
        let phase = phase.expect("a lattice");
        let source = source();
        let pos = phase.near(&source, (50, 70), Pos::new(91, 133));
        let beside = pos.shifted(1, 1, &source).expect("inside");
        assert_eq!(phase.near(&source, (51, 71), beside), beside);
        assert!(Phase::new([[4.0, 2.0], [2.0, 1.0]], [[4.0, 0.0], [0.0, 4.0]], 11).is_none());
        assert!(Phase::rows(&[([0.0; 2], [0.0, 0.1])], 11).is_none());
        let parallel = [([0.1, 0.0], [0.1, 0.0]), ([0.2, 0.0], [0.2, 0.0])];
        assert!(Phase::rows(&parallel, 11).is_none() && Phase::rows(&[], 11).is_none());
    }
}
