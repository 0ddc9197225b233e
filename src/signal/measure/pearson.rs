//! Pearson's distributions: one for every skewness and kurtosis, in closed form.

/// Intervals of the table.
const INTERVALS: usize = 64;

/// Standard deviations that the table covers to either side.
const REACH: f64 = 12.0;

/// Share of the mass beyond which a tail is followed no further: there are no samples to tell how
/// far it goes, and a value outside of one distribution must not fly to the end of another.
const TAIL: f64 = 1e-3;

/// The distribution of mean 0, variance 1 and given skewness and kurtosis, tabulated.
///
/// # Paper
/// Moritz et al. 2017, Sec. 4.3, after Johnson and Kotz 1970.
#[derive(Debug, Clone)]
pub struct Pearson {
    /// `(z, share below z)`, both rising.
    table: Vec<(f64, f64)>,
    /// Where the tails begin.
    ends: (f64, f64),
}

impl Pearson {
    /// `skewness` is cut to -4..=4, `kurtosis` (3 for a Gaussian) to `skewness^2 + 1.1 ..=
    /// skewness^2 + 30`: below `skewness^2 + 1` there is no distribution, near it there are two
    /// spikes.
    pub fn new(skewness: f64, kurtosis: f64) -> Self {
        let s = skewness.abs().min(4.0);
        let density = Density::new(s, kurtosis.clamp(s * s + 1.1, s * s + 30.0));
        // Nodes lie denser in the middle; the outermost at the ends, where there are any.
        let (left, right) = density.ends();
        let node = |i: usize| {
            let t = (2 * i) as f64 / INTERVALS as f64 - 1.0;
            let end = if t < 0.0 { -left.max(-REACH) } else { right.min(REACH) };
            end * t * (0.125 + 0.875 * t * t)
        };
        let mut sum = 0.0;
        let mut table = vec![(node(0), 0.0)];
        table.extend((1..=INTERVALS).map(|i| {
            sum += density.mass(node(i - 1), node(i));
            (node(i), sum)
        }));
        table.iter_mut().for_each(|(_, below)| *below /= sum);
        if skewness < 0.0 {
            // Leaning to the left is leaning to the right in a mirror.
            table = table.iter().rev().map(|(z, below)| (-z, 1.0 - below)).collect();
        }
        let mut made = Self { table, ends: (0.0, 0.0) };
        made.ends = (made.quantile(TAIL), made.quantile(1.0 - TAIL));
        made
    }

    /// The share of the mass below `z`.
    pub fn share_below(&self, z: f64) -> f64 {
        let i = self.table.partition_point(|&(node, _)| node <= z);
        match i.checked_sub(1).map(|i| self.table[i]) {
            None => 0.0,
            Some(_) if i > INTERVALS => 1.0,
            Some((from, below)) => {
                let (to, above) = self.table[i];
                below + (above - below) * (z - from) / (to - from)
            }
        }
    }

    /// The value below which the share `u` in `0..=1` lies.
    pub fn quantile(&self, u: f64) -> f64 {
        let i = self.table.partition_point(|&(_, below)| below < u).clamp(1, INTERVALS);
        let ((from, below), (to, above)) = (self.table[i - 1], self.table[i]);
        if above > below {
            from + (to - from) * ((u - below) / (above - below)).min(1.0)
        } else {
            to
        }
    }

    /// The value that has the place in `other` that `z` has in this distribution. In the tails
    /// distances are kept.
    pub fn matched(&self, other: &Self, z: f64) -> f64 {
        if z <= self.ends.0 {
            return other.ends.0 + (z - self.ends.0);
        }
        if z >= self.ends.1 {
            return other.ends.1 + (z - self.ends.1);
        }
        other.quantile(self.share_below(z)).clamp(other.ends.0, other.ends.1)
    }
}

/// A density, but for a factor: the solution of `p' / p = -(A z + B) / (C + B z + D z^2)` with
/// `A = 10 k - 12 s^2 - 18`, `B = s (k + 3)`, `C = 4 k - 3 s^2`, `D = 2 k - 3 s^2 - 6` (skewness s
/// not negative, kurtosis k). The roots of the denominator make the types I, IV and VI; II, III, V,
/// VII and the Gaussian are limits of them and are approached from beside.
enum Density {
    /// `|1 - z / r|^m` for each root r: types I (roots on both sides of 0) and VI (both below 0).
    Roots { roots: [f64; 2], powers: [f64; 2] },
    /// `q(z)^m exp(-n atan(..))`, no real root: type IV.
    NoRoots { a: f64, b: f64, c: f64, d: f64 },
}

impl Density {
    fn new(s: f64, k: f64) -> Self {
        let (a, b) = (10.0 * k - 12.0 * s * s - 18.0, s * (k + 3.0));
        let (c, mut d) = (4.0 * k - 3.0 * s * s, 2.0 * k - 3.0 * s * s - 6.0);
        // Beside the limits: exponents stay below a million, which leaves ten digits.
        if d.abs() < 1e-5 {
            d = -1e-5;
        }
        let mut discriminant = b * b - 4.0 * c * d;
        if discriminant.abs() < 1e-8 * b * b {
            discriminant = 1e-8 * b * b;
        }
        if discriminant < 0.0 {
            return Self::NoRoots { a, b, c, d };
        }
        // The root that does not cancel first (b is not negative), the other by their product.
        let far = -0.5 * (b + discriminant.sqrt());
        let roots = [far / d, c / far];
        let power = |r: f64, other: f64| -(a * r + b) / (d * (r - other));
        let powers = [power(roots[0], roots[1]), power(roots[1], roots[0])];
        Self::Roots { roots, powers }
    }

    fn at(&self, z: f64) -> f64 {
        let log = match self {
            Self::Roots { roots, powers } => {
                powers[0] * libm::log1p(-z / roots[0]) + powers[1] * libm::log1p(-z / roots[1])
            }
            Self::NoRoots { a, b, c, d } => {
                let w = (4.0 * c * d - b * b).sqrt();
                let turn = libm::atan((2.0 * d * z + b) / w) - libm::atan(b / w);
                -a / (2.0 * d) * libm::log((c + z * (b + z * d)) / c)
                    - (b - a * b / (2.0 * d)) * (2.0 / w) * turn
            }
        };
        libm::exp(log)
    }

    /// Where there is mass: between the roots beside 0.
    fn ends(&self) -> (f64, f64) {
        match self {
            Self::NoRoots { .. } => (f64::NEG_INFINITY, f64::INFINITY),
            Self::Roots { roots, .. } => {
                let below = roots.iter().filter(|r| **r < 0.0);
                let above = roots.iter().filter(|r| **r > 0.0);
                let ends = (f64::NEG_INFINITY, f64::INFINITY);
                (below.fold(ends.0, |l, r| l.max(*r)), above.fold(ends.1, |h, r| h.min(*r)))
            }
        }
    }

    /// The mass from `z0` to `z1`.
    fn mass(&self, z0: f64, z1: f64) -> f64 {
        let mut mass = (z1 - z0) * self.at(0.5 * (z0 + z1));
        if let Self::Roots { roots, powers } = self {
            // Beside a root, p = c u^m with u the distance: its integral is not the middle's value.
            for (root, m) in roots.iter().zip(powers) {
                if z0 == *root || z1 == *root {
                    mass *= libm::exp2(*m) / (m + 1.0);
                }
            }
        }
        mass
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean, variance, skewness, kurtosis of a table.
    fn moments(p: &Pearson) -> [f64; 4] {
        let raw = |n: i32| -> f64 {
            let each = |w: &[(f64, f64)]| {
                let ((a, below), (b, above)) = (w[0], w[1]);
                // The mass of an interval lies evenly in it.
                let power = (b.powi(n + 1) - a.powi(n + 1)) / (f64::from(n + 1) * (b - a));
                (above - below) * power
            };
            p.table.windows(2).map(each).sum()
        };
        let m = raw(1);
        let v = raw(2) - m * m;
        let third = raw(3) - 3.0 * m * raw(2) + 2.0 * m.powi(3);
        let fourth = raw(4) - 4.0 * m * raw(3) + 6.0 * m * m * raw(2) - 3.0 * m.powi(4);
        [m, v, third / v.powf(1.5), fourth / (v * v)]
    }

    #[test]
    fn the_distribution_has_the_moments_it_was_made_from() {
        // Types: Gaussian, II (uniform, arc), I, U-shaped I, III, VI, V, IV, VII.
        for (s, k) in [
            (0.0, 3.0),
            (0.0, 1.8),
            (0.0, 1.5),
            (0.5, 2.8),
            (-0.6, 1.9),
            (1.0, 4.5),
            (-1.0, 4.5),
            (1.0, 4.7),
            (0.8, 4.2),
            (0.5, 4.0),
            (-0.5, 4.0),
            (0.0, 4.5),
        ] {
            let [m, v, skew, kurt] = moments(&Pearson::new(s, k));
            assert!(m.abs() < 0.01 && (v - 1.0).abs() < 0.03, "{s}, {k}: mean {m}, variance {v}");
            let far = (skew - s).abs().max((kurt - k).abs() / k);
            assert!(far < 0.05, "{s}, {k}: skewness {skew}, kurtosis {kurt}");
        }
    }

    #[test]
    fn known_distributions_are_met() {
        let close = |p: &Pearson, z: f64, want: f64| {
            let got = p.share_below(z);
            assert!((got - want).abs() < 2e-3, "share below {z}: {got}, not {want}");
        };
        let gauss = Pearson::new(0.0, 3.0);
        for (z, share) in [(-2.0, 0.02275), (-0.5, 0.30854), (0.0, 0.5), (1.0, 0.84134)] {
            close(&gauss, z, share);
        }
        let uniform = Pearson::new(0.0, 1.8);
        for z in [-1.5, -0.4, 0.9, 1.7] {
            close(&uniform, z, 0.5 + z / 12f64.sqrt());
        }
        // The exponential distribution, from -1 on.
        let exponential = Pearson::new(2.0, 9.0);
        for z in [-0.9, 0.0, 1.0, 3.0] {
            close(&exponential, z, 1.0 - f64::exp(-1.0 - z));
        }
        // Student's t of 8 degrees of freedom, scaled to variance 1.
        close(&Pearson::new(0.0, 4.5), 1.0 / (8f64 / 6.0).sqrt(), 0.82665);
    }

    #[test]
    fn quantiles_invert_shares_and_matching_rises() {
        for (s, k) in [(0.0, 3.0), (1.0, 4.5), (-1.5, 4.0), (3.0, 40.0), (0.0, 1.0), (-9.0, 2.0)] {
            let (p, gauss) = (Pearson::new(s, k), Pearson::new(0.0, 3.0));
            for u in [0.01, 0.3, 0.5, 0.8, 0.99] {
                let back = p.share_below(p.quantile(u));
                assert!((back - u).abs() < 1e-9, "{s}, {k}: {u} came back as {back}");
            }
            let there: Vec<f64> =
                (-80..80).map(|i| p.matched(&gauss, f64::from(i) / 10.0)).collect();
            assert!(there.iter().all(|z| z.is_finite()), "{s}, {k}: {there:?}");
            assert!(there.windows(2).all(|w| w[0] <= w[1]), "{s}, {k}: {there:?}");
            let same = p.matched(&p, p.quantile(0.37));
            assert!((same - p.quantile(0.37)).abs() < 1e-9, "{s}, {k}: moved to {same}");
        }
    }
}
