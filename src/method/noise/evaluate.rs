//! [`Evaluator`]: a document made ready to give values.

use std::sync::{Arc, OnceLock};

use pulp::Arch;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::method::noise::colour::Colours;
use crate::method::noise::document::{Document, Model, Term};
use crate::method::noise::points::{PlaneNoise, SolidNoise, axes};
use crate::method::noise::shape::Shape;
use crate::method::noise::tiling::table::Places;
use crate::method::noise::tiling::{Layout, Tiling};
use crate::signal::wavelet_noise::{BLOCK, Solid, Torus};

/// How bands that a sample cannot hold are treated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter {
    /// Distance of samples in pixels of the photo: bands fade as they reach its Nyquist limit. 0 keeps
    /// all bands.
    pub footprint: f64,
    /// Whether the bands that remain are strengthened so that the contrast stays.
    pub keep_contrast: bool,
}

impl Filter {
    /// All bands as they are.
    pub const NONE: Self = Self { footprint: 0.0, keep_contrast: false };
}

/// A document made ready to give values at points.
#[derive(Debug, Clone)]
pub struct Evaluator {
    document: Document,
    pub(super) terms: Vec<Term>,
    pub(super) tori: Vec<Arc<Torus>>,
    /// Instead of terms, of a texture that is tiled.
    pub(super) tiling: Option<Tiling>,
    /// Of each term, for points in space.
    solids: OnceLock<Vec<Arc<Solid>>>,
    /// Variance of each term's noise at the photo's pixels.
    at_pixels: Vec<f64>,
    pub(super) channels: Vec<ChannelEvaluator>,
    pub(super) mean: Vec<f32>,
    pub(super) matrix: Vec<Vec<f32>>,
    /// Cosine and sine of the directions' angle.
    pub(crate) turn: Option<[f64; 2]>,
}

/// An independent channel made ready.
#[derive(Debug, Clone)]
pub(super) struct ChannelEvaluator {
    weights: Vec<f32>,
    pub(super) offsets: Vec<[f64; 3]>,
    /// Variance of each band at the photo's pixels, with its weight.
    variances: Vec<f64>,
    pub(super) shape: Option<Shape>,
}

/// A channel's weights under a filter, and what brings its noise into shape.
#[derive(Debug, Clone)]
pub(crate) struct Filtered {
    /// Of each term.
    pub(crate) weights: Vec<f32>,
    /// From noise to standard deviations; 0 for no noise at all.
    pub(crate) per_deviation: f32,
    /// Standard deviation of what the filter took away, in those of all.
    pub(super) lost: f32,
    /// Level of a tiled texture's input.
    level: f32,
}

impl Evaluator {
    /// Of a valid document.
    pub fn new(document: Document) -> Self {
        let terms = document.terms();
        let tori = terms.iter().map(|t| Torus::shared(t.detail)).collect();
        let at_pixels = document.variances();
        let channels = document.channels().iter().enumerate().map(|(c, channel)| {
            let offset = |(t, term): (usize, &Term)| {
                let [x, y] = term.levels;
                document.offset(t, [x, y, x], c).map(f64::from)
            };
            ChannelEvaluator {
                weights: channel.weights.iter().map(|&w| w as f32).collect(),
                offsets: terms.iter().enumerate().map(offset).collect(),
                variances: channel.weights.iter().zip(&at_pixels).map(|(w, v)| w * w * v).collect(),
                shape: channel.histogram.as_ref().map(|values| {
                    let values = std::array::from_fn(|i| values[i]);
                    Shape::new(&values)
                }),
            }
        });
        let channels: Vec<ChannelEvaluator> = channels.collect();
        let tiling = match &document.model {
            Model::Tiling { layout, .. } => Tiling::new(layout, channels.len()),
            _ => None,
        };
        let turn = match &document.model {
            Model::Oriented { angle, .. } if *angle != 0.0 => {
                let radians = angle.to_radians();
                Some([libm::cos(radians), libm::sin(radians)])
            }
            _ => None,
        };
        Self {
            channels,
            tiling,
            mean: document.mean.iter().map(|&v| v as f32).collect(),
            matrix: document.matrix.iter().map(|r| r.iter().map(|&v| v as f32).collect()).collect(),
            terms,
            tori,
            solids: OnceLock::new(),
            at_pixels,
            turn,
            document,
        }
    }

    /// Number of tiles that [`Evaluator::periodic`] chooses; 0 for noise.
    pub fn periodic_tiles(&self, period: [f64; 2]) -> usize {
        self.tiling.as_ref().map_or(0, |tiling| tiling.count(period))
    }

    /// Steps of progress that [`Evaluator::periodic`] takes.
    pub fn periodic_steps(&self, period: [f64; 2]) -> u64 {
        self.tiling.as_ref().map_or(0, |tiling| tiling.steps(period))
    }

    /// For a tiled texture one that goes round after `period` pixels of the photo along x and y; noise goes
    /// round by [`raster`](super::raster::render) alone.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn periodic(&self, ctx: &Ctx, period: [f64; 2]) -> Result<Self> {
        let around =
            |tiling: &Tiling| tiling.periodic(ctx, period, &self.deviations(), self.document.seed);
        Ok(Self { tiling: self.tiling.as_ref().map(around).transpose()?, ..self.clone() })
    }

    /// Layout, places and deviations by level of a tiled texture.
    pub(crate) fn tiled(&self) -> Option<(&Layout, Places, &[Vec<f64>])> {
        let Model::Tiling { layout, .. } = &self.document.model else { return None };
        let tiling = self.tiling.as_ref()?;
        Some((layout, layout.places()?, tiling.deviations()))
    }

    /// What it was made of.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Number of channels of a value.
    pub fn channels(&self) -> usize {
        self.mean.len()
    }

    /// What brings independent channel `c` into shape.
    pub(crate) fn shape(&self, c: usize) -> Option<&Shape> {
        self.channels[c].shape.as_ref()
    }

    /// The weights of every independent channel under `filter`.
    pub(crate) fn filtered(&self, filter: Filter) -> Vec<Filtered> {
        if let Some(tiling) = &self.tiling {
            return self.tiles_filtered(tiling, filter);
        }
        let kept: Vec<f64> = self.terms.iter().map(|t| kept(t, filter.footprint)).collect();
        let of = |channel: &ChannelEvaluator| {
            let total: f64 = channel.variances.iter().sum();
            let left: f64 = channel.variances.iter().zip(&kept).map(|(v, k)| v * k * k).sum();
            // Where nothing is left there is nothing to strengthen.
            let keep = filter.keep_contrast && left > 0.0;
            let gain = if keep { (total / left).sqrt() } else { 1.0 };
            let lost = if keep { 0.0 } else { (total - left).max(0.0) };
            let weight = |(w, k): (&f32, &f64)| (f64::from(*w) * k * gain) as f32;
            Filtered {
                weights: channel.weights.iter().zip(&kept).map(weight).collect(),
                per_deviation: if total > 0.0 { total.sqrt().recip() as f32 } else { 0.0 },
                lost: if total > 0.0 { (lost / total).sqrt() as f32 } else { 0.0 },
                level: 0.0,
            }
        };
        self.channels.iter().map(of).collect()
    }

    fn tiles_filtered(&self, tiling: &Tiling, filter: Filter) -> Vec<Filtered> {
        let kept = tiling.kept(filter.footprint);
        let of = |(channel, deviation): (&ChannelEvaluator, &f64)| {
            let left = kept.fade * deviation;
            let keep = filter.keep_contrast && left > 0.0;
            let gain = if keep { kept.fade / left } else { kept.fade };
            let weight = channel.weights[0];
            Filtered {
                weights: vec![(f64::from(weight) * gain) as f32],
                per_deviation: if weight > 0.0 { weight.recip() } else { 0.0 },
                lost: if keep { 0.0 } else { (1.0 - left * left).max(0.0).sqrt() as f32 },
                level: kept.level,
            }
        };
        self.channels.iter().zip(&kept.deviations).map(of).collect()
    }

    /// Values at points (x, y): every channel, with full scale 1, not clipped.
    ///
    /// The same bits as [`raster`](super::raster::render) gives at those of its pixels' middles.
    pub fn plane(&self, points: &[[f64; 2]], filter: Filter, out: &mut [f32]) {
        let filtered = self.filtered(filter);
        if let Some(tiling) = &self.tiling {
            let mut one = vec![0.0; self.channels.len()];
            let mut known = None;
            self.blocks(points, &filtered, out, |_, points, noise| {
                for (i, point) in points.iter().enumerate() {
                    tiling.at(*point, filtered[0].level, &mut known, &mut one);
                    for ((noise, one), f) in noise.iter_mut().zip(&one).zip(&filtered) {
                        noise[i] = one * f.weights[0];
                    }
                }
            });
            return;
        }
        self.blocks(points, &filtered, out, |_, points, noise| {
            let points = &axes(points.iter().map(|point| self.turned(*point)));
            let block = PlaneNoise { evaluator: self, filtered: &filtered, points, noise };
            Arch::new().dispatch(block);
        });
    }

    /// Standard deviations of the independent channels.
    fn deviations(&self) -> Vec<f64> {
        self.channels.iter().map(|channel| channel.variances.iter().sum::<f64>().sqrt()).collect()
    }

    /// The channels at points, of whose noise `add_noise` makes a block at a time; it is told which point is
    /// the first.
    fn blocks<P>(
        &self,
        points: &[P],
        filtered: &[Filtered],
        out: &mut [f32],
        mut add_noise: impl FnMut(usize, &[P], &mut [[f32; BLOCK]]),
    ) {
        let mut noise = vec![[0.0; BLOCK]; self.channels.len()];
        let blocks = points.chunks(BLOCK).zip(out.chunks_mut(BLOCK * self.channels()));
        for (k, (points, out)) in blocks.enumerate() {
            noise.as_flattened_mut().fill(0.0);
            add_noise(k * BLOCK, points, &mut noise);
            let noise = noise.as_flattened_mut();
            Arch::new().dispatch(Colours { evaluator: self, filtered, noise, out });
        }
    }

    /// A point in the directions of the noise.
    pub(super) fn turned(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        self.turn.map_or([x, y], |[c, s]| [c * x + s * y, c * y - s * x])
    }

    /// Values at points (x, y, z) of a solid texture; on a surface if its unit normals are given, one for
    /// each point: then without the low frequencies that a cut through a solid has.
    ///
    /// Only of isotropic noise.
    pub fn solid(
        &self,
        points: &[[f64; 3]],
        normals: Option<&[[f64; 3]]>,
        filter: Filter,
        out: &mut [f32],
    ) {
        let solids = self
            .solids
            .get_or_init(|| self.terms.iter().map(|t| Solid::shared(t.detail)).collect());
        let filtered = self.filtered(filter);
        // As strong as the bands are at the photo's pixels.
        let gains: Vec<f32> = self.at_pixels.iter().map(|v| v.sqrt() as f32).collect();
        self.blocks(points, &filtered, out, |first, points, noise| {
            let normals = normals.map(|normals| &normals[first..][..points.len()]);
            let points = &axes(points.iter().copied());
            let (filtered, gains) = (&filtered, &gains);
            let block =
                SolidNoise { evaluator: self, filtered, solids, gains, points, normals, noise };
            Arch::new().dispatch(block);
        });
    }
}

/// Position of `at`, in pixels, on the torus of a band. The middle of the photo's first pixel is a
/// coefficient of the finest band.
#[inline(always)]
pub(super) fn position(at: f64, offset: f64, level: u32) -> f64 {
    // Exact but for the sum: the divisor is a power of two.
    (at - 0.5 + offset) / f64::from(1u32 << level)
}

/// What share of a band is kept when samples are `footprint` apart: all up to where its highest frequency
/// is the Nyquist limit, nothing from where its lowest is.
fn kept(term: &Term, footprint: f64) -> f64 {
    let finest = f64::from(term.levels[0].min(term.levels[1]));
    if footprint <= 0.0 {
        return 1.0;
    }
    let t = (1.0 + finest - libm::log2(footprint)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
