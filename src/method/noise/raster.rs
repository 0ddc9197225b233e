//! [`render`]: pictures of a procedural texture.

use std::ops::Range;
use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::method::noise::colour::Colours;
use crate::method::noise::document::{MOST_CHANNELS, Term};
use crate::method::noise::evaluate::{Evaluator, Filter, position};
use crate::signal::wavelet_noise::{Row, Torus, hash};

/// Which part of a texture is rendered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Rows and columns.
    pub size: (usize, usize),
    /// Distance of pixels, in pixels of the photo.
    pub scale: f64,
    /// Where the picture's upper left corner lies (x, y), in pixels of the photo.
    pub origin: [f64; 2],
    /// Whether it goes round: right fits left and bottom fits top. Such a texture is another one than
    /// that which does not, with the same statistics; bands coarser than a quarter of it are left out.
    pub tileable: bool,
}

/// A torus of fewer coefficients a side holds so few waves that channels would be seen to share them.
const OWN: usize = 64;

/// The coefficients of a term and where pixels lie on them.
struct Grid {
    /// Of every channel.
    tori: Vec<Arc<Torus>>,
    /// Coefficients to a pixel of the photo, along x and y; of a texture that need not go round the
    /// inverse of a power of two.
    per_pixel: Option<[f64; 2]>,
}

/// Renders these rows of `view`, a step of progress to each: row by row, for every pixel all channels, with
/// full scale 1, not clipped. The same bits whichever rows are rendered together.
///
/// A tiled texture goes round if its evaluator does: see [`Evaluator::periodic`].
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn render(
    ctx: &Ctx,
    evaluator: &Evaluator,
    view: &View,
    rows: Range<usize>,
    filter: Filter,
) -> Result<Vec<f32>> {
    let cols = view.size.1;
    let channels = evaluator.channels();
    let mut out = vec![0.0; rows.len() * cols * channels];
    let at = |i: usize, axis: usize| view.origin[axis] + (i as f64 + 0.5) * view.scale;
    if evaluator.turn.is_some() || evaluator.tiling.is_some() {
        // Not along the axes: point by point.
        let lines = out.par_chunks_mut(cols * channels).enumerate();
        return lines
            .try_for_each(|(y, line)| {
                ctx.step(1)?;
                let y = rows.start + y;
                let points: Vec<_> = (0..cols).map(|x| [at(x, 0), at(y, 1)]).collect();
                evaluator.plane(&points, filter, line);
                Ok(())
            })
            .map(|()| out);
    }
    let filtered = evaluator.filtered(filter);
    let grids = grids(evaluator, view);
    let place =
        |at: f64, axis: usize, offset: f64, term: usize| match grids[term].as_ref()?.per_pixel {
            None => Some(position(at, offset, evaluator.terms[term].levels[axis])),
            // The offset is in pixels of a band as it is in the document.
            Some(per) => Some(
                (at - 0.5) * per[axis] + position(0.5, offset, evaluator.terms[term].levels[axis]),
            ),
        };
    // Where the columns lie, for every channel and term.
    let columns: Vec<Vec<Option<Row>>> = evaluator
        .channels
        .iter()
        .enumerate()
        .map(|(c, channel)| {
            let terms = channel.offsets.par_iter().enumerate();
            let row = |(t, offset): (usize, &[f64; 3])| {
                let n = grids[t].as_ref()?.tori[c].shape().1;
                place(0.5, 0, 0.0, t)?;
                let places = (0..cols).filter_map(|x| place(at(x, 0), 0, offset[0], t));
                Some(Row::new(places, n))
            };
            terms.map(row).collect()
        })
        .collect();
    let lines = out.par_chunks_mut(cols * channels).enumerate();
    lines.try_for_each_init(
        || (vec![0.0; cols * evaluator.channels.len()], Vec::new()),
        |(noise, combined), (y, line)| {
            ctx.step(1)?;
            let y = rows.start + y;
            noise.fill(0.0);
            let rows = evaluator.channels.iter().zip(&filtered).zip(&columns).enumerate();
            for ((c, ((channel, f), columns)), noise) in rows.zip(noise.chunks_mut(cols)) {
                let terms = f.weights.iter().zip(&grids).zip(columns).enumerate();
                for (t, ((&weight, grid), xs)) in terms {
                    let (Some(grid), Some(xs)) = (grid, xs) else { continue };
                    let Some(y) = place(at(y, 1), 1, channel.offsets[t][1], t) else { continue };
                    if weight != 0.0 {
                        let torus = &*grid.tori[c];
                        Arch::new().dispatch(AddRow { torus, xs, y, weight, combined, noise });
                    }
                }
            }
            Arch::new().dispatch(Colours { evaluator, filtered: &filtered, noise, out: line });
            Ok(())
        },
    )?;
    Ok(out)
}

/// A row of noise, with the CPU's widest instructions.
struct AddRow<'a> {
    torus: &'a Torus,
    xs: &'a Row,
    y: f64,
    weight: f32,
    combined: &'a mut Vec<f32>,
    noise: &'a mut [f32],
}

impl WithSimd for AddRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.torus.add_row(self.xs, self.y, self.weight, self.combined, self.noise);
    }
}

/// The coefficients of every term; `None` for one too coarse for a texture that goes round.
fn grids(evaluator: &Evaluator, view: &View) -> Vec<Option<Grid>> {
    let grid = |(t, (term, torus)): (usize, (&Term, &Arc<Torus>))| {
        let channels = evaluator.channels.len();
        if !view.tileable {
            return Some(Grid { tori: vec![torus.clone(); channels], per_pixel: None });
        }
        let (rows, cols) = view.size;
        // The nearest even number of coefficients a period, in as many repetitions as needed.
        let fitting = |pixels: usize, level: u32| {
            let coefficients = pixels as f64 * view.scale / f64::from(1u32 << level);
            let times = (coefficients / Torus::SIDE as f64 - 1e-9).ceil().max(1.0);
            let period = 2.0 * (coefficients / times / 2.0).round();
            (period >= 4.0)
                .then_some((period as usize, period * times / (pixels as f64 * view.scale)))
        };
        let (across, per_x) = fitting(cols, term.levels[0])?;
        let (down, per_y) = fitting(rows, term.levels[1])?;
        let stream = hash(evaluator.document().seed).wrapping_add((t * MOST_CHANNELS) as u32);
        let torus = |c: usize| {
            Arc::new(Torus::even((down, across), term.detail, stream.wrapping_add(c as u32)))
        };
        let tori = if down.min(across) < OWN {
            (0..channels).map(torus).collect()
        } else {
            vec![torus(0); channels]
        };
        Some(Grid { tori, per_pixel: Some([per_x, per_y]) })
    };
    evaluator.terms.par_iter().zip(&evaluator.tori).enumerate().map(grid).collect()
}
