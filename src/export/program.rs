//! [`Program`]: a procedural texture as the numbers that a shader computes with.

use crate::base::params::Value as _;
use crate::image::material::MapKind;
use crate::method::noise::document::Term;
use crate::method::noise::{Evaluator, Filter};
use crate::signal::wavelet_noise::Torus;
use crate::signal::wavelet_noise::spectrum::at_pixels;

/// A procedural texture on the plane as the numbers that a shader computes with.
///
/// At a point (x, y) in pixels of the photo, y down:
///
/// 1. with `turn` = (c, s), let (x, y) = (c x + s y, c y - s x);
/// 2. channel k is the sum over the terms t of `channels[k].weights[t]` times the quadratic B-spline
///    surface over tile `terms[t].tile`, times its `scale`, at position
///    ((x - 0.5 + ox) / 2^lx, (y - 0.5 + oy) / 2^ly) with (ox, oy) = `channels[k].offsets[t]` and
///    (lx, ly) = `terms[t].levels`; coefficient i has its middle at position i, and the tile goes round;
/// 3. if `channels[k].shape` is there: multiply by `per_deviation`, hold within the first and the last
///    knot, and evaluate the piece it falls into;
/// 4. output i is `mean[i]` plus the sum over k of `matrix[i][k]` times channel k. Full scale is 1, in
///    the encodings of the maps, not clipped.
///
/// To filter for samples that are f pixels apart, a term with l = min(`levels`) is multiplied by
/// k = smoothstep of clamp(1 + l - log2 f, 0, 1). What is lost has a variance of d^2 = the sum over the terms
/// of `shares[t]` (1 - k^2), in deviations, and the shape is replaced by its mean over a normal
/// distribution of that variance, by three places: u - sqrt(3) d and u + sqrt(3) d count 1/6, u counts 2/3.
#[derive(Debug, Clone)]
pub struct Program {
    /// Tiles of coefficients: 16-bit integers of [`Torus::SIDE`] rows and columns, and their scale.
    pub tiles: Vec<(Vec<i16>, f32)>,
    /// The terms of every channel.
    pub terms: Vec<ProgramTerm>,
    /// The independent channels.
    pub channels: Vec<ProgramChannel>,
    /// Cosine and sine of the directions' angle.
    pub turn: Option<[f64; 2]>,
    /// Mean of every output.
    pub mean: Vec<f32>,
    /// What each independent channel adds to each output: a row for each output.
    pub matrix: Vec<Vec<f32>>,
    /// Name, encoding (`srgb`, `linear`, `data`) and number of outputs of each map, in order.
    pub maps: Vec<(String, String, usize)>,
    /// What the numbers of each map are.
    pub kinds: Vec<MapKind>,
    /// Width and height of the photo in pixels.
    pub size: [u32; 2],
}

/// A term: which coefficients, how far apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProgramTerm {
    /// Which of the tiles.
    pub tile: usize,
    /// The coefficients are `2^levels` pixels apart along x and y.
    pub levels: [u32; 2],
}

/// An independent channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramChannel {
    /// Of each term.
    pub weights: Vec<f32>,
    /// By how many pixels each term is moved along x and y: whole numbers, less than 2^24.
    pub offsets: Vec<[u32; 2]>,
    /// The share of each term in the variance.
    pub shares: Vec<f32>,
    /// From noise to standard deviations.
    pub per_deviation: f32,
    /// Of every piece of the histogram's function: the knot where it begins, then c0 to c3 and r: with
    /// t = (u - knot) r the value is c0 + t (c1 + t (c2 + t c3)). The last ends at
    /// [`KNOTS`](crate::method::noise::KNOTS)' last.
    pub shape: Option<Vec<(f32, [f32; 5])>>,
}

impl Program {
    /// Of a texture.
    pub fn new(evaluator: &Evaluator) -> Self {
        let document = evaluator.document();
        let mut details = Vec::new();
        let terms: Vec<_> = document
            .terms()
            .into_iter()
            .map(|term| {
                let tile = details.iter().position(|d| *d == term.detail).unwrap_or_else(|| {
                    details.push(term.detail);
                    details.len() - 1
                });
                ProgramTerm { tile, levels: term.levels }
            })
            .collect();
        let tile = |detail| {
            let torus = Torus::new((Torus::SIDE, Torus::SIDE), detail);
            (torus.integers().to_vec(), torus.scale())
        };
        let channels =
            evaluator.filtered(Filter::NONE).into_iter().enumerate().map(|(c, filtered)| {
                let offset = |(t, term): (usize, &ProgramTerm)| {
                    let [x, y] = term.levels;
                    let [x, y, _] = document.offset(t, [x, y, x], c);
                    [x, y]
                };
                let variance = |(w, term): (&f32, &Term)| {
                    f64::from(*w).powi(2) * at_pixels(term.detail, term.levels)
                };
                let variances: Vec<f64> =
                    filtered.weights.iter().zip(&document.terms()).map(variance).collect();
                let total: f64 = variances.iter().sum();
                let share = |v: &f64| if total > 0.0 { (v / total) as f32 } else { 0.0 };
                ProgramChannel {
                    shares: variances.iter().map(share).collect(),
                    weights: filtered.weights,
                    offsets: terms.iter().enumerate().map(offset).collect(),
                    per_deviation: filtered.per_deviation,
                    shape: evaluator.shape(c).map(|shape| shape.pieces().collect()),
                }
            });
        Self {
            channels: channels.collect(),
            tiles: details.into_iter().map(tile).collect(),
            terms,
            turn: evaluator.turn,
            mean: document.mean.iter().map(|&v| v as f32).collect(),
            matrix: document.matrix.iter().map(|r| r.iter().map(|&v| v as f32).collect()).collect(),
            maps: document
                .maps
                .iter()
                .map(|map| (map.name.clone(), map.encoding.clone(), map.channels))
                .collect(),
            kinds: document
                .maps
                .iter()
                .map(|map| MapKind::parse(&map.kind).unwrap_or(MapKind::Data))
                .collect(),
            size: document.size,
        }
    }
}
