//! [`Redo`]: one rectangle of a finished tile is made anew.

use crate::base::error::{Error, Result};
use crate::base::params::Value as _;
use crate::image::picture::Picture;
use crate::image::rect::Rect;
use crate::image::sourcemap::SourceMap;
use crate::image::symmetry::Symmetry;
use crate::verb::params::{Axis, Method, Size, TileParams};

/// One rectangle of a finished tile to be made anew: all pixels outside of it stay what they are, and
/// those inside grow out of them.
///
/// What was in the rectangle is made expensive, in every photo place and symmetry it came from, so
/// that something else comes even with the seed of the old tile; other seeds make other choices. The
/// masks decide what may come in, not what stays outside.
#[derive(Debug, Clone, Copy)]
pub struct Redo<'a> {
    /// The source map of the tile. The photos are those that it was made from, in their order, and
    /// the symmetries have all that it names; `flatten` must be the tile's for its pixels to stay
    /// the same.
    pub of: &'a SourceMap,
    /// The rectangle. On an axis that repeats it may reach over the tile's edge.
    pub rect: Rect,
}

impl Redo<'_> {
    /// Width and height of the tile.
    pub(super) fn tile_size(&self, params: &TileParams) -> Result<(usize, usize)> {
        let size @ (width, height) = (self.of.width(), self.of.height());
        if params.size != Size::Auto && params.size != (Size::Pixels { width, height }) {
            let expected = format!("left out, or the {width}x{height} of the tile that is redone");
            return Err(Error::parameter("size", expected, params.size.show()));
        }
        Ok(size)
    }

    /// Checks that a tile of these photos and parameters can be that of the source map, and the
    /// rectangle one of its.
    pub(super) fn check(&self, photos: &[&Picture], params: &TileParams) -> Result<()> {
        if params.method == Method::MakeSeamless {
            let expected = "one that copies pixels when a rectangle is redone";
            return Err(Error::parameter("method", expected, params.method.show()));
        }
        if params.band > 0 {
            let expected = "0 when a rectangle is redone";
            return Err(Error::parameter("band", expected, params.band));
        }
        self.check_rect(params)?;
        let sizes = self.of.source_sizes();
        if sizes.len() != photos.len() {
            let expected = "a rectangle of a tile made of the photos that are given";
            let got = format!("a tile of {} and {} photos", sizes.len(), photos.len());
            return Err(Error::parameter("redo", expected, got));
        }
        for (i, (photo, &(want_h, want_w))) in photos.iter().zip(sizes).enumerate() {
            let (got_w, got_h) = (photo.width(), photo.height());
            if (got_h, got_w) != (want_h, want_w) {
                let what = if i == 0 { "the photo".into() } else { format!("photo {}", i + 1) };
                let remedy = "a tile is redone with the photos that it was made from".into();
                return Err(Error::SizeMismatch { what, got_w, got_h, want_w, want_h, remedy });
            }
        }
        let listed = params.symmetry.list();
        let named = self.of.origins().unwrap_or_default().iter().map(|origin| origin.symmetry);
        let missing = |symmetry: &Symmetry| !listed.contains(symmetry);
        if let Some(symmetry) = named.into_iter().find(missing) {
            let mirrored = if symmetry.is_mirrored() { "mirrored and " } else { "" };
            let turned = u16::from(symmetry.turns()) * 90;
            let expected = format!(
                "what the tile was made with (it has pixels {mirrored}turned by {turned} degrees)"
            );
            return Err(Error::parameter("symmetry", expected, params.symmetry.show()));
        }
        Ok(())
    }

    fn check_rect(&self, params: &TileParams) -> Result<()> {
        let (rect, (height, width)) = (self.rect, (self.of.height(), self.of.width()));
        let bad = |expected: String| Err(Error::parameter("redo", expected, rect));
        if rect.height == 0 || rect.width == 0 {
            return bad("a rectangle with at least one pixel".into());
        }
        if rect.y >= height || rect.x >= width {
            return bad(format!("a rectangle that begins in the {width}x{height} tile"));
        }
        let wraps = |other: Axis| params.method != Method::NoWrap && params.axis != other;
        let over = |start: usize, len: usize, n: usize| len > n - start;
        for (axis, wraps, over) in [
            ("y", wraps(Axis::X), over(rect.y, rect.height, height)),
            ("x", wraps(Axis::Y), over(rect.x, rect.width, width)),
        ] {
            if over && !wraps {
                return bad(format!(
                    "within the {width}x{height} tile on the axis {axis}, which does not repeat"
                ));
            }
        }
        let (most_h, most_w) = (height - params.patch.min(height), width - params.patch.min(width));
        if rect.height > height
            || rect.width > width
            || (rect.height > most_h && rect.width > most_w)
        {
            return bad(format!(
                "at most {width}x{most_h} or {most_w}x{height}, which leaves a patch to fit to"
            ));
        }
        Ok(())
    }
}
