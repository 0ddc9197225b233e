//! [`tile`]: a photo becomes a texture that repeats.

use serde::Serialize;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::image::rect::Rect;
use crate::image::sourcemap::SourceMap;
pub use crate::verb::costs::Costs;
use crate::verb::inputs::Inputs;
use crate::verb::maker::Maker;
use crate::verb::params::TileParams;

/// Most tiles of one run.
pub const MAX_VARIANTS: usize = 1000;

/// How a tile was made and what it costs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Version of texforge.
    pub version: &'static str,
    /// Seed of all random choices.
    pub seed: u64,
    /// Every parameter as text, with `size` resolved, and `stationarity` to the `sigma` that it came
    /// to: the same parameters make the same tile.
    pub params: Vec<(&'static str, String)>,
    /// The sigma in use (but for a sigma map).
    pub sigma: f32,
    /// The place on the dial, if that chose the sigma.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stationarity: Option<f32>,
    /// Width and height of the photo in pixels.
    pub photo_size: (usize, usize),
    /// Width and height of the further photos.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub also_sizes: Vec<(usize, usize)>,
    /// Width and height of the tile in pixels.
    pub tile_size: (usize, usize),
    /// The costs.
    pub costs: Costs,
    /// The rectangle that was made anew, if the rest of the tile was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub redo: Option<Rect>,
    /// Wall time in seconds of each stage, in order; `analysis` of the photo and `dial` are shared by
    /// the tiles of a run. The only part that differs between runs.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
}

/// What an iteration has come to: one line of [`Tile::trace`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Level of the pyramid: 0 has the tile's size, every further one is smaller by 1.3.
    pub level: usize,
    /// Iteration at this level, from 1. The last of level 0 is the delivered tile: one more than
    /// there are iterations, as the seams are settled after them.
    pub iteration: u32,
    /// The costs, as [`Report::costs`] has them, of the tile that would have been delivered if the
    /// work had stopped here before the seams are settled: the middles of the matched patches.
    /// Texture is compared with the photo at the level's resolution, and the window of the
    /// stationarity cost is a fraction of the level's own size. On the last line they are those of
    /// the report.
    pub costs: Costs,
}

/// The result of [`tile`].
#[derive(Debug, Clone)]
pub struct Tile {
    /// The tile, in the photo's own sample type; of the flattened photo's pixels if it was flattened.
    pub picture: Picture,
    /// Which pixel of which photo each pixel of the tile is a copy of; `None` for
    /// [`Method::MakeSeamless`], which blends.
    pub source_map: Option<SourceMap>,
    /// How it was made and what it costs.
    pub report: Report,
    /// The costs of every iteration, coarse to fine; empty unless [`Inputs::trace`] is set, and with
    /// [`Method::MakeSeamless`], which has no iterations.
    pub trace: Vec<Step>,
}

/// Turns a photo into a tile that repeats without a seam and without a blob that gives the
/// repetition away.
///
/// `photo` is H x W x C: grey, RGB (each with or without alpha), or data of any number of channels.
/// `mask` (size of the photo) says where it may be used; transparent pixels are never used. Every
/// pixel of the tile is a copy of one pixel of the photo, except with [`Method::MakeSeamless`].
///
/// # Paper
/// Moritz, James, Haines, Ritschel, Weyrich: Texture Stationarization (2017), Algorithm 1.
///
/// # Determinism
/// Same photo, mask, parameters and `ctx.seed`: same bytes, for any thread count and SIMD level.
///
/// # Errors
/// [`Error::Parameter`], [`Error::TooSmall`] (patch larger than photo or tile),
/// [`Error::EmptyMask`], [`Error::SizeMismatch`] (masks), [`Error::NotFinite`], [`Error::Memory`]
/// (checked before anything is allocated), [`Error::Cancelled`].
pub fn tile(ctx: &Ctx, photo: &Picture, mask: Option<&Mask>, params: &TileParams) -> Result<Tile> {
    let one = tiles(ctx, &Inputs { mask, ..Inputs::new(photo) }, params, 1)?.pop();
    one.ok_or_else(|| Error::Internal { message: "no tile came back".into() })
}

/// As [`tile`], with everything that a tile can be made from, and several times: `count` tiles
/// whose seeds are `ctx.seed` and those after it. What is learnt about the photo is learnt once.
///
/// # Paper
/// Moritz et al. 2017, Fig. 10: with a sigma map, a locally prescribed reach. Statistics are computed
/// under windows of a few sizes and their mappings blended at every pixel.
///
/// # Errors
/// As [`tile`]; [`Error::SizeMismatch`] (sigma map); [`Error::Parameter`] for a `count` that is not 1 to 1000 (1 with
/// [`Method::MakeSeamless`], which makes no random choices) and for seeds beyond the last one.
pub fn tiles(
    ctx: &Ctx,
    inputs: &Inputs<'_>,
    params: &TileParams,
    count: usize,
) -> Result<Vec<Tile>> {
    let made = tiles_meanwhile(ctx, inputs, params, count, |_| Ok(()))?;
    Ok(made.into_iter().map(|(tile, ())| tile).collect())
}

/// A tile whose costs are being measured.
#[derive(Debug)]
pub(crate) struct Draft<'a> {
    /// Which of the run's tiles it is, from 0.
    pub(crate) number: usize,
    pub(crate) seed: u64,
    /// As [`Report::params`].
    pub(crate) params: &'a [(&'static str, String)],
    pub(crate) picture: &'a Picture,
    pub(crate) source_map: Option<&'a SourceMap>,
}

/// As [`tiles`]. What `meanwhile` does with each tile, such as writing it, is done while its costs are
/// measured, and comes back with it.
///
/// # Errors
/// As [`tiles`]; those of `meanwhile`.
pub(crate) fn tiles_meanwhile<T: Send>(
    ctx: &Ctx,
    inputs: &Inputs<'_>,
    params: &TileParams,
    count: usize,
    meanwhile: impl Fn(&Draft<'_>) -> Result<T> + Sync,
) -> Result<Vec<(Tile, T)>> {
    let further = count.saturating_sub(1) as u64;
    let last = ctx.seed.checked_add(further).ok_or_else(|| {
        let expected = format!("at most {} with {count} variants", u64::MAX - further);
        Error::parameter("seed", expected, ctx.seed)
    })?;
    let mut maker = Maker::new(ctx, inputs, params, count)?;
    ctx.begin(maker.work(count, params.stationarity.is_some()));
    if params.stationarity.is_some() {
        maker.learn_dial(ctx)?;
    }
    let make = |(number, seed): (usize, u64)| {
        let place = params.stationarity;
        maker.make(ctx, seed, place, |picture, source_map, params| {
            meanwhile(&Draft { number, seed, params, picture, source_map })
        })
    };
    (0..).zip(ctx.seed..=last).map(make).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::picture::{Encoding, Samples};
    use crate::verb::params::Size;

    fn photo() -> Picture {
        let texels = (0..64 * 64).map(|i| ((i * 7919) % 251) as u8).collect();
        Picture::new(64, 64, 1, Samples::U8(texels), Encoding::Srgb).expect("a picture")
    }

    fn params() -> TileParams {
        TileParams { size: Size::Pixels { width: 40, height: 32 }, ..TileParams::default() }
    }

    #[test]
    fn each_draft_is_the_tile_that_comes_back() {
        let (photo, ctx) = (photo(), Ctx::new(5, 2).expect("pool"));
        let made = tiles_meanwhile(&ctx, &Inputs::new(&photo), &params(), 3, |draft| {
            let pixels = draft.picture.samples().clone();
            Ok((draft.number, draft.seed, draft.params.to_vec(), pixels, draft.source_map.cloned()))
        });
        let made = made.expect("three tiles");
        assert_eq!(made.len(), 3);
        for (i, (tile, (number, seed, params, pixels, source_map))) in made.iter().enumerate() {
            assert_eq!((*number, *seed), (i, 5 + i as u64));
            assert_eq!((*seed, params), (tile.report.seed, &tile.report.params));
            assert!(pixels == tile.picture.samples() && *source_map == tile.source_map, "tile {i}");
        }
        let alone = tiles(&ctx, &Inputs::new(&photo), &params(), 3).expect("three tiles");
        for (tile, (with, _)) in alone.iter().zip(&made) {
            assert!(tile.picture.samples() == with.picture.samples());
            assert_eq!(tile.report.costs, with.report.costs);
        }
    }

    #[test]
    fn what_fails_meanwhile_fails_the_run() {
        let (photo, ctx) = (photo(), Ctx::new(0, 2).expect("pool"));
        let refused = || Error::Internal { message: "the disk is full".into() };
        let made = tiles_meanwhile(&ctx, &Inputs::new(&photo), &params(), 3, |draft| {
            if draft.number == 1 { Err(refused()) } else { Ok(()) }
        });
        assert_eq!(made.expect_err("no tiles").to_string(), refused().to_string());
    }
}
