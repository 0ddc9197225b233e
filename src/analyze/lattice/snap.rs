//! Rectangles that a lattice repeats in.

use crate::signal::basis::{Basis, Vector, coefficients, combined, dot, dual};

/// By how much a photo may be stretched or squeezed. Much more shows as bricks of another shape.
pub const MOST_SCALING: f64 = 0.03;

/// The same of pieces that are laid in step at a size that was asked for: better all bricks narrower or
/// wider than some cut, as seen on a dozen walls, floors and cloths. Where displacements lie along the
/// axes, every size that holds about one has whole periods within the root of two.
pub const MOST_SCALING_ASKED: f64 = 0.45;

/// By how much a displacement may miss the axis: as a share of the shortest vector, and in pixels if
/// that is more.
const MISFIT: f64 = 0.03;
const MISFIT_PIXELS: f64 = 0.5;

/// What a whole allowed misfit costs, as a change of the size: a size 5 % farther away is taken for a
/// displacement that lies on the axis.
const MISFIT_COST: f64 = 0.05;

/// A size near a wished one after which a lattice repeats on both axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snap {
    /// Width in pixels, after scaling.
    pub width: usize,
    /// Height in pixels, after scaling.
    pub height: usize,
    /// By what the photo's width must be multiplied so that `width` is a whole number of periods; as
    /// far from 1 as was allowed, by [`Lattice::snap`](crate::Lattice::snap) 3 %.
    pub scale_x: f64,
    /// By what the photo's height must be multiplied, likewise.
    pub scale_y: f64,
    /// How often v1 and v2 are in the horizontal displacement, and in the vertical one.
    pub periods: [[i64; 2]; 2],
    /// By how many pixels of the photo the horizontal displacement misses the horizontal, and the
    /// vertical one the vertical: what scaling cannot mend. At most 3 % of the shortest vector, or
    /// half a pixel.
    pub misfit: [f64; 2],
}

/// The rectangle nearest to `width` x `height` that the lattice repeats in: the wished side itself
/// wherever scaling by at most `most` makes it a period, else the nearest period; `None` if
/// there is none from half to twice the wished side. `lean` is the misfit allowed beside the usual, as a
/// share of the displacement: 0 for what is cut out as it is.
pub fn snap(basis: Basis, (width, height): (usize, usize), most: f64, lean: f64) -> Option<Snap> {
    let Side { length: w, scale: scale_x, periods: a, misfit: misfit_x } =
        side(basis, width, most, lean)?;
    // The vertical axis is the horizontal one of the transposed lattice.
    let Side { length: h, scale: scale_y, periods: b, misfit: misfit_y } =
        side(basis.map(|[x, y]| [y, x]), height, most, lean)?;
    let periods = [a, b];
    Some(Snap { width: w, height: h, scale_x, scale_y, periods, misfit: [misfit_x, misfit_y] })
}

/// A displacement along one axis: see [`Snap`] for what it is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// In pixels of the output.
    pub length: usize,
    /// Of the photo.
    pub scale: f64,
    /// How often v1 and v2 are in it.
    pub periods: [i64; 2],
    /// By how many pixels of the photo it leaves the axis.
    pub misfit: f64,
}

/// The best displacement along the first axis: [`snap`] for one side alone.
pub fn side(basis: Basis, wish: usize, most_scaling: f64, lean: f64) -> Option<Side> {
    let far = 2.0 * wish as f64;
    let upright = MISFIT_PIXELS.max(MISFIT * dot(basis[0], basis[0]).sqrt());
    let most_off = upright.max(lean * far);
    // The vector that leads away from the axis faster brings back what the other has left it by.
    let back = usize::from(basis[1][1].abs() >= basis[0][1].abs());
    let most = [[far, most_off], [far, -most_off]]
        .map(|corner| coefficients(basis, corner)[1 - back].abs())
        .into_iter()
        .fold(0.0, f64::max) as i64;
    let mut best: Option<(f64, Side)> = None;
    for i in -most..=most {
        let rest = -(i as f64) * basis[1 - back][1] / basis[back][1];
        for j in [rest.floor() as i64, rest.floor() as i64 + 1] {
            let periods = if back == 1 { [i, j] } else { [j, i] };
            let [length, off]: Vector = combined(basis, periods[0] as f64, periods[1] as f64);
            let allowed = upright.max(lean * length);
            if length < 1.0 || off.abs() > allowed {
                continue;
            }
            let fits = |side: usize| (side as f64 / length - 1.0).abs() <= most_scaling;
            let side = if fits(wish) { wish } else { length.round() as usize };
            if !fits(side) || 2 * side < wish || side > 2 * wish {
                continue;
            }
            let cost = libm::log(side as f64 / wish as f64).abs()
                + (side as f64 / length - 1.0).abs()
                + MISFIT_COST * off.abs() / allowed;
            if best.is_none_or(|(least, _)| cost < least) {
                let scale = side as f64 / length;
                best = Some((cost, Side { length: side, scale, periods, misfit: off.abs() }));
            }
        }
    }
    best.map(|(_, found)| found)
}

/// Rows of a lattice: parallel lines that all its points lie on, and how many an output leads over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rows {
    /// Rows a pixel: to the right and downwards.
    pub frequency: Vector,
    /// Rows that the output's width leads over, and its height; whole on an axis that repeats.
    pub of_output: [f64; 2],
}

/// Rows closer than this share of the widest are not seen as such; some always fit. The courses of a
/// Flemish bond lie a third as far apart as the columns of its bricks.
const NARROWEST: f64 = 0.3;

/// Frequencies of rows that are looked at, in those along either vector.
const COEFFICIENTS: [[f64; 2]; 8] = [
    [1.0, 0.0],
    [0.0, 1.0],
    [1.0, 1.0],
    [1.0, -1.0],
    [2.0, 1.0],
    [2.0, -1.0],
    [1.0, 2.0],
    [1.0, -2.0],
];

/// The one or two widest families of rows of the lattice that fit into a rectangle of which only the axes with `repeats` (to the
/// right, downwards) have to hold whole numbers of them; none if all would have to be turned or
/// moved together by more than [`MOST_SCALING`]. The wider rows lie apart, the closer their points, and the
/// plainer they are seen. Looked at are the rows along either vector, along either diagonal of the
/// cell and of two cells; for a reduced basis there are no wider ones.
pub fn rows(basis: Basis, size: (usize, usize), repeats: [bool; 2]) -> Vec<Rows> {
    let Some(dual) = dual(basis) else { return Vec::new() };
    let sides = [size.0 as f64, size.1 as f64];
    let mut frequencies = COEFFICIENTS.map(|[a, b]| combined(dual, a, b));
    frequencies.sort_by(|&a, &b| dot(a, a).total_cmp(&dot(b, b)));
    let widest = dot(frequencies[0], frequencies[0]);
    let fitted = |frequency: Vector| {
        let of_output = std::array::from_fn(|k| {
            let count = frequency[k] * sides[k];
            if repeats[k] { count.round() } else { count }
        });
        let off: Vector = std::array::from_fn(|k| of_output[k] / sides[k] - frequency[k]);
        let fits = dot(off, off) <= MOST_SCALING * MOST_SCALING * dot(frequency, frequency);
        fits.then_some(Rows { frequency, of_output })
    };
    let seen = |k: &Vector| NARROWEST * NARROWEST * dot(*k, *k) <= widest;
    // No two of them are parallel.
    frequencies.into_iter().filter(seen).filter_map(fitted).take(2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By trying all displacements of a square of coefficients.
    fn naive(basis: Basis, wish: usize) -> Option<(usize, f64)> {
        let allowed = MISFIT_PIXELS.max(MISFIT * dot(basis[0], basis[0]).sqrt());
        let mut best: Option<(f64, usize, f64)> = None;
        for a in -80..=80 {
            for b in -80..=80 {
                let [x, y] = combined(basis, f64::from(a), f64::from(b));
                for side in [x.round().max(0.0) as usize, wish] {
                    let scale = side as f64 / x;
                    let near = (scale - 1.0).abs() <= MOST_SCALING;
                    let wished = (wish as f64 / x - 1.0).abs() <= MOST_SCALING;
                    if x >= 1.0 && y.abs() <= allowed && near && (side == wish || !wished) {
                        let cost = (side as f64 / wish as f64).ln().abs()
                            + (scale - 1.0).abs()
                            + MISFIT_COST * y.abs() / allowed;
                        let inside = 2 * side >= wish && side <= 2 * wish;
                        if inside && best.is_none_or(|b| cost < b.0 - 1e-12) {
                            best = Some((cost, side, scale));
                        }
                    }
                }
            }
        }
        best.map(|(_, side, scale)| (side, scale))
    }

    #[test]
    fn it_finds_what_trying_everything_finds() {
        let bases = [
            [[20.0, 0.0], [0.0, 30.0]],
            [[85.3, -127.8], [85.1, 127.9]],
            [[16.0, 16.0], [16.0, -16.0]],
            [[29.4, 1.4], [0.7, -44.8]],
            [[36.5, 0.0], [-8.9, 13.4]],
            [[121.1, 63.1], [-62.8, 121.3]],
        ];
        let mut found = 0;
        for basis in bases {
            for (width, height) in [(256, 256), (500, 300), (97, 411)] {
                let transposed = basis.map(|[x, y]: [f64; 2]| [y, x]);
                let want = naive(basis, width).zip(naive(transposed, height));
                let got = snap(basis, (width, height), MOST_SCALING, 0.0);
                assert_eq!(got.is_some(), want.is_some(), "{basis:?} at {width}x{height}");
                if let Some((got, ((w, sx), (h, sy)))) = got.zip(want) {
                    found += 1;
                    assert_eq!((got.width, got.height), (w, h), "{basis:?} at {width}x{height}");
                    assert!((got.scale_x - sx).abs() + (got.scale_y - sy).abs() < 1e-9);
                }
            }
        }
        assert!(found >= 9, "only {found} could be snapped");
    }

    #[test]
    fn a_snapped_size_is_a_scaled_lattice_displacement() {
        let basis = [[85.3, -127.8], [85.1, 127.9]];
        let Snap { width, height, scale_x, scale_y, periods, misfit } =
            snap(basis, (512, 512), MOST_SCALING, 0.0).expect("near");
        // Running bond: rows shifted by half, so the rectangle has twice the cell's area.
        assert_eq!((width, height, periods), (512, 512, [[3, 3], [-2, 2]]));
        let [x, off_x] = combined(basis, 3.0, 3.0);
        let [off_y, y] = combined(basis, -2.0, 2.0);
        assert!((x * scale_x - 512.0).abs() < 1e-9 && (y * scale_y - 512.0).abs() < 1e-9);
        assert!((misfit[0] - off_x.abs()).abs() + (misfit[1] - off_y.abs()).abs() < 1e-9);
    }

    #[test]
    fn rows_fit_where_their_distance_does() {
        // Courses of bricks, 21 apart, each shifted by half a brick.
        let bricks = [[37.0, 0.0], [18.5, 21.0]];
        let courses = |width, height, repeats| {
            let rows = *rows(bricks, (width, height), repeats).first()?;
            assert!(rows.frequency[0].abs() < 1e-12, "{rows:?}");
            assert!((rows.frequency[1].abs() - 1.0 / 21.0).abs() < 1e-12, "{rows:?}");
            Some(rows.of_output.map(f64::abs))
        };
        // An odd number of courses will do, and one that is stretched by 2 %.
        assert_eq!(courses(83, 105, [true; 2]), Some([0.0, 5.0]));
        assert_eq!(courses(83, 86, [true; 2]), Some([0.0, 4.0]));
        assert_eq!(courses(83, 94, [true; 2]), None, "four and a half");
        assert_eq!(courses(83, 94, [true, false]), Some([0.0, 94.0 / 21.0]), "nothing below");
        assert_eq!(rows([[4.0, 2.0], [2.0, 1.0]], (40, 40), [true; 2]), [], "no lattice");
        // Five chequers either way: somewhere two of a colour meet.
        let chequers = rows([[100.0, 100.0], [100.0, -100.0]], (512, 512), [true; 2]);
        let mut counts: Vec<_> =
            chequers.iter().map(|r| r.of_output.map(|n| n.abs() as i32)).collect();
        counts.sort_unstable();
        assert_eq!(counts, [[0, 5], [5, 0]]);
        // By trying all numbers of rows.
        let mut found = 0;
        for basis in [bricks, [[40.0, 1.5], [-3.0, 55.0]], [[30.0, 30.0], [31.0, -29.0]]] {
            let [k1, k2] = dual(basis).expect("a lattice");
            for (width, height) in [(92, 105), (110, 120), (200, 184), (121, 77), (160, 160)] {
                let longest = COEFFICIENTS
                    .map(|[a, b]| (a * k1[0] + b * k2[0]).hypot(a * k1[1] + b * k2[1]))
                    .into_iter()
                    .fold(f64::MAX, f64::min)
                    / NARROWEST;
                let mut widest: Option<(f64, f64)> = None;
                for [a, b] in COEFFICIENTS {
                    let k = [a * k1[0] + b * k2[0], a * k1[1] + b * k2[1]];
                    let length = k[0].hypot(k[1]);
                    if length > longest {
                        continue;
                    }
                    for m in -30..=30 {
                        for n in -30..=30 {
                            let x = f64::from(m) / width as f64 - k[0];
                            let y = f64::from(n) / height as f64 - k[1];
                            let off = x.hypot(y) / length;
                            let wider = widest.is_none_or(|(w, o)| {
                                length < w - 1e-12 || (length < w + 1e-12 && off < o)
                            });
                            if off <= MOST_SCALING && wider {
                                widest = Some((length, off));
                            }
                        }
                    }
                }
                let got = rows(basis, (width, height), [true; 2]).first().copied();
                assert_eq!(got.is_some(), widest.is_some(), "{basis:?} {width}x{height}");
                if let Some((Rows { frequency: [x, y], of_output: [m, n] }, want)) = got.zip(widest)
                {
                    found += 1;
                    let off = (m / width as f64 - x).hypot(n / height as f64 - y) / x.hypot(y);
                    assert!((x.hypot(y) - want.0).abs() + (off - want.1).abs() < 1e-9);
                    assert!(m.fract() == 0.0 && n.fract() == 0.0);
                }
            }
        }
        assert!(found >= 5, "only {found} fit");
    }

    #[test]
    fn without_a_rectangle_near_there_is_none() {
        assert_eq!(
            snap([[400.0, 0.0], [0.0, 400.0]], (128, 128), MOST_SCALING, 0.0),
            None,
            "periods too long"
        );
        let askew = [[100.0, 2.5], [-2.5, 100.0]];
        assert_eq!(snap(askew, (300, 300), MOST_SCALING, 0.0), None, "askew");
        let leaning = snap(askew, (300, 300), MOST_SCALING, 0.03).expect("it may lean");
        assert_eq!((leaning.width, leaning.periods), (300, [[3, 0], [0, 3]]));
        assert!((leaning.misfit[0] - 7.5).abs() < 1e-9, "{leaning:?}");
        assert_eq!(
            snap([[100.0, 8.0], [-8.0, 100.0]], (300, 300), MOST_SCALING, 0.03),
            None,
            "too much"
        );
    }
}
