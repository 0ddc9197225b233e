//! [`Rect`]: a rectangle of a picture that may lie across its edges.

use std::fmt;

use serde::Serialize;

/// A rectangle of a picture's pixels. On a picture that repeats it may reach over the bottom and
/// right edges: it goes on at the opposite ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Rect {
    /// First row.
    pub y: usize,
    /// First column.
    pub x: usize,
    /// Number of rows.
    pub height: usize,
    /// Number of columns.
    pub width: usize,
}

impl Rect {
    /// Reads `WIDTHxHEIGHT+X+Y`, as X11 and `ImageMagick` write a geometry.
    pub fn parse(text: &str) -> Option<Self> {
        let (size, corner) = text.split_once('+')?;
        let (width, height) = size.split_once(['x', 'X'])?;
        let (x, y) = corner.split_once('+')?;
        // Rust reads "+3" as a number; a geometry has one sign each.
        let number = |text: &str| text.parse().ok().filter(|_| !text.starts_with('+'));
        Some(Self { y: number(y)?, x: number(x)?, height: number(height)?, width: number(width)? })
    }

    /// Whether pixel (`y`, `x`) of a picture of this size (height, width), which repeats, lies in it.
    #[inline]
    pub fn contains(&self, (y, x): (usize, usize), (height, width): (usize, usize)) -> bool {
        let inside = |i: usize, n: usize, start: usize, len: usize| (i + n - start % n) % n < len;
        inside(y, height, self.y, self.height) && inside(x, width, self.x, self.width)
    }

    /// All pixels of a picture of size `to` that show a part of it, if the rectangle is of the same
    /// picture at size `from` (height, width).
    #[must_use]
    pub fn scaled(&self, from: (usize, usize), to: (usize, usize)) -> Self {
        let side = |start: usize, len: usize, from: usize, to: usize| {
            let first = start * to / from;
            (first, ((start + len) * to).div_ceil(from).min(first + to) - first)
        };
        let (y, height) = side(self.y, self.height, from.0, to.0);
        let (x, width) = side(self.x, self.width, from.1, to.1);
        Self { y, x, height, width }
    }

    /// It without a rim of `by` pixels, or of a quarter of a side that is short.
    #[must_use]
    pub fn shrunk(&self, by: usize) -> Self {
        let (dy, dx) = (by.min(self.height / 4), by.min(self.width / 4));
        let (height, width) = (self.height - 2 * dy, self.width - 2 * dx);
        Self { y: self.y + dy, x: self.x + dx, height, width }
    }

    /// It and all pixels at most `by` rows and columns away, on a picture of this size that repeats.
    #[must_use]
    pub fn grown(&self, by: usize, (height, width): (usize, usize)) -> Self {
        let side = |start: usize, len: usize, n: usize| match len + 2 * by {
            grown if grown < n => ((start % n + n - by) % n, grown),
            _ => (0, n),
        };
        let (y, height) = side(self.y, self.height, height);
        let (x, width) = side(self.x, self.width, width);
        Self { y, x, height, width }
    }
}

impl fmt::Display for Rect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { y, x, height, width } = self;
        write!(f, "{width}x{height}+{x}+{y}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_comes_back() {
        let rect = Rect { y: 4, x: 3, height: 2, width: 1 };
        assert_eq!((Rect::parse("1x2+3+4"), rect.to_string()), (Some(rect), "1x2+3+4".into()));
        for text in ["", "1x2", "1x2+3", "1x2+3+4+5", "1x2++3+4", "+1x2+3+4", "-1x2+3+4", "1x2-3+4"]
        {
            assert_eq!(Rect::parse(text), None, "{text}");
        }
        assert_eq!(Rect::parse("1x2+3+99999999999999999999"), None);
    }

    #[test]
    fn a_rim_is_taken_off() {
        let rect = Rect { y: 4, x: 3, height: 20, width: 9 };
        assert_eq!(rect.shrunk(3), Rect { y: 7, x: 5, height: 14, width: 5 });
        assert_eq!(rect.shrunk(0), rect);
    }

    /// Against marking pixels one by one, on all rectangles of a small picture.
    #[test]
    fn pixels_are_those_that_counting_marks() {
        let marked = |rect: &Rect, (h, w): (usize, usize)| {
            let mut marks = vec![false; h * w];
            for i in 0..rect.height * rect.width {
                let (y, x) = (rect.y + i / rect.width, rect.x + i % rect.width);
                marks[y % h * w + x % w] = true;
            }
            marks
        };
        let size @ (h, w) = (5, 7);
        for i in 0..h * w * h * w {
            let (y, x, height, width) = (i % h, i / h % w, 1 + i / h / w % h, 1 + i / h / w / h);
            let rect = Rect { y, x, height, width };
            let marks = marked(&rect, size);
            let has = |rect: &Rect, i: usize| rect.contains((i / w, i % w), size);
            assert!((0..h * w).all(|i| has(&rect, i) == marks[i]), "{rect:?}");
            for by in 0..3 {
                let near = |i: usize| {
                    let side = 2 * by + 1;
                    (0..side * side).any(|d| {
                        let (dy, dx) = (h * 9 + d / side - by, w * 9 + d % side - by);
                        marks[(i / w + dy) % h * w + (i % w + dx) % w]
                    })
                };
                let grown = rect.grown(by, size);
                assert!((0..h * w).all(|i| has(&grown, i) == near(i)), "{rect:?} by {by}");
            }
            // A picture of half the size (rounded): whatever overlaps, in twelfths and so on.
            let to @ (th, tw) = (3, 4);
            let small = rect.scaled(size, to);
            let overlaps =
                |i: usize, n: usize, k: usize, m: usize| i * m < (k + 1) * n && k * n < (i + 1) * m;
            for k in 0..th * tw {
                let shows = (0..h * w).any(|i| {
                    marks[i] && overlaps(i / w, h, k / tw, th) && overlaps(i % w, w, k % tw, tw)
                });
                assert_eq!(small.contains((k / tw, k % tw), to), shows, "{rect:?}, {k}");
            }
        }
    }
}
