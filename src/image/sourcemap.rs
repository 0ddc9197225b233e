//! [`SourceMap`]: for every output pixel the source pixel it is a copy of.

use rayon::prelude::*;

use crate::base::error::{Error, Result};
use crate::image::interpolate::{Fraction, PARTS, Reader};
use crate::image::material::MapKind;
use crate::image::normals::{renormalize, turn_normals};
use crate::image::picture::{Picture, Sample, Samples};
use crate::image::symmetry::Symmetry;
use crate::with_samples;

/// The photo that a pixel was copied from, and how that photo was laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Origin {
    /// Which photo, from 0 on.
    pub photo: u16,
    /// How it lay: mirrored, turned.
    pub symmetry: Symmetry,
}

/// Where every pixel of a texture comes from: the result that all pictures are made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceMap {
    height: usize,
    width: usize,
    /// Height and width of each photo.
    sources: Vec<(usize, usize)>,
    yx: Vec<[u32; 2]>,
    /// One a pixel; empty if every pixel is of the only photo, as it lies.
    origins: Vec<Origin>,
    /// How far beside its position each pixel is read; empty if all are copies.
    fractions: Vec<Fraction>,
}

impl SourceMap {
    /// A map from its positions `[y, x]` in one photo, row by row.
    ///
    /// # Errors
    /// [`Error::BadPicture`] if a side is zero, the number of positions is not `height * width`,
    /// or a position lies outside the source.
    pub fn new(
        size: (usize, usize),
        source_size: (usize, usize),
        yx: Vec<[u32; 2]>,
    ) -> Result<Self> {
        Self::of_views(size, vec![source_size], yx, Vec::new())
    }

    /// A map of size (height, width) from its positions `[y, x]` in photos of these sizes (height,
    /// width), row by row, and the origin of each. The positions are those in the photo as it is,
    /// whatever its symmetry. No origins at all mean the only photo, as it lies.
    ///
    /// # Errors
    /// [`Error::BadPicture`], as [`SourceMap::new`], and for origins that do not fit the positions
    /// or name a photo that is not there.
    pub fn of_views(
        (height, width): (usize, usize),
        sources: Vec<(usize, usize)>,
        yx: Vec<[u32; 2]>,
        origins: Vec<Origin>,
    ) -> Result<Self> {
        let bad = |reason| Err(Error::BadPicture { what: "source map".into(), reason });
        if height == 0 || width == 0 || height.checked_mul(width) != Some(yx.len()) {
            return bad(format!("{} positions do not make {width}x{height} pixels", yx.len()));
        }
        let one = origins.is_empty() && sources.len() == 1;
        if !one && origins.len() != yx.len() {
            return bad(format!("{} origins for {} positions", origins.len(), yx.len()));
        }
        let map = Self { height, width, sources, yx, origins, fractions: Vec::new() };
        let source = |i: usize| map.sources.get(usize::from(map.origin(i).photo)).copied();
        let outside = |(i, &[y, x]): (usize, &[u32; 2])| {
            source(i).is_none_or(|(h, w)| y as usize >= h || x as usize >= w)
        };
        if let Some((i, [y, x])) = map.yx.par_iter().enumerate().find_first(|&at| outside(at)) {
            let photo = usize::from(map.origin(i).photo) + 1;
            let Some((h, w)) = source(i) else {
                return bad(format!("photo {photo} of {} is not there", map.sources.len()));
            };
            return bad(format!("position row {y}, column {x} lies outside its {w}x{h} source"));
        }
        Ok(map)
    }

    /// The same, with every pixel read so far beside its position: between pixels, where that is not
    /// nought.
    ///
    /// # Errors
    /// [`Error::BadPicture`] if there is not one fraction a pixel, or pixels have origins.
    pub fn between(self, fractions: Vec<Fraction>) -> Result<Self> {
        if fractions.len() != self.yx.len() || !self.origins.is_empty() {
            let what = "source map".into();
            let reason = format!(
                "{} fractions for {} positions in one photo",
                fractions.len(),
                self.yx.len()
            );
            return Err(Error::BadPicture { what, reason });
        }
        Ok(Self { fractions, ..self })
    }

    /// Height of the output in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Width of the output in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height and width of the (first) source in pixels.
    pub fn source_size(&self) -> (usize, usize) {
        self.sources[0]
    }

    /// Height and width of every source in pixels.
    pub fn source_sizes(&self) -> &[(usize, usize)] {
        &self.sources
    }

    /// The positions `[y, x]`, row by row.
    pub fn positions(&self) -> &[[u32; 2]] {
        &self.yx
    }

    /// The origins, row by row; `None` if every pixel is of the only photo, as it lies.
    pub fn origins(&self) -> Option<&[Origin]> {
        (!self.origins.is_empty()).then_some(&self.origins)
    }

    /// How far beside its position each pixel is read, row by row; `None` if all are copies.
    pub fn fractions(&self) -> Option<&[Fraction]> {
        (!self.fractions.is_empty()).then_some(&self.fractions)
    }

    /// The origin of output pixel `i`.
    #[inline]
    pub fn origin(&self, i: usize) -> Origin {
        self.origins.get(i).copied().unwrap_or_default()
    }

    /// Gathers `map` through the source map of one photo: see [`SourceMap::apply_all`].
    ///
    /// # Errors
    /// As [`SourceMap::apply_all`].
    pub fn apply(&self, map: &Picture, kind: MapKind) -> Result<Picture> {
        self.apply_all(&[map], kind)
    }

    /// Gathers maps, one of each photo, through the source map: output pixel (y, x) is the pixel at
    /// `positions()[y * width + x]` of its photo's map, bit for bit; or, where that has a fraction, what
    /// lies between the pixels around it, in linear light.
    ///
    /// A map of another size than its source (but the same shape) is read bilinearly at the
    /// corresponding places. Normals are mirrored and turned with the photo, and come out with unit
    /// length.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`] if a map's aspect ratio is not its source's; [`Error::BadPicture`] if
    /// there is not one map a photo or they differ in type; [`Error::Parameter`] for
    /// [`MapKind::Normal`] where a photo was turned by a quarter: there one has to know which way
    /// green points.
    pub fn apply_all(&self, maps: &[&Picture], kind: MapKind) -> Result<Picture> {
        self.ensure_maps_fit(maps)?;
        let turned = self.origins.iter().any(|o| o.symmetry.swaps_axes());
        kind.ensure_turnable(turned)?;
        let samples = with_samples!(maps[0].samples(), v => gathered(self, v, maps, kind));
        let first = maps[0];
        let out = first.with_samples(self.height, self.width, first.channels(), samples)?;
        if !kind.is_normal() {
            return Ok(out);
        }
        renormalize(if self.origins.is_empty() {
            out
        } else {
            turn_normals(&out, kind, |i| self.origins[i].symmetry)?
        })
    }

    fn ensure_maps_fit(&self, maps: &[&Picture]) -> Result<()> {
        if maps.len() != self.sources.len() {
            let reason = format!(
                "{} given, {} needed: one for each photo, in their order",
                maps.len(),
                self.sources.len()
            );
            return Err(Error::BadPicture { what: "the maps".into(), reason });
        }
        for (i, (map, &(sh, sw))) in maps.iter().zip(&self.sources).enumerate() {
            let what = if i == 0 { "the map".to_owned() } else { format!("map {}", i + 1) };
            let (h, w) = (map.height(), map.width());
            // One pixel of rounding is allowed, as resizing leaves it.
            if (h * sw).abs_diff(w * sh) > sw.max(sh) {
                return Err(Error::SizeMismatch {
                    what,
                    got_w: w,
                    got_h: h,
                    want_w: sw,
                    want_h: sh,
                    remedy: "a map must show the same picture as the photo the source map was \
                             made from, at any resolution but the same aspect ratio"
                        .into(),
                });
            }
            map.ensure_like(maps[0], &what)?;
        }
        Ok(())
    }
}

/// The samples of every output pixel. `first` are those of the first map and say the type.
fn gathered<T: Sample>(
    source_map: &SourceMap,
    first: &[T],
    maps: &[&Picture],
    kind: MapKind,
) -> Samples {
    let c = maps[0].channels();
    let slices: Vec<&[T]> = maps.iter().map(|m| T::slice(m.samples()).unwrap_or(first)).collect();
    let same_size = |(m, &size): (&&Picture, &(usize, usize))| (m.height(), m.width()) == size;
    let same_size: Vec<bool> = maps.iter().zip(&source_map.sources).map(same_size).collect();
    // Fractions come with one photo only.
    let reader = (!source_map.fractions.is_empty()).then(|| Reader::new(maps[0], slices[0], kind));
    let mut out = vec![T::from_unit(0.0); source_map.yx.len() * c];
    let pixels = out.par_chunks_exact_mut(c).zip(&source_map.yx).enumerate();
    pixels.for_each(|(i, (out, &[y, x]))| {
        let photo = usize::from(source_map.origin(i).photo);
        let (v, w) = (slices[photo], maps[photo].width());
        let fraction = source_map.fractions.get(i).copied().unwrap_or_default();
        let between = reader.as_ref().filter(|_| fraction != [0, 0]);
        if let Some(reader) = between.filter(|_| same_size[photo]) {
            reader.read(out, [y, x], fraction);
        } else if same_size[photo] {
            let at = (y as usize * w + x as usize) * c;
            out.copy_from_slice(&v[at..at + c]);
        } else {
            let size = (maps[photo].height(), w, c);
            let place = |p: u32, k: usize| f64::from(p) + f64::from(fraction[k]) / PARTS as f64;
            read_bilinear(out, v, size, (place(y, 0), place(x, 1)), source_map.sources[photo]);
        }
    });
    T::wrap(out)
}

/// Reads a map at the place that corresponds to one of its source.
fn read_bilinear<T: Sample>(
    out: &mut [T],
    v: &[T],
    (h, w, c): (usize, usize, usize),
    (y, x): (f64, f64),
    (sh, sw): (usize, usize),
) {
    // Pixel centres correspond: (p + 0.5) / source = (q + 0.5) / map.
    let place = |p: f64, n: usize, source: usize| {
        let q = ((p + 0.5) * n as f64 / source as f64 - 0.5).clamp(0.0, (n - 1) as f64);
        let low = q as usize;
        (low, (low + 1).min(n - 1), q - low as f64)
    };
    let (y0, y1, fy) = place(y, h, sh);
    let (x0, x1, fx) = place(x, w, sw);
    for (k, out) in out.iter_mut().enumerate() {
        let at = |y: usize, x: usize| v[(y * w + x) * c + k].to_unit();
        let top = at(y0, x0) * (1.0 - fx) + at(y0, x1) * fx;
        let bottom = at(y1, x0) * (1.0 - fx) + at(y1, x1) * fx;
        *out = T::from_unit(top * (1.0 - fy) + bottom * fy);
    }
}
