//! [`Atlas`]: several pictures, each in several symmetries, laid out as one picture to search.

use crate::image::symmetry::Symmetry;
use crate::search::patch::MatchImage;

/// Longest side of an atlas, which [`Pos`](crate::search::field::Pos) can address.
const LONGEST: usize = 1 << 16;

/// A picture as it lies in an atlas.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct View {
    /// Which picture.
    pub picture: usize,
    /// How it lies.
    pub symmetry: Symmetry,
    /// First row and column in the atlas.
    pub corner: (usize, usize),
    /// Height and width in the atlas.
    pub size: (usize, usize),
    /// Height and width of the picture as it is.
    pub picture_size: (usize, usize),
}

impl View {
    /// Where in the picture the atlas pixel (`y`, `x`) of this view lies.
    #[inline]
    pub fn source(&self, (y, x): (usize, usize)) -> (usize, usize) {
        self.symmetry.source((y - self.corner.0, x - self.corner.1), self.picture_size)
    }

    #[inline]
    fn contains(&self, y: usize, x: usize) -> bool {
        y.wrapping_sub(self.corner.0) < self.size.0 && x.wrapping_sub(self.corner.1) < self.size.1
    }
}

/// Where every view lies. Between neighbours a line of pixels belongs to none, so that no patch
/// without such a pixel lies across two views, and a step from one ends there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Atlas {
    height: usize,
    width: usize,
    /// Column by column, from the top down.
    views: Vec<View>,
}

impl Atlas {
    /// One picture as it is.
    pub fn plain(height: usize, width: usize) -> Self {
        let (size, corner) = ((height, width), (0, 0));
        let symmetry = Symmetry::default();
        let view = View { picture: 0, symmetry, corner, size, picture_size: size };
        Self { height, width, views: vec![view] }
    }

    /// Pictures of these sizes (height, width), each in all of these symmetries. The order of the
    /// views does not depend on the sizes. `None` if they do not fit.
    pub fn new(sizes: &[(usize, usize)], symmetries: &[Symmetry]) -> Option<Self> {
        let (mut y, mut x, mut width, mut height) = (0, 0, 0, 0);
        let mut views = Vec::new();
        for (picture, &picture_size) in sizes.iter().enumerate() {
            for &symmetry in symmetries {
                let size = symmetry.size(picture_size);
                if y > 0 && y + size.0 > LONGEST {
                    (y, x) = (0, width + 1);
                }
                views.push(View { picture, symmetry, corner: (y, x), size, picture_size });
                height = height.max(y + size.0);
                width = width.max(x + size.1);
                y += size.0 + 1;
            }
        }
        (height <= LONGEST && width <= LONGEST).then_some(Self { height, width, views })
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The views.
    pub fn views(&self) -> &[View] {
        &self.views
    }

    /// Whether it is one picture as it is.
    pub fn is_plain(&self) -> bool {
        self.views.len() == 1 && self.views[0].symmetry == Symmetry::default()
    }

    /// The index of the view that pixel (`y`, `x`) belongs to.
    #[inline]
    pub fn view_at(&self, y: usize, x: usize) -> Option<usize> {
        if let [only] = &self.views[..] {
            return only.contains(y, x).then_some(0);
        }
        // Columns of views stand side by side; in each, views lie one below the other.
        let column = self.views[..self.views.partition_point(|v| v.corner.1 <= x)].last()?.corner.1;
        let after = self.views.partition_point(|v| (v.corner.1, v.corner.0) <= (column, y));
        after.checked_sub(1).filter(|&i| self.views[i].contains(y, x))
    }

    /// The atlas of pictures in the matching space.
    pub fn image(&self, mut pictures: Vec<MatchImage>) -> MatchImage {
        if self.is_plain() {
            return pictures.swap_remove(0);
        }
        let mut image = MatchImage::new(self.height, self.width);
        image.fill_rows(|y, row| {
            for view in self.views.iter().filter(|v| v.contains(y, v.corner.1)) {
                let picture = &pictures[view.picture];
                for (x, px) in (view.corner.1..).zip(&mut row[view.corner.1..][..view.size.1]) {
                    let (y, x) = view.source((y, x));
                    *px = picture.pixel(y, x);
                }
            }
        });
        image
    }

    /// The atlas of flags, one slice a picture (`None`: all set); what belongs to no view is not
    /// set. `None` if all is set.
    pub fn flags(&self, pictures: &[Option<&[bool]>]) -> Option<Vec<bool>> {
        if self.is_plain() {
            return pictures[0].map(<[bool]>::to_vec);
        }
        let mut flags = vec![false; self.height * self.width];
        for view in &self.views {
            let set = pictures[view.picture];
            for y in view.corner.0..view.corner.0 + view.size.0 {
                for x in view.corner.1..view.corner.1 + view.size.1 {
                    let (py, px) = view.source((y, x));
                    flags[y * self.width + x] =
                        set.is_none_or(|set| set[py * view.picture_size.1 + px]);
                }
            }
        }
        Some(flags)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_found_where_they_lie_and_nowhere_else() {
        let symmetries = [0, 1, 6].map(|i| Symmetry::ALL[i]);
        // The second and the third column begin because the first are full.
        for sizes in [&[(5, 7), (3, 4)][..], &[(40_000, 2), (3, 15_000), (10_000, 3)]] {
            let atlas = Atlas::new(sizes, &symmetries).expect("fits");
            assert_eq!(atlas.views().len(), 3 * sizes.len());
            let step = (atlas.height() * atlas.width() / 100_000).max(1);
            let edges = atlas.views().iter().flat_map(|v| {
                let (bottom, right) = (v.corner.0 + v.size.0, v.corner.1 + v.size.1);
                [(v.corner.0, v.corner.1), (bottom - 1, right - 1), (bottom, v.corner.1)]
            });
            let all = (0..atlas.height() * atlas.width()).step_by(step);
            let all = all.map(|i| (i / atlas.width(), i % atlas.width()));
            for (y, x) in all.chain(edges) {
                let mut holding =
                    atlas.views().iter().enumerate().filter(|(_, v)| v.contains(y, x));
                let want = holding.next().map(|(i, _)| i);
                assert!(holding.next().is_none(), "views overlap at {y}, {x}");
                assert_eq!(atlas.view_at(y, x), want, "at {y}, {x}");
            }
        }
    }

    #[test]
    fn views_keep_apart_and_hold_their_pictures() {
        let sizes = [(5, 7), (3, 4)];
        let atlas = Atlas::new(&sizes, &Symmetry::ALL).expect("fits");
        let pictures = sizes.iter().enumerate().map(|(p, &(h, w))| {
            let mut image = MatchImage::new(h, w);
            image.fill_rows(|y, row| {
                row.iter_mut().enumerate().for_each(|(x, px)| *px = [p as u8, y as u8, x as u8, 9]);
            });
            image
        });
        let image = atlas.image(pictures.collect());
        let set: Vec<bool> = (0..12).map(|i| i != 5).collect();
        let flags = atlas.flags(&[None, Some(&set)]).expect("gaps");
        for y in 0..atlas.height() {
            for x in 0..atlas.width() {
                let flag = flags[y * atlas.width() + x];
                let Some(view) = atlas.view_at(y, x).map(|i| atlas.views()[i]) else {
                    assert!(!flag, "a gap is set at {y}, {x}");
                    continue;
                };
                let (py, px) = view.source((y, x));
                assert_eq!(image.pixel(y, x), [view.picture as u8, py as u8, px as u8, 9]);
                assert_eq!(flag, (view.picture, py * 4 + px) != (1, 5), "at {y}, {x}");
                // The next pixel belongs to the same view or to none.
                for (y, x) in [(y + 1, x), (y, x + 1)] {
                    let next = atlas.view_at(y, x).map(|i| atlas.views()[i]);
                    assert!(next.is_none_or(|next| next == view), "no gap at {y}, {x}");
                }
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_none_and_one_picture_is_plain() {
        assert!(Atlas::new(&[(40_000, 50_000); 4], &Symmetry::ALL[..1]).is_none());
        assert!(Atlas::plain(70, 20).is_plain() && Atlas::plain(65_536, 3).is_plain());
        assert!(!Atlas::new(&[(7, 7)], &Symmetry::ALL[1..2]).expect("fits").is_plain());
    }
}
