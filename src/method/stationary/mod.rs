//! Stationary tiles: PatchMatch on the torus with stationarity projection.
//!
//! Moritz, James, Haines, Ritschel, Weyrich: Texture Stationarization (2017), Algorithm 1. The
//! same loop without wrap or without projection gives the baselines.

mod level;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::image::sourcemap::SourceMap;
use crate::search::field::Field;
use crate::search::patch::MatchImage;
use crate::search::patchmatch::{self, Search, Usage, Wrap};
use crate::search::seams;
use crate::search::vote::{Votes, vote};
use crate::signal::histogram::{Bins, Distribution};
use crate::signal::localhist::{self, Domain, Pixel};

use level::{Codes, Level};

/// Channel that holds local contrast; the three before it are the colour.
const CONTRAST: usize = 3;

/// Share by which the contrast is pulled back to the exemplar's in every iteration. Averaging votes
/// drift towards smooth places; without this pull fine detail dies out (sharpness of the gallery's
/// concrete falls to half the photo's), and at 1 outliers come back.
const CONTRAST_PULL: f32 = 0.5;

/// Sweeps of the seam placement; after four hardly a pixel moves.
const SEAM_SWEEPS: u32 = 4;

/// What to make, and how hard to try.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Height and width of the output in pixels.
    pub size: (usize, usize),
    /// Which axes wrap.
    pub wrap: Wrap,
    /// Standard deviation of the stationarity window as a fraction of the shorter side; `None`
    /// leaves the projection out.
    pub sigma: Option<f32>,
    /// Patch side.
    pub patch: usize,
    /// Weight of spatial uniformity.
    pub uniformity: f32,
    /// Iterations at the coarsest level.
    pub coarse_iterations: u32,
    /// Iterations at each other level.
    pub fine_iterations: u32,
}

/// Synthesizes a texture from `photo`: where every output pixel comes from.
///
/// # Errors
/// See [`tile`](crate::tile).
pub fn run(ctx: &Ctx, photo: &Picture, mask: Option<&Mask>, plan: &Plan) -> Result<SourceMap> {
    let levels = level::build(photo, mask, plan)?;
    let n_coarse = levels.len() - 1;
    let iterations = |j: usize| {
        if j == n_coarse { plan.coarse_iterations } else { plan.fine_iterations }
    };
    let work: u64 = levels
        .iter()
        .enumerate()
        .map(|(j, l)| u64::from(iterations(j)) * (l.size.0 * l.size.1) as u64)
        .sum();
    ctx.begin(work);
    let mut pass = 0;
    let mut field: Option<Field> = None;
    for (j, level) in levels.iter().enumerate().rev() {
        let (h, w) = level.size;
        let mut f = match field.take() {
            None => Field::random(h, w, &level.source, ctx.seed),
            Some(coarse) => coarse.upsampled(h, w, &level.source, ctx.seed),
        };
        let coarsest = j == n_coarse;
        for i in 0..iterations(j) {
            let mut pixels = Pixels::voted(ctx, &f, level, plan.wrap);
            let fade = 1.0 - (i + 1) as f32 / iterations(j) as f32;
            pixels.match_global(level, if coarsest { fade } else { 0.0 });
            if let Some(sigma) = plan.sigma {
                let sigma = sigma as f64 * h.min(w) as f64;
                localhist::project(&mut pixels.lab, pixels.domain, sigma);
            }
            let target = pixels.target(level, plan);
            let usage = Usage::of(&f, &level.source, plan.uniformity * level.usage_unit);
            let search = if coarsest {
                Search { pass, radius: 0, n_random: 8 }
            } else {
                Search { pass, radius: 64, n_random: 4 }
            };
            patchmatch::pass(ctx, &target, &level.source, &usage, plan.wrap, search, &mut f)?;
            pass += 1;
        }
        field = Some(f);
    }
    let field = field.expect("there is at least one level");
    let half = plan.patch / 2;
    let finest = &levels[0];
    let mut yx: Vec<seams::From> =
        field.pos.iter().map(|p| [(p.y() + half) as u32, (p.x() + half) as u32]).collect();
    let pixels = Pixels::voted(ctx, &field, finest, plan.wrap);
    let target = pixels.delivered(finest, plan);
    let canvas = seams::Canvas {
        source: &finest.source.image,
        usable: mask.map(Mask::usable),
        target: &target,
        wrap: plan.wrap,
    };
    seams::settle(ctx, &canvas, &mut yx, SEAM_SWEEPS)?;
    SourceMap::new(plan.size, (photo.height(), photo.width()), yx)
}

/// Peak memory of [`run`] besides the photo itself, for a photo and an output of these sizes
/// (height, width), in bytes; generous by a quarter.
pub fn memory_bytes(photo: (usize, usize), output: (usize, usize)) -> u64 {
    // Per photo pixel: linear light and L*a*b* in floats (12 + 16 + 16), contrast 4, and the
    // pyramid's codes and norms, 8 bytes times 1 / (1 - 1.3^-2).
    const PHOTO: u64 = 76;
    // Per output pixel: two fields 8, votes 8, L*a*b* 16, canvas 4, source map and sweeps 32.
    const OUTPUT: u64 = 80;
    let pixels = |(h, w): (usize, usize)| h as u64 * w as u64;
    (PHOTO * pixels(photo) + OUTPUT * pixels(output)) / 4 * 5
}

/// The current texture in L*a*b*, with an apron on the axes that do not wrap.
struct Pixels {
    lab: Vec<Pixel>,
    domain: Domain,
}

impl Pixels {
    fn voted(ctx: &Ctx, field: &Field, level: &Level, wrap: Wrap) -> Self {
        use rayon::prelude::*;
        let votes: Votes = vote(ctx.simd, field, &level.source, wrap);
        let domain =
            Domain { height: votes.height, width: votes.width, wrap_y: wrap.y, wrap_x: wrap.x };
        let codes = &level.codes;
        let lab = (0..votes.sums.len())
            .into_par_iter()
            .map(|i| {
                let count = votes.count(i / votes.width, i % votes.width) as f32;
                codes.lab(votes.sums[i].map(|s| s as f32 / count))
            })
            .collect();
        Self { lab, domain }
    }

    /// Moves each channel's values towards the exemplar's distribution: `Q_target = alpha Q_e +
    /// (1 - alpha) Q_f`.
    fn match_global(&mut self, level: &Level, alpha: f32) {
        use rayon::prelude::*;
        for k in 0..4 {
            let alpha = if k == CONTRAST { alpha.max(CONTRAST_PULL) } else { alpha };
            let bins = Bins::covering(self.lab.iter().map(|px| px[k]), 256);
            let own = Distribution::of(self.lab.iter().map(|px| px[k]), bins);
            let quantiles = &level.quantiles[k];
            self.lab.par_iter_mut().for_each(|px| {
                let wanted = quantiles.at(own.share_below(px[k]));
                px[k] += alpha * (wanted - px[k]);
            });
        }
    }

    /// The texture as codes, without apron.
    fn delivered(&self, level: &Level, plan: &Plan) -> MatchImage {
        let ((h, w), half) = (level.size, plan.patch / 2);
        let y0 = if plan.wrap.y { 0 } else { half };
        let x0 = if plan.wrap.x { 0 } else { half };
        let mut image = MatchImage::new(h, w);
        image.fill_rows(|y, row| {
            let from = &self.lab[(y + y0) * self.domain.width + x0..];
            row.iter_mut().zip(from).for_each(|(px, &lab)| *px = level.codes.encode(lab));
        });
        image
    }

    /// The texture as codes on the canvas, apron included.
    fn target(&self, level: &Level, plan: &Plan) -> MatchImage {
        let ((h, w), n) = (level.size, plan.patch);
        let half = n / 2;
        let mut target = MatchImage::new(h + n - 1, w + n - 1);
        let codes: &Codes = &level.codes;
        target.fill_rows(|y, row| {
            let from = |i: usize, n: usize, wrap: bool| {
                if wrap { (i + n * half - half) % n } else { i }
            };
            let y = from(y, h, plan.wrap.y);
            for (x, px) in row.iter_mut().enumerate() {
                let x = from(x, w, plan.wrap.x);
                *px = codes.encode(self.lab[y * self.domain.width + x]);
            }
        });
        target
    }
}
