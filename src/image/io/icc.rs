//! Embedded color profiles: converted to sRGB (integers) or linear light (floats), or kept.

use moxcms::{
    ColorProfile, DataColorSpace, Layout, RenderingIntent, ToneReprCurve, TransformOptions,
};

use super::Raw;
use crate::image::picture::{Encoding, Samples};

/// Two colors nearer than this (of full scale 1) are the same: half a step of 8 bits. Smaller, and
/// the many slightly different sRGB profiles in circulation would be "converted" by rounding.
const SAME: f32 = 0.002;

/// Whether a profile is sRGB (or grey with sRGB's curve) for all practical purposes. Broken
/// profiles are not.
pub(super) fn is_srgb(profile: &[u8]) -> bool {
    ColorProfile::new_from_slice(profile).is_ok_and(|profile| {
        let layout =
            if profile.color_space == DataColorSpace::Gray { Layout::Gray } else { Layout::Rgb };
        changes(&profile, layout, &srgb(layout)).is_some_and(|change| change < SAME)
    })
}

/// Whether a profile can be converted from at all.
pub(super) fn is_usable(profile: &[u8]) -> bool {
    ColorProfile::new_from_slice(profile)
        .is_ok_and(|profile| changes(&profile, Layout::Rgb, &srgb(Layout::Rgb)).is_some())
}

/// Converts `raw` from its profile; returns the profile if it has to stay with the samples.
///
/// # Determinism
/// Scalar code only, the same result on every CPU.
pub(super) fn convert(raw: &mut Raw, profile: Vec<u8>) -> Option<Vec<u8>> {
    match try_convert(raw, &profile) {
        Ok(Some(note)) => raw.notes.push(note),
        Ok(None) => {}
        Err(reason) => {
            raw.notes.push(format!(
                "the embedded color profile was not converted ({reason}); it stays with the \
                 picture and the colors are treated as sRGB meanwhile"
            ));
            return Some(profile);
        }
    }
    None
}

fn try_convert(raw: &mut Raw, profile: &[u8]) -> Result<Option<String>, String> {
    let layout = match raw.channels {
        1 => Layout::Gray,
        2 => Layout::GrayAlpha,
        3 => Layout::Rgb,
        4 => Layout::Rgba,
        n => return Err(format!("{n} channels")),
    };
    let from = ColorProfile::new_from_slice(profile).map_err(|e| e.to_string())?;
    let gray = matches!(layout, Layout::Gray | Layout::GrayAlpha);
    if gray && from.color_space == DataColorSpace::Rgb && is_srgb(profile) {
        return Ok(None);
    }
    let wanted = if gray { DataColorSpace::Gray } else { DataColorSpace::Rgb };
    if from.color_space != wanted {
        return Err(format!("it is for {:?}, the samples are {wanted:?}", from.color_space));
    }
    // Floats are linear light in this house, integers are sRGB.
    let float = raw.samples.is_float();
    let to = if float { linear(layout) } else { srgb(layout) };
    let core = if gray { Layout::Gray } else { Layout::Rgb };
    let change = changes(&from, core, &to).ok_or("it is damaged or of an unknown kind")?;
    if change < SAME && !float {
        raw.encoding = Encoding::Srgb;
        return Ok(None);
    }
    if change < 1e-5 {
        return Ok(None);
    }
    raw.samples = transform(&raw.samples, &from, layout, &to)?;
    raw.encoding = if float { Encoding::Linear } else { Encoding::Srgb };
    let target = if float { "linear light" } else { "sRGB" };
    Ok(Some(format!(
        "the colors were converted from the embedded profile{} to {target}",
        name(&from)
    )))
}

fn transform(
    samples: &Samples,
    from: &ColorProfile,
    layout: Layout,
    to: &ColorProfile,
) -> Result<Samples, String> {
    let text = |e: moxcms::CmsError| e.to_string();
    let options = options();
    Ok(match samples {
        Samples::U8(v) => {
            let mut out = vec![0; v.len()];
            let run = from.create_transform_8bit(layout, to, layout, options).map_err(text)?;
            run.transform(v, &mut out).map_err(text)?;
            Samples::U8(out)
        }
        Samples::U16(v) => {
            let mut out = vec![0; v.len()];
            let run = from.create_transform_16bit(layout, to, layout, options).map_err(text)?;
            run.transform(v, &mut out).map_err(text)?;
            Samples::U16(out)
        }
        Samples::F32(v) => {
            if !v.iter().all(|s| (0.0..=1.0).contains(s)) {
                return Err("it is defined for values from 0 to 1 only".into());
            }
            let mut out = vec![0.0; v.len()];
            let run = from.create_transform_f32(layout, to, layout, options).map_err(text)?;
            run.transform(v, &mut out).map_err(text)?;
            Samples::F32(out)
        }
        Samples::F16(_) | Samples::F64(_) => return Err("half and double floats".into()),
    })
}

/// CMYK pixels (0 is no ink) as sRGB, by their profile.
pub(super) fn srgb_from_cmyk(cmyk: &[u8], profile: &[u8]) -> Result<Vec<u8>, String> {
    let text = |e: moxcms::CmsError| e.to_string();
    let from = ColorProfile::new_from_slice(profile).map_err(text)?;
    if from.color_space != DataColorSpace::Cmyk {
        return Err(format!("it is for {:?}, the samples are Cmyk", from.color_space));
    }
    let to = srgb(Layout::Rgb);
    let run =
        from.create_transform_8bit(Layout::Rgba, &to, Layout::Rgb, options()).map_err(text)?;
    let mut out = vec![0; cmyk.len() / 4 * 3];
    run.transform(cmyk, &mut out).map_err(text)?;
    Ok(out)
}

fn options() -> TransformOptions {
    TransformOptions {
        rendering_intent: RenderingIntent::RelativeColorimetric,
        ..TransformOptions::default()
    }
}

fn srgb(layout: Layout) -> ColorProfile {
    let mut to = ColorProfile::new_srgb();
    if matches!(layout, Layout::Gray | Layout::GrayAlpha) {
        let curve = to.red_trc.take();
        to = ColorProfile::new_gray_with_gamma(2.2);
        to.gray_trc = curve;
    }
    to
}

fn linear(layout: Layout) -> ColorProfile {
    let mut to = srgb(layout);
    let curve = || Some(ToneReprCurve::Parametric(vec![1.0]));
    to.cicp = None;
    if matches!(layout, Layout::Gray | Layout::GrayAlpha) {
        to.gray_trc = curve();
    } else {
        (to.red_trc, to.green_trc, to.blue_trc) = (curve(), curve(), curve());
    }
    to
}

/// The largest change of a sample that going from one profile to the other makes, tried on a grid
/// of colors; `None` if there is no way. Works for every kind of profile, tables included.
fn changes(from: &ColorProfile, layout: Layout, to: &ColorProfile) -> Option<f32> {
    let steps = 9_u16;
    let level = |i: u16| f32::from(i) / f32::from(steps - 1);
    let colors: Vec<f32> = if layout == Layout::Gray {
        (0..=64).map(|i| f32::from(i as u16) / 64.0).collect()
    } else {
        let grid = (0..steps * steps * steps)
            .flat_map(|i| [level(i / steps / steps), level(i / steps % steps), level(i % steps)]);
        grid.collect()
    };
    let mut out = vec![0.0; colors.len()];
    let run = from.create_transform_f32(layout, to, layout, options()).ok()?;
    run.transform(&colors, &mut out).ok()?;
    let change = colors.iter().zip(&out).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    out.iter().all(|v| v.is_finite()).then_some(change)
}

/// The profile's own name in quotes, if it has one.
fn name(profile: &ColorProfile) -> String {
    use moxcms::ProfileText::{Description, Localizable, PlainString};
    let text = match &profile.description {
        Some(PlainString(text)) => text.clone(),
        Some(Localizable(list)) => list.first().map(|l| l.value.clone()).unwrap_or_default(),
        Some(Description(d)) => d.ascii_string.clone(),
        None => String::new(),
    };
    let text: String = text.chars().filter(|c| !c.is_control()).take(60).collect();
    if text.is_empty() { text } else { format!(" \"{text}\"") }
}
