//! Changes of a [`Document`] that mean something to people.

use std::ops::Range;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::base::params::Value as _;
use crate::image::material::MapKind;
use crate::method::noise::document::{Band, Document, MOST_LEVEL, Model, Term};
use crate::method::noise::shape::Shape;
use crate::method::noise::tiling;
use crate::signal::wavelet_noise::spectrum::at_pixels;

/// Luma of display-referred red, green and blue (ITU-R BT.709).
const LUMA: [f64; 3] = [0.2126, 0.7152, 0.0722];

impl Document {
    /// Where the channels of every map begin and end.
    pub fn ranges(&self) -> Vec<Range<usize>> {
        let mut first = 0;
        let range = |channels: usize| {
            first += channels;
            first - channels..first
        };
        self.maps.iter().map(|map| map.channels).map(range).collect()
    }

    /// Where the channels of the maps of colours lie.
    fn colors(&self) -> Vec<Range<usize>> {
        let color = |kind: &str| MapKind::parse(kind) == Some(MapKind::Color);
        let maps = self.maps.iter().zip(self.ranges());
        maps.filter(|(map, _)| color(&map.kind)).map(|(_, range)| range).collect()
    }

    /// Multiplies the contrast of all maps by a factor.
    pub fn scale_contrast(&mut self, factor: f64) {
        self.matrix.iter_mut().flatten().for_each(|v| *v *= factor);
    }

    /// Adds to the mean of the maps of colours.
    pub fn brighten(&mut self, by: f64) {
        for range in self.colors() {
            self.mean[range].iter_mut().for_each(|v| *v += by);
        }
    }

    /// Multiplies by a factor how far colours are from grey, in maps of three channels.
    pub fn saturate(&mut self, factor: f64) {
        let saturated = |color: [f64; 3]| {
            let grey: f64 = color.iter().zip(LUMA).map(|(v, luma)| v * luma).sum();
            // Of factor 1 exactly the same.
            color.map(|v| v + (factor - 1.0) * (v - grey))
        };
        for range in self.colors().into_iter().filter(|range| range.len() == LUMA.len()) {
            let first = range.start;
            let mean = saturated(std::array::from_fn(|i| self.mean[first + i]));
            self.mean[range].copy_from_slice(&mean);
            for column in 0..self.channels().len() {
                let axis = saturated(std::array::from_fn(|i| self.matrix[first + i][column]));
                axis.into_iter().enumerate().for_each(|(i, v)| self.matrix[first + i][column] = v);
            }
        }
    }

    /// Number of octaves that the bands cover: one more than the coarsest's level.
    pub fn octaves(&self) -> usize {
        self.terms().iter().map(|term| octave(term) + 1).max().unwrap_or(0)
    }

    /// Multiplies the weights of every octave, the finest first; those beyond the list stay. Contrast
    /// follows, in histograms as well. A tiled texture has no octaves.
    pub fn gain(&mut self, gains: &[f64]) {
        if matches!(self.model, Model::Tiling { .. }) {
            return;
        }
        let terms = self.terms();
        let variances = variances(&terms);
        self.reweigh([&variances, &variances], |weights| {
            let gain = |term| gains.get(octave(term)).copied().unwrap_or(1.0);
            weights.iter().zip(&terms).map(|(weight, term)| weight * gain(term)).collect()
        });
    }

    /// Makes features `2^octaves` times as wide; the noise is another one. What becomes finer than the
    /// photo's pixels is left out, as filtering leaves it out of a smaller picture.
    ///
    /// Returns false, and changes nothing, if no band would be left or one would be too coarse.
    pub fn resize(&mut self, octaves: i32) -> bool {
        let before = self.terms();
        let moved = before.iter().map(|term| {
            let [x, y] = term.levels.map(|level| level.checked_add_signed(octaves));
            Some([x?, y?])
        });
        let moved: Vec<Option<[u32; 2]>> = moved.collect();
        let Some(&coarsest) = moved.iter().flatten().flatten().max() else { return false };
        if coarsest > MOST_LEVEL {
            return false;
        }
        // Which of the old bands each of the new ones was.
        let mut origins: Vec<Option<usize>> =
            (0..moved.len()).filter(|&i| moved[i].is_some()).map(Some).collect();
        let after: Vec<Term> = match &mut self.model {
            Model::Wavelet { bands, .. } => {
                origins.splice(0..0, (0..octaves.max(0)).map(|_| None));
                (0..=coarsest).map(|level| bands.term(level)).collect()
            }
            Model::Oriented { bands, .. } => {
                let kept = bands.iter().zip(&moved);
                let kept = kept.filter_map(|(band, to)| to.map(|levels| Band { levels, ..*band }));
                *bands = kept.collect();
                self.terms()
            }
            Model::Tiling { .. } => return false,
        };
        let (before, after) = (variances(&before), variances(&after));
        self.reweigh([&before, &after], |weights| {
            // The finest bands are stronger at pixels than others of the same weight.
            let weight = |(to, from): (usize, &Option<usize>)| {
                from.map_or(0.0, |from| weights[from] * (before[from] / after[to]).sqrt())
            };
            origins.iter().enumerate().map(weight).collect()
        });
        true
    }

    /// Steps of progress that [`Document::reseed`] takes.
    pub fn reseed_steps(&self) -> u64 {
        if matches!(self.model, Model::Tiling { .. }) { tiling::steps() } else { 0 }
    }

    /// Another texture with the same statistics.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn reseed(&mut self, ctx: &Ctx, seed: u32) -> Result<()> {
        self.seed = seed;
        match &mut self.model {
            Model::Tiling { layout, channels } => {
                let deviations: Vec<f64> = channels.iter().map(|c| c.weights[0]).collect();
                layout.choose(ctx, &deviations, seed)
            }
            _ => Ok(()),
        }
    }

    /// Takes the histograms away: channels are normally distributed, with the same variance.
    pub fn make_normal(&mut self) {
        let variances = self.variances();
        for channel in self.channels_mut() {
            let Some(histogram) = channel.histogram.take() else { continue };
            let is = deviation(&channel.weights, &variances);
            let (_, wanted) = Shape::new(&std::array::from_fn(|i| histogram[i])).moments();
            let gain = if is > 0.0 { wanted.sqrt() / is } else { 0.0 };
            channel.weights.iter_mut().for_each(|weight| *weight *= gain);
        }
    }

    /// Replaces all weights; histograms are stretched as the noise's standard deviation is. `variances` are
    /// those of the bands before and after.
    fn reweigh(&mut self, variances: [&[f64]; 2], change: impl Fn(&[f64]) -> Vec<f64>) {
        for channel in self.channels_mut() {
            let before = deviation(&channel.weights, variances[0]);
            channel.weights = change(&channel.weights);
            let after = deviation(&channel.weights, variances[1]);
            if let Some(histogram) = channel.histogram.as_mut().filter(|_| before > 0.0) {
                histogram.iter_mut().for_each(|v| *v *= after / before);
            }
        }
    }
}

/// The finest octave that a band has a part in.
fn octave(term: &Term) -> usize {
    term.levels[0].min(term.levels[1]) as usize
}

/// Variance of every band with unit weight at the photo's pixels.
fn variances(terms: &[Term]) -> Vec<f64> {
    terms.iter().map(|term| at_pixels(term.detail, term.levels)).collect()
}

/// Standard deviation of noise with these weights.
pub(super) fn deviation(weights: &[f64], variances: &[f64]) -> f64 {
    weights.iter().zip(variances).map(|(w, v)| w * w * v).sum::<f64>().sqrt()
}
