//! A steerable pyramid of one scale and four orientations that reconstructs perfectly.
//!
//! The filters are third derivatives of a Gaussian in four directions (Freeman and Adelson 1991), as
//! separable convolutions: any size, no padding, and the same bytes on every processor, which a
//! Fourier transform with its choice of instructions does not promise.

use std::sync::LazyLock;

use rayon::prelude::*;

use crate::signal::window::Domain;

/// Orientations: derivatives along 0, 45, 90 and 135 degrees from the rows' direction.
pub const ORIENTATIONS: usize = 4;

/// Standard deviation of the Gaussian in pixels: the response is strongest to waves of four pixels.
const SIGMA: f64 = 1.1;

/// Pixels to either side that a filter reaches: 4.5 standard deviations.
const REACH: usize = 5;

/// Taps of a filter.
const TAPS: usize = 2 * REACH + 1;

/// The filters along one axis: the Gaussian's derivatives of order 0 to 3.
type Taps = [[f32; TAPS]; 4];

/// What a filter of order p becomes in a mirror: itself or its negative.
fn parity(order: usize) -> f32 {
    if order.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// Waves along each axis that are tried to find the filters' greatest gain.
const WAVES: usize = 64;

/// How each orientation is made of the derivatives `x^3, x^2 y, x y^2, y^3`, scaled so that the
/// filters pass no wave with a gain above 1 in all.
struct Filters {
    taps: Taps,
    /// `(orientation, order along y)`.
    mix: [[f32; 4]; ORIENTATIONS],
}

static FILTERS: LazyLock<Filters> = LazyLock::new(|| {
    let tap = |order: usize, i: usize| {
        let x = (i as f64 - REACH as f64) / SIGMA;
        let polynomial = [1.0, -x, x * x - 1.0, 3.0 * x - x * x * x][order];
        polynomial * libm::exp(-0.5 * x * x)
    };
    let taps: [[f64; TAPS]; 4] =
        std::array::from_fn(|order| std::array::from_fn(|i| tap(order, i)));
    // cos^3, 3 cos^2 sin, 3 cos sin^2, sin^3 of the four angles.
    let h = std::f64::consts::FRAC_1_SQRT_2;
    let mix = [(1.0, 0.0), (h, h), (0.0, 1.0), (-h, h)]
        .map(|(c, s): (f64, f64)| [c * c * c, 3.0 * c * c * s, 3.0 * c * s * s, s * s * s]);
    // The squared gain of all four for a wave, at its greatest.
    let response = |order: usize, w: f64| -> f64 {
        // Even filters answer to a cosine, odd ones to a sine: three derivatives, always to a sine.
        let wave = if order.is_multiple_of(2) { libm::cos } else { libm::sin };
        (0..TAPS).map(|i| taps[order][i] * wave(w * (i as f64 - REACH as f64))).sum()
    };
    let waves = (0..=WAVES).map(|i| std::f64::consts::PI * i as f64 / WAVES as f64);
    let table: Vec<[f64; 4]> =
        waves.map(|w| std::array::from_fn(|order| response(order, w))).collect();
    let mut most = 0f64;
    for y in &table {
        for x in &table {
            // Waves to the lower right and to the upper right.
            for side in [1.0, -1.0] {
                let gain = |mix: &[f64; 4]| -> f64 {
                    let sum =
                        |n: usize| mix[n] * x[3 - n] * y[n] * if n % 2 == 1 { side } else { 1.0 };
                    (0..4).map(sum).sum()
                };
                most = most.max(mix.iter().map(|mix| gain(mix).powi(2)).sum());
            }
        }
    }
    let scale = 1.0 / most.sqrt();
    Filters {
        taps: taps.map(|taps| taps.map(|tap| tap as f32)),
        mix: mix.map(|mix| mix.map(|m| (m * scale) as f32)),
    }
});

/// The responses of a plane to the oriented filters, each of its size; one value a pixel. Axes that do
/// not wrap are continued in a mirror.
pub type Bands = [Vec<f32>; ORIENTATIONS];

/// Takes a plane apart. What the bands lack is the residual: the plane less their [`transposed`].
///
/// # Paper
/// Moritz et al. 2017, eq. 4.
///
/// # Determinism
/// Same bytes for any thread count and on any processor.
pub fn responses(plane: &[f32], domain: Domain) -> Bands {
    assert_eq!(plane.len(), domain.height * domain.width, "values do not fill the domain");
    let filters = &*FILTERS;
    let mut bands: Bands = std::array::from_fn(|_| vec![0.0; plane.len()]);
    let axes = Axes::new(domain);
    for_rows(&mut bands, domain.width, |y, mut rows| {
        let mut basis: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; domain.width]);
        let mut column = vec![0.0; domain.width + 2 * REACH];
        for (n, basis) in basis.iter_mut().enumerate() {
            axes.down(y, 1.0, &filters.taps[n], plane, &mut column);
            axes.across(1.0, &filters.taps[3 - n], &mut column, basis);
        }
        for (row, mix) in rows.iter_mut().zip(&filters.mix) {
            mixed(row, &basis, *mix);
        }
    });
    bands
}

/// Puts a plane together again whose bands have changed by `changes`: its residual, and the changed
/// bands filtered once more. The filters are linear, so that is the plane and the changes' transposed;
/// without a change it is the plane, exactly.
pub fn rebuilt(plane: &[f32], changes: &Bands, domain: Domain) -> Vec<f32> {
    let mut picture = transposed(changes, domain);
    picture.iter_mut().zip(plane).for_each(|(moved, v)| *moved += v);
    picture
}

/// Bands filtered by the transposed filters, added up.
pub fn transposed(bands: &Bands, domain: Domain) -> Vec<f32> {
    let (filters, width) = (&*FILTERS, domain.width);
    let mut basis: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; bands[0].len()]);
    for_rows(&mut basis, width, |y, mut rows| {
        let bands = bands.each_ref().map(|band| &band[y * width..][..width]);
        for (n, row) in rows.iter_mut().enumerate() {
            mixed(row, &bands, std::array::from_fn(|k| filters.mix[k][n]));
        }
    });
    let axes = Axes::new(domain);
    let mut sum = [vec![0.0; bands[0].len()]];
    for_rows(&mut sum, width, |y, [row]| {
        let mut column = vec![0.0; width + 2 * REACH];
        for (n, basis) in basis.iter().enumerate() {
            // Transposed, a filter is mirrored; and its response in a mirror has its parity.
            let (py, px) = (parity(n), parity(3 - n));
            axes.down(y, py, &filters.taps[n].map(|t| py * t), basis, &mut column);
            axes.across(px, &filters.taps[3 - n].map(|t| px * t), &mut column, row);
        }
    });
    let [sum] = sum;
    sum
}

/// Runs `work` on each row of the planes.
fn for_rows<const N: usize>(
    planes: &mut [Vec<f32>; N],
    width: usize,
    work: impl Fn(usize, [&mut [f32]; N]) + Sync,
) {
    let mut rows: Vec<Vec<&mut [f32]>> = Vec::new();
    for plane in planes {
        for (y, row) in plane.chunks_mut(width).enumerate() {
            if rows.len() <= y {
                rows.push(Vec::with_capacity(N));
            }
            rows[y].push(row);
        }
    }
    rows.into_par_iter().enumerate().for_each(|(y, rows)| {
        let Ok(rows) = <[&mut [f32]; N]>::try_from(rows) else { unreachable!("N planes") };
        work(y, rows);
    });
}

/// `out += sum of weights times rows`.
fn mixed<R: AsRef<[f32]>>(out: &mut [f32], rows: &[R; 4], weights: [f32; 4]) {
    let [a, b, c, d] = rows.each_ref().map(AsRef::as_ref);
    for ((((out, a), b), c), d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        *out += (weights[0] * a + weights[1] * b) + (weights[2] * c + weights[3] * d);
    }
}

/// Where filters find what lies beyond the ends.
struct Axes {
    domain: Domain,
    rows: Vec<(usize, bool)>,
    cols: Vec<(usize, bool)>,
}

impl Axes {
    fn new(domain: Domain) -> Self {
        // Which sample stands at each place from `-REACH` on, and whether it is seen in a mirror.
        let axis = |n: usize, wrap: bool| -> Vec<(usize, bool)> {
            let at = |i: isize| {
                if wrap {
                    return (i.rem_euclid(n as isize) as usize, false);
                }
                let i = i.rem_euclid(2 * n as isize) as usize;
                if i < n { (i, false) } else { (2 * n - 1 - i, true) }
            };
            (0..n + 2 * REACH).map(|i| at(i as isize - REACH as isize)).collect()
        };
        Self {
            domain,
            rows: axis(domain.height, domain.wrap_y),
            cols: axis(domain.width, domain.wrap_x),
        }
    }

    /// Filters down the columns: row `y`, in the middle of `out`. What is seen in a mirror counts
    /// `mirrored` times. The sum over the taps is in a fixed order.
    fn down(&self, y: usize, mirrored: f32, taps: &[f32; TAPS], plane: &[f32], out: &mut [f32]) {
        let width = self.domain.width;
        let out = &mut out[REACH..][..width];
        out.fill(0.0);
        for (tap, &(row, mirror)) in taps.iter().zip(&self.rows[y..]) {
            let tap = if mirror { mirrored * tap } else { *tap };
            let row = &plane[row * width..][..width];
            out.iter_mut().zip(row).for_each(|(o, v)| *o += tap * v);
        }
    }

    /// Filters along the row that lies in the middle of `line`; adds to `out`.
    fn across(&self, mirrored: f32, taps: &[f32; TAPS], line: &mut [f32], out: &mut [f32]) {
        let width = self.domain.width;
        for place in (0..REACH).chain(REACH + width..width + 2 * REACH) {
            let (x, mirror) = self.cols[place];
            line[place] = line[REACH + x] * if mirror { mirrored } else { 1.0 };
        }
        for (i, tap) in taps.iter().enumerate() {
            out.iter_mut().zip(&line[i..]).for_each(|(o, v)| *o += tap * v);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use proptest::prelude::*;

    fn noise(seed: u64, n: usize) -> Vec<f32> {
        (0..n).map(|i| Rng::new(seed, 0, 0, i as u64).below(8129) as f32).collect()
    }

    fn energy(values: &[f32]) -> f64 {
        values.iter().map(|&v| f64::from(v) * f64::from(v)).sum()
    }

    fn domains() -> impl Strategy<Value = Domain> {
        (1..40usize, 1..40usize, any::<bool>(), any::<bool>())
            .prop_map(|(height, width, wrap_y, wrap_x)| Domain { height, width, wrap_y, wrap_x })
    }

    proptest! {
        /// By the definition: what the bands lack, and the changed bands filtered once more.
        #[test]
        fn any_size_is_rebuilt(domain in domains(), seed in any::<u64>()) {
            let n = domain.height * domain.width;
            let plane = noise(seed, n);
            let bands = responses(&plane, domain);
            let changes: Bands = std::array::from_fn(|k| noise(seed ^ (k as u64 + 1), n));
            let changed: Bands = std::array::from_fn(|k| {
                bands[k].iter().zip(&changes[k]).map(|(b, c)| b + c).collect()
            });
            let lacking = plane.iter().zip(transposed(&bands, domain)).map(|(v, b)| v - b);
            let by_definition = lacking.zip(transposed(&changed, domain)).map(|(l, b)| l + b);
            for (i, (a, b)) in by_definition.zip(rebuilt(&plane, &changes, domain)).enumerate() {
                // Values reach 8128 four times over and have 24 bits.
                prop_assert!((a - b).abs() < 2e-2, "{domain:?}, pixel {i}: {a} became {b}");
            }
            let nothing: Bands = std::array::from_fn(|_| vec![0.0; n]);
            prop_assert_eq!(rebuilt(&plane, &nothing, domain), plane);
        }

        /// Filtering once more is the transposed map: `<B f, c> = <f, B^T c>`. So a change of the
        /// responses changes the picture in their direction and no other.
        #[test]
        fn the_way_back_is_the_transposed_way(domain in domains(), seed in any::<u64>()) {
            let n = domain.height * domain.width;
            let plane = noise(seed, n);
            let bands = responses(&plane, domain);
            let other: Bands = std::array::from_fn(|k| noise(seed ^ (k as u64 + 1), n));
            let product = |a: &[f32], b: &[f32]| -> f64 {
                a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
            };
            let there: f64 = (0..4).map(|k| product(&bands[k], &other[k])).sum();
            let back = product(&plane, &transposed(&other, domain));
            let scale = (energy(&plane) * energy(&other.concat())).sqrt();
            prop_assert!((there - back).abs() < 1e-5 * scale, "{domain:?}: {there}, {back}");
        }

        #[test]
        fn no_plane_gains_energy(domain in domains(), seed in any::<u64>()) {
            let plane = noise(seed, domain.height * domain.width);
            let bands = responses(&plane, domain).concat();
            prop_assert!(energy(&bands) <= 1.001 * energy(&plane), "{domain:?}");
        }
    }

    /// Waves of four pixels pass almost wholly, in any direction alike; shades do not at all.
    #[test]
    fn a_wave_answers_in_its_direction() {
        let domain = Domain { height: 64, width: 64, wrap_y: true, wrap_x: true };
        let wave = |cycles_y: f64, cycles_x: f64| -> Vec<f32> {
            let at = |i: usize| {
                let turn = cycles_y * (i / 64) as f64 + cycles_x * (i % 64) as f64;
                (turn * std::f64::consts::TAU / 64.0).cos() as f32
            };
            (0..64 * 64).map(at).collect()
        };
        let gains = |wave: &[f32]| {
            let bands = responses(wave, domain);
            bands.map(|band| energy(&band) / energy(wave))
        };
        // Down, along both diagonals, to the right.
        for (strongest, y, x) in [(0, 0.0, 16.0), (1, 11.0, 11.0), (2, 16.0, 0.0), (3, 11.0, -11.0)]
        {
            let gains = gains(&wave(y, x));
            let sum: f64 = gains.iter().sum();
            assert!((0.9..1.001).contains(&sum), "{y}, {x}: {gains:?}");
            assert!(gains[strongest] > 0.75 * sum, "{y}, {x}: {gains:?}");
        }
        assert!(gains(&wave(1.0, 1.0)).iter().sum::<f64>() < 1e-3, "a shade passes");
        assert!(energy(&responses(&[100.0; 4096], domain).concat()) < 1e-3, "a constant");
    }
}
