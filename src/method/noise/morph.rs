//! [`morph`]: textures between two.

use crate::base::error::{Error, Result};
use crate::method::noise::document::{Channel, Document, MapSpec, Model, Score};
use crate::method::noise::edit::deviation;
use crate::method::noise::shape::KNOTS;

/// The texture between `a` (t = 0) and `b` (t = 1): all numbers go straight, but for colours, which turn.
///
/// Before, `b`'s independent channels are put into the order and given the signs with which their colours
/// are nearest to `a`'s, so that none passes through another on the way. Two frames of three colours
/// at right angles, as a fit of a colour photo has, then turn into each other at constant speed
/// (spherical linear interpolation of quaternions; a reflection cannot occur, as an axis has no sign of
/// its own). In any other number of dimensions each colour's direction goes along the
/// chord, and its length straight. A band or an independent channel that one texture lacks fades; a
/// channel without a histogram has a straight one.
///
/// Noise is `a`'s up to 1, where the texture is `b` itself; so values go smoothly up to there if both have
/// one seed and `b`'s channels stayed in place, statistics always.
///
/// # Paper
/// Section 8, figure 15.
///
/// # Errors
/// [`Error::Parameter`] if t is not within 0..=1, or the textures have different maps or models.
pub fn morph(a: &Document, b: &Document, t: f64) -> Result<Document> {
    if !(0.0..=1.0).contains(&t) {
        return Err(Error::parameter("t", "0 to 1", t));
    }
    if a.maps != b.maps {
        let expected = format!("a texture of the same maps as the first ({})", maps(a));
        return Err(Error::parameter("other", expected, format!("one of {}", maps(b))));
    }
    let (model, places) = between(&a.model, &b.model, t)?;
    if t == 0.0 {
        return Ok(a.clone());
    }
    if t == 1.0 {
        return Ok(b.clone());
    }
    let mut histograms = [a, b].into_iter().flat_map(Document::channels).map(|c| &c.histogram);
    let filled = histograms.any(Option::is_some).then(|| (shaped(a), shaped(b)));
    let (a, b) = filled.as_ref().map_or((a, b), |(a, b)| (a, b));
    let bands = places.iter().flatten().max().map_or(0, |last| last + 1);
    let (from, to) = paired(axes(a, &places[0], bands), axes(b, &places[1], bands));
    let directions = match [&from, &to].map(|axes| frame(axes)) {
        [Some(a), Some(b)] => turned(&a, &b, t).map(Vec::from).to_vec(),
        _ => from.iter().zip(&to).map(|(a, b)| chord(&a.direction, &b.direction, t)).collect(),
    };
    let lengths = from.iter().zip(&to).map(|(a, b)| lerp(a.length, b.length, t));
    let columns: Vec<Vec<f64>> = directions
        .into_iter()
        .zip(lengths)
        .map(|(direction, length)| direction.into_iter().map(|v| v * length).collect())
        .collect();
    let channels = from.iter().zip(&to).map(|(a, b)| a.channel(b, t)).collect();
    let whole = |a: u32, b: u32| lerp(f64::from(a), f64::from(b), t).round() as u32;
    Ok(Document::new(
        a.seed,
        [whole(a.size[0], b.size[0]), whole(a.size[1], b.size[1])],
        a.maps.clone(),
        straight(&a.mean, &b.mean, t),
        (0..a.mean.len()).map(|i| columns.iter().map(|column| column[i]).collect()).collect(),
        with_channels(model, channels),
        Score {
            fit: lerp(a.score.fit, b.score.fit, t),
            recommended: if t < 0.5 { &a.score } else { &b.score }.recommended.clone(),
        },
    ))
}

fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a + t * (b - a)
}

fn straight(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| lerp(*a, *b, t)).collect()
}

fn maps(document: &Document) -> String {
    let one =
        |map: &MapSpec| format!("{} ({} x {}, {})", map.name, map.channels, map.kind, map.encoding);
    document.maps.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// The model between two, without channels, and where the bands of both stand in it.
fn between(a: &Model, b: &Model, t: f64) -> Result<(Model, [Vec<usize>; 2])> {
    let bad = |a: &str, b: &str| {
        Err(Error::parameter("other", format!("{a}, as the first texture is"), b.to_owned()))
    };
    match (a, b) {
        (Model::Wavelet { bands: a, .. }, Model::Wavelet { bands: b, .. }) if a != b => {
            let name = |shape: &_| format!("noise of {shape:?} bands").to_lowercase();
            bad(&name(a), &name(b))
        }
        (Model::Wavelet { bands, channels: a }, Model::Wavelet { channels: b, .. }) => {
            let places = |channels: &[Channel]| (0..channels[0].weights.len()).collect();
            let model = Model::Wavelet { bands: *bands, channels: Vec::new() };
            Ok((model, [places(a), places(b)]))
        }
        (
            Model::Oriented { angle: from, bands: a, .. },
            Model::Oriented { angle: to, bands: b, .. },
        ) => {
            let mut bands = a.clone();
            bands.extend(b.iter().filter(|band| !a.contains(band)));
            let places = |own: &[_]| {
                own.iter().filter_map(|band| bands.iter().position(|b| b == band)).collect()
            };
            let places = [places(a), places(b)];
            // Half a turn changes nothing: the shorter way.
            let way = (to - from + 90.0).rem_euclid(180.0) - 90.0;
            Ok((Model::Oriented { angle: from + t * way, bands, channels: Vec::new() }, places))
        }
        (Model::Wavelet { .. }, Model::Oriented { .. }) => {
            bad("isotropic noise", "noise with directions")
        }
        (Model::Oriented { .. }, Model::Wavelet { .. }) => {
            bad("noise with directions", "isotropic noise")
        }
        (Model::Tiling { .. }, _) | (_, Model::Tiling { .. }) => {
            let expected = "noise, as the first: between tiles there is nothing";
            Err(Error::parameter("other", expected, "tiling and blending"))
        }
    }
}

fn with_channels(model: Model, channels: Vec<Channel>) -> Model {
    match model {
        Model::Wavelet { bands, .. } => Model::Wavelet { bands, channels },
        Model::Oriented { angle, bands, .. } => Model::Oriented { angle, bands, channels },
        Model::Tiling { layout, .. } => Model::Tiling { layout, channels },
    }
}

/// An independent channel and its colour.
#[derive(Debug, Clone)]
struct Axis {
    /// Of unit length, or 0.
    direction: Vec<f64>,
    /// Of the matrix' column.
    length: f64,
    /// Of the bands of both textures.
    weights: Vec<f64>,
    histogram: Option<Vec<f64>>,
}

impl Axis {
    /// The same colour without noise.
    fn faded(&self) -> Self {
        Self {
            weights: vec![0.0; self.weights.len()],
            histogram: self.histogram.as_ref().map(|h| vec![0.0; h.len()]),
            ..self.clone()
        }
    }

    /// The same distribution of colours along the opposite direction.
    fn negated(mut self) -> Self {
        self.direction.iter_mut().for_each(|v| *v = -*v);
        if let Some(histogram) = &mut self.histogram {
            histogram.reverse();
            histogram.iter_mut().for_each(|v| *v = -*v);
        }
        self
    }

    /// The channel between two.
    fn channel(&self, other: &Self, t: f64) -> Channel {
        let histograms = self.histogram.as_ref().zip(other.histogram.as_ref());
        Channel {
            weights: straight(&self.weights, &other.weights, t),
            histogram: histograms.map(|(a, b)| straight(a, b, t)),
        }
    }
}

/// The document with a straight histogram wherever it has none.
fn shaped(document: &Document) -> Document {
    let mut document = document.clone();
    if document.channels().iter().all(|c| c.histogram.is_some()) {
        return document;
    }
    let variances = document.variances();
    for channel in document.channels_mut().iter_mut().filter(|c| c.histogram.is_none()) {
        let deviation = deviation(&channel.weights, &variances);
        channel.histogram = Some(KNOTS.map(|u| u * deviation).to_vec());
    }
    document
}

/// The independent channels of a document among `bands` bands, of which its own stand at `places`.
fn axes(document: &Document, places: &[usize], bands: usize) -> Vec<Axis> {
    let axis = |(c, channel): (usize, &Channel)| {
        let column: Vec<f64> = document.matrix.iter().map(|row| row[c]).collect();
        let length = column.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut weights = vec![0.0; bands];
        places.iter().zip(&channel.weights).for_each(|(&place, &weight)| weights[place] = weight);
        Axis {
            direction: column.iter().map(|v| if length > 0.0 { v / length } else { 0.0 }).collect(),
            length,
            weights,
            histogram: channel.histogram.clone(),
        }
    };
    document.channels().iter().enumerate().map(axis).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `a`'s axes, and for each that of `b` which it turns into. Axes without a partner fade.
fn paired(mut a: Vec<Axis>, b: Vec<Axis>) -> (Vec<Axis>, Vec<Axis>) {
    let partners = match [&a, &b].map(|axes| frame(axes)) {
        [Some(a), Some(b)] => nearest_frame(&a, &b).to_vec(),
        _ => nearest(&a, &b),
    };
    let mut to: Vec<Axis> = a.iter().map(Axis::faded).collect();
    let mut lone = vec![true; b.len()];
    for (i, j, sign) in partners {
        to[i] = if sign < 0.0 { b[j].clone().negated() } else { b[j].clone() };
        lone[j] = false;
    }
    for axis in b.into_iter().zip(lone).filter_map(|(axis, lone)| lone.then_some(axis)) {
        a.push(axis.faded());
        to.push(axis);
    }
    (a, to)
}

/// Pairs of axes and the second's sign: always those two that are nearest of all that are left.
fn nearest(a: &[Axis], b: &[Axis]) -> Vec<(usize, usize, f64)> {
    let cosine = |i: usize, j: usize| dot(&a[i].direction, &b[j].direction);
    let mut all: Vec<_> =
        (0..a.len()).flat_map(|i| (0..b.len()).map(move |j| (i, j, cosine(i, j)))).collect();
    all.sort_by(|x, y| y.2.abs().total_cmp(&x.2.abs()));
    let mut pairs: Vec<(usize, usize, f64)> = Vec::new();
    for (i, j, cosine) in all {
        if pairs.iter().all(|pair| pair.0 != i && pair.1 != j) {
            pairs.push((i, j, cosine));
        }
    }
    pairs
}

/// Three axes, each of unit length.
type Frame = [[f64; 3]; 3];

/// The directions, if they are three at right angles.
fn frame(axes: &[Axis]) -> Option<Frame> {
    let vectors: Vec<[f64; 3]> =
        axes.iter().filter_map(|axis| axis.direction.as_slice().try_into().ok()).collect();
    let frame: Frame = vectors.try_into().ok()?;
    // Numbers have six digits.
    let square = |i: usize, j: usize| {
        let want = f64::from(u8::from(i == j));
        (dot(&frame[i], &frame[j]) - want).abs() < 1e-4
    };
    (0..9).all(|k| square(k / 3, k % 3)).then_some(frame)
}

fn determinant([a, b, c]: &Frame) -> f64 {
    let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
    a[0] * minor(1, 2) - a[1] * minor(0, 2) + a[2] * minor(0, 1)
}

/// The order and the signs of `b`'s axes that take the smallest rotation from `a`'s.
fn nearest_frame(a: &Frame, b: &Frame) -> [(usize, usize, f64); 3] {
    const ORDERS: [[usize; 3]; 6] =
        [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut best = (f64::MIN, [(0, 0, 1.0); 3]);
    for order in ORDERS {
        for signs in 0..8 {
            let sign = |i: usize| if signs >> i & 1 == 0 { 1.0 } else { -1.0 };
            let pairs: [(usize, usize, f64); 3] = std::array::from_fn(|i| (i, order[i], sign(i)));
            let moved: Frame = pairs.map(|(_, j, sign)| b[j].map(|v| sign * v));
            // A rotation, not a reflection; the larger its trace, the smaller its angle.
            let trace: f64 = a.iter().zip(&moved).map(|(a, b)| dot(a, b)).sum();
            if determinant(a) * determinant(&moved) > 0.0 && trace > best.0 {
                best = (trace, pairs);
            }
        }
    }
    best.1
}

/// The frame that lies between two, which are at most 63 degrees apart.
fn turned(a: &Frame, b: &Frame, t: f64) -> Frame {
    // b's axes along a's: the rotation, in a's own frame.
    let m = |row: usize, column: usize| dot(&a[row], &b[column]);
    let w = 0.5 * (1.0 + m(0, 0) + m(1, 1) + m(2, 2)).max(0.0).sqrt();
    let axis = [m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1)].map(|v| v / (4.0 * w));
    // From no rotation to this one at constant speed.
    let sine = dot(&axis, &axis).sqrt();
    let half = t * libm::atan2(sine, w);
    let gain = if sine > 0.0 { libm::sin(half) / sine } else { 0.0 };
    let ([x, y, z], w) = (axis.map(|v| v * gain), libm::cos(half));
    let columns = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
        [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
        [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
    ];
    columns.map(|column| {
        std::array::from_fn(|i| column.iter().zip(a).map(|(part, axis)| part * axis[i]).sum())
    })
}

/// The direction between two, along the chord; if one is none, the other.
fn chord(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    let none = |v: &[f64]| v.iter().all(|v| *v == 0.0);
    let between = match (none(a), none(b)) {
        (true, _) => b.to_vec(),
        (_, true) => a.to_vec(),
        _ => straight(a, b, t),
    };
    let length = dot(&between, &between).sqrt();
    between.iter().map(|v| if length > 0.0 { v / length } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests;
