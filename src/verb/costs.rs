//! [`Costs`]: what a finished tile costs.

use serde::Serialize;

use crate::analyze::{stationarity, texture};
use crate::image::color::ColorModel;
use crate::image::picture::Picture;
use crate::image::sigma_map::SigmaMap;
use crate::image::sourcemap::SourceMap;
use crate::method::stationary::Evenness;
use crate::search::patchmatch::Wrap;
use crate::signal::measure::Statistic;
use crate::signal::window::Domain;
use crate::verb::params::TileParams;

/// What the finished tile costs, measured on the delivered picture. Lower is better.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Costs {
    /// Texture cost: mean over pixels of the squared CIE L*a*b* distance per patch pixel between
    /// the tile's patch and the photo's patch named by the source map (paper eq. 5). An upper
    /// bound of the exact cost, which takes the best patch of the whole photo, averaged over an
    /// even grid of patches. `None` for
    /// [`Method::MakeSeamless`](crate::Method::MakeSeamless), whose pixels are not the photo's.
    pub texture: Option<f64>,
    /// Stationarity cost: mean earth mover's distance between the local histograms of two places,
    /// summed over L*, a* and b* (paper eq. 1 and 3), in L*a*b* units.
    pub stationarity: f64,
    /// The cost under the measure of the parameters: the same number for the histogram; for the
    /// moments, the mean squared difference of two places' moments (of values counted from the
    /// mean in tens of units), in L*a*b* units squared (paper eq. 2); for the steerable filters,
    /// the earth mover's distance summed over twelve responses, in L*a*b* units (paper eq. 4).
    /// `None` without a measure. Comparable between tiles of the same measure and order only.
    pub stationarity_by_measure: Option<f64>,
}

/// Measures the costs of a tile of these photos.
pub(super) fn costs(
    photos: &[&Picture],
    picture: &Picture,
    map: Option<&SourceMap>,
    params: &TileParams,
    sigma_map: Option<&SigmaMap>,
    wrap: Wrap,
) -> Costs {
    let (pixels, domain) = colors(photos[0], picture, wrap);
    let (height, width) = (domain.height, domain.width);
    let sigma = f64::from(params.sigma) * height.min(width) as f64;
    let stationarity = stationarity::histogram_cost(&pixels, domain, sigma);
    let by_measure = |evenness: Evenness| match evenness.statistic {
        Statistic::Histogram if sigma_map.is_none() => stationarity,
        other => other.cost(&pixels, domain, &evenness.window((height, width), domain)),
    };
    Costs {
        texture: map.map(|map| texture::cost_bound(&pixels, photos, map, params.patch, wrap)),
        stationarity,
        stationarity_by_measure: params.evenness(sigma_map).map(by_measure),
    }
}

/// A tile's pixels in the space in which its photo is matched (L*a*b* for colours), and its domain.
pub(super) fn colors(photo: &Picture, tile: &Picture, wrap: Wrap) -> (Vec<[f32; 3]>, Domain) {
    let model = ColorModel::new(photo);
    let pixels = model.matching_pixels(tile);
    let (height, width) = (tile.height(), tile.width());
    (pixels, Domain { height, width, wrap_y: wrap.y, wrap_x: wrap.x })
}
