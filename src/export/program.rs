//! [`Program`]: a procedural texture as the numbers that a shader computes with.

use crate::base::params::Value as _;
use crate::image::material::MapKind;
use crate::method::noise::document::Term;
use crate::method::noise::tiling::Layout;
use crate::method::noise::tiling::table::Places;
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
/// Of a tiled texture (`tiling` is there, `terms` and `tiles` are empty) step 2 is another, see
/// [`ProgramTiling`], and so is its filter.
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
    /// What a tiled texture is made of.
    pub tiling: Option<ProgramTiling>,
}

/// A tiled texture: all channels at once.
///
/// At a point (x, y) in pixels of the photo, with (a, b) = `layout.cell`:
///
/// 1. let v = y / b and u = x / a - v / 2; (i, j) and (f, g) are the whole and the fractional parts of
///    (u, v). Where f + g < 1 the vertices 0, 1 and 2 are (i, j), (i + 1, j) and (i, j + 1) with weights
///    1 - f - g, f and g; else (i + 1, j + 1), (i, j + 1) and (i + 1, j) with f + g - 1, 1 - f and 1 - g.
/// 2. Vertex (i, j) lies at (a i + (a / 2) j, b j). It has entry `SIDE` (j mod `SIDE`) + (i mod `SIDE`) of
///    `layout.table`, with [`SIDE`](crate::method::noise::tiling::SIDE); its place in the input is `places.first` + `places.step` times the
///    entry's `choices`.
/// 3. The correlations r01, r02, r12 are `alike` / 255 of: component 0 of vertex 0, component 1 of vertex
///    0, component 2 of vertex 1; in the other half of cells component 0 of vertex 1, component 1 of
///    vertex 2 and component 2 of vertex 2.
/// 4. w is the weights to the power of `layout.sharpness`; all are divided by the square root of
///    w0^2 + w1^2 + w2^2 + 2 (w0 w1 r01 + w0 w2 r02 + w1 w2 r12).
/// 5. Channel k is `channels[k].weights[0]` times the sum over the vertices of w times component k of the
///    input at the vertex' place plus the way from the vertex to the point, in pixels of the input, whose
///    first has its middle at (0.5, 0.5), and which are interpolated linearly. The input's samples are
///    `(stored - 32768) / 8192`; channels 0, 1 and 2 are in its first picture, and so on.
///
/// To filter for samples that are f pixels apart, let o = max(0, log2 f). The input is taken at level
/// l = min(o, `levels` - 1), linearly between two levels, where each is the mean of two by two pixels of the
/// one before, and the channel is multiplied by the smoothstep s of clamp(`levels` - o, 0, 1). What is lost has a
/// variance of d^2 = 1 - (s e)^2, in deviations, where e is the channel's number in `deviations`, linearly
/// between levels.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramTiling {
    /// Cells, table and input.
    pub layout: Layout,
    /// Where vertices may lie in the input.
    pub places: Places,
    /// How many levels the input has, with itself.
    pub levels: u32,
    /// Of every level, of every channel: what is left of its standard deviation.
    pub deviations: Vec<Vec<f64>>,
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
            tiling: evaluator.tiled().map(|(layout, places, deviations)| ProgramTiling {
                layout: layout.clone(),
                places,
                levels: deviations.len() as u32,
                deviations: deviations.to_vec(),
            }),
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
            shaped_by_its_words(pieces, noise * f64::from(channel.per_deviation), lost.sqrt())
        };
        let channels: Vec<f64> = program.channels.iter().map(channel).collect();
        let output = |(mean, row): (&f32, &Vec<f32>)| {
            let sum: f64 = row.iter().zip(&channels).map(|(m, c)| f64::from(*m) * c).sum();
            f64::from(*mean) + sum
        };
        program.mean.iter().zip(&program.matrix).map(output).collect()
    }

    /// The mean of the shape over what was lost, of deviation `d`.
    fn shaped_by_its_words(pieces: &[(f32, [f32; 5])], u: f64, d: f64) -> f64 {
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
        let side = 3f64.sqrt() * d;
        (at(u - side) + at(u + side)) / 6.0 + at(u) * 2.0 / 3.0
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

    /// What the doc comment of [`ProgramTiling`] says, word by word: the channels and what is lost.
    fn tiled_by_its_words(program: &Program, [x, y]: [f64; 2], footprint: f64) -> Vec<(f64, f64)> {
        use crate::method::noise::tiling::SIDE;
        let tiling = program.tiling.as_ref().expect("tiled");
        let (layout, places) = (&tiling.layout, &tiling.places);
        let [a, b] = layout.cell.map(f64::from);
        let (v, u) = (y / b, x / a - y / b / 2.0);
        let (i, j) = (u.floor() as i64, v.floor() as i64);
        let (f, g) = (u - u.floor(), v - v.floor());
        let below = f + g < 1.0;
        let (vertices, weights) = if below {
            ([(i, j), (i + 1, j), (i, j + 1)], [1.0 - f - g, f, g])
        } else {
            ([(i + 1, j + 1), (i, j + 1), (i + 1, j)], [f + g - 1.0, 1.0 - f, 1.0 - g])
        };
        let entry = vertices.map(|(i, j)| {
            let around = |i: i64| i.rem_euclid(SIDE as i64) as usize;
            SIDE * around(j) + around(i)
        });
        let alike = |vertex: usize, component: usize| {
            f64::from(layout.table.alike[entry[vertex]][component]) / 255.0
        };
        let r = if below {
            [alike(0, 0), alike(0, 1), alike(1, 2)]
        } else {
            [alike(1, 0), alike(2, 1), alike(2, 2)]
        };
        let w = weights.map(|w| w.powi(layout.sharpness as i32));
        let products = w[0] * w[1] * r[0] + w[0] * w[2] * r[1] + w[1] * w[2] * r[2];
        let all = (w.iter().map(|w| w * w).sum::<f64>() + 2.0 * products).sqrt();
        // The input, halved as often as asked.
        let sample = |level: u32, k: usize, x: i64, y: i64| {
            let (together, n) = (layout.input.together(), 1i64 << level);
            let [width, height] = layout.input.size.map(i64::from);
            let (x, y) = (x.clamp(0, width / n - 1) * n, y.clamp(0, height / n - 1) * n);
            let mut sum = 0.0;
            for y in y..y + n {
                for x in x..x + n {
                    let at = (y * width + x) as usize * together + k % together;
                    sum += f64::from(layout.input.pictures[k / together][at]);
                }
            }
            (sum / (n * n) as f64 - 32768.0) / 8192.0
        };
        let surface = |level: u32, k: usize, [x, y]: [f64; 2]| {
            let [x, y] = [x, y].map(|v| v / f64::from(1 << level) - 0.5);
            let (tx, ty) = (x - x.floor(), y - y.floor());
            let at =
                |dx: i64, dy: i64| sample(level, k, x.floor() as i64 + dx, y.floor() as i64 + dy);
            (1.0 - ty) * ((1.0 - tx) * at(0, 0) + tx * at(1, 0))
                + ty * ((1.0 - tx) * at(0, 1) + tx * at(1, 1))
        };
        let octaves = footprint.log2().max(0.0);
        let level = octaves.min(f64::from(tiling.levels) - 1.0);
        let (low, part) = (level.floor() as u32, level - level.floor());
        let high = (low + 1).min(tiling.levels - 1);
        let t = (f64::from(tiling.levels) - octaves).clamp(0.0, 1.0);
        let s = t * t * (3.0 - 2.0 * t);
        let channel = |k: usize| {
            let mut sum = 0.0;
            for (v, (i, j)) in vertices.into_iter().enumerate() {
                let choice = layout.table.choices[entry[v]];
                let at = [a * i as f64 + a / 2.0 * j as f64, b * j as f64];
                let at = std::array::from_fn(|axis| {
                    let place = places.first[axis] + places.step[axis] * u32::from(choice[axis]);
                    f64::from(place) + [x, y][axis] - at[axis]
                });
                let value = (1.0 - part) * surface(low, k, at) + part * surface(high, k, at);
                sum += w[v] / all * value;
            }
            let of = |level: u32| tiling.deviations[level as usize][k];
            let e = (1.0 - part) * of(low) + part * of(high);
            (s * sum, (1.0 - (s * e).powi(2)).max(0.0).sqrt())
        };
        (0..program.channels.len()).map(channel).collect()
    }

    #[test]
    fn its_words_give_the_evaluators_tiles() {
        use crate::base::ctx::Ctx;
        use crate::method::noise::fit::{Exemplar, Options, analyse};
        use crate::method::noise::tiling;
        use crate::method::noise::{BandShape, MapSpec, Model, Score};
        let (rows, cols) = (70, 90);
        let mut rng = crate::base::rng::Rng::new(1, 0, 0, 0);
        let mut plane = |gain: f32| -> Vec<f32> {
            (0..rows * cols).map(|_| gain * rng.below(1000) as f32).collect()
        };
        let planes = [plane(1e-3), plane(4e-4), plane(2e-4), plane(1e-4)];
        let exemplar = Exemplar { planes: &planes, shape: (rows, cols), usable: None };
        let ctx = Ctx::new(5, 1).expect("a context");
        for histogram in [true, false] {
            let options = Options { shape: BandShape::Round, direct: false, histogram };
            let analysis = analyse(&ctx, &exemplar, options).expect("an analysis");
            let options = tiling::fit::Options { cell: 19, sharpness: 3, longest: 85 };
            let (fit, layout) =
                tiling::fit::fit(&ctx, &analysis, &exemplar, options).expect("a fit");
            let map = |channels: usize| MapSpec {
                name: channels.to_string(),
                kind: "data".into(),
                encoding: "data".into(),
                channels,
            };
            let model = Model::Tiling { layout, channels: fit.channels };
            let score = Score { fit: 0.0, recommended: "none".into() };
            let size = [cols as u32, rows as u32];
            let document =
                Document::new(5, size, vec![map(3), map(1)], fit.mean, fit.matrix, model, score);
            let again = Document::from_json(&document.to_json()).expect("its own text");
            assert!(again == document, "another document after reading it");
            let evaluator = Evaluator::new(document);
            let program = Program::new(&evaluator);
            for i in 0..300 {
                let point = [f64::from(i) * 7.31 - 900.0, f64::from(i * i % 101) * 3.7];
                for footprint in [1.0, 1.6, 3.1, 6.0, 100.0] {
                    let mut out = [0.0; 4];
                    evaluator.plane(&[point], Filter { footprint, keep_contrast: false }, &mut out);
                    let channels = tiled_by_its_words(&program, point, footprint);
                    for (i, value) in out.into_iter().enumerate() {
                        let mut expected = f64::from(program.mean[i]);
                        for (k, (u, lost)) in channels.iter().enumerate() {
                            let channel = &program.channels[k];
                            let shaped = channel.shape.as_ref().map_or_else(
                                || u * f64::from(channel.weights[0]),
                                |pieces| shaped_by_its_words(pieces, *u, *lost),
                            );
                            expected += f64::from(program.matrix[i][k]) * shaped;
                        }
                        let error = (f64::from(value) - expected).abs();
                        assert!(error < 1e-5, "{histogram} {point:?} {footprint}: {error}");
                    }
                }
            }
        }
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
