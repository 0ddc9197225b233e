//! What is done with a photo that repeats before anything is taken out of it.

use crate::analyze::lattice;
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::params::Value as _;
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::method::flatten;
use crate::method::representative::Frame;
use crate::signal::basis::dot;
use crate::verb::extract::FoundPeriod;
use crate::verb::extract::params::{ExtractParams, PeriodSource};
use crate::verb::extract::period::{find_period, framed};

/// Shortest side of a photo that can be looked at: two periods of a few pixels.
const SMALLEST: usize = 16;

/// Least period that can be asked for, in pixels.
const LEAST_PERIOD: f64 = 2.0;

/// Side of a lean that is no lean, in pixels over a tile.
const UPRIGHT: f64 = 0.1;

/// A photo made ready: its period is whole pixels.
pub(super) struct Prepared {
    pub(super) found: FoundPeriod,
    pub(super) frame: Frame,
    /// Height and width of a tile.
    pub(super) tile: (usize, usize),
    /// By what the photo's width and height were multiplied.
    pub(super) scale: (f64, f64),
    pub(super) scaled: Picture,
    /// Where that may be used; `None` is everywhere.
    pub(super) flags: Option<Vec<bool>>,
    pub(super) notes: Vec<String>,
}

/// Checks, flattens, finds the period, scales. `steps` of progress follow.
pub(super) fn prepare(
    ctx: &Ctx,
    photo: &Picture,
    mask: Option<&Mask>,
    params: &ExtractParams,
    steps: u64,
) -> Result<Prepared> {
    check(photo, params)?;
    let mut notes = Vec::new();
    let mask = usable(photo, mask)?;
    ctx.begin(lattice::STEPS + steps);
    let flat = flattened(ctx, photo, mask.as_ref(), params, &mut notes)?;
    let photo = flat.as_ref().unwrap_or(photo);
    let found = ctx.install(|| find_period(ctx, photo, mask.as_ref(), params))?;
    let (frame, tile) = framed((photo.height(), photo.width()), found.sides, params)?;
    let [x, y] = frame.unit().map(|v| dot(v, v).sqrt().recip());
    notes.extend(described(&found, &frame, tile, [x, y]));
    let (scaled, flags) =
        ctx.install(|| Ok((frame.read(photo, MapKind::Color)?, frame.usable(mask.as_ref()))))?;
    Ok(Prepared { found, frame, tile, scale: (x, y), scaled, flags, notes })
}

/// Checks everything that can be known before the work.
fn check(photo: &Picture, params: &ExtractParams) -> Result<()> {
    params.validate()?;
    if let Some(alpha) = params.alpha.filter(|alpha| !(alpha.is_finite() && *alpha >= 0.0)) {
        return Err(Error::parameter("alpha", "none, or a number from 0 up", alpha));
    }
    flatten::check_reach(params.flatten)?;
    let (width, height) = (photo.width(), photo.height());
    if width.min(height) < SMALLEST {
        let (what, remedy) = ("the photo".into(), "take a larger piece of it".into());
        return Err(Error::TooSmall { what, width, height, need: SMALLEST, remedy });
    }
    if let PeriodSource::Pixels { width: w, height: h } = params.period {
        let fits = |period: f64, side: usize| (LEAST_PERIOD..=side as f64 / 2.0).contains(&period);
        if !fits(w, width) || !fits(h, height) {
            let expected = format!(
                "{LEAST_PERIOD}x{LEAST_PERIOD} to {}x{}, half the photo, so that it repeats at least twice",
                width as f64 / 2.0,
                height as f64 / 2.0
            );
            return Err(Error::parameter("period", expected, params.period.show()));
        }
    }
    photo.ensure_finite("the photo")?;
    // Linear light of the photo, the scaled photo's, its samples, colours, codes and costs; the
    // lattice's planes.
    let (pixels, channels) = ((width * height) as u64, photo.channels() as u64);
    let work = pixels * (8 * channels + 100) + photo.byte_len() as u64 + 600 * pixels.min(1 << 20);
    let tiles = params.count as u64 * pixels / 4 * (12 + photo.byte_len() as u64 / pixels);
    ensure_available(
        &format!("extracting tiles from a {width}x{height} photo"),
        work.checked_add(tiles),
    )
}

/// Where the photo may be used; `None` is everywhere.
fn usable(photo: &Picture, mask: Option<&Mask>) -> Result<Option<Mask>> {
    if let Some(mask) = mask {
        mask.ensure_size("the mask", photo.height(), photo.width())?;
    }
    let both = match (mask, Mask::from_alpha(photo)) {
        (Some(mask), Some(alpha)) => Some(mask.and(&alpha)?),
        (mask, alpha) => mask.cloned().or(alpha),
    };
    Ok(both.filter(|mask| mask.count() < mask.usable().len()))
}

fn flattened(
    ctx: &Ctx,
    photo: &Picture,
    mask: Option<&Mask>,
    params: &ExtractParams,
    notes: &mut Vec<String>,
) -> Result<Option<Picture>> {
    if params.flatten <= 0.0 {
        return Ok(None);
    }
    let sigma = f64::from(params.flatten) * photo.height().min(photo.width()) as f64;
    let flat = ctx.install(|| flatten::run(photo, mask, sigma))?;
    notes.push(flat.note(sigma));
    Ok(Some(flat.picture))
}

/// What was found and done, for people.
fn described(
    found: &FoundPeriod,
    frame: &Frame,
    (tile_h, tile_w): (usize, usize),
    scale: [f64; 2],
) -> Vec<String> {
    let [a, b] = found.sides;
    let mut notes = Vec::new();
    if let Some(confidence) = found.confidence {
        let by = if found.by == "ssd" { "difference from itself" } else { "lattice" };
        notes.push(format!(
            "the photo repeats every {:.2} pixels to the right and {:.2} downwards (found by its {by}, \
             confidence {confidence:.2})",
            a[0], b[1]
        ));
    }
    if !frame.is_plain() {
        let leans = a[1].abs().max(b[0].abs()) > UPRIGHT;
        let upright = if leans {
            format!(" and put upright (it leaned by {:.1} and {:.1} pixels)", a[1], b[0])
        } else {
            String::new()
        };
        notes.push(format!(
            "the photo was scaled by {:.4} across and {:.4} down{upright}, so that a tile is {tile_w}x{tile_h} \
             whole pixels",
            scale[0], scale[1]
        ));
    }
    notes
}
