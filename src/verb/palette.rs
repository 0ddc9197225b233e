//! [`palette`]: one photo, evened out from little to much.

use crate::analyze::appearance::Appearance;
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::image::picture::Picture;
use crate::image::sheet::{self, Cell};
use crate::verb::costs::colors;
use crate::verb::inputs::Inputs;
use crate::verb::maker::{Maker, wrap};
use crate::verb::params::TileParams;
use crate::verb::tile::Tile;

/// Most steps of a palette.
pub const MAX_STEPS: usize = 100;

/// Longest side of a step in the picture of all, in pixels.
const SHOWN: usize = 384;

/// Tiles of one photo at even steps of the dial. The result of [`palette`].
#[derive(Debug, Clone)]
pub struct Palette {
    /// The tiles, from the least even to the most; their reports say where on the dial they are and
    /// what sigma that is.
    pub tiles: Vec<Tile>,
    /// How different two neighbours look, in L*a*b* units: one less than there are tiles. The
    /// steps are even if these are alike.
    pub differences: Vec<f64>,
    /// What the dial was made from: the sigmas that were tried, falling, and how much the look has
    /// changed up to each, in L*a*b* units.
    pub curve: Vec<(f64, f64)>,
}

impl Palette {
    /// All steps in one picture, 8 bits a sample: from left to right, each tile repeated twice in
    /// each direction and reduced to at most 384 pixels, over a bar as long as its place on the dial.
    ///
    /// # Errors
    /// None that valid tiles can cause.
    pub fn picture(&self) -> Result<Picture> {
        let cell = |tile: &Tile| {
            let picture = sheet::repeated(&tile.picture, 2, SHOWN)?;
            Ok(Cell { picture, share: tile.report.stationarity.unwrap_or(0.0) })
        };
        sheet::row(&self.tiles.iter().map(cell).collect::<Result<Vec<_>>>()?)
    }
}

/// Makes a photo into `steps` tiles, from hardly evened out to wholly: equal steps look like equal
/// steps, so that one can be chosen by eye. [`TileParams::stationarity`] then makes it again, or any
/// between them.
///
/// All have the seed of `ctx`; `params` say the rest, but neither sigma nor stationarity.
///
/// # Paper
/// Moritz et al. 2017, Sec. 4.4, Fig. 10 and 11.
///
/// # Determinism
/// Same photo, inputs, parameters and `ctx.seed`: same bytes, for any thread count and SIMD level.
///
/// # Errors
/// [`Error::Parameter`] for `steps` that are not 2 to 100, a sigma or stationarity in the parameters,
/// a sigma map, and without a method and measure that make stationary; those of
/// [`tile`](crate::tile).
pub fn palette(
    ctx: &Ctx,
    inputs: &Inputs<'_>,
    params: &TileParams,
    steps: usize,
) -> Result<Palette> {
    if !(2..=MAX_STEPS).contains(&steps) {
        return Err(Error::parameter("steps", format!("2 to {MAX_STEPS}"), steps));
    }
    if let Some(stationarity) = params.stationarity {
        let expected = "left out with a palette, which shows all of them";
        return Err(Error::parameter("stationarity", expected, stationarity));
    }
    if params.sigma.to_bits() != TileParams::default().sigma.to_bits() {
        let expected = "left out with a palette, which shows what it does";
        return Err(Error::parameter("sigma", expected, params.sigma));
    }
    // As for any place on the dial: nothing else may say how even the tiles become.
    let params = TileParams { stationarity: Some(0.0), ..params.clone() };
    let mut maker = Maker::new(ctx, inputs, &params, steps)?;
    ctx.begin(maker.work(steps, true));
    let curve = maker.learn_dial(ctx)?.points().to_vec();
    let place = |i: usize| i as f32 / (steps - 1) as f32;
    let tile = |i: usize| -> Result<Tile> {
        Ok(maker.make(ctx, ctx.seed, Some(place(i)), |_, _, _| Ok(()))?.0)
    };
    let tiles = (0..steps).map(tile).collect::<Result<Vec<Tile>>>()?;
    let differences = ctx.install(|| {
        let look = |tile: &Tile| {
            let (pixels, domain) = colors(inputs.photo, &tile.picture, wrap(&params));
            Appearance::of(&pixels, domain)
        };
        let looks: Vec<Appearance> = tiles.iter().map(look).collect();
        Ok(looks.windows(2).map(|pair| pair[0].distance(&pair[1])).collect())
    })?;
    Ok(Palette { tiles, differences, curve })
}
