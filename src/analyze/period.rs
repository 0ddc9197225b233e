//! Periods along one axis, and the rectangles that a lattice repeats in.

use crate::signal::basis::{Basis, Vector, coefficients, combined, dot};

/// Displacements that leave less than this share of the picture to compare do not count.
const LEAST_OVERLAP: f64 = 0.25;

/// Least period, in pixels: what is finer is grain.
const LEAST: usize = 3;

/// How far from its place a minimum may lie, as a share of the period: bricks are not laid to the
/// pixel. Much more finds a minimum everywhere.
const SLACK: f64 = 0.06;

/// A shorter period is taken if it is this nearly as strong as the strongest. Multiples of a period
/// are periods too, and often a little stronger.
const SHORTER: f64 = 0.88;

/// Differences count as this share of what unrelated pixels differ by, at least: where hardly anything
/// differs, such as along the rows of a picture of nothing but rows, minima mean nothing.
const FLOOR: f64 = 0.1;

/// Strength at which the confidence is a half.
const EVEN: f64 = 0.16;

/// A period along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period {
    /// In pixels.
    pub length: f64,
    /// How many minima of the difference it was measured by.
    pub minima: usize,
    /// How sure it is that the picture has a period and this is it, in 0..=1.
    pub confidence: f64,
}

/// The period of a picture from its self-difference: entry k is the mean squared difference between
/// the picture and its copy moved by k pixels (`None`: not known), and `unrelated` what unrelated
/// pixels differ by. `None` if nothing repeats at all.
///
/// A period has minima at all its multiples. The candidates are the minima up to half the picture;
/// each is followed through its multiples, and is as strong as these are deep on average, compared
/// with what lies between them. The worst of three and more is left out: one may be missing. A
/// harmonic misses every second one, and is weak; a multiple is as strong as the period, so the
/// shortest of the strong ones is it.
///
/// # Paper
/// Representative Tile Extraction, sec. 3, eq. 3. There the period is the last minimum's place over
/// its number; here it is the least squares fit to all places.
pub fn period(differences: &[Option<f64>], unrelated: f64) -> Option<Period> {
    let n = differences.len();
    let known = ((n as f64 * (1.0 - LEAST_OVERLAP)) as usize).min(n);
    let g: Vec<f64> = differences[..known].iter().map_while(|v| *v).collect();
    let is_minimum = |&k: &usize| g[k] < g[k - 1] && g[k] <= g[k + 1];
    let minima = (LEAST..(n / 2 + 1).min(g.len().saturating_sub(1))).filter(is_minimum);
    // The first minimum itself may be missing, so the half of each is tried as well.
    let lengths = minima.map(|k| bottom_of(&g, k)).flat_map(|length| [length, length / 2.0]);
    let lengths = lengths.filter(|length| *length >= LEAST as f64);
    let followed: Vec<(f64, Period)> =
        lengths.filter_map(|length| follow(&g, length, FLOOR * unrelated)).collect();
    let strongest = followed.iter().map(|(strength, _)| *strength).fold(0.0, f64::max);
    let strong = followed.into_iter().filter(|(s, _)| *s > 0.0 && *s >= SHORTER * strongest);
    strong.map(|(_, period)| period).reduce(|a, b| if b.length < a.length { b } else { a })
}

/// Follows a length through its multiples: its strength, and the period that comes out.
fn follow(g: &[f64], mut length: f64, floor: f64) -> Option<(f64, Period)> {
    let (mut top, mut bottom) = (0.0, 0.0);
    let mut depths = Vec::new();
    for m in 1.. {
        let expected = length * f64::from(m);
        let slack = (SLACK * length).max(1.0);
        let (low, high) = (expected - slack, expected + slack);
        if high + 1.0 >= g.len() as f64 {
            break;
        }
        let places = low.ceil().max(1.0) as usize..=high.floor() as usize;
        let at = places.reduce(|a, b| if g[b] < g[a] { b } else { a })?;
        let around = |share: f64| {
            let edge = (expected + share * length).round().max(0.0) as usize;
            edge.min(g.len() - 1)
        };
        let window = &g[around(-0.5)..=around(0.5)];
        let mean = window.iter().sum::<f64>() / window.len() as f64;
        let depth = if mean > 0.0 { (mean - g[at]) / mean.max(floor) } else { 0.0 };
        depths.push(depth);
        // A place that is no minimum says nothing of the length.
        if g[at] < g[at - 1] && g[at] <= g[at + 1] && depth > 0.0 {
            top += f64::from(m) * bottom_of(g, at);
            bottom += f64::from(m * m);
            length = top / bottom;
        }
    }
    let minima = depths.len();
    depths.sort_unstable_by(f64::total_cmp);
    let kept = &depths[usize::from(minima >= 3)..];
    let strength = kept.iter().sum::<f64>() / kept.len().max(1) as f64;
    let cube = (strength.max(0.0) / EVEN).powi(3);
    let confidence = cube / (1.0 + cube);
    (minima > 0).then_some((strength, Period { length, minima, confidence }))
}

/// The place of a minimum to a fraction of a pixel: of the parabola through it and its neighbours.
fn bottom_of(g: &[f64], at: usize) -> f64 {
    let (a, b, c) = (g[at - 1], g[at], g[at + 1]);
    let curve = a - 2.0 * b + c;
    at as f64 + if curve > 0.0 { ((a - c) / (2.0 * curve)).clamp(-0.5, 0.5) } else { 0.0 }
}

/// Most that a side of a rectangle may lean, as a share of its length: it is put upright by a
/// shear or a turn of about three degrees.
const MOST_LEAN: f64 = 0.055;

/// What a lean of a whole [`MOST_LEAN`] costs, as a share of the length: a side a quarter longer that
/// is upright is taken for one that leans.
const LEAN_COST: f64 = 0.25;

/// The smallest two displacements of a lattice that lie nearly along the axes, each at most `longest`
/// (to the right, downwards); `None` if there are none.
pub fn rectangle(basis: Basis, longest: Vector) -> Option<Basis> {
    let along = |axis: usize| {
        let far = longest[axis];
        let off = MOST_LEAN * far;
        let corner = |sign: f64| if axis == 0 { [far, sign * off] } else { [sign * off, far] };
        let corners = [corner(1.0), corner(-1.0)].map(|v| coefficients(basis, v));
        let most = |k: usize| corners.iter().map(|c| c[k].abs()).fold(0.0, f64::max) as i64;
        let (rows, cols) = (most(0), most(1));
        let mut best: Option<(f64, Vector)> = None;
        for i in -rows..=rows {
            for j in -cols..=cols {
                let v = combined(basis, i as f64, j as f64);
                let (length, lean) = (v[axis], v[1 - axis].abs());
                if length < 1.0 || length > far || lean > MOST_LEAN * length {
                    continue;
                }
                let cost = length * (1.0 + LEAN_COST * lean / (MOST_LEAN * length));
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, v));
                }
            }
        }
        best.map(|(_, v)| v)
    };
    let [a, b] = [along(0)?, along(1)?];
    // Nearly upright sides cannot be parallel, whatever their lengths.
    debug_assert!(dot(a, a) > 0.0 && dot(b, b) > 0.0, "sides of no length");
    Some([a, b])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A difference that is 1 but for minima of this depth and half width at the multiples.
    fn dips(n: usize, period: f64, depth: impl Fn(usize) -> f64) -> Vec<Option<f64>> {
        let at = |k: usize| {
            let m = (k as f64 / period).round();
            let t = (k as f64 - m * period).abs() / (0.2 * period);
            let wave = 0.02 * (k as f64 * 1.7).sin();
            1.0 + wave - depth(m as usize) * (1.0 - t * t).max(0.0)
        };
        (0..n).map(|k| Some(at(k))).collect()
    }

    #[test]
    fn a_fractional_period_is_measured_over_all_minima() {
        let found = period(&dips(400, 23.37, |_| 0.6), 1.0).expect("a period");
        assert!((found.length - 23.37).abs() < 0.02, "{found:?}");
        assert!(found.confidence > 0.9 && found.minima >= 11, "{found:?}");
    }

    #[test]
    fn harmonics_and_multiples_are_not_the_period() {
        // Every second minimum is much shallower: the period is two of them.
        let uneven = |m: usize| if m % 2 == 1 { 0.25 } else { 0.7 };
        let found = period(&dips(400, 20.0, uneven), 1.0).expect("a period");
        assert!((found.length - 40.0).abs() < 0.1, "{found:?}");
        // A little shallower is one: noise.
        let even = |m: usize| if m % 2 == 1 { 0.6 } else { 0.66 };
        let found = period(&dips(400, 20.0, even), 1.0).expect("a period");
        assert!((found.length - 20.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn one_missing_minimum_does_not_matter() {
        for missing in 1..=6 {
            let depth = |m: usize| if m == missing { 0.0 } else { 0.6 };
            let found = period(&dips(300, 31.3, depth), 1.0).expect("a period");
            assert!((found.length - 31.3).abs() < 0.1, "{missing}: {found:?}");
        }
    }

    #[test]
    fn what_does_not_repeat_has_none_or_no_confidence() {
        let rising: Vec<_> = (0..200).map(|k| Some(f64::from(k))).collect();
        assert_eq!(period(&rising, 100.0), None);
        assert_eq!(period(&[], 1.0), None);
        assert_eq!(period(&[None, None], 1.0), None);
        let faint: Vec<_> =
            dips(400, 23.0, |_| 0.6).into_iter().map(|v| v.map(|v| 0.01 * v)).collect();
        assert!(period(&faint, 1.0).is_none_or(|p| p.confidence < 0.1), "hardly anything differs");
        let found = period(&dips(400, 23.0, |_| 0.0), 1.0);
        assert!(found.is_none_or(|p| p.confidence < 0.1), "{found:?}");
    }

    #[test]
    fn rectangles_of_lattices_are_upright_and_small() {
        let check = |basis: Basis, want: Option<[Vector; 2]>| {
            let got = rectangle(basis, [400.0, 400.0]);
            assert_eq!(got.is_some(), want.is_some(), "{basis:?}: {got:?}");
            for (got, want) in got.iter().flatten().zip(want.iter().flatten()) {
                let off = (got[0] - want[0]).hypot(got[1] - want[1]);
                assert!(off < 1e-9, "{basis:?}: {got:?}, not {want:?}");
            }
        };
        check([[20.0, 0.0], [0.0, 30.0]], Some([[20.0, 0.0], [0.0, 30.0]]));
        // Running bond: two courses.
        check([[64.0, 0.0], [32.0, 20.0]], Some([[64.0, 0.0], [0.0, 40.0]]));
        check([[16.0, 16.0], [16.0, -16.0]], Some([[32.0, 0.0], [0.0, 32.0]]));
        // Turned by two degrees: the sides lean, and are put upright later.
        check([[100.0, 3.5], [-3.5, 100.0]], Some([[100.0, 3.5], [-3.5, 100.0]]));
        check([[300.0, 290.0], [-290.0, 300.0]], None);
    }
}
