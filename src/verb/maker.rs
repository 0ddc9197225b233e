//! [`Maker`]: what all tiles of a run share.

use std::time::{Duration, Instant};

use crate::analyze::lattice::snap::{MOST_SCALING, MOST_SCALING_ASKED, Snap};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::params::Value as _;
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::image::sigma_map::SigmaMap;
use crate::image::sourcemap::SourceMap;
use crate::method::stationary::{self, Dial, Exemplar, Kept, Periods};
use crate::method::{flatten, make_seamless};
use crate::search::patchmatch::Wrap;
use crate::verb::costs::costs;
use crate::verb::inputs::Inputs;
use crate::verb::lattice::glanced;
use crate::verb::params::{Axis, Follow, Measure, Method, Quality, Size, Symmetries, TileParams};
use crate::verb::tile::{MAX_VARIANTS, Report, Step, Tile};

/// Longest side of a tile, in pixels.
const MAX_TILE_SIDE: usize = 32_768;

/// Parameters as text.
type Shown = [(&'static str, String)];

/// Photos that were checked and analysed, ready for tiles of any seed and sigma.
#[derive(Debug)]
pub(super) struct Maker<'a> {
    inputs: &'a Inputs<'a>,
    params: &'a TileParams,
    /// Width and height of the tiles.
    size: (usize, usize),
    plan: stationary::Plan,
    /// The flattened photos, if they are used.
    flat: Option<Vec<Picture>>,
    /// `None` for the method that blends.
    exemplar: Option<Exemplar>,
    notes: Vec<String>,
    /// How the look depends on sigma, once that was found out.
    dial: Option<Dial>,
    /// Stages that the tiles share.
    seconds: Vec<(&'static str, f64)>,
}

impl<'a> Maker<'a> {
    /// Checks that `count` tiles can be made, and analyses the photos.
    ///
    /// # Errors
    /// See [`tiles`](crate::tiles).
    pub(super) fn new(
        ctx: &Ctx,
        inputs: &'a Inputs<'a>,
        params: &'a TileParams,
        count: usize,
    ) -> Result<Self> {
        let start = Instant::now();
        let (mut width, mut height) = check(inputs, params, count)?;
        let mut notes = Vec::new();
        let mut periods = None;
        if can_follow(inputs, params) {
            let followed = follow(ctx, inputs, params, (width, height), &mut notes)?;
            if let Some((size, found)) = followed {
                let size = Size::Pixels { width: size.0, height: size.1 };
                // The size may have changed; it must do like any other.
                (width, height) = check(inputs, &TileParams { size, ..params.clone() }, count)?;
                periods = Some(found);
            }
        }
        let wrap = wrap(params);
        let masks = inputs.usable(params)?;
        if masks[0].is_some() && params.method == Method::MakeSeamless {
            notes.push(
                "the method make-seamless uses the whole photo; the mask is ignored".to_owned(),
            );
        }
        if inputs.sigma_map.is_some() && !makes_stationary(params) {
            notes.push("nothing is made stationary; the sigma map changes no pixel".to_owned());
        }
        let mut plan = plan(params, inputs.sigma_map, (height, width), wrap);
        plan.periods = periods;
        if params.band > 0 {
            let photo = (inputs.photo.height(), inputs.photo.width());
            let usable = masks[0].as_ref().map(Mask::usable);
            plan.kept = Some(Kept::middle(photo, usable, (height, width), params.band, wrap)?);
        }
        if let Some(redo) = &inputs.redo {
            plan.kept = Some(Kept::outside(redo.of.clone(), redo.rect));
        }
        let (flat, exemplar) = ctx.install(|| {
            let flat = inputs.flattened(&masks, params, &mut notes)?;
            if params.method == Method::MakeSeamless {
                return Ok((flat, None));
            }
            let photos = inputs.photos(flat.as_deref());
            let photos: Vec<_> = photos.into_iter().zip(masks.iter().map(Option::as_ref)).collect();
            let symmetries = params.symmetry.list();
            let exemplar = Exemplar::new(ctx, &photos, symmetries, &plan, inputs.trace)?;
            Ok((flat, Some(exemplar)))
        })?;
        let size = (width, height);
        let seconds = vec![("analysis", start.elapsed().as_secs_f64())];
        Ok(Self { inputs, params, size, plan, flat, exemplar, notes, dial: None, seconds })
    }

    /// Steps of progress of `count` tiles, and of the dial.
    pub(super) fn work(&self, count: usize, with_dial: bool) -> u64 {
        let Some(exemplar) = &self.exemplar else { return 0 };
        let dial = if with_dial { Dial::work(exemplar, &self.plan) } else { 0 };
        exemplar.work(&self.plan) * count as u64 + dial
    }

    /// Finds out how the tile's look depends on sigma.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(super) fn learn_dial(&mut self, ctx: &Ctx) -> Result<&Dial> {
        let start = Instant::now();
        let Some(exemplar) = &self.exemplar else {
            return Err(Error::Internal { message: "a dial without an exemplar".into() });
        };
        let dial = ctx.install(|| Dial::new(ctx, exemplar, &self.plan))?;
        self.seconds.push(("dial", start.elapsed().as_secs_f64()));
        Ok(self.dial.insert(dial))
    }

    /// Makes the tile of a seed: with the sigma of the parameters, or of a place on the dial. While its
    /// costs are measured, `meanwhile` is given the picture, its source map and all parameters.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; those of `meanwhile`.
    pub(super) fn make<T: Send>(
        &self,
        ctx: &Ctx,
        seed: u64,
        stationarity: Option<f32>,
        meanwhile: impl FnOnce(&Picture, Option<&SourceMap>, &Shown) -> Result<T> + Send,
    ) -> Result<(Tile, T)> {
        let start = Instant::now();
        let ctx = ctx.with_seed(seed);
        let (width, height) = self.size;
        let mut params = self.params.clone();
        params.size = Size::Pixels { width, height };
        params.stationarity = None;
        if let (Some(dial), Some(stationarity)) = (&self.dial, stationarity) {
            params.sigma = dial.sigma(stationarity);
        }
        let mut plan = self.plan.clone();
        if let Some(evenness) = &mut plan.evenness {
            evenness.sigma = params.sigma;
        }
        let photos = self.inputs.photos(self.flat.as_deref());
        let measured = |photos: &[&Picture], picture: &Picture, map: Option<&SourceMap>| {
            costs(photos, picture, map, &params, self.inputs.sigma_map, plan.wrap)
        };
        let (mut trace, mut tracing) = (Vec::new(), Duration::ZERO);
        let mut look = |look: &stationary::Look<'_>| {
            let since = Instant::now();
            let photos: Vec<&Picture> = look.photos.iter().collect();
            let picture = look.map.apply_all(&photos, MapKind::Color)?;
            let costs = measured(&photos, &picture, Some(&look.map));
            trace.push(Step { level: look.level, iteration: look.iteration, costs });
            tracing += since.elapsed();
            Ok(())
        };
        let watch: Option<stationary::Watch<'_>> =
            if self.inputs.trace { Some(&mut look) } else { None };
        let (picture, source_map) = ctx.install(|| match &self.exemplar {
            None => Ok((make_seamless::run(photos[0], (height, width), plan.wrap)?, None)),
            Some(exemplar) => {
                let map = stationary::run(&ctx, exemplar, &plan, watch)?;
                Ok((map.apply_all(&photos, MapKind::Color)?, Some(map)))
            }
        })?;
        let made = start.elapsed();
        let shown = params.show();
        let ((costs, measuring), taken) = ctx.install(|| {
            let map = source_map.as_ref();
            let costs = || (measured(&photos, &picture, map), start.elapsed().saturating_sub(made));
            Ok(rayon::join(costs, || meanwhile(&picture, map, &shown)))
        })?;
        let taken = taken?;
        let own = [
            Some(("synthesis", made.saturating_sub(tracing).as_secs_f64())),
            self.inputs.trace.then_some(("trace", tracing.as_secs_f64())),
            Some(("costs", measuring.as_secs_f64())),
        ];
        let report = Report {
            version: env!("CARGO_PKG_VERSION"),
            seed,
            params: shown,
            sigma: params.sigma,
            stationarity,
            photo_size: (photos[0].width(), photos[0].height()),
            also_sizes: photos[1..].iter().map(|p| (p.width(), p.height())).collect(),
            tile_size: self.size,
            redo: self.inputs.redo.map(|redo| redo.rect),
            costs,
            seconds: self.seconds.iter().copied().chain(own.into_iter().flatten()).collect(),
            notes: self.notes.clone(),
        };
        Ok((Tile { picture, source_map, report, trace }, taken))
    }
}

/// The axes on which the tile shall repeat.
pub(super) fn wrap(params: &TileParams) -> Wrap {
    Wrap { y: params.axis != Axis::X, x: params.axis != Axis::Y }
}

/// Whether anything is made equal everywhere.
fn makes_stationary(params: &TileParams) -> bool {
    params.method == Method::Stationary && params.measure != Measure::None
}

/// Checks everything that can be known before the work; returns the tile's width and height.
fn check(inputs: &Inputs<'_>, params: &TileParams, count: usize) -> Result<(usize, usize)> {
    params.validate()?;
    if let Some(stationarity) = params.stationarity {
        check_dial(inputs, params, stationarity)?;
    }
    if !(1..=MAX_VARIANTS).contains(&count) {
        return Err(Error::parameter("variants", format!("1 to {MAX_VARIANTS}"), count));
    }
    if count > 1 && params.method == Method::MakeSeamless {
        let expected = "1 with the method make-seamless, which makes no random choices";
        return Err(Error::parameter("variants", expected, count));
    }
    flatten::check_reach(params.flatten)?;
    if params.patch.is_multiple_of(2) {
        return Err(Error::parameter("patch", "odd, so that a patch has a middle", params.patch));
    }
    if params.measure != Measure::Moments && params.order != TileParams::default().order {
        let expected = "left out unless the measure is `moments`";
        return Err(Error::parameter("order", expected, params.order));
    }
    let photo = inputs.photo;
    let (width, height) = match &inputs.redo {
        Some(redo) => redo.tile_size(params)?,
        None => params.resolved_size(photo.width(), photo.height()),
    };
    let sides = 1..=MAX_TILE_SIDE;
    if !sides.contains(&width) || !sides.contains(&height) {
        let expected = format!("1x1 to {MAX_TILE_SIDE}x{MAX_TILE_SIDE} pixels");
        return Err(Error::parameter("size", expected, format!("{width}x{height}")));
    }
    let too_small = |what: &str, width: usize, height: usize, remedy: &str| Error::TooSmall {
        what: what.into(),
        width,
        height,
        need: params.patch,
        remedy: remedy.into(),
    };
    let (pw, ph) = (photo.width(), photo.height());
    if params.method == Method::MakeSeamless {
        if width > pw || height > ph {
            let expected = format!("at most the photo's {pw}x{ph} with the method make-seamless");
            return Err(Error::parameter("size", expected, format!("{width}x{height}")));
        }
    } else if width.min(height) < params.patch {
        return Err(too_small(
            "the tile",
            width,
            height,
            "choose a smaller patch or a larger size",
        ));
    }
    if params.band > 0 {
        check_band(params, (pw, ph), (width, height))?;
    }
    let photos = inputs.photos(None);
    if let Some(redo) = &inputs.redo {
        redo.check(&photos, params)?;
    }
    for (i, photo) in photos.iter().enumerate() {
        let what = if i == 0 { "the photo".to_owned() } else { format!("photo {}", i + 1) };
        let (pw, ph) = (photo.width(), photo.height());
        if params.method != Method::MakeSeamless && pw.min(ph) < params.patch {
            return Err(too_small(&what, pw, ph, "choose a smaller patch or a larger photo"));
        }
        photo.ensure_like(photos[0], &what)?;
        photo.ensure_finite(&what)?;
    }
    if params.method == Method::MakeSeamless {
        let expected = "left out with the method make-seamless, which uses one photo as it lies";
        if photos.len() > 1 {
            return Err(Error::parameter("also", expected, photos.len() - 1));
        }
        if params.symmetry != Symmetries::None {
            return Err(Error::parameter("symmetry", expected, params.symmetry.show()));
        }
    }
    if let Some(map) = inputs.sigma_map {
        map.ensure_size(height, width)?;
    }
    // A filtered channel is eleven planes of floats; a sigma map has up to eight planes of weights.
    let filtered = if params.measure == Measure::Steerable { 44 } else { 0 };
    let mapped = if inputs.sigma_map.is_some() { 48 } else { 0 };
    // What is kept: the source map (12), and at a level its pixels and patches (20).
    let kept = if inputs.redo.is_some() { 32 } else { 0 };
    let measured = (width * height) as u64 * (filtered + mapped + kept);
    // Every tile with its source map stays until the last is made; flattened photos are copies.
    let tile = (width * height) as u64 * (photo.byte_len() / (pw * ph)) as u64;
    let others = (tile + 12 * (width * height) as u64).checked_mul(count as u64 - 1);
    let bytes: u64 = photos.iter().map(|photo| photo.byte_len() as u64).sum();
    let flat = if params.flatten > 0.0 { bytes } else { 0 };
    let sizes: Vec<_> = photos.iter().map(|photo| (photo.height(), photo.width())).collect();
    let symmetries = params.symmetry.list();
    let work = stationary::memory_bytes(&sizes, symmetries, (height, width));
    let need = others
        .zip(work)
        .and_then(|(others, work)| work.checked_add(tile + flat + measured + others));
    let what = if count > 1 { format!("{count} tiles of") } else { "a tile of".to_owned() };
    let from = match photos.len() * symmetries.len() {
        1 => format!("a {pw}x{ph} photo"),
        views => format!("{views} views of photos of {pw}x{ph} and so on"),
    };
    ensure_available(&format!("{what} {width}x{height} from {from}"), need)?;
    Ok((width, height))
}

/// Whether there could be a lattice to follow.
fn can_follow(inputs: &Inputs<'_>, params: &TileParams) -> bool {
    params.lattice == Follow::Auto
        && params.method == Method::Stationary
        && params.band == 0
        && params.symmetry == Symmetries::None
        && inputs.also.is_empty()
}

/// Looks for the photo's lattice: the width and height of a tile of whole periods, and how it is made
/// of them; `None` if there is none to follow. `notes` say it if there is one.
fn follow(
    ctx: &Ctx,
    inputs: &Inputs<'_>,
    params: &TileParams,
    (width, height): (usize, usize),
    notes: &mut Vec<String>,
) -> Result<Option<((usize, usize), Periods)>> {
    let lattice = match glanced(ctx, inputs.photo) {
        Ok(lattice) if lattice.found => lattice,
        Err(error @ (Error::Cancelled | Error::Memory { .. } | Error::Internal { .. })) => {
            return Err(error);
        }
        // What is too small or too plain for a lattice has none.
        Ok(_) | Err(_) => return Ok(None),
    };
    let confidence = lattice.confidence;
    let [[ax, ay], [bx, by]] = [lattice.v1, lattice.v2];
    let vectors = format!(
        "the photo repeats by ({ax:.1}, {ay:.1}) and ({bx:.1}, {by:.1}) pixels (confidence \
         {confidence:.2})"
    );
    let fixed = params.size != Size::Auto || inputs.redo.is_some();
    let size = (width, height);
    let nearest = lattice.snap_pieces(width, height, MOST_SCALING);
    let exact = |snap: &Snap| (snap.width, snap.height) == size;
    let held = if fixed {
        let asked = lattice.snap_pieces(width, height, MOST_SCALING_ASKED);
        nearest.filter(exact).or(asked.filter(exact))
    } else {
        nearest
    };
    if let Some(snap) = held {
        // An axis that does not repeat holds what there is room for, as large as in the photo.
        let wrap = wrap(params);
        let scales = [(wrap.x, snap.scale_x), (wrap.y, snap.scale_y)];
        let off = scales.iter().map(|&(wrap, scale)| if wrap { (scale - 1.0).abs() } else { 0.0 });
        let off = off.fold(0.0, f64::max);
        let by = if off > MOST_SCALING {
            let whole =
                nearest.map_or(String::new(), |s| format!("; {}x{} needs none", s.width, s.height));
            format!(", scaled by up to {:.0} %{whole}", 100.0 * off)
        } else {
            String::new()
        };
        let (w, h) = (snap.width, snap.height);
        notes.push(format!("{vectors}; a tile of {w}x{h} holds whole periods{by}"));
        let vectors = [lattice.v1, lattice.v2];
        let of_output = std::array::from_fn(|k| {
            let (wrap, scale) = scales[k];
            snap.periods[k].map(|n| n as f64 * if wrap { 1.0 } else { scale })
        });
        let periods = Periods::Lattice { vectors, of_output };
        return Ok(Some(((snap.width, snap.height), periods)));
    }
    let whole = nearest.map_or(String::new(), |s| format!("; {}x{} does", s.width, s.height));
    let wrap = wrap(params);
    let rows = lattice.rows(width, height, [wrap.x, wrap.y]);
    let along = if rows.is_empty() { "" } else { "whole rows, but along them " };
    notes.push(format!(
        "{vectors}; {width}x{height} holds {along}no whole number of them, so some are cut{whole}"
    ));
    Ok((!rows.is_empty()).then_some((size, Periods::Rows(rows))))
}

/// Checks that the dial has something to turn, and that nothing else turns it.
fn check_dial(inputs: &Inputs<'_>, params: &TileParams, stationarity: f32) -> Result<()> {
    let refused = |expected: &str| Err(Error::parameter("stationarity", expected, stationarity));
    if !(0.0..=1.0).contains(&stationarity) {
        return refused("0 to 1");
    }
    if !makes_stationary(params) {
        return refused("left out unless the method is stationary, with a measure");
    }
    if params.sigma.to_bits() != TileParams::default().sigma.to_bits() {
        return refused("left out with `sigma`: both say how even the tile becomes; give one");
    }
    if inputs.sigma_map.is_some() {
        return refused("left out with a sigma map: both say how even the tile becomes; give one");
    }
    Ok(())
}

/// Checks that a border of `params.band` pixels leaves a middle that the photo has.
fn check_band(
    params: &TileParams,
    (photo_width, photo_height): (usize, usize),
    (width, height): (usize, usize),
) -> Result<()> {
    if !matches!(params.method, Method::Stationary | Method::WrapOnly) {
        let expected = "0 unless the method is stationary or wrap-only";
        return Err(Error::parameter("band", expected, params.band));
    }
    if width > photo_width || height > photo_height {
        let expected = format!("at most the photo's {photo_width}x{photo_height} with a band");
        return Err(Error::parameter("size", expected, format!("{width}x{height}")));
    }
    let side = match params.axis {
        Axis::Both => width.min(height),
        Axis::X => width,
        Axis::Y => height,
    };
    let most = side.saturating_sub(1) / 2;
    if params.band < params.patch || params.band > most {
        let least = params.patch;
        let expected = format!(
            "{least} (the patch side) to {most}, which leaves a middle of {width}x{height}"
        );
        return Err(Error::parameter("band", expected, params.band));
    }
    Ok(())
}

fn plan(
    params: &TileParams,
    sigma_map: Option<&SigmaMap>,
    size: (usize, usize),
    wrap: Wrap,
) -> stationary::Plan {
    let even = params.method == Method::Stationary;
    let wraps = params.method != Method::NoWrap;
    let (coarse_iterations, fine_iterations) = match params.quality {
        Quality::Draft => (12, 1),
        Quality::Normal => (30, 2),
        Quality::Best => (60, 6),
    };
    stationary::Plan {
        size,
        wrap: Wrap { y: wrap.y && wraps, x: wrap.x && wraps },
        evenness: params.evenness(sigma_map).filter(|_| even),
        patch: params.patch,
        uniformity: params.uniformity,
        rarity: if even { params.rarity } else { 0.0 },
        periods: None,
        kept: None,
        coarse_iterations,
        fine_iterations,
    }
}
