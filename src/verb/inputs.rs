//! What a tile is made from.

use crate::base::error::{Error, Result};
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::image::sigma_map::SigmaMap;
use crate::image::sourcemap::{Origin, SourceMap};
use crate::method::flatten;
use crate::verb::params::TileParams;
use crate::verb::redo::Redo;

/// What a tile is made from.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// The photo, H x W x C: grey, RGB (each with or without alpha), or data of any number of
    /// channels.
    pub photo: &'a Picture,
    /// Further photos of the same sample type, channels and encoding, of any sizes, to mix with it.
    /// Of these, all that is opaque may be used.
    pub also: &'a [Picture],
    /// Where the photo may be used (size of the photo).
    pub mask: Option<&'a Mask>,
    /// What must not be copied from the photo (size of the photo): marks, which
    /// [`TileParams::avoid_grow`] widens.
    pub avoid: Option<&'a Mask>,
    /// How far the measure reaches at every pixel, in place of `sigma`; of the tile's size. The
    /// histogram's cost is measured with `sigma` still, that of the measure in use with the map.
    pub sigma_map: Option<&'a SigmaMap>,
    /// Whether every iteration's costs are measured too, see [`Tile::trace`](crate::Tile::trace). The
    /// same bytes; the time it takes is listed apart in the report.
    pub trace: bool,
    /// Makes one rectangle of a finished tile of these photos anew, instead of a whole tile.
    pub redo: Option<Redo<'a>>,
}

impl<'a> Inputs<'a> {
    /// A photo alone.
    pub fn new(photo: &'a Picture) -> Self {
        Self {
            photo,
            also: &[],
            mask: None,
            avoid: None,
            sigma_map: None,
            trace: false,
            redo: None,
        }
    }

    /// All photos, in their order: as they are, or `flat` in their place.
    pub(super) fn photos<'b>(&'b self, flat: Option<&'b [Picture]>) -> Vec<&'b Picture> {
        match flat {
            Some(flat) => flat.iter().collect(),
            None => [self.photo].into_iter().chain(self.also).collect(),
        }
    }

    /// Where each photo may be used: the caller's masks and the photo's own alpha; `None` is
    /// everywhere.
    pub(super) fn usable(&self, params: &TileParams) -> Result<Vec<Option<Mask>>> {
        let (height, width) = (self.photo.height(), self.photo.width());
        let mut parts = Vec::new();
        if let Some(mask) = self.mask {
            mask.ensure_size("the mask", height, width)?;
            parts.push(mask.clone());
        }
        if let Some(marks) = self.avoid {
            marks.ensure_size("the avoid mask", height, width)?;
            parts.push(marks.clear_of(params.avoid_grow));
        } else if params.avoid_grow > 0 {
            let expected = "0 where there is no avoid mask to grow";
            return Err(Error::parameter("avoid_grow", expected, params.avoid_grow));
        }
        parts.extend(Mask::from_alpha(self.photo));
        let first = parts.into_iter().map(Ok).reduce(|a, b| a?.and(&b?)).transpose()?;
        let all = [first].into_iter().chain(self.also.iter().map(Mask::from_alpha));
        Ok(all.map(|mask| mask.filter(|m| m.count() < m.usable().len())).collect())
    }

    /// The photos with their light flattened, if `params` want it; `notes` say what was done.
    pub(super) fn flattened(
        &self,
        masks: &[Option<Mask>],
        params: &TileParams,
        notes: &mut Vec<String>,
    ) -> Result<Option<Vec<Picture>>> {
        if params.flatten <= 0.0 {
            return Ok(None);
        }
        let flat = |(photo, mask): (&Picture, &Option<Mask>)| {
            let sigma = f64::from(params.flatten) * photo.height().min(photo.width()) as f64;
            let flat = flatten::run(photo, mask.as_ref(), sigma)?;
            notes.push(flat.note(sigma));
            Ok(flat.picture)
        };
        self.photos(None).into_iter().zip(masks).map(flat).collect::<Result<Vec<_>>>().map(Some)
    }

    /// Fails before the long work if `maps`, called `name`, could not be gathered after it: not one a
    /// photo, of another shape or type, or normals that would have to be turned and do not say how.
    ///
    /// # Errors
    /// Those of [`SourceMap::apply_all`](crate::SourceMap::apply_all).
    pub fn ensure_maps_fit(
        &self,
        name: &str,
        maps: &[&Picture],
        kind: MapKind,
        params: &TileParams,
    ) -> Result<()> {
        let sizes = self.photos(None).iter().map(|p| (p.height(), p.width())).collect();
        kind.ensure_turnable(params.symmetry.list().iter().any(|s| s.swaps_axes()))?;
        // One pixel is gathered: the rules are those of the source map.
        let probe = SourceMap::of_views((1, 1), sizes, vec![[0, 0]], vec![Origin::default()])?;
        probe.apply_all(maps, kind).map(drop).map_err(|error| match error {
            Error::SizeMismatch { what, got_w, got_h, want_w, want_h, remedy } => {
                let what = named(&what, name);
                Error::SizeMismatch { what, got_w, got_h, want_w, want_h, remedy }
            }
            Error::BadPicture { what, reason } => {
                Error::BadPicture { what: named(&what, name), reason }
            }
            other => other,
        })
    }
}

/// "the map" and "map 2" with the map's name.
fn named(what: &str, name: &str) -> String {
    format!("{what} `{name}`")
}
