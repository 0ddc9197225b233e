//! [`Symmetry`]: the eight ways to lay a picture on a square grid.

/// One of the eight symmetries of a square: the picture mirrored left to right or not, then
/// turned by quarter turns, counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Symmetry(u8);

/// The bit of [`Symmetry::code`] that says "mirrored"; the two below count the turns.
const MIRRORED: u8 = 4;

impl Symmetry {
    /// All of them; the first leaves the picture as it is, the first four only turn it.
    pub const ALL: [Self; 8] = [
        Self(0),
        Self(1),
        Self(2),
        Self(3),
        Self(MIRRORED),
        Self(MIRRORED + 1),
        Self(MIRRORED + 2),
        Self(MIRRORED + 3),
    ];

    /// The symmetry with this [`Symmetry::code`].
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.get(usize::try_from(code).ok()?).copied()
    }

    /// Its number in files: quarter turns, and 4 more if mirrored.
    pub fn code(self) -> u8 {
        self.0
    }

    /// Whether the picture is mirrored.
    pub fn is_mirrored(self) -> bool {
        self.0 & MIRRORED != 0
    }

    /// Quarter turns, 0 to 3.
    pub fn turns(self) -> u8 {
        self.0 & 3
    }

    /// Whether rows become columns.
    pub fn swaps_axes(self) -> bool {
        self.0 & 1 == 1
    }

    /// Height and width of what a picture of `height` x `width` becomes.
    #[inline]
    pub fn size(self, (height, width): (usize, usize)) -> (usize, usize) {
        if self.swaps_axes() { (width, height) } else { (height, width) }
    }

    /// Where in a picture of `height` x `width` the pixel lies that becomes (`y`, `x`).
    #[inline]
    pub fn source(self, (y, x): (usize, usize), (height, width): (usize, usize)) -> (usize, usize) {
        let (y, x) = match self.turns() {
            0 => (y, x),
            1 => (x, width - 1 - y),
            2 => (height - 1 - y, width - 1 - x),
            _ => (height - 1 - x, y),
        };
        (y, if self.is_mirrored() { width - 1 - x } else { x })
    }

    /// Where pixel (`y`, `x`) of a picture of `height` x `width` goes: the inverse of
    /// [`Symmetry::source`].
    #[inline]
    pub fn place(self, (y, x): (usize, usize), (height, width): (usize, usize)) -> (usize, usize) {
        let x = if self.is_mirrored() { width - 1 - x } else { x };
        match self.turns() {
            0 => (y, x),
            1 => (width - 1 - x, y),
            2 => (height - 1 - y, width - 1 - x),
            _ => (x, height - 1 - y),
        }
    }

    /// What becomes of a direction, `x` to the right and `y` up, that is drawn on the picture: its
    /// new components as (which of `[x, y]`, whether its sign changes).
    pub fn direction(self) -> [(usize, bool); 2] {
        // Mirroring changes the sign of x; a quarter turn makes (x, y) to (-y, x).
        let mut out = [(0, self.is_mirrored()), (1, false)];
        for _ in 0..self.turns() {
            let [x, (from, negative)] = out;
            out = [(from, !negative), x];
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mirrored by reversing rows, turned as a matrix is: by their definitions, one at a time.
    fn naive(symmetry: Symmetry, picture: &[Vec<u32>]) -> Vec<Vec<u32>> {
        let mut picture = picture.to_vec();
        if symmetry.is_mirrored() {
            picture.iter_mut().for_each(|row| row.reverse());
        }
        for _ in 0..symmetry.turns() {
            let width = picture[0].len();
            // The last column becomes the first row.
            picture =
                (0..width).rev().map(|x| picture.iter().map(|row| row[x]).collect()).collect();
        }
        picture
    }

    #[test]
    fn pixels_go_where_mirrors_and_turns_bring_them() {
        let (h, w) = (3, 5);
        let picture: Vec<Vec<u32>> =
            (0..h as u32).map(|y| (0..w as u32).map(|x| y * 10 + x).collect()).collect();
        let mut seen = Vec::new();
        for symmetry in Symmetry::ALL {
            let want = naive(symmetry, &picture);
            assert_eq!(symmetry.size((h, w)), (want.len(), want[0].len()));
            for (y, row) in want.iter().enumerate() {
                for (x, &value) in row.iter().enumerate() {
                    let (sy, sx) = symmetry.source((y, x), (h, w));
                    assert_eq!(picture[sy][sx], value, "{symmetry:?} at {y}, {x}");
                    assert_eq!(symmetry.place((sy, sx), (h, w)), (y, x), "{symmetry:?}");
                }
            }
            assert_eq!(Symmetry::from_code(symmetry.code().into()), Some(symmetry));
            assert!(!seen.contains(&want), "{symmetry:?} is another's picture");
            seen.push(want);
        }
        assert_eq!(Symmetry::from_code(8), None);
    }

    /// A direction is the difference of two pixels (rows count down): the pixels' new difference
    /// is the new direction.
    #[test]
    fn directions_go_with_the_pixels() {
        for symmetry in Symmetry::ALL {
            for (dx, dy_up) in [(1_i32, 0_i32), (0, 1), (2, -3), (-1, 2)] {
                let size = (20, 30);
                let at = |x: i32, y_up: i32| {
                    let (y, x) = symmetry.place(((10 - y_up) as usize, (10 + x) as usize), size);
                    [x as i32, -(y as i32)]
                };
                let (from, to) = (at(0, 0), at(dx, dy_up));
                let want = [to[0] - from[0], to[1] - from[1]];
                let got = symmetry.direction().map(|(k, negative)| {
                    let v = [dx, dy_up][k];
                    if negative { -v } else { v }
                });
                assert_eq!(got, want, "{symmetry:?} of {dx}, {dy_up}");
            }
        }
    }
}
