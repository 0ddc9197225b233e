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
            let torus = Torus::shared(detail);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::noise::{Document, KNOTS};

    /// What the doc comment of [`Program`] says, word by word.
    fn by_its_words(program: &Program, [x, y]: [f64; 2], footprint: f64) -> Vec<f64> {
        let [c, s] = program.turn.unwrap_or([1.0, 0.0]);
        let (x, y) = (c * x + s * y, c * y - s * x);
        let channel = |channel: &ProgramChannel| {
            let (mut noise, mut lost) = (0.0, 0.0);
            for (t, term) in program.terms.iter().enumerate() {
                let finest = f64::from(term.levels[0].min(term.levels[1]));
                let e = (1.0 + finest - footprint.log2()).clamp(0.0, 1.0);
                let kept = e * e * (3.0 - 2.0 * e);
                let at = |v: f64, axis: usize| {
                    let offset = f64::from(channel.offsets[t][axis]);
                    (v - 0.5 + offset) / 2f64.powi(term.levels[axis] as i32)
                };
                let (integers, scale) = &program.tiles[term.tile];
                let surface = surface(integers, at(x, 0), at(y, 1)) * f64::from(*scale);
                noise += f64::from(channel.weights[t]) * kept * surface;
                lost += f64::from(channel.shares[t]) * (1.0 - kept * kept);
            }
            let Some(pieces) = &channel.shape else { return noise };
            let at = |u: f64| {
                let u = u.clamp(KNOTS[0], KNOTS[KNOTS.len() - 1]);
                let (knot, [c0, c1, c2, c3, r]) =
                    pieces.iter().rev().find(|p| u >= f64::from(p.0)).unwrap_or(&pieces[0]);
                let t = (u - f64::from(*knot)) * f64::from(*r);
                [c1, c2, c3]
                    .iter()
                    .zip(1..)
                    .fold(f64::from(*c0), |sum, (c, n)| sum + f64::from(**c) * t.powi(n))
            };
            let (u, d) = (noise * f64::from(channel.per_deviation), lost.sqrt());
            let side = 3f64.sqrt() * d;
            (at(u - side) + at(u + side)) / 6.0 + at(u) * 2.0 / 3.0
        };
        let channels: Vec<f64> = program.channels.iter().map(channel).collect();
        let output = |(mean, row): (&f32, &Vec<f32>)| {
            let sum: f64 = row.iter().zip(&channels).map(|(m, c)| f64::from(*m) * c).sum();
            f64::from(*mean) + sum
        };
        program.mean.iter().zip(&program.matrix).map(output).collect()
    }

    /// The sum over all coefficients near by, each with its spline.
    fn surface(integers: &[i16], x: f64, y: f64) -> f64 {
        let spline = |d: f64| match d.abs() {
            d if d < 0.5 => 0.75 - d * d,
            d if d < 1.5 => 0.5 * (1.5 - d).powi(2),
            _ => 0.0,
        };
        let around = |i: i64| i.rem_euclid(Torus::SIDE as i64) as usize;
        let mut sum = 0.0;
        for j in y.floor() as i64 - 2..=y.floor() as i64 + 2 {
            for i in x.floor() as i64 - 2..=x.floor() as i64 + 2 {
                let coefficient = f64::from(integers[around(j) * Torus::SIDE + around(i)]);
                sum += coefficient * spline(x - i as f64) * spline(y - j as f64);
            }
        }
        sum
    }

    #[test]
    fn its_words_give_the_evaluators_values() {
        let head = r#"{"format":"texforge-noise","version":1,"seed":7,"size":[99,70],"maps":[{"name":"a","kind":"color","encoding":"srgb","channels":3}],"mean":[0.5,0.4,0.3],"matrix":[[0.8,0.5],[0.5,-0.7],[0.3,0.2]],"model":"#;
        let rest = r#","score":{"fit":1,"recommended":"none"}}"#;
        let histogram = "[-0.3,-0.28,-0.2,-0.1,-0.05,0,0.02,0.05,0.1,0.3,0.4]";
        let channels = format!(
            r#""channels":[{{"weights":[0.1,0.1,0.2],"histogram":{histogram}}},{{"weights":[0.1,0,0.1]}}]"#
        );
        let oriented = r#""oriented":{"angle":30,"bands":[{"levels":[0,0],"parts":["fine","fine"]},{"levels":[5,1],"parts":["low","band"]},{"levels":[1,3],"parts":["band","low"]}],"#;
        for model in [r#""wavelet":{"bands":"round","#, r#""wavelet":{"bands":"square","#, oriented]
        {
            let text = format!("{head}{{{model}{channels}}}}}{rest}");
            let evaluator = Evaluator::new(Document::from_json(&text).expect("valid"));
            let program = Program::new(&evaluator);
            for i in 0..300 {
                let point = [f64::from(i) * 7.31 - 900.0, f64::from(i * i % 101) * 3.7];
                for footprint in [1.0, 1.6, 3.1, 100.0] {
                    let mut out = [0.0; 3];
                    let filter = Filter { footprint, keep_contrast: false };
                    evaluator.plane(&[point], filter, &mut out);
                    let expected = by_its_words(&program, point, footprint);
                    for (value, expected) in out.into_iter().zip(expected) {
                        let error = (f64::from(value) - expected).abs();
                        assert!(error < 1e-5, "{model} {point:?} {footprint}: {error}");
                    }
                }
            }
        }
    }
}
