//! The normal distribution.

/// Density of the standard normal distribution.
pub fn density(u: f64) -> f64 {
    libm::exp(-0.5 * u * u) / (std::f64::consts::TAU).sqrt()
}

/// Share of the standard normal distribution below `u`.
pub fn cumulative(u: f64) -> f64 {
    0.5 * libm::erfc(-u * std::f64::consts::FRAC_1_SQRT_2)
}

/// Below which value a share `p` of the standard normal distribution lies, 0 < `p` < 1; accurate to
/// about 1e-12.
pub fn quantile(p: f64) -> f64 {
    if p > 0.5 {
        return -quantile(1.0 - p);
    }
    // Hastings' approximation (Abramowitz and Stegun 26.2.23), then Newton's steps.
    let t = (-2.0 * libm::log(p)).sqrt();
    let top = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let mut u = top / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308))) - t;
    for _ in 0..3 {
        let error = (cumulative(u) - p) / density(u);
        u -= error / (1.0 + 0.5 * u * error);
    }
    u
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_invert_shares() {
        for p in [1e-9, 0.001, 0.02425, 0.3, 0.5, 0.77, 0.975, 1.0 - 1e-6] {
            assert!((cumulative(quantile(p)) - p).abs() < 1e-12 + 1e-9 * p, "{p}");
        }
        assert!((quantile(0.975) - 1.959_963_985).abs() < 1e-8);
    }
}
