//! [`Nodes`]: a program as numbers for node graphs, which have no integers and no loops.
//!
//! Nine coefficients by arithmetic for every term and channel would be thousands of nodes. So the
//! spline surface of each tile is drawn into a picture, some samples to a coefficient, and the host's
//! image lookup reads it. Neighbouring channels read a band at places that are a fixed way apart, in
//! coefficients; so three channels are the red, green and blue of one picture.
//!
//! Texture coordinates have v up and repeat with 1; one unit is the photo's width or height. Of a tiled
//! texture the pictures are another, see [`Tiles`].

mod tiles;

pub(super) use tiles::Tiles;

use super::{Program, ProgramChannel};
use crate::method::noise::KNOTS;
use crate::signal::wavelet_noise::Torus;

/// Channels that are looked up together.
pub(super) const TOGETHER: usize = 3;

/// A program for node graphs.
#[derive(Debug)]
pub(super) struct Nodes {
    /// What turns positions in pixels, v up: the rows of a matrix.
    pub(super) turn: Option<[[f64; 2]; 2]>,
    /// Of each term, by what a position in pixels is divided to be a place in the tile's picture.
    pub(super) spans: Vec<[f64; 2]>,
    /// The channels by [`TOGETHER`].
    pub(super) groups: Vec<Group>,
    /// By how many coefficients (x, y) green and blue are before red in the pictures.
    pub(super) shifts: [[usize; 2]; TOGETHER],
    /// Instead of terms, of a texture that is tiled.
    pub(super) tiles: Option<Tiles>,
}

/// Up to three channels that are looked up together; numbers of those that are missing are 0.
#[derive(Debug)]
pub(super) struct Group {
    /// Of each term, what is added to the place in the picture; 0..1.
    pub(super) offsets: Vec<[f64; 2]>,
    /// Of each term, or of the tiles, by what the values are multiplied. The sum is in standard deviations for channels
    /// with a histogram.
    pub(super) weights: Vec<[f64; TOGETHER]>,
    /// The histograms, if a channel has one.
    pub(super) shape: Option<GroupShape>,
}

/// The histograms of a group: with u the sum of the terms, `straight` u + `base` + the sum over the
/// pieces of t (c1 + t (c2 + t c3)), where t is u - knot held within 0 and width.
#[derive(Debug)]
pub(super) struct GroupShape {
    /// 1 for channels without a histogram. None if all have one.
    pub(super) straight: Option<[f64; TOGETHER]>,
    /// The value before the first knot.
    pub(super) base: [f64; TOGETHER],
    /// Of every piece the knot, the width, and c1 to c3.
    pub(super) pieces: Vec<(f64, f64, [[f64; TOGETHER]; 3])>,
}

impl Nodes {
    /// For pictures with `fine` samples to a coefficient, of which the first is in the middle of the
    /// first coefficient.
    pub(super) fn new(program: &Program, fine: usize) -> Self {
        let side = Torus::SIDE as f64;
        let spans: Vec<[f64; 2]> = program
            .terms
            .iter()
            .map(|term| term.levels.map(|level| side * f64::from(1u32 << level)))
            .collect();
        let height = f64::from(program.size[1]);
        let [c, s] = program.turn.unwrap_or([1.0, 0.0]);
        // The photo's y is height - v; half a sample, as pictures begin at its edge.
        let half = 0.5 / (side * fine as f64);
        let offset = |[x, y]: [u32; 2], [span_x, span_y]: [f64; 2]| {
            let x = (s * height - 0.5 + f64::from(x)) / span_x + half;
            let y = (c * height - 0.5 + f64::from(y)) / span_y + half;
            [x.rem_euclid(1.0), (-y).rem_euclid(1.0)]
        };
        let group = |channels: &[ProgramChannel]| Group {
            offsets: channels[0].offsets.iter().zip(&spans).map(|(&o, &s)| offset(o, s)).collect(),
            weights: (0..channels[0].weights.len())
                .map(|t| each(channels, |c| weight(c, t)))
                .collect(),
            shape: GroupShape::new(channels),
        };
        Self {
            turn: program.turn.map(|[c, s]| [[c, -s], [s, c]]),
            groups: program.channels.chunks(TOGETHER).map(group).collect(),
            shifts: std::array::from_fn(|k| shift(program, k)),
            tiles: program.tiling.as_ref().map(|tiling| Tiles::new(tiling, program.size[1])),
            spans,
        }
    }
}

/// By how many coefficients channel `k` is before the first, in all terms.
fn shift(program: &Program, k: usize) -> [usize; 2] {
    let Some((channel, term)) = program.channels.get(k).zip(program.terms.first()) else {
        return [0; 2];
    };
    let (from, to) = (program.channels[0].offsets[0], channel.offsets[0]);
    std::array::from_fn(|axis| {
        (to[axis].wrapping_sub(from[axis]) >> term.levels[axis]) as usize % Torus::SIDE
    })
}

/// A number of each channel of a group.
fn each(channels: &[ProgramChannel], of: impl Fn(&ProgramChannel) -> f64) -> [f64; TOGETHER] {
    std::array::from_fn(|k| channels.get(k).map_or(0.0, &of))
}

fn weight(channel: &ProgramChannel, term: usize) -> f64 {
    let gain = if channel.shape.is_some() { channel.per_deviation } else { 1.0 };
    f64::from(channel.weights[term]) * f64::from(gain)
}

impl GroupShape {
    fn new(channels: &[ProgramChannel]) -> Option<Self> {
        let shape = |c: &ProgramChannel, i: usize| c.shape.as_ref().map(|pieces| pieces[i]);
        channels.iter().any(|c| c.shape.is_some()).then(|| Self {
            straight: channels
                .iter()
                .any(|c| c.shape.is_none())
                .then(|| each(channels, |c| f64::from(u8::from(c.shape.is_none())))),
            base: each(channels, |c| shape(c, 0).map_or(0.0, |(_, [c0, ..])| f64::from(c0))),
            pieces: (0..KNOTS.len() - 1)
                .map(|i| {
                    // In u itself: t is (u - knot) r.
                    let power = |n: usize| {
                        each(channels, |c| {
                            let of = |(_, piece): (f32, [f32; 5])| {
                                f64::from(piece[n]) * f64::from(piece[4]).powi(n as i32)
                            };
                            shape(c, i).map_or(0.0, of)
                        })
                    };
                    (KNOTS[i], KNOTS[i + 1] - KNOTS[i], [power(1), power(2), power(3)])
                })
                .collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::noise::{Band, Channel, Document, Evaluator, MapSpec, Model, Score, Shape};
    use crate::signal::wavelet_noise::Part;

    /// Five channels, every other one with a histogram; bands that differ along the axes.
    fn program() -> (Program, Vec<f64>) {
        let histogram: Vec<f64> = KNOTS.iter().map(|u| 0.3 * u + 0.05 * u * u.abs()).collect();
        let channels = (0..5).map(|k| Channel {
            weights: vec![0.1, 0.2],
            histogram: (k % 2 == 0).then(|| histogram.clone()),
        });
        let bands = vec![
            Band { levels: [0, 3], parts: [Part::Fine, Part::Low] },
            Band { levels: [5, 2], parts: [Part::Low, Part::Band] },
        ];
        let map = MapSpec {
            name: "all".into(),
            kind: "data".into(),
            encoding: "data".into(),
            channels: 5,
        };
        let document = Document::new(
            7,
            [60, 40],
            vec![map],
            vec![0.0; 5],
            vec![vec![1.0; 5]; 5],
            Model::Oriented { angle: 20.0, bands, channels: channels.collect() },
            Score { fit: 0.0, recommended: "none".into() },
        );
        (Program::new(&Evaluator::new(document)), histogram)
    }

    #[test]
    fn channels_of_a_group_are_one_way_apart_in_all_terms() {
        let (program, _) = program();
        let shifts = Nodes::new(&program, 3).shifts;
        for first in (0..program.channels.len()).step_by(TOGETHER) {
            for (k, shift) in shifts.iter().enumerate() {
                let Some(channel) = program.channels.get(first + k) else { continue };
                for (t, term) in program.terms.iter().enumerate() {
                    for (axis, by) in shift.iter().enumerate() {
                        let period = (Torus::SIDE as u32) << term.levels[axis];
                        let moved = (*by as u32) << term.levels[axis];
                        let expected = program.channels[first].offsets[t][axis] + moved;
                        assert_eq!(channel.offsets[t][axis], expected % period, "{k} {t} {axis}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_pieces_add_up_to_the_histogram() {
        let (program, histogram) = program();
        let group = &Nodes::new(&program, 3).groups[0];
        let exact = Shape::new(&std::array::from_fn(|i| histogram[i]));
        let shape = group.shape.as_ref().expect("histograms");
        for i in -40..=40 {
            let u = 0.1 * f64::from(i);
            let value = |k: usize| {
                let piece = |(knot, width, [c1, c2, c3]): &(f64, f64, [[f64; TOGETHER]; 3])| {
                    let t = (u - knot).clamp(0.0, *width);
                    t * (c1[k] + t * (c2[k] + t * c3[k]))
                };
                let straight = shape.straight.map_or(0.0, |straight| straight[k]);
                straight * u + shape.base[k] + shape.pieces.iter().map(piece).sum::<f64>()
            };
            assert!((value(0) - f64::from(exact.at(u as f32))).abs() < 1e-5, "{u}");
            assert!((value(1) - u).abs() < 1e-12, "{u}");
        }
    }
}
