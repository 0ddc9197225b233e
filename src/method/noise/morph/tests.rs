use proptest::prelude::*;

use super::*;
use crate::method::noise::BandShape;
use crate::signal::wavelet_noise::spectrum::at_pixels;

/// A matrix whose columns are at right angles: turned about three axes, perhaps mirrored.
fn rotation(angles: [f64; 3], mirrored: bool) -> Vec<Vec<f64>> {
    let mut m: Vec<Vec<f64>> =
        (0..3).map(|i| (0..3).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for (axis, angle) in angles.into_iter().enumerate() {
        let (c, s) = (libm::cos(angle), libm::sin(angle));
        let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
        for row in &mut m {
            (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
        }
    }
    if mirrored {
        m.iter_mut().for_each(|row| row[1] = -row[1]);
    }
    m
}

fn document(matrix: Vec<Vec<f64>>, weights: &[&[f64]], histogram: bool) -> Document {
    let shape = |k: f64| KNOTS.iter().map(|u| k * (u + 0.1 * u * u)).collect();
    let channels = weights.iter().enumerate().map(|(k, weights)| Channel {
        weights: weights.to_vec(),
        histogram: histogram.then(|| shape(0.1 / (k + 1) as f64)),
    });
    let (kind, encoding) = ("color".to_owned(), "srgb".to_owned());
    let map = MapSpec { name: "basecolor".into(), kind, encoding, channels: matrix.len() };
    Document::new(
        7,
        [300, 200],
        vec![map],
        (0..matrix.len()).map(|i| 0.2 + 0.1 * i as f64).collect(),
        matrix,
        Model::Wavelet { bands: BandShape::Round, channels: channels.collect() },
        Score { fit: 0.9, recommended: "wavelet".into() },
    )
}

const WEIGHTS: [&[f64]; 3] = [&[0.05, 0.1, 0.08], &[0.02, 0.01, 0.03], &[0.01, 0.0, 0.005]];

/// The covariance of the colours of noise without histograms, whose bands have these variances: the
/// definition.
fn covariance(document: &Document, bands: &[f64]) -> Vec<f64> {
    let n = document.mean.len();
    let variance = |c: &Channel| deviation(&c.weights, bands).powi(2);
    let variances: Vec<f64> = document.channels().iter().map(variance).collect();
    let entry = |i: usize, j: usize| {
        let row = |i: usize| document.matrix[i].iter();
        row(i).zip(row(j)).zip(&variances).map(|((a, b), v)| a * b * v).sum()
    };
    (0..n * n).map(|k| entry(k / n, k % n)).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

proptest! {
    #[test]
    fn frames_turn_at_constant_speed_by_the_smallest_angle(
        a in prop::array::uniform3(-3.2..3.2f64), b in prop::array::uniform3(-3.2..3.2f64),
        mirrored in prop::array::uniform2(prop::bool::ANY),
    ) {
        let columns = |m: Vec<Vec<f64>>| -> Frame {
            std::array::from_fn(|j| std::array::from_fn(|i| m[i][j]))
        };
        let (a, b) = (columns(rotation(a, mirrored[0])), columns(rotation(b, mirrored[1])));
        let pairs = nearest_frame(&a, &b);
        let to: Frame = pairs.map(|(_, j, sign)| b[j].map(|v| sign * v));
        let angle = |a: &Frame, b: &Frame| {
            let trace: f64 = a.iter().zip(b).map(|(a, b)| dot(a, b)).sum();
            libm::acos(((trace - 1.0) / 2.0).clamp(-1.0, 1.0))
        };
        // The group of the cube leaves at most this.
        let all = angle(&a, &to);
        prop_assert!(all < 1.097, "{all}");
        for t in [0.0, 0.25, 0.5, 0.9, 1.0] {
            let between = turned(&a, &to, t);
            prop_assert!((determinant(&between) - determinant(&a)).abs() < 1e-9);
            for k in 0..9 {
                let want = f64::from(u8::from(k / 3 == k % 3));
                prop_assert!((dot(&between[k / 3], &between[k % 3]) - want).abs() < 1e-9);
            }
            // An angle's cosine tells little of small angles.
            prop_assert!((angle(&a, &between) - t * all).abs() < 1e-6);
            prop_assert!((angle(&between, &to) - (1.0 - t) * all).abs() < 1e-6);
        }
    }

    #[test]
    fn a_texture_is_between_itself_and_itself(
        angles in prop::array::uniform3(-3.2..3.2f64), mirrored: bool, histogram: bool, t in 0.0..=1.0f64,
    ) {
        let document = document(rotation(angles, mirrored), &WEIGHTS, histogram);
        prop_assert_eq!(morph(&document, &document, t).expect("same"), document);
    }

    #[test]
    fn names_of_axes_do_not_matter(angles in prop::array::uniform3(-3.2..3.2f64), t in 0.01..0.99f64) {
        // The same statistics with the axes in another order and with other signs.
        let a = document(rotation(angles, false), &WEIGHTS, false);
        let matrix = a.matrix.iter().map(|row| vec![row[2], -row[0], row[1]]).collect();
        let b = document(matrix, &[WEIGHTS[2], WEIGHTS[0], WEIGHTS[1]], false);
        let between = morph(&a, &b, t).expect("between");
        let covariance = |d| covariance(d, &[1.0, 1.1, 0.9]);
        prop_assert!(distance(&covariance(&between), &covariance(&a)) < 1e-7);
    }

    #[test]
    fn covariance_goes_without_steps(
        a in prop::array::uniform3(-3.2..3.2f64), b in prop::array::uniform3(-3.2..3.2f64),
        mirrored: bool, counts in prop::array::uniform2(1usize..=3),
    ) {
        let part = |m: Vec<Vec<f64>>, n: usize, mirrored| -> Document {
            let m = m.into_iter().map(|row| row[..n].to_vec()).collect();
            document(m, &WEIGHTS[if mirrored { 3 - n } else { 0 }..][..n], false)
        };
        let a = part(rotation(a, false), counts[0], false);
        let b = part(rotation(b, mirrored), counts[1], true);
        let covariance = |d: &Document| covariance(d, &[1.0, 1.1, 0.9]);
        let mut before = covariance(&a);
        for i in 1..=200 {
            let now = covariance(&morph(&a, &b, f64::from(i) / 200.0).expect("between"));
            let step = distance(&before, &now);
            prop_assert!(step < 6e-4, "step {step} at {i}");
            before = now;
        }
        prop_assert!(distance(&before, &covariance(&b)) == 0.0);
    }
}

#[test]
fn numbers_go_straight() {
    let a = document(rotation([0.1, 0.2, 0.3], false), &WEIGHTS, true);
    let mut b = document(
        rotation([0.1, 0.2, 0.3], false),
        &[&[0.1, 0.1, 0.1, 0.2], &[0.0; 4], &[0.3; 4]],
        false,
    );
    b.mean = vec![0.6, 0.1, 0.4];
    let between = morph(&a, &b, 0.25).expect("between");
    for (k, (c, (a, b))) in
        between.channels().iter().zip(a.channels().iter().zip(b.channels())).enumerate()
    {
        for (j, weight) in c.weights.iter().enumerate() {
            let (a, b) = (a.weights.get(j).copied().unwrap_or(0.0), b.weights[j]);
            assert!((weight - (0.75 * a + 0.25 * b)).abs() < 1e-6, "{k} {j}");
        }
        let deviation = deviation_of(&b.weights);
        for (i, value) in c.histogram.as_ref().expect("one has it").iter().enumerate() {
            let a = a.histogram.as_ref().expect("a has it")[i];
            let want = 0.75 * a + 0.25 * KNOTS[i] * deviation;
            assert!((value - want).abs() < 1e-6, "{k} {i}: {value} {want}");
        }
    }
    for i in 0..3 {
        assert!((between.mean[i] - (0.75 * a.mean[i] + 0.25 * b.mean[i])).abs() < 1e-6);
    }
}

/// Deviation at the photo's pixels of round bands with these weights.
fn deviation_of(weights: &[f64]) -> f64 {
    let term = |(j, w): (usize, &f64)| {
        let term = BandShape::Round.term(j as u32);
        w * w * at_pixels(term.detail, term.levels)
    };
    weights.iter().enumerate().map(term).sum::<f64>().sqrt()
}

#[test]
fn what_does_not_match_is_refused() {
    let color = document(rotation([0.0; 3], false), &WEIGHTS, false);
    let grey = document(vec![vec![1.0]], &WEIGHTS[..1], false);
    let mut square = color.clone();
    let channels = color.channels().to_vec();
    square.model = Model::Wavelet { bands: BandShape::Square, channels: channels.clone() };
    let mut oriented = color.clone();
    oriented.model = Model::Oriented { angle: 0.0, bands: Vec::new(), channels };
    for (other, t, what) in [
        (&grey, 0.5, "`other` must be a texture of the same maps"),
        (
            &square,
            0.0,
            "`other` must be noise of round bands, as the first texture is, got noise of square",
        ),
        (&oriented, 1.0, "`other` must be isotropic noise"),
        (&color, 1.0001, "`t` must be 0 to 1"),
        (&color, -0.1, "`t` must be 0 to 1"),
        (&color, f64::NAN, "`t` must be 0 to 1"),
    ] {
        let error = morph(&color, other, t).expect_err(what).to_string();
        assert!(error.starts_with(what), "{error}");
    }
}

#[test]
fn directions_turn_the_shorter_way() {
    use crate::method::noise::Band;
    use crate::signal::wavelet_noise::Part;
    let band = |levels| Band { levels, parts: [Part::Band, Part::Low] };
    let oriented = |angle, bands: Vec<Band>, weights: &[f64]| {
        let mut document = document(vec![vec![1.0]], &[weights], false);
        let channels = document.channels().to_vec();
        document.model = Model::Oriented { angle, bands, channels };
        document
    };
    let a = oriented(80.0, vec![band([0, 1]), band([2, 2])], &[0.1, 0.2]);
    let b = oriented(-70.0, vec![band([2, 2]), band([3, 1])], &[0.4, 0.3]);
    let Model::Oriented { angle, bands, channels } = morph(&a, &b, 0.5).expect("between").model
    else {
        panic!("directions")
    };
    assert_eq!(angle, 95.0);
    assert_eq!(bands, [band([0, 1]), band([2, 2]), band([3, 1])]);
    assert_eq!(channels[0].weights, [0.05, 0.3, 0.15]);
}
