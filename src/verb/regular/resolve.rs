//! What is left open by the parameters is found out, and what cannot be is refused.

use crate::analyze::lattice::snap::{self, MOST_SCALING};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::params::{OrAuto, Value as _};
use crate::image::color::{ColorModel, MatchSpace};
use crate::image::interpolate::REACH;
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::method::flatten;
use crate::search::patchmatch::Wrap;
use crate::signal::basis::{Basis, area, coefficients, combined, dot, reduced};
use crate::verb::lattice::{LatticeParams, detect};
use crate::verb::params::Size;
use crate::verb::regular::params::{Guide, RegularParams, Subpixel};

/// Longest side of a texture, in pixels.
const MAX_SIDE: usize = 1 << 20;

/// Least side of a block.
pub(super) const LEAST_BLOCK: usize = 8;

/// Side of a block by itself: this share of the root of the cell's area (pieces smaller than a brick
/// are joined within bricks, larger ones repeat recognizably), but at least this many pixels.
const BLOCK_SHARE: f64 = 1.0;
const BLOCK_PIXELS: f64 = 64.0;

/// Border by itself, as a share of the block: up to a half gives the seams more room, and time.
const BORDER_SHARE: f64 = 0.45;

/// Where the photo may be used, by mask and alpha (`None`: everywhere); checked to hold something that
/// is not all alike.
pub(super) fn usable(photo: &Picture, mask: Option<&Mask>) -> Result<Option<Mask>> {
    let (height, width) = (photo.height(), photo.width());
    if let Some(mask) = mask {
        mask.ensure_size("the mask", height, width)?;
    }
    let alpha = Mask::from_alpha(photo);
    let usable = match (mask, alpha) {
        (Some(mask), Some(alpha)) => Some(mask.and(&alpha)?),
        (Some(mask), None) => Some(mask.clone()),
        (None, alpha) => alpha,
    };
    let usable = usable.filter(|mask| mask.count() < mask.usable().len());
    let c = photo.channels();
    let pixel = |i: usize| (0..c).map(move |k| photo.samples().unit(i * c + k));
    let mut all = (0..height * width).filter(|&i| usable.as_ref().is_none_or(|m| m.usable()[i]));
    let first = all.next();
    if first.is_none_or(|first| all.all(|i| pixel(i).eq(pixel(first)))) {
        return Err(Error::BadPicture {
            what: "the photo".into(),
            reason: "all its usable pixels are alike, so there is no pattern to continue".into(),
        });
    }
    Ok(usable)
}

/// The lattice to follow, and how sure it is if it was looked for.
pub(super) fn lattice(
    ctx: &Ctx,
    photo: &Picture,
    mask: Option<&Mask>,
    params: &RegularParams,
) -> Result<(Option<Basis>, Option<f64>)> {
    let basis = match params.lattice {
        Guide::None => return Ok((None, None)),
        Guide::Vectors(basis) => basis,
        Guide::Auto => {
            let asked =
                LatticeParams { min_confidence: params.min_confidence, ..Default::default() };
            let found = detect(ctx, photo, mask, &asked, false)?;
            if !found.found {
                return Err(Error::NoStructure {
                    what: "lattice".into(),
                    confidence: found.confidence,
                    least: f64::from(params.min_confidence),
                    remedy: "give its two displacements, or take `lattice` none for a texture \
                             without one"
                        .into(),
                });
            }
            return Ok((Some([found.v1, found.v2]), Some(found.confidence)));
        }
    };
    let refused = |expected: String| Error::parameter("lattice", expected, params.lattice.show());
    let [a, b] = basis;
    let sine = (a[0] * b[1] - a[1] * b[0]).abs() / (dot(a, a) * dot(b, b)).sqrt();
    if sine.is_nan() || sine < 1e-3 {
        return Err(refused("two displacements that are not parallel, nor zero".into()));
    }
    let basis = reduced(basis);
    let (w, h) = (photo.width() as f64, photo.height() as f64);
    if basis.iter().any(|v| 2.0 * v[0].abs() > w || 2.0 * v[1].abs() > h) {
        let expected =
            "displacements of at most half the photo's width and height, or nothing repeats";
        return Err(refused(expected.into()));
    }
    if basis.iter().any(|v| dot(*v, *v) < 4.0) {
        return Err(refused("displacements of at least 2 pixels".into()));
    }
    Ok((Some(basis), None))
}

/// Width and height of the texture, and the lattice in it.
pub(super) fn sized(
    params: &RegularParams,
    photo: (usize, usize),
    lattice: Option<Basis>,
    wrap: Wrap,
) -> Result<((usize, usize), Basis)> {
    let wish = match params.size {
        Size::Auto => photo,
        Size::Pixels { width, height } => (width, height),
    };
    let sides = 1..=MAX_SIDE;
    if !sides.contains(&wish.0) || !sides.contains(&wish.1) {
        let expected = format!("1x1 to {MAX_SIDE}x{MAX_SIDE} pixels");
        return Err(Error::parameter("size", expected, format!("{}x{}", wish.0, wish.1)));
    }
    let Some(basis) = lattice else { return Ok((wish, [[1.0, 0.0], [0.0, 1.0]])) };
    // On an axis that does not repeat the texture is as it is in the photo.
    let free = |axis: usize, length: usize| {
        let mut v = [0.0; 2];
        v[axis] = length as f64;
        (length, v)
    };
    let side = |axis: usize, wraps: bool, length: usize| {
        if !wraps {
            return Ok(free(axis, length));
        }
        let turned = basis.map(|[x, y]| if axis == 0 { [x, y] } else { [y, x] });
        let near = snap::side(turned, length, MOST_SCALING, MOST_SCALING);
        if let Some(s) = near.filter(|s| params.size == Size::Auto || s.length == length) {
            let [a, b] = s.periods.map(|n| n as f64);
            return Ok((s.length, combined(basis, a, b)));
        }
        let does = near.map_or(String::new(), |s| format!("; {} does", s.length));
        let expected = format!(
            "a whole number of periods within 3 % where the texture repeats{does} (or auto)"
        );
        let name = if axis == 0 { "width" } else { "height" };
        Err(Error::parameter("size", expected, format!("a {name} of {length}")))
    };
    let (width, across) = side(0, wrap.x, wish.0)?;
    let (height, down) = side(1, wrap.y, wish.1)?;
    // What is across and down in the photo becomes the texture's width and height.
    let output = basis.map(|v| {
        let [a, b] = coefficients([across, down], v);
        [a * width as f64, b * height as f64]
    });
    Ok(((width, height), output))
}

/// Side of the blocks and their border.
pub(super) fn blocks(
    params: &RegularParams,
    (width, height): (usize, usize),
    lattice: Option<Basis>,
) -> Result<(usize, usize)> {
    let short = width.min(height) as f64;
    // Some place of every phase lies in a rectangle as large as the cell's bounding box.
    let cell = lattice.map_or(0.0, |[a, b]| (a[0].abs() + b[0].abs()).max(a[1].abs() + b[1].abs()));
    let kernel = if params.subpixel == Subpixel::On && lattice.is_some() { REACH } else { 0 };
    let slack = (params.deform + params.tolerance + kernel) as f64;
    let room = (short - cell - 2.0 * slack) / (1.0 + 2.0 * BORDER_SHARE);
    let wish =
        lattice.map_or(short / 8.0, |basis| (BLOCK_SHARE * area(basis).sqrt()).max(BLOCK_PIXELS));
    let block = match params.block {
        OrAuto::Given(block) => block,
        OrAuto::Auto => wish.min(room).max(LEAST_BLOCK as f64) as usize,
    };
    if block < LEAST_BLOCK {
        let expected = format!("at least {LEAST_BLOCK} pixels");
        return Err(Error::parameter("block", expected, block));
    }
    let border = match params.border {
        OrAuto::Given(border) => border,
        OrAuto::Auto => ((BORDER_SHARE * block as f64) as usize).max(1),
    };
    if !(1..=block / 2).contains(&border) {
        let expected = format!("1 to {} (half the block)", block / 2);
        return Err(Error::parameter("border", expected, border));
    }
    let need = block + 2 * border + 2 * (params.deform + kernel);
    if width.min(height) < need {
        let what = "the photo".into();
        let remedy = format!(
            "that is a block of {block} with a border of {border}: choose smaller ones, or a larger \
             photo"
        );
        return Err(Error::TooSmall { what, width, height, need, remedy });
    }
    Ok((block, border))
}

/// Reach of the flattening as a share of the photo's shorter side; 0 for none.
pub(super) fn flatten_share(
    params: &RegularParams,
    (width, height): (usize, usize),
    lattice: Option<Basis>,
) -> f32 {
    match params.flatten {
        OrAuto::Given(share) => share,
        OrAuto::Auto => {
            // Wider than a cell: narrower, the pattern itself would be taken for light.
            let cell = lattice.map_or(0.0, |[_, b]| dot(b, b).sqrt());
            (cell / width.min(height) as f64).clamp(FLATTEN_SHARE, 1.0) as f32
        }
    }
}

/// Least share that the flattening takes by itself: less would take colours of single bricks for light.
const FLATTEN_SHARE: f64 = 0.25;

/// Most that a colour channel is raised or lowered by itself: more is the colour of things.
const MOST_LIGHT: f64 = 2.5;

/// The photo with its light flattened, if it is to be; `notes` say what was done.
pub(super) fn flattened(
    ctx: &Ctx,
    photo: &Picture,
    usable: Option<&Mask>,
    params: &RegularParams,
    lattice: Option<Basis>,
    notes: &mut Vec<String>,
) -> Result<Option<Picture>> {
    let size = (photo.width(), photo.height());
    let share = flatten_share(params, size, lattice);
    if params.flatten == OrAuto::Auto && ColorModel::new(photo).space() == MatchSpace::Data {
        return Ok(None);
    }
    flatten::check_reach(share)?;
    if !(0.0..=1.0).contains(&share) {
        return Err(Error::parameter("flatten", "0 (off) to 1", share));
    }
    if share == 0.0 {
        return Ok(None);
    }
    let sigma = f64::from(share) * size.0.min(size.1) as f64;
    let flat = ctx.install(|| flatten::run(photo, usable, sigma))?;
    let (low, high) = flat.factors;
    if params.flatten == OrAuto::Auto && high.max(1.0 / low) > MOST_LIGHT {
        notes.push(format!(
            "the light was not flattened: where the photo is brighter or darker by up to {:.1} times, that \
             is hardly light",
            high.max(1.0 / low)
        ));
        return Ok(None);
    }
    notes.push(flat.note(sigma));
    Ok(Some(flat.picture))
}
