//! Stationary tiles: PatchMatch on the torus with stationarity projection.
//!
//! Moritz, James, Haines, Ritschel, Weyrich: Texture Stationarization (2017), Algorithm 1. The
//! same loop without wrap or without projection gives the baselines.

mod balance;
mod dial;
mod kept;
mod level;

use rayon::prelude::*;

use crate::analyze::lattice::snap::Rows;
use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::image::sigma_map::SigmaMap;
use crate::image::sourcemap::{Origin, SourceMap};
use crate::image::symmetry::Symmetry;
use crate::search::atlas::Atlas;
use crate::search::field::{Field, Pos};
use crate::search::patch::MatchImage;
use crate::search::patchmatch::{self, Search, Wrap};
use crate::search::phase::Phase;
use crate::search::place_cost::PlaceCost;
use crate::search::seams;
use crate::search::source::Source;
use crate::search::vote::{Votes, vote};
use crate::signal::basis::Basis;
use crate::signal::histogram::{Counts, SOFT_BITS};
use crate::signal::measure::Statistic;
use crate::signal::resample::resized;
use crate::signal::window::{Domain, Window};

use balance::Balance;
pub use dial::Dial;
pub use kept::Kept;
use kept::KeptLevel;
use level::Level;

/// Channel that holds local contrast; the three before it are the colour.
const CONTRAST: usize = 3;

/// Share by which the contrast is pulled back to the exemplar's in every iteration. Averaging votes
/// drift towards smooth places; without this pull fine detail dies out (compare plain concrete in the
/// gallery with the pull at 0).
const CONTRAST_PULL: f32 = 0.5;

/// Share of the projection at the levels between the coarsest (all of it) and the finest (none:
/// there the photo's own pixels decide). The coarsest level has spread the stains already; more costs
/// likeness (a higher texture cost), less leaves patches of shade that show when tiled.
const FINE_PROJECTION: f32 = 0.75;

/// Standard deviation of the narrowest window, in pixels of a level. The dozen pixels in it are too few
/// for a distribution; still narrower ones only cost time at the coarse levels.
const LEAST_WINDOW: f64 = 2.0;

/// Sweeps of the seam placement; after three hardly a pixel moves.
const SEAM_SWEEPS: u32 = 3;

/// What to make, and how hard to try.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Height and width of the output in pixels.
    pub size: (usize, usize),
    /// Which axes wrap.
    pub wrap: Wrap,
    /// What is made equal everywhere; `None` leaves the projection out.
    pub evenness: Option<Evenness>,
    /// Patch side.
    pub patch: usize,
    /// Weight of spatial uniformity.
    pub uniformity: f32,
    /// How much rare places cost, as a share of what they are rarer than others.
    pub rarity: f32,
    /// The lattice of the (only) photo, which the output repeats in.
    pub periods: Option<Periods>,
    /// Output pixels that are given.
    pub kept: Option<Kept>,
    /// Iterations at the coarsest level.
    pub coarse_iterations: u32,
    /// Iterations at each other level.
    pub fine_iterations: u32,
}

/// A lattice in the photo, and how the output's axes are made of it.
#[derive(Debug, Clone)]
pub enum Periods {
    /// The whole lattice.
    Lattice {
        /// Vectors in pixels of the photo, each to the right and downwards.
        vectors: Basis,
        /// Coefficients of the displacements by the output's width and by its height; whole numbers
        /// where it repeats.
        of_output: [[f64; 2]; 2],
    },
    /// One or two families of its rows alone: along one nothing is held.
    Rows(Vec<Rows>),
}

impl Periods {
    /// The lattice at a level with an output of `size`, in a source of one view.
    fn at_level(
        &self,
        photo: (usize, usize),
        size: (usize, usize),
        source: &Source,
    ) -> Option<Phase> {
        let view = source.atlas.views()[0].size;
        let (sy, sx) = (view.0 as f64 / photo.0 as f64, view.1 as f64 / photo.1 as f64);
        let (w, h) = (size.1 as f64, size.0 as f64);
        match self {
            Self::Lattice { vectors, of_output } => {
                let vectors = vectors.map(|[x, y]| [x * sx, y * sy]);
                // Cells of the output, of which its sides are made.
                let [[a, b], [c, d]] = *of_output;
                let n = a * d - b * c;
                if n.abs() < 1e-9 {
                    return None;
                }
                let output = [[d * w / n, -b * h / n], [-c * w / n, a * h / n]];
                Phase::new(vectors, output, source.patch)
            }
            Self::Rows(rows) => {
                let family = |rows: &Rows| {
                    let ([x, y], [a, b]) = (rows.frequency, rows.of_output);
                    ([x / sx, y / sy], [a / w, b / h])
                };
                Phase::rows(&rows.iter().map(family).collect::<Vec<_>>(), source.patch)
            }
        }
    }
}

/// What is made equal everywhere, and within which reach.
#[derive(Debug, Clone)]
pub struct Evenness {
    /// The statistic.
    pub statistic: Statistic,
    /// Standard deviation of its window as a fraction of the output's shorter side.
    pub sigma: f32,
    /// The same for every pixel of the output, in place of `sigma`.
    pub sigma_map: Option<SigmaMap>,
}

impl Evenness {
    /// The window at an output of this size, over a domain that may have an apron around it.
    pub fn window(&self, (height, width): (usize, usize), domain: Domain) -> Window {
        let side = height.min(width) as f32;
        let Some(map) = &self.sigma_map else {
            return Window::even((f64::from(self.sigma) * f64::from(side)).max(LEAST_WINDOW));
        };
        let gray: Vec<[f32; 3]> = map.values().iter().map(|&v| [v; 3]).collect();
        let small = resized(&gray, map.size(), (height, width));
        // What the map does not reach is like its edge.
        let inside = |i: usize, n: usize, all: usize| i.saturating_sub((all - n) / 2).min(n - 1);
        let at = |i: usize| {
            let y = inside(i / domain.width, height, domain.height);
            let sigma = small[y * width + inside(i % domain.width, width, domain.width)][0];
            (sigma * side).max(LEAST_WINDOW as f32)
        };
        let sigmas: Vec<f32> = (0..domain.height * domain.width).map(at).collect();
        Window::prescribed(&sigmas)
    }
}

/// A look at the work: the tile that would be delivered if it stopped here, at its level's size.
#[derive(Debug)]
pub struct Look<'a> {
    /// Number of the level; 0 has the output's size, every further one is smaller by 1.3.
    pub level: usize,
    /// Iterations done at this level. The last look of all counts one more: the seams are settled.
    pub iteration: u32,
    /// The photos at this level, as three channels of linear light (or data).
    pub photos: &'a [Picture],
    /// Which of their pixels each of the tile's is.
    pub map: SourceMap,
}

/// Is shown every iteration; an error from it ends the work.
pub type Watch<'a> = &'a mut (dyn FnMut(&Look<'_>) -> Result<()> + Send);

/// Photos, analysed: what all runs on them share.
#[derive(Debug)]
pub struct Exemplar {
    /// Height and width of each photo.
    sizes: Vec<(usize, usize)>,
    /// Finest first.
    levels: Vec<Level>,
    /// Where the finest level's source may be used; `None` is everywhere.
    usable: Option<Vec<bool>>,
}

impl Exemplar {
    /// Analyses photos of one type, as far as their masks let them be used, in these symmetries, for
    /// tiles of this plan; `watched` if a [`run`] will be.
    ///
    /// # Errors
    /// See [`tile`](crate::tile).
    pub fn new(
        ctx: &Ctx,
        photos: &[(&Picture, Option<&Mask>)],
        symmetries: &[Symmetry],
        plan: &Plan,
        watched: bool,
    ) -> Result<Self> {
        let (levels, usable) = level::build(ctx, photos, symmetries, plan, watched)?;
        let sizes = photos.iter().map(|(photo, _)| (photo.height(), photo.width())).collect();
        Ok(Self { sizes, levels, usable })
    }

    /// Steps of progress that one [`run`] counts.
    pub fn work(&self, plan: &Plan) -> u64 {
        self.work_down_to(plan, 0)
    }

    /// The same for the levels from the coarsest to `finest`.
    fn work_down_to(&self, plan: &Plan, finest: usize) -> u64 {
        let area = |l: &Level| (l.size.0 * l.size.1) as u64;
        let levels = self.levels.iter().enumerate().skip(finest);
        levels
            .map(|(j, l)| u64::from(effort(plan, l, j + 1 == self.levels.len()).0) * area(l))
            .sum()
    }
}

/// Synthesizes a texture from the exemplar: where every output pixel comes from. `ctx.begin` is the
/// caller's. Watching changes nothing in it.
///
/// # Errors
/// See [`tile`](crate::tile); those of `watch`.
pub fn run(
    ctx: &Ctx,
    exemplar: &Exemplar,
    plan: &Plan,
    mut watch: Option<Watch<'_>>,
) -> Result<SourceMap> {
    let (field, kept) = synthesize(ctx, exemplar, plan, 0, watch.as_mut())?;
    let finest = &exemplar.levels[0];
    let mut yx = centers(&field, plan.patch);
    let mut votes = vote(ctx.simd, &field, &finest.source, plan.wrap);
    if let Some(kept) = &kept {
        kept.restore(&mut votes, &finest.source, plan.wrap);
    }
    let fixed = kept.as_ref().map(|kept| kept.place(&mut yx));
    let canvas = seams::Canvas {
        source: &finest.source.image,
        atlas: &finest.source.atlas,
        usable: exemplar.usable.as_deref(),
        fixed: fixed.as_deref(),
        target: &without_apron(&votes, plan, plan.size),
        wrap: plan.wrap,
    };
    seams::settle(ctx, &canvas, &mut yx, SEAM_SWEEPS)?;
    let map = named(yx, &finest.source.atlas, &exemplar.sizes, plan.size)?;
    if let Some(watch) = watch {
        let iteration = effort(plan, finest, exemplar.levels.len() == 1).0 + 1;
        watch(&Look { level: 0, iteration, photos: &finest.photos, map: map.clone() })?;
    }
    Ok(map)
}

/// Goes through the levels from the coarsest down to number `finest`: where every pixel's patch is
/// matched there, and what is kept.
fn synthesize(
    ctx: &Ctx,
    exemplar: &Exemplar,
    plan: &Plan,
    finest: usize,
    mut watch: Option<&mut Watch<'_>>,
) -> Result<(Field, Option<KeptLevel>)> {
    let levels = &exemplar.levels;
    let n_coarse = levels.len() - 1;
    let mut pass = 0;
    let balanced = !plan.kept.as_ref().is_some_and(Kept::is_tile);
    let mut balance = Balance::new(if balanced { exemplar.sizes.len() } else { 1 });
    let mut field: Option<Field> = None;
    let mut kept: Option<KeptLevel> = None;
    for (j, level) in levels.iter().enumerate().skip(finest).rev() {
        let (h, w) = level.size;
        let mut f = match field.take() {
            None => Field::random(h, w, &level.source, ctx.seed),
            Some(field) => field.upsampled((h, w), &levels[j + 1].source, &level.source, ctx.seed),
        };
        let coarser = levels.get(j + 1).zip(kept.as_ref());
        kept = plan.kept.as_ref().map(|kept| kept.at_level(level, coarser, ctx.seed));
        if let Some(kept) = &kept {
            kept.hold(&mut f);
        }
        let phase = plan
            .periods
            .as_ref()
            .and_then(|p| p.at_level(exemplar.sizes[0], (h, w), &level.source));
        if let Some(phase) = &phase {
            f = f.in_phase(phase, &level.source);
        }
        let coarsest = j == n_coarse;
        let mut usage = PlaceCost::of_usage(&f, &level.source, plan.uniformity * level.usage_unit);
        let areas = balance::areas(&level.source, exemplar.sizes.len());
        let (iterations, search) = effort(plan, level, coarsest);
        let apron = |wrap: bool| if wrap { 0 } else { plan.patch - 1 };
        let domain = Domain {
            height: h + apron(plan.wrap.y),
            width: w + apron(plan.wrap.x),
            wrap_y: plan.wrap.y,
            wrap_x: plan.wrap.x,
        };
        let window = plan.evenness.as_ref().map(|e| (e, e.window((h, w), domain)));
        for i in 0..iterations {
            let mut votes = vote(ctx.simd, &f, &level.source, plan.wrap);
            let fade = 1.0 - (i + 1) as f32 / iterations as f32;
            match_global(&mut votes, level, if coarsest { fade } else { 0.0 });
            let projection = if coarsest {
                1.0
            } else if level.size == plan.size {
                0.0
            } else {
                FINE_PROJECTION
            };
            if let Some((evenness, window)) = window.as_ref().filter(|_| projection > 0.0) {
                evenness.statistic.project(&mut votes.soft, domain, window, projection);
            }
            if let Some(kept) = &kept {
                kept.restore(&mut votes, &level.source, plan.wrap);
            }
            let target = canvas(&votes, plan, (h, w));
            let now = PlaceCost::of_usage(&f, &level.source, plan.uniformity * level.usage_unit);
            usage = now.averaged(&usage);
            let cost = usage.clone().plus(plan.rarity, &level.rarity);
            let cost = match kept.as_ref().and_then(KeptLevel::cost) {
                Some(more) => cost.plus(1.0, more),
                None => cost,
            };
            let search = Search { pass, phase, ..search };
            let unit = f64::from(plan.uniformity) * level.patch_variance;
            let cost = match balance.costs(&f, &level.source, &areas, unit) {
                Some(costs) => cost.with_picture_costs(&level.source, &costs),
                None => cost,
            };
            patchmatch::pass(ctx, &target, &level.source, &cost, plan.wrap, search, &mut f)?;
            if let Some(kept) = &kept {
                kept.hold(&mut f);
            }
            pass += 1;
            if let Some(watch) = watch.as_mut() {
                let sizes: Vec<_> = level.photos.iter().map(|p| (p.height(), p.width())).collect();
                let map = named(centers(&f, plan.patch), &level.source.atlas, &sizes, (h, w))?;
                watch(&Look { level: j, iteration: i + 1, photos: &level.photos, map })?;
            }
        }
        field = Some(f);
    }
    Ok((field.expect("there is at least one level"), kept))
}

/// The pixel in the middle of each matched patch.
fn centers(field: &Field, patch: usize) -> Vec<seams::From> {
    let half = patch / 2;
    field.pos.par_iter().map(|p: &Pos| [(p.y() + half) as u32, (p.x() + half) as u32]).collect()
}

/// The source map, of this `size`, of pixels of an atlas of photos of these sizes.
fn named(
    yx: Vec<seams::From>,
    atlas: &Atlas,
    photos: &[(usize, usize)],
    size: (usize, usize),
) -> Result<SourceMap> {
    if atlas.is_plain() {
        return SourceMap::new(size, photos[0], yx);
    }
    let named = yx.into_iter().map(|[y, x]| {
        let at = (y as usize, x as usize);
        let view = &atlas.views()[atlas.view_at(at.0, at.1).unwrap_or(0)];
        let (y, x) = view.source(at);
        let origin = Origin { photo: view.picture as u16, symmetry: view.symmetry };
        ([y as u32, x as u32], origin)
    });
    let (yx, origins) = named.unzip();
    SourceMap::of_views(size, photos.to_vec(), yx, origins)
}

/// Peak memory of the analysis and a [`run`] besides the photos themselves, for photos and an output
/// of these sizes (height, width) in this many symmetries, in bytes; generous by a quarter. `None` if
/// the photos do not fit into one atlas.
pub fn memory_bytes(
    photos: &[(usize, usize)],
    symmetries: &[Symmetry],
    output: (usize, usize),
) -> Option<u64> {
    // Per photo pixel: linear light of this level and the next (12 + 7).
    const PHOTO: u64 = 19;
    // Per atlas pixel: codes without contrast (4), codes of all levels (4 * 2.45), and with a mask or
    // several views what is usable, flag by flag (1 + 2.45) and as a list (4 * 2.45).
    const ATLAS: u64 = 27;
    // Per output pixel: two fields (8), votes (8), canvas (4), three source maps (24), or the costs'
    // colours (20).
    const OUTPUT: u64 = 48;
    let atlas = Atlas::new(photos, symmetries)?;
    let pixels = |(h, w): (usize, usize)| h as u64 * w as u64;
    let photos: u64 = photos.iter().map(|&photo| pixels(photo)).sum();
    let atlas = pixels((atlas.height(), atlas.width()));
    Some((PHOTO * photos + ATLAS * atlas + OUTPUT * pixels(output)) / 4 * 5)
}

/// Picks what to do at a level: iterations, and how far to search.
fn effort(plan: &Plan, level: &Level, coarsest: bool) -> (u32, Search) {
    let finest = level.size == plan.size;
    if finest && !coarsest {
        (plan.fine_iterations.div_ceil(2), Search { pass: 0, radius: 32, n_random: 2, phase: None })
    } else if coarsest {
        (plan.coarse_iterations, Search { pass: 0, radius: 0, n_random: 8, phase: None })
    } else {
        (plan.fine_iterations, Search { pass: 0, radius: 32, n_random: 2, phase: None })
    }
}

/// Moves each channel's values towards the exemplar's distribution: `Q_target = alpha Q_e +
/// (1 - alpha) Q_f`, where the contrast is pulled at least by [`CONTRAST_PULL`].
fn match_global(votes: &mut Votes, level: &Level, alpha: f32) {
    let soft = &votes.soft;
    let table = |k: usize| {
        let alpha = if k == CONTRAST { alpha.max(CONTRAST_PULL) } else { alpha };
        let table = || level.quantiles[k].matching_table(&Counts::of_channel(soft, k), alpha);
        (alpha > 0.0).then(|| (k, table()))
    };
    let tables: Vec<(usize, Vec<u16>)> = (0..4).into_par_iter().filter_map(table).collect();
    votes.soft.par_chunks_mut(votes.width).for_each(|row| {
        for (k, table) in &tables {
            row.iter_mut().for_each(|px| px[*k] = table[usize::from(px[*k])]);
        }
    });
}

/// The votes as codes, `rows` x `cols` of them starting at (`y0`, `x0`), which wrap around.
fn rounded_codes(
    votes: &Votes,
    (y0, x0): (isize, isize),
    (rows, cols): (usize, usize),
) -> MatchImage {
    let from =
        |i: usize, start: isize, n: usize| (i as isize + start).rem_euclid(n as isize) as usize;
    let mut image = MatchImage::new(rows, cols);
    image.fill_rows(|y, row| {
        let line = &votes.soft[from(y, y0, votes.height) * votes.width..][..votes.width];
        let mut x = from(0, x0, votes.width);
        for px in row {
            *px = line[x].map(|v| ((v + (1 << (SOFT_BITS - 1))) >> SOFT_BITS) as u8);
            x += 1;
            if x == votes.width {
                x = 0;
            }
        }
    });
    image
}

/// The search's target: the texture with an apron of `patch - 1`, wrapped or voted.
fn canvas(votes: &Votes, plan: &Plan, (h, w): (usize, usize)) -> MatchImage {
    let apron = |wrap: bool| if wrap { -((plan.patch / 2) as isize) } else { 0 };
    let size = (h + plan.patch - 1, w + plan.patch - 1);
    rounded_codes(votes, (apron(plan.wrap.y), apron(plan.wrap.x)), size)
}

/// The texture without any apron.
fn without_apron(votes: &Votes, plan: &Plan, size: (usize, usize)) -> MatchImage {
    let start = |wrap: bool| if wrap { 0 } else { (plan.patch / 2) as isize };
    rounded_codes(votes, (start(plan.wrap.y), start(plan.wrap.x)), size)
}
