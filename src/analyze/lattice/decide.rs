//! Which lattice it is: that of the colours or that of the edges.

use super::field::Field;
use super::turns::Cells;
use super::{Candidate, EVEN, Found, refine};
use crate::signal::basis::{Basis, area, coefficients, combined, dot, reduced};

/// A lattice of the colours with more of the edges' cells in one of its own is one of chance.
const MOST_TURNS: i32 = 4;

/// Lattices are the same within this share of the root of a cell's area.
const SAME: f64 = 0.15;

/// What was found in the colours, or in the edges.
pub(super) struct Look {
    /// The strongest lattice, in pixels of the whole picture.
    pub(super) candidate: Candidate,
    /// The correlations at the finest scale that was looked at.
    pub(super) field: Field,
    /// Pixels of that scale in one of the picture, to the right and downwards.
    pub(super) scale: [f64; 2],
}

impl Look {
    /// With the vectors fitted at the finest scale.
    pub(super) fn found(&self) -> Found {
        let Candidate { basis, strength, goodness, correlation } = self.candidate;
        let basis = refine::sharpened(&self.field, basis, self.scale).unwrap_or(basis);
        let cube = (strength / EVEN).powi(3);
        Found { basis: reduced(basis), confidence: cube / (1.0 + cube), goodness, correlation }
    }

    /// Of a picture that this was found in a reduction of: `scale` says its pixels in one of the picture.
    pub(super) fn within(self, scale: [f64; 2]) -> Self {
        let basis = self.candidate.basis.map(|v| [v[0] / scale[0], v[1] / scale[1]]);
        let candidate = Candidate { basis, ..self.candidate };
        Self { candidate, scale: [0, 1].map(|k| self.scale[k] * scale[k]), ..self }
    }
}

/// The lattice by which a picture repeats, of what was found in its colours and in its edges.
///
/// Edges tell the lattice of a wall whose bricks all have other colours. What they do not tell is a
/// chessboard's two colours. So if the colours' lattice is a part of the edges', the edges' is taken, unless
/// its `cells` differ in turns. If the two have nothing to do with each other, the stronger is.
pub(super) fn decided(colors: &Look, edges: &Look, cells: impl Fn(Basis) -> Cells) -> Found {
    let (of_colors, of_edges) = (colors.candidate, edges.candidate);
    if of_edges.strength < EVEN {
        return colors.found();
    }
    let Some(multiples) = multiples(of_edges.basis, of_colors.basis) else {
        let stronger = of_edges.strength > of_colors.strength;
        return if stronger { edges.found() } else { colors.found() };
    };
    let mut known = cells(of_edges.basis);
    let [[a, b], [c, d]] = multiples;
    let mut found = match (a * d - b * c).abs() {
        1 if of_colors.strength >= of_edges.strength => colors.found(),
        1 => Found { basis: colors.found().basis, ..edges.found() },
        times if times <= MOST_TURNS && of_colors.strength >= EVEN => {
            // Too few cells say nothing: then the colours do.
            match known.differ(multiples) {
                Some(false) => edges.found(),
                Some(true) | None => return colors.found(),
            }
        }
        _ => edges.found(),
    };
    while let Some(turns) = known.turns() {
        found.basis = coarser(found.basis, turns);
        known = cells(found.basis);
    }
    found
}

/// The reduced basis of the vectors that are these multiples of a basis'.
fn coarser(basis: Basis, multiples: [[i32; 2]; 2]) -> Basis {
    reduced(multiples.map(|[a, b]| combined(basis, f64::from(a), f64::from(b))))
}

/// Whether a lattice has only every second, third or fourth point of a `finer` one.
pub(super) fn is_part(basis: Basis, finer: Basis) -> bool {
    multiples(finer, basis)
        .is_some_and(|[[a, b], [c, d]]| (2..=MOST_TURNS).contains(&(a * d - b * c).abs()))
}

/// Which multiples of the vectors of `basis` those of another are; `None` if they are none.
fn multiples(basis: Basis, other: Basis) -> Option<[[i32; 2]; 2]> {
    let exact = other.map(|v| coefficients(basis, v));
    let whole = exact.map(|c| c.map(f64::round));
    let same = |(c, w): (&[f64; 2], &[f64; 2])| {
        let off = combined(basis, c[0] - w[0], c[1] - w[1]);
        // Far multiples are less exact.
        let far = 1.0 + w[0].abs().max(w[1].abs());
        dot(off, off) <= SAME * SAME * far * area(basis)
    };
    let independent = whole[0][0] * whole[1][1] != whole[0][1] * whole[1][0];
    (independent && exact.iter().zip(&whole).all(same)).then(|| whole.map(|c| c.map(|v| v as i32)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiples_are_found_or_refused() {
        let basis = [[30.0, 2.0], [-4.0, 25.0]];
        for want in [[[1, 0], [0, 1]], [[2, 1], [0, 3]], [[1, -4], [1, 1]]] {
            let other = want.map(|[a, b]| combined(basis, f64::from(a), f64::from(b)));
            let near = other.map(|[x, y]| [x + 1.5, y - 1.0]);
            assert_eq!(multiples(basis, other), Some(want));
            assert_eq!(multiples(basis, near), Some(want));
            let half = [other[0], combined(basis, 0.5, 1.0)];
            assert_eq!(multiples(basis, half), None);
        }
        // Parallel vectors span nothing.
        assert_eq!(multiples(basis, [[30.0, 2.0], [60.0, 4.0]]), None);
    }
}
