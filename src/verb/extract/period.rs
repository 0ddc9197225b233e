//! The photo's period: found, and made whole.

use crate::analyze::lattice;
use crate::analyze::period::{period, rectangle};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::image::color::ColorModel;
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::method::representative::Frame;
use crate::signal::basis::{Basis, dot};
use crate::signal::self_difference::self_difference;
use crate::verb::extract::params::{ExtractParams, PeriodSource, Scaling};
use crate::verb::extract::{FoundPeriod, LEAST_PATCH};

/// A period counts as whole if no pixel of the photo is moved by more than this if it is rounded.
const UNMOVED: f64 = 0.5;

/// By how much a photo is enlarged rather than made smaller by nearly a pixel a period: as a share.
const MOST_ENLARGED: f64 = 0.005;

/// The colours that are compared.
pub(super) fn colors(picture: &Picture) -> Vec<[f32; 3]> {
    ColorModel::new(picture).matching_pixels(picture)
}

/// The period that was given, or that is found.
pub(super) fn find_period(
    ctx: &Ctx,
    photo: &Picture,
    mask: Option<&Mask>,
    params: &ExtractParams,
) -> Result<FoundPeriod> {
    if let PeriodSource::Pixels { width, height } = params.period {
        ctx.step(lattice::STEPS)?;
        return Ok(FoundPeriod {
            sides: [[width, 0.0], [0.0, height]],
            by: "given",
            confidence: None,
        });
    }
    let size = (photo.height(), photo.width());
    let pixels = colors(photo);
    let mut alike = (0..pixels.len()).filter(|&i| mask.is_none_or(|m| m.usable()[i]));
    let first = alike.next();
    if first.is_none_or(|first| alike.all(|i| pixels[i] == pixels[first])) {
        return Err(Error::BadPicture {
            what: "the photo".into(),
            reason: "all its usable pixels are alike, so there is nothing that could repeat".into(),
        });
    }
    let least = f64::from(params.min_confidence);
    let sure = |guess: &FoundPeriod| guess.confidence.unwrap_or(0.0);
    let mut best = 0.0;
    let ways: [(PeriodSource, Way<'_>); 2] = [
        (PeriodSource::Lattice, &|| of_lattice(ctx, &pixels, size, mask)),
        (PeriodSource::Ssd, &|| Ok(along_axes(&pixels, size, mask))),
    ];
    for (way, find) in ways {
        if params.period == way || params.period == PeriodSource::Auto {
            match find()? {
                Some(guess) if sure(&guess) >= least => return Ok(guess),
                guess => best = guess.map_or(best, |guess| sure(&guess).max(best)),
            }
        }
    }
    let what = "period along its axes".into();
    let remedy =
        "give one as WIDTHxHEIGHT in pixels (--period), or make a tile of all of the photo \
                  (texforge tile)"
            .into();
    Err(Error::NoStructure { what, confidence: best, least, remedy })
}

/// A way to find a period.
type Way<'a> = &'a dyn Fn() -> Result<Option<FoundPeriod>>;

/// By the self-difference along both axes.
fn along_axes(
    pixels: &[[f32; 3]],
    (h, w): (usize, usize),
    mask: Option<&Mask>,
) -> Option<FoundPeriod> {
    let usable = mask.map(Mask::usable);
    let planes = lattice::normalized(pixels, (h, w), mask, (h, w));
    let along = |planes: &[Vec<f32>], size, usable: Option<&[bool]>| {
        let (differences, variance) = self_difference(planes, size, usable);
        period(&differences, 2.0 * variance)
    };
    let across = along(&planes, (h, w), usable)?;
    let transposed = |i: usize| i % h * w + i / h;
    let planes: Vec<Vec<f32>> =
        planes.iter().map(|p| (0..h * w).map(|i| p[transposed(i)]).collect()).collect();
    let flags: Option<Vec<bool>> = usable.map(|u| (0..h * w).map(|i| u[transposed(i)]).collect());
    let down = along(&planes, (w, h), flags.as_deref())?;
    Some(FoundPeriod {
        sides: [[across.length, 0.0], [0.0, down.length]],
        by: "ssd",
        confidence: Some(across.confidence.min(down.confidence)),
    })
}

/// The smallest rectangle of the lattice.
fn of_lattice(
    ctx: &Ctx,
    pixels: &[[f32; 3]],
    size: (usize, usize),
    mask: Option<&Mask>,
) -> Result<Option<FoundPeriod>> {
    let found = lattice::find(ctx, pixels, size, mask, 0.0, true)?;
    let half = [size.1 as f64 / 2.0, size.0 as f64 / 2.0];
    Ok(found.and_then(|found| {
        let sides = rectangle(found.basis, half)?;
        Some(FoundPeriod { sides, by: "lattice", confidence: Some(found.confidence) })
    }))
}

/// How the photo is read, and the height and width of a tile in it.
pub(super) fn framed(
    photo: (usize, usize),
    sides: Basis,
    params: &ExtractParams,
) -> Result<(Frame, (usize, usize))> {
    let sides = sides.map(|v| v.map(|v| v * params.periods as f64));
    let [w, h] = sides.map(|v| dot(v, v).sqrt());
    let whole = |n: f64| {
        let enlarged = n.round() > n * (1.0 + MOST_ENLARGED);
        let down = params.scale == Scaling::Down && enlarged;
        (if down { n.floor() } else { n.round() }).max(1.0) as usize
    };
    let tile = (whole(h), whole(w));
    // By how much the far end of the photo is moved if the sides are rounded and put upright.
    let [across, down] = [photo.1 as f64 / w, photo.0 as f64 / h];
    let rounded = [[tile.1 as f64, 0.0], [0.0, tile.0 as f64]];
    let off = |k: usize| {
        let [a, b] = [0, 1].map(|i: usize| (sides[i][k] - rounded[i][k]).abs());
        a * across + b * down
    };
    let whole = off(0).max(off(1)) <= UNMOVED;
    let frame = if params.scale == Scaling::Off || whole {
        Frame::plain(photo)
    } else {
        Frame::new(photo, sides, tile)
    };
    let (height, width) = frame.size();
    if tile.0 > height || tile.1 > width {
        let expected = format!(
            "fewer, so that a tile fits into the photo (one period is {:.1}x{:.1} pixels)",
            w / params.periods as f64,
            h / params.periods as f64
        );
        return Err(Error::parameter("periods", expected, params.periods));
    }
    if params.band > 0 {
        let most = tile.0.min(tile.1).saturating_sub(1) / 2;
        if params.band < LEAST_PATCH || params.band > most {
            let (h, w) = tile;
            let expected =
                format!("0, or {LEAST_PATCH} to {most}, which leaves a middle of the {w}x{h} tile");
            return Err(Error::parameter("band", expected, params.band));
        }
    }
    Ok((frame, tile))
}
