//! texforge turns photographs into textures that can be used.
//!
//! [`tile`] makes a stationary tile from a casual photo, as a [`Tile`]: the picture, and the
//! [`SourceMap`] that says which photo pixel each of its pixels is. [`detect_lattice`] finds by which
//! displacements a photo of bricks, tiles or cloth repeats.
//!
//! ```
//! use texforge::{Ctx, Encoding, Picture, Samples, TileParams, tile};
//!
//! let texels = (0..96 * 96).map(|i| ((i * 7919) % 251) as u8).collect();
//! let photo = Picture::new(96, 96, 1, Samples::U8(texels), Encoding::Srgb)?;
//! let params = TileParams { size: texforge::Size::Pixels { width: 64, height: 48 }, ..Default::default() };
//! let tile = tile(&Ctx::new(0, 1)?, &photo, None, &params)?;
//! assert_eq!((tile.picture.height(), tile.picture.width()), (48, 64));
//! # Ok::<(), texforge::Error>(())
//! ```

pub mod analyze;
pub mod base;
pub mod cli;
pub mod export;
pub mod image;
pub mod method;
#[cfg(feature = "python")]
mod python;
pub mod search;
pub mod signal;
pub mod verb;

pub use analyze::lattice::snap::Snap;
pub use base::ctx::{Ctx, Job, Simd};
pub use base::error::{Error, ErrorKind, Result};
pub use image::mask::Mask;
pub use image::material::MapKind;
pub use image::picture::{Encoding, Picture, Samples};
pub use image::rect::Rect;
pub use image::sigma_map::SigmaMap;
pub use image::sourcemap::{Origin, SourceMap};
pub use image::symmetry::Symmetry;
pub use method::noise::Filter;
pub use method::representative::{Place, Similarity};
pub use verb::extract::wang::{Edges, TileSet, WangReport, WangSet, wang};
pub use verb::extract::{
    ExtractParams, ExtractReport, ExtractedTile, Extraction, FoundPeriod, PeriodSource, Scaling,
    WangParams, extract,
};
pub use verb::inputs::Inputs;
pub use verb::lattice::{Lattice, LatticeParams, detect_lattice, lattice_autocorrelation};
pub use verb::noise::{
    NamedMap, NoiseEdit, NoiseEditParams, NoiseParams, NoiseReport, NoiseTexture, RenderParams,
    RenderedMap, SampleType, fit_noise,
};
pub use verb::palette::{Palette, palette};
pub use verb::params::{Axis, Follow, Measure, Method, Quality, Size, Symmetries, TileParams};
pub use verb::redo::Redo;
pub use verb::regular::{
    Guide, Regular, RegularMaker, RegularParams, RegularReport, RegularStrip, regular,
};
pub use verb::texture_cost::{TextureCost, TextureCostParams, texture_cost};
pub use verb::tile::{Costs, Report, Step, Tile, tile, tiles};
