//! [`NoiseEdit`]: what can be changed in a fitted texture.

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::params::params;
use crate::method::noise::{self, Document, Model};
use crate::verb::noise::{Histogram, NoiseTexture};

params! {
    /// What can be changed in a fitted texture by a number or a word; the defaults change nothing.
    pub struct NoiseEditParams for "noise edit" {
        /// Factor of the contrast of all maps.
        contrast: f32 = 1.0, in 0.0..=10.0;
        /// Factor of how far colours are from grey: 0 is grey. Maps of other numbers than colours stay.
        saturation: f32 = 1.0, in 0.0..=10.0;
        /// What is added to colours, where 1 is white.
        brightness: f32 = 0.0, in -1.0..=1.0;
        /// Factor of the width of features: 1, 2, 4, 8, 16 or 1 / 2, 1 / 4, ... (0.5, 0.25, 0.125, 0.0625). In between, choose another scale when rendering.
        feature_size: f32 = 1.0, in 0.0625..=16.0;
        /// Whether the histograms are kept, or become normal distributions.
        histogram: Histogram = Histogram::Kept;
    }
}

/// What to change in a fitted texture; the default changes nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NoiseEdit {
    /// By a number or a word.
    pub params: NoiseEditParams,
    /// Factors of the octaves' weights, 0 to 100, the finest first; those beyond the list stay.
    pub gains: Vec<f64>,
    /// New means, by the maps' names: a number for each channel, or one for all, with full scale 1 in the
    /// map's encoding. They are taken as they are, whatever the brightness and the saturation.
    pub means: Vec<(String, Vec<f64>)>,
    /// Another seed: the same statistics elsewhere.
    pub seed: Option<u32>,
}

/// Largest factor of an octave's weight.
const MOST_GAIN: f64 = 100.0;

/// What a tiled texture can have of what changes bands.
const WITHOUT_BANDS: &str = "left out for this texture, whose tiles have no bands";

/// Farthest that a mean may be from 0.
const MOST_MEAN: f64 = 1e4;

impl NoiseTexture {
    /// The texture between this (t = 0) and another of the same maps (t = 1).
    ///
    /// Means, weights and histograms go straight; the colours of the independent channels turn, the
    /// shortest way (Lagae et al. 2009, section 8), and so none passes through another. A band or a channel
    /// that one of them lacks fades. The noise is this texture's, up to `t` = 1, which is the other itself.
    ///
    /// # Errors
    /// [`Error::Parameter`] if `t` is not within 0..=1, or the textures have other maps or models.
    pub fn morph(&self, other: &Self, t: f64) -> Result<Self> {
        noise::morph(self.document(), other.document(), t).map(Self::new)
    }

    /// The texture with changes.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a number out of range, more gains than the texture has octaves, a mean
    /// for a map that it has not or with another number of channels, and a feature size that is no power of
    /// two, or leaves no band that a texture can have, and numbers that leave a document's range; for gains
    /// and feature sizes of a tiled texture, which has no bands. [`Error::Cancelled`].
    pub fn edit(&self, ctx: &Ctx, edit: &NoiseEdit) -> Result<Self> {
        let params = &edit.params;
        params.validate()?;
        let mut document = self.document().clone();
        gain(&mut document, &edit.gains)?;
        resize(&mut document, params.feature_size)?;
        if params.histogram == Histogram::Normal {
            document.make_normal();
        }
        document.scale_contrast(f64::from(params.contrast));
        document.saturate(f64::from(params.saturation));
        document.brighten(f64::from(params.brightness));
        edit.means.iter().try_for_each(|(map, mean)| set_mean(&mut document, map, mean))?;
        if let Some(seed) = edit.seed.filter(|seed| *seed != document.seed) {
            ctx.begin(document.reseed_steps());
            ctx.install(|| document.reseed(ctx, seed))?;
        }
        let document = document.rounded();
        // It must be possible to read what is written.
        document.validate().map_err(|_| {
            let expected = "less, after what was edited before: numbers leave a texture's range";
            Error::parameter("contrast", expected, params.contrast)
        })?;
        Ok(Self::new(document))
    }
}

fn gain(document: &mut Document, gains: &[f64]) -> Result<()> {
    if let (Model::Tiling { .. }, Some(first)) = (&document.model, gains.first()) {
        return Err(Error::parameter("gains", WITHOUT_BANDS, first));
    }
    if let Some(bad) = gains.iter().find(|gain| !(0.0..=MOST_GAIN).contains(*gain)) {
        return Err(Error::parameter("gains", format!("factors of 0 to {MOST_GAIN}"), bad));
    }
    let octaves = document.octaves();
    if gains.len() > octaves {
        let expected = format!("at most {octaves} factors, as the texture has so many octaves");
        return Err(Error::parameter("gains", expected, gains.len()));
    }
    document.gain(gains);
    Ok(())
}

fn resize(document: &mut Document, factor: f32) -> Result<()> {
    if matches!(document.model, Model::Tiling { .. }) && factor != 1.0 {
        return Err(Error::parameter("feature_size", WITHOUT_BANDS, factor));
    }
    let octaves = libm::log2f(factor);
    if octaves != octaves.round() {
        let expected = "a power of two, as bands are octaves of the photo's pixels (choose another \
                        scale when rendering)";
        return Err(Error::parameter("feature_size", expected, factor));
    }
    if octaves != 0.0 && !document.resize(octaves as i32) {
        let expected = "one with which some band is left, and none is too coarse";
        return Err(Error::parameter("feature_size", expected, factor));
    }
    Ok(())
}

fn set_mean(document: &mut Document, map: &str, mean: &[f64]) -> Result<()> {
    let Some(i) = document.maps.iter().position(|spec| spec.name == map) else {
        let names: Vec<&str> = document.maps.iter().map(|spec| spec.name.as_str()).collect();
        let expected = format!("for a map of the texture ({})", names.join(", "));
        return Err(Error::parameter("means", expected, format!("`{map}`")));
    };
    let range = document.ranges()[i].clone();
    if mean.len() != 1 && mean.len() != range.len() {
        let expected = format!("1 or {} numbers for the map `{map}`", range.len());
        return Err(Error::parameter("means", expected, mean.len()));
    }
    if let Some(bad) = mean.iter().find(|v| v.is_nan() || v.abs() > MOST_MEAN) {
        let expected = format!("numbers within {MOST_MEAN} of 0");
        return Err(Error::parameter("means", expected, bad));
    }
    let values = mean.iter().cycle();
    document.mean[range].iter_mut().zip(values).for_each(|(to, value)| *to = *value);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::noise::{Band, BandShape, Channel, Filter, KNOTS, MapSpec, Score};
    use crate::signal::wavelet_noise::Part;
    use crate::signal::wavelet_noise::spectrum::at_pixels;

    type Change = Box<dyn Fn(&mut NoiseEdit)>;
    type Expected<'a> = Box<dyn Fn(&[f64; 4], usize) -> f64 + 'a>;

    /// A photo of colours and heights; `histogram` as `a` u + `b` u^2.
    fn texture(histogram: Option<(f64, f64)>) -> NoiseTexture {
        let map = |name: &str, kind: &str, encoding: &str, channels| MapSpec {
            name: name.into(),
            kind: kind.into(),
            encoding: encoding.into(),
            channels,
        };
        let shape = |(a, b): (f64, f64)| KNOTS.map(|u| a * u + b * u * u).to_vec();
        let channel = |weights: [f64; 4]| Channel {
            weights: weights.to_vec(),
            histogram: histogram.map(shape),
        };
        NoiseTexture::new(Document::new(
            3,
            [256, 256],
            vec![map("basecolor", "color", "srgb", 3), map("height", "data", "data", 1)],
            vec![0.5, 0.4, 0.3, 0.6],
            vec![vec![0.6, 0.2], vec![0.5, -0.3], vec![0.4, 0.1], vec![0.2, 0.7]],
            Model::Wavelet {
                bands: BandShape::Round,
                channels: vec![channel([0.02, 0.05, 0.04, 0.01]), channel([0.0, 0.01, 0.02, 0.03])],
            },
            Score { fit: 0.8, recommended: "wavelet".into() },
        ))
    }

    fn edited(texture: &NoiseTexture, change: impl FnOnce(&mut NoiseEdit)) -> Result<NoiseTexture> {
        let mut edit = NoiseEdit::default();
        change(&mut edit);
        texture.edit(&ctx(), &edit)
    }

    fn ctx() -> Ctx {
        Ctx::new(0, 1).expect("context")
    }

    /// Values far from each other.
    fn values(texture: &NoiseTexture) -> Vec<[f64; 4]> {
        let points: Vec<[f64; 2]> = (0..4000)
            .map(|i| [f64::from(i % 63) * 71.25 + 0.5, f64::from(i / 63) * 93.75 + 0.5])
            .collect();
        let values = texture.at(&ctx(), &points, Filter::NONE).expect("values");
        values.chunks(4).map(|v| std::array::from_fn(|i| f64::from(v[i]))).collect()
    }

    fn moments(values: &[[f64; 4]]) -> ([f64; 4], [f64; 4]) {
        let n = values.len() as f64;
        let mean = std::array::from_fn(|i| values.iter().map(|v| v[i]).sum::<f64>() / n);
        let variance = |i: usize| values.iter().map(|v| (v[i] - mean[i]).powi(2)).sum::<f64>() / n;
        (mean, std::array::from_fn(|i| variance(i).sqrt()))
    }

    #[test]
    fn the_default_changes_nothing() {
        for texture in [texture(None), texture(Some((0.05, 0.004)))] {
            let same = texture.edit(&ctx(), &NoiseEdit::default()).expect("no change");
            assert_eq!(same.to_json(), texture.to_json());
            let gains = edited(&texture, |edit| edit.gains = vec![1.0; 4]).expect("no change");
            assert_eq!(gains.to_json(), texture.to_json());
        }
    }

    #[test]
    fn values_follow_contrast_saturation_brightness_and_means() {
        let texture = texture(Some((0.05, 0.004)));
        let mean = [0.5, 0.4, 0.3, 0.6];
        let grey = |v: &[f64; 4]| 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];
        let cases: [(Change, Expected); 4] = [
            (
                Box::new(|e| e.params.contrast = 1.5),
                Box::new(|v, i| mean[i] + 1.5 * (v[i] - mean[i])),
            ),
            (
                Box::new(|e| e.params.saturation = 0.25),
                Box::new(|v, i| if i == 3 { v[3] } else { grey(v) + 0.25 * (v[i] - grey(v)) }),
            ),
            (
                Box::new(|e| e.params.brightness = -0.25),
                Box::new(|v, i| if i == 3 { v[3] } else { v[i] - 0.25 }),
            ),
            (
                Box::new(|e| {
                    e.means = vec![
                        ("basecolor".into(), vec![0.1, 0.2, 0.3]),
                        ("height".into(), vec![0.25]),
                    ];
                }),
                Box::new(|v, i| v[i] - mean[i] + [0.1, 0.2, 0.3, 0.25][i]),
            ),
        ];
        let before = values(&texture);
        for (case, (change, expected)) in cases.iter().enumerate() {
            let after = values(&edited(&texture, change).expect("edit"));
            for (before, after) in before.iter().zip(&after) {
                for (i, after) in after.iter().enumerate() {
                    assert!((after - expected(before, i)).abs() < 1e-5, "case {case}, {i}");
                }
            }
        }
    }

    #[test]
    fn octaves_fade_alike_with_and_without_histograms() {
        // A straight histogram is none.
        let plain = texture(None);
        let deviation = |c: usize| {
            let weights = &plain.document().channels()[c].weights;
            let terms = plain.document().terms();
            let terms = weights.iter().zip(terms);
            terms.map(|(w, t)| w * w * at_pixels(t.detail, t.levels)).sum::<f64>().sqrt()
        };
        let mut document = plain.document().clone();
        let Model::Wavelet { channels, .. } = &mut document.model else { panic!("isotropic") };
        for (c, channel) in channels.iter_mut().enumerate() {
            channel.histogram = Some(KNOTS.map(|u| u * deviation(c)).to_vec());
        }
        let shaped = NoiseTexture::new(document);
        let change = |edit: &mut NoiseEdit| edit.gains = vec![0.0, 0.5, 2.0];
        let [a, b] = [&plain, &shaped].map(|t| values(&edited(t, change).expect("edit")));
        let far = |v: &[f64; 4], w: &[f64; 4]| {
            v.iter().zip(w).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        // The straight line ends at 3.2 deviations.
        let differ = a.iter().zip(&b).filter(|(a, b)| far(a, b) > 1e-4).count();
        assert!(differ < 30, "{differ}");
        assert!(far(&moments(&a).1, &moments(&values(&plain)).1) > 0.005);
    }

    #[test]
    fn a_normal_distribution_has_the_histograms_contrast() {
        let texture = texture(Some((0.05, 0.008)));
        let normal = edited(&texture, |edit| edit.params.histogram = Histogram::Normal);
        let normal = normal.expect("edit");
        assert!(normal.document().channels().iter().all(|c| c.histogram.is_none()));
        let (a, b) = (moments(&values(&texture)).1, moments(&values(&normal)).1);
        for i in 0..4 {
            assert!((a[i] / b[i] - 1.0).abs() < 0.05, "{a:?} {b:?}");
        }
    }

    #[test]
    fn features_grow_by_octaves() {
        for histogram in [None, Some((0.05, 0.004))] {
            let texture = texture(histogram);
            let wide = edited(&texture, |edit| edit.params.feature_size = 4.0).expect("edit");
            for (a, b) in texture.document().channels().iter().zip(wide.document().channels()) {
                assert_eq!(b.weights[..2], [0.0; 2]);
                assert_eq!(b.weights.len(), a.weights.len() + 2);
                // From level 2 on all bands are alike.
                assert_eq!(b.weights[4..], a.weights[2..]);
            }
            let (a, b) = (moments(&values(&texture)).1, moments(&values(&wide)).1);
            for i in 0..4 {
                assert!((a[i] / b[i] - 1.0).abs() < 0.1, "{a:?} {b:?}");
            }
            // Back again.
            let back = edited(&wide, |edit| edit.params.feature_size = 0.25).expect("edit");
            for (a, b) in texture.document().channels().iter().zip(back.document().channels()) {
                for (a, b) in a.weights.iter().zip(&b.weights) {
                    assert!((a - b).abs() <= 2e-5 * a, "{a} {b}");
                }
            }
            // What is finer than a pixel is gone, and its contrast with it.
            let small = edited(&texture, |edit| edit.params.feature_size = 0.25).expect("edit");
            assert_eq!(small.document().terms().len(), 2);
            assert!(moments(&values(&small)).1[0] < 0.8 * a[0]);
        }
    }

    #[test]
    fn directed_bands_move_too() {
        let mut document = texture(None).document().clone();
        let channels = document.channels().to_vec();
        let band = |levels| Band { levels, parts: [Part::Band, Part::Low] };
        let bands = [[0, 1], [1, 1], [2, 1], [1, 3]].map(band).to_vec();
        document.model = Model::Oriented { angle: 10.0, bands, channels };
        let texture = NoiseTexture::new(document);
        let small = edited(&texture, |edit| edit.params.feature_size = 0.5).expect("edit");
        let Model::Oriented { bands, channels, .. } = &small.document().model else {
            panic!("directions")
        };
        assert_eq!(bands[..], [[0, 0], [1, 0], [0, 2]].map(band));
        assert!(channels.iter().all(|c| c.weights.len() == 3));
        let text = small.to_json();
        assert_eq!(NoiseTexture::from_json(&text).expect("valid").to_json(), text);
    }

    #[test]
    fn senseless_changes_are_refused() {
        let texture = texture(None);
        let cases: [(&str, Change); 11] = [
            ("`contrast` must be 0 to 10", Box::new(|e| e.params.contrast = f32::NAN)),
            ("`saturation` must be 0 to 10", Box::new(|e| e.params.saturation = -0.1)),
            ("`brightness` must be -1 to 1", Box::new(|e| e.params.brightness = 2.0)),
            ("`feature_size` must be a power of two", Box::new(|e| e.params.feature_size = 3.0)),
            ("`feature_size` must be 0.0625 to 16", Box::new(|e| e.params.feature_size = 32.0)),
            ("`feature_size` must be one with", Box::new(|e| e.params.feature_size = 0.0625)),
            ("`gains` must be factors of 0 to 100", Box::new(|e| e.gains = vec![1.0, -1.0])),
            ("`gains` must be at most 4 factors", Box::new(|e| e.gains = vec![1.0; 5])),
            (
                "`means` must be for a map of the texture (basecolor, height), got `normal`",
                Box::new(|e| e.means = vec![("normal".into(), vec![0.5])]),
            ),
            (
                "`means` must be 1 or 3 numbers",
                Box::new(|e| e.means = vec![("basecolor".into(), vec![0.5; 2])]),
            ),
            (
                "`means` must be numbers within 10000",
                Box::new(|e| e.means = vec![("height".into(), vec![f64::INFINITY])]),
            ),
        ];
        for (what, change) in cases {
            let error = edited(&texture, change).expect_err(what).to_string();
            assert!(error.starts_with(what), "{error}");
        }
    }
}
