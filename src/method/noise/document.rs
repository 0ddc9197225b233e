//! [`Document`]: a procedural texture as it is stored.

use serde::{Deserialize, Serialize};

use crate::base::error::{Error, Result};
use crate::image::material::MapKind;
use crate::method::noise::shape::KNOTS;
use crate::method::noise::tiling::Layout;
use crate::signal::wavelet_noise::spectrum::at_pixels;
use crate::signal::wavelet_noise::{Detail, Part, Torus, hash};

/// What the field `format` of a document says.
const FORMAT: &str = "texforge-noise";

/// The version of the format that is written. Older ones will always be read, and give the same values.
const VERSION: u32 = 1;

/// Most channels of all maps together.
pub const MOST_CHANNELS: usize = 32;

/// The coarsest band has coefficients `2^MOST_LEVEL` pixels of the photo apart.
pub const MOST_LEVEL: u32 = 14;

/// Numbers beyond this are damage, not textures.
const LARGEST: f64 = 1e6;

/// A procedural texture: what was measured of a photo, or of all maps of a material.
///
/// The unit of length is a pixel of the photo; x goes right, y down, and the photo's first pixel has its
/// middle at (0.5, 0.5).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    /// `texforge-noise`.
    format: String,
    /// Version of the format.
    version: u32,
    /// Chooses among the textures with the same statistics, below 2^32.
    pub seed: u32,
    /// Width and height of the photo in pixels.
    pub size: [u32; 2],
    /// The maps, in the order of their channels.
    pub maps: Vec<MapSpec>,
    /// Mean of every channel, with full scale 1.
    pub mean: Vec<f64>,
    /// What the independent channels add to every channel: a row for each, a column for each of
    /// `channels`.
    pub matrix: Vec<Vec<f64>>,
    /// How the independent channels are made.
    pub model: Model,
    /// How well a texture of this kind fits the photo.
    pub score: Score,
}

/// A map of the material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapSpec {
    /// Its name: `basecolor`, `roughness`, ...
    pub name: String,
    /// What its numbers are, as in [`MapKind`].
    pub kind: String,
    /// `srgb`, `linear` or `data`.
    pub encoding: String,
    /// How many channels it has, without alpha.
    pub channels: usize,
}

/// How the independent channels are made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Model {
    /// Isotropic wavelet noise: every channel has a weight for each band, whose coefficients are 1, 2, 4,
    /// ... pixels apart.
    Wavelet {
        /// The bands' shape in the spectrum.
        bands: BandShape,
        /// Every channel.
        channels: Vec<Channel>,
    },
    /// Wavelet noise with bands that differ along two directions.
    Oriented {
        /// By how many degrees the first direction is turned from x towards y.
        angle: f64,
        /// The bands, for whose weights see `channels`.
        bands: Vec<Band>,
        /// Every channel, with a weight for each band.
        channels: Vec<Channel>,
    },
    /// Parts of the photo, blended.
    Tiling {
        /// How.
        layout: Layout,
        /// Every channel; its one weight is its standard deviation.
        channels: Vec<Channel>,
    },
}

/// The shape of isotropic bands in the spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BandShape {
    /// Round: alike in all directions.
    Round,
    /// Square: the paper's, with Cook and DeRose's noise.
    Square,
}

impl BandShape {
    /// The term of the band whose coefficients are `2^level` pixels apart.
    pub fn term(self, level: u32) -> Term {
        let detail = match (self, level) {
            (Self::Square, _) => Detail::Square,
            (Self::Round, 0) => Detail::RoundFine,
            (Self::Round, _) => Detail::Round,
        };
        Term { levels: [level; 2], detail }
    }
}

/// A band whose coefficients are `2^levels` pixels apart along the two directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Band {
    /// Along each direction.
    pub levels: [u32; 2],
    /// Which frequencies along each direction.
    pub parts: [Part; 2],
}

impl Band {
    fn term(&self) -> Term {
        Term { levels: self.levels, detail: Detail::Axes(self.parts) }
    }
}

/// An independent channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Standard deviation of each band.
    pub weights: Vec<f64>,
    /// Its histogram: the channel's values where the noise has those standard deviations that
    /// [`KNOTS`] lists. None leaves the noise as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub histogram: Option<Vec<f64>>,
}

/// How well a model fits a photo, each in 0..=1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Score {
    /// How well this texture fits the photo.
    pub fit: f64,
    /// `wavelet`, `oriented`, `tiling` or `none`: what fits it best.
    pub recommended: String,
}

/// What one term of the noise is: which coefficients, how far apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Term {
    /// Coefficients are `2^levels` pixels apart, along x and along y.
    pub levels: [u32; 2],
    /// Which coefficients.
    pub detail: Detail,
}

impl Document {
    /// A document of the current version; see the fields. Numbers are rounded to six digits.
    pub fn new(
        seed: u32,
        size: [u32; 2],
        maps: Vec<MapSpec>,
        mean: Vec<f64>,
        matrix: Vec<Vec<f64>>,
        model: Model,
        score: Score,
    ) -> Self {
        let (format, version) = (FORMAT.to_owned(), VERSION);
        Self { format, version, seed, size, maps, mean, matrix, model, score }.rounded()
    }

    /// With all numbers rounded to six digits, as they are written.
    #[must_use]
    pub fn rounded(mut self) -> Self {
        let round = |values: &mut Vec<f64>| values.iter_mut().for_each(|v| *v = six_digits(*v));
        round(&mut self.mean);
        self.matrix.iter_mut().for_each(round);
        if let Model::Oriented { angle, .. } = &mut self.model {
            *angle = six_digits(*angle);
        }
        for channel in self.channels_mut() {
            round(&mut channel.weights);
            channel.histogram.iter_mut().for_each(round);
        }
        self.score.fit = six_digits(self.score.fit);
        self
    }

    /// Reads a document from JSON text.
    ///
    /// # Errors
    /// [`Error::Document`] if it is not JSON, not such a document, of a later version, or holds what no
    /// texture has.
    pub fn from_json(text: &str) -> Result<Self> {
        let bad = |reason: String| Error::Document { reason };
        // The version first: a later one may have other fields.
        let value: serde_json::Value =
            serde_json::from_str(text).map_err(|e| bad(format!("it is not JSON ({e})")))?;
        let format = value.get("format").and_then(serde_json::Value::as_str);
        if format != Some(FORMAT) {
            let reason =
                format!("its field `format` is not `{FORMAT}`: it was not made by `noise fit`");
            return Err(bad(reason));
        }
        let version = value.get("version").and_then(serde_json::Value::as_u64);
        if version.is_none_or(|v| v == 0 || v > u64::from(VERSION)) {
            let version = version.map_or_else(|| "none".into(), |v| v.to_string());
            let reason = format!(
                "its version is {version}, and this texforge reads 1 to {VERSION}; a newer texforge may read it"
            );
            return Err(bad(reason));
        }
        // From the text again, as that knows the lines.
        let document: Self = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
        document.validate()?;
        Ok(document)
    }

    /// The document as JSON text: short, one line.
    pub fn to_json(&self) -> String {
        // Numbers, strings and lists only.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// The independent channels.
    pub fn channels(&self) -> &[Channel] {
        match &self.model {
            Model::Wavelet { channels, .. }
            | Model::Oriented { channels, .. }
            | Model::Tiling { channels, .. } => channels,
        }
    }

    /// The independent channels.
    pub(super) fn channels_mut(&mut self) -> &mut [Channel] {
        match &mut self.model {
            Model::Wavelet { channels, .. }
            | Model::Oriented { channels, .. }
            | Model::Tiling { channels, .. } => channels,
        }
    }

    /// The terms that [`Channel::weights`] weigh; none of a texture that is tiled.
    pub fn terms(&self) -> Vec<Term> {
        match &self.model {
            Model::Wavelet { bands, channels } => {
                let levels = 0..channels.first().map_or(0, |c| c.weights.len()) as u32;
                levels.map(|level| bands.term(level)).collect()
            }
            Model::Oriented { bands, .. } => bands.iter().map(Band::term).collect(),
            Model::Tiling { .. } => Vec::new(),
        }
    }

    /// Variance at the photo's pixels of what each weight of a channel weighs, with weight 1.
    pub(super) fn variances(&self) -> Vec<f64> {
        match self.model {
            Model::Tiling { .. } => vec![1.0],
            _ => self.terms().iter().map(|term| at_pixels(term.detail, term.levels)).collect(),
        }
    }

    /// By how many whole pixels term `term` of channel `channel` is moved along x, y and z: the same
    /// noise everywhere would tie channels and bands together.
    pub fn offset(&self, term: usize, levels: [u32; 3], channel: usize) -> [u32; 3] {
        // Channels of a band must not come near each other: these steps keep any 32 apart.
        const STEPS: [u32; 3] = [97, 61, 41];
        std::array::from_fn(|axis| {
            let key = hash(self.seed).wrapping_add((3 * term + axis) as u32);
            let step = (STEPS[axis] * channel as u32) << levels[axis];
            hash(key).wrapping_add(step) % ((Torus::SIDE as u32) << levels[axis])
        })
    }

    /// Checks all that reading it does not.
    pub(crate) fn validate(&self) -> Result<()> {
        let bad = |reason: String| Err(Error::Document { reason });
        let channels: usize = self.maps.iter().fold(0, |sum, map| sum.saturating_add(map.channels));
        if !(1..=MOST_CHANNELS).contains(&channels) || self.maps.iter().any(|map| map.channels == 0)
        {
            return bad(format!(
                "its maps have {channels} channels, possible are 1 to {MOST_CHANNELS} in all and 1 at least in each"
            ));
        }
        for (i, map) in self.maps.iter().enumerate() {
            use crate::base::params::Value;
            if self.maps[..i].iter().any(|other| other.name == map.name) {
                return bad(format!("two of its maps are called `{}`", map.name));
            }
            if MapKind::parse(&map.kind).is_none() {
                return bad(format!(
                    "the kind of its map `{}` is `{}`, not one of {}",
                    map.name,
                    map.kind,
                    MapKind::CHOICES.join(", ")
                ));
            }
            if !["srgb", "linear", "data"].contains(&map.encoding.as_str()) {
                return bad(format!(
                    "the encoding of its map `{}` is `{}`, not srgb, linear or data",
                    map.name, map.encoding
                ));
            }
        }
        if self.size.iter().any(|&n| n == 0 || n > 1 << 16) {
            return bad(format!(
                "its size is {}x{}, not 1 to 65536 pixels",
                self.size[0], self.size[1]
            ));
        }
        let independent = self.channels();
        if independent.is_empty() || independent.len() > channels {
            return bad(format!(
                "it has {} independent channels for {channels}",
                independent.len()
            ));
        }
        if self.mean.len() != channels || self.matrix.len() != channels {
            return bad(format!(
                "its maps have {channels} channels, but `mean` has {} numbers and `matrix` {} rows",
                self.mean.len(),
                self.matrix.len()
            ));
        }
        if let Some(row) = self.matrix.iter().find(|row| row.len() != independent.len()) {
            return bad(format!(
                "a row of `matrix` has {} numbers for {} independent channels",
                row.len(),
                independent.len()
            ));
        }
        if let Model::Tiling { layout, .. } = &self.model
            && let Some(fault) = layout.fault(independent.len())
        {
            return bad(fault);
        }
        let terms = self.terms();
        let weights = if matches!(self.model, Model::Tiling { .. }) { 1 } else { terms.len() };
        for (i, channel) in independent.iter().enumerate() {
            if channel.weights.len() != weights || channel.weights.iter().any(|w| *w < 0.0) {
                return bad(format!(
                    "independent channel {i} has {} weights instead of {weights}, or one below 0",
                    channel.weights.len(),
                ));
            }
            let rises = |h: &Vec<f64>| h.len() == KNOTS.len() && h.windows(2).all(|w| w[0] <= w[1]);
            if !channel.histogram.as_ref().is_none_or(rises) {
                return bad(format!(
                    "the histogram of independent channel {i} is not {} numbers that do not fall",
                    KNOTS.len()
                ));
            }
        }
        if terms.len() > 256 || terms.iter().any(|t| t.levels.iter().any(|&j| j > MOST_LEVEL)) {
            return bad(format!(
                "it has more than 256 bands, or one with a level above {MOST_LEVEL}"
            ));
        }
        let weights =
            independent.iter().flat_map(|c| c.weights.iter().chain(c.histogram.iter().flatten()));
        let angle = if let Model::Oriented { angle, .. } = &self.model { *angle } else { 0.0 };
        let all =
            self.mean.iter().chain(self.matrix.iter().flatten()).chain(weights).chain([&angle]);
        if let Some(number) = all.into_iter().find(|v| v.is_nan() || v.abs() > LARGEST) {
            return bad(format!("the number {number} in it is too large for a texture"));
        }
        Ok(())
    }
}

/// Rounded to six significant digits.
fn six_digits(value: f64) -> f64 {
    // Through the text, which is what the digits are.
    format!("{value:.5e}").parse().unwrap_or(value)
}
