//! sRGB, linear light and CIE L*a*b* (D65).

/// Linear light from a display-referred sRGB value in `0..=1` (IEC 61966-2-1).
pub fn linear_from_srgb(v: f64) -> f64 {
    if v <= 0.040_45 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
}

/// Display-referred sRGB from linear light in `0..=1`.
pub fn srgb_from_linear(v: f64) -> f64 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * libm::pow(v, 1.0 / 2.4) - 0.055 }
}
