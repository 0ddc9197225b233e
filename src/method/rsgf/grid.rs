//! The blocks of the output, and where two of them may meet.

/// A block's row and column. Blocks go on beyond the output's border, so they may be negative.
pub(super) type Block = [i64; 2];

/// Whether a block is filled with a random sample; the others, as on a chess board, are gaps.
pub(super) fn is_sample([row, col]: Block) -> bool {
    (row + col).rem_euclid(2) == 0
}

/// The blocks along one axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    /// The output's side.
    pub(super) size: usize,
    /// How many blocks cover it.
    pub(super) blocks: usize,
    /// Side of a block; where the output wraps, the mean.
    side: f64,
    pub(super) wraps: bool,
}

impl Axis {
    /// Blocks of side `block`. Where the output wraps, their number is even, as on a chess board that
    /// is rolled up, and their sides differ by a pixel at most.
    pub(super) fn new(size: usize, block: usize, wraps: bool) -> Self {
        if !wraps {
            return Self { size, blocks: size.div_ceil(block), side: block as f64, wraps };
        }
        let pairs = (size as f64 / (2 * block) as f64).round().max(1.0) as usize;
        Self { size, blocks: 2 * pairs, side: size as f64 / (2 * pairs) as f64, wraps }
    }

    /// Where block `i` begins; it ends where the next begins.
    pub(super) fn edge(&self, i: i64) -> i64 {
        let n = self.blocks as i64;
        if self.wraps {
            i.div_euclid(n) * self.size as i64 + i.rem_euclid(n) * self.size as i64 / n
        } else {
            i * self.side as i64
        }
    }

    /// The block itself, or where the output wraps the one of the first round that it repeats.
    pub(super) fn own(&self, i: i64) -> i64 {
        if self.wraps { i.rem_euclid(self.blocks as i64) } else { i }
    }
}

/// A side of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Top,
    Left,
    Right,
    Bottom,
}

impl Side {
    /// All, in their order.
    pub(super) const ALL: [Self; 4] = [Self::Top, Self::Left, Self::Right, Self::Bottom];

    /// The block on the other side.
    pub(super) fn beyond(self, [row, col]: Block) -> Block {
        match self {
            Self::Top => [row - 1, col],
            Self::Left => [row, col - 1],
            Self::Right => [row, col + 1],
            Self::Bottom => [row + 1, col],
        }
    }
}

/// The side of a block of `size` that a pixel of it is nearest to; of equally near ones the first.
pub(super) fn nearest_side(size: (usize, usize), (y, x): (usize, usize)) -> Side {
    let away = [
        (y, Side::Top),
        (x, Side::Left),
        (size.1 - 1 - x, Side::Right),
        (size.0 - 1 - y, Side::Bottom),
    ];
    away.into_iter().min_by_key(|(distance, _)| *distance).map_or(Side::Top, |(_, side)| side)
}

/// Where a gap and its neighbours overlap: around each side a lens of `border` pixels to both sides of
/// it, which narrows at 45 degrees towards the corners. So no three patches overlap anywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Lenses {
    /// The gap's height and width.
    pub(super) size: (usize, usize),
    /// Half the width of a lens.
    pub(super) border: usize,
}

impl Lenses {
    /// Height and width of the gap with its border.
    pub(super) fn window(&self) -> (usize, usize) {
        (self.size.0 + 2 * self.border, self.size.1 + 2 * self.border)
    }

    /// The side whose lens pixel (`y`, `x`) of the window is in, and how deep in the gap it is: from
    /// -1 to 1, 0 on the side itself.
    pub(super) fn at(&self, (y, x): (usize, usize)) -> Option<(Side, f32)> {
        let inside = |i: usize, n: usize| {
            let near = i as f32 + 0.5 - self.border as f32;
            (near, n as f32 - near)
        };
        let (top, bottom) = inside(y, self.size.0);
        let (left, right) = inside(x, self.size.1);
        let border = self.border as f32;
        [
            (Side::Top, top, left.min(right)),
            (Side::Left, left, top.min(bottom)),
            (Side::Right, right, top.min(bottom)),
            (Side::Bottom, bottom, left.min(right)),
        ]
        .into_iter()
        .find_map(|(side, depth, along)| {
            let reach = border.min(along);
            (depth.abs() < reach).then(|| (side, depth / reach))
        })
    }

    /// Whether pixel (`y`, `x`) of the window is in the gap itself.
    fn is_inside(&self, (y, x): (usize, usize)) -> bool {
        let b = self.border;
        (b..b + self.size.0).contains(&y) && (b..b + self.size.1).contains(&x)
    }

    /// Whether pixel (`y`, `x`) of the window is the gap's own by its place: in it and in no lens.
    pub(super) fn is_own(&self, at: (usize, usize)) -> bool {
        self.is_inside(at) && self.at(at).is_none()
    }

    /// Whether it is so deep in the gap that no neighbour reaches there.
    pub(super) fn is_core(&self, (y, x): (usize, usize)) -> bool {
        let deep = |i: usize, n: usize| (2 * self.border..n).contains(&i);
        deep(y, self.size.0) && deep(x, self.size.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_cover_an_axis_and_wrap() {
        for (size, block) in [(100, 40), (1024, 40), (7, 40), (481, 33)] {
            let plain = Axis::new(size, block, false);
            assert_eq!(plain.edge(0), 0);
            assert!(plain.edge(plain.blocks as i64) >= size as i64);
            let wraps = Axis::new(size, block, true);
            assert_eq!((wraps.blocks % 2, wraps.edge(wraps.blocks as i64)), (0, size as i64));
            for i in -5..9 {
                let side = (wraps.edge(i + 1) - wraps.edge(i)) as usize;
                assert!((wraps.side - side as f64).abs() < 1.0, "{size}: {side}");
                let round = wraps.blocks as i64;
                assert_eq!(wraps.edge(i + round), wraps.edge(i) + size as i64);
                assert_eq!(wraps.own(i + round), wraps.own(i));
            }
        }
    }

    #[test]
    fn lenses_of_neighbours_do_not_overlap() {
        // Two gaps that touch at a corner, and everything around: every pixel is in one lens at most.
        let lenses = Lenses { size: (9, 12), border: 4 };
        let (height, width) = lenses.window();
        let mut taken = vec![0; 60 * 60];
        for (oy, ox) in [(10, 10), (19, 22), (28, 34), (28, 10)] {
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                if lenses.at((y, x)).is_some() || lenses.is_own((y, x)) {
                    taken[(oy + y) * 60 + (ox as usize) + x] += 1;
                }
            }
        }
        assert!(taken.iter().all(|&n| n <= 1), "{taken:?}");
        assert_eq!(lenses.at((4, 10)).map(|l| l.0), Some(Side::Top));
        assert_eq!(lenses.at((3, 10)).map(|l| l.0), Some(Side::Top));
        assert_eq!(lenses.at((0, 0)), None);
    }
}
