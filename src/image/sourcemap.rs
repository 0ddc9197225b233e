//! [`SourceMap`]: for every output pixel the source pixel it is a copy of.

use crate::base::error::{Error, Result};
use crate::image::material::MapKind;
use crate::image::picture::{Picture, Sample};
use crate::with_samples;

/// Where every pixel of a texture comes from: the result that all pictures are made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceMap {
    height: usize,
    width: usize,
    source_height: usize,
    source_width: usize,
    yx: Vec<[u32; 2]>,
}

impl SourceMap {
    /// A map from its positions `[y, x]`, row by row.
    ///
    /// # Errors
    /// [`Error::BadPicture`] if a side is zero, the number of positions is not `height * width`,
    /// or a position lies outside the source.
    pub fn new(
        (height, width): (usize, usize),
        (source_height, source_width): (usize, usize),
        yx: Vec<[u32; 2]>,
    ) -> Result<Self> {
        let bad = |reason| Err(Error::BadPicture { what: "source map".into(), reason });
        if height == 0 || width == 0 || height.checked_mul(width) != Some(yx.len()) {
            return bad(format!("{} positions do not make {width}x{height} pixels", yx.len()));
        }
        let outside =
            |p: &&[u32; 2]| p[0] as usize >= source_height || p[1] as usize >= source_width;
        if let Some([y, x]) = yx.iter().find(outside) {
            return bad(format!(
                "position row {y}, column {x} lies outside its {source_width}x{source_height} source"
            ));
        }
        Ok(Self { height, width, source_height, source_width, yx })
    }

    /// Height of the output in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Width of the output in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height and width of the source in pixels.
    pub fn source_size(&self) -> (usize, usize) {
        (self.source_height, self.source_width)
    }

    /// The positions `[y, x]`, row by row.
    pub fn positions(&self) -> &[[u32; 2]] {
        &self.yx
    }

    /// Gathers `map` through the source map: output pixel (y, x) is the map's pixel at
    /// `positions()[y * width + x]`, bit for bit.
    ///
    /// A map of another size than the source (but the same shape) is read bilinearly at the
    /// corresponding places. Normal maps ([`MapKind::Normal`]) come out with unit length.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`] if the map's aspect ratio is not the source's.
    pub fn apply(&self, map: &Picture, kind: MapKind) -> Result<Picture> {
        let (h, w, c) = (map.height(), map.width(), map.channels());
        // One pixel of rounding is allowed, as resizing leaves it.
        let same_shape = (h * self.source_width).abs_diff(w * self.source_height)
            <= self.source_width.max(self.source_height);
        if !same_shape {
            return Err(Error::SizeMismatch {
                what: "the map".into(),
                got_w: w,
                got_h: h,
                want_w: self.source_width,
                want_h: self.source_height,
                remedy: "a map must show the same picture as the photo the source map was made \
                         from, at any resolution but the same aspect ratio"
                    .into(),
            });
        }
        let same_size = (h, w) == self.source_size();
        let samples = with_samples!(map.samples(), v => if same_size {
            gather(&self.yx, v, w, c)
        } else {
            gather_bilinear(&self.yx, v, (h, w, c), self.source_size())
        });
        let out = map.with_samples(self.height, self.width, c, samples)?;
        if kind == MapKind::Normal { crate::image::material::renormalize(out) } else { Ok(out) }
    }
}

fn gather<T: Sample>(
    yx: &[[u32; 2]],
    v: &[T],
    w: usize,
    c: usize,
) -> crate::image::picture::Samples {
    let mut out = Vec::with_capacity(yx.len() * c);
    for &[y, x] in yx {
        let at = (y as usize * w + x as usize) * c;
        out.extend_from_slice(&v[at..at + c]);
    }
    T::wrap(out)
}

fn gather_bilinear<T: Sample>(
    yx: &[[u32; 2]],
    v: &[T],
    (h, w, c): (usize, usize, usize),
    (sh, sw): (usize, usize),
) -> crate::image::picture::Samples {
    // Pixel centres correspond: (p + 0.5) / source = (q + 0.5) / map.
    let place = |p: u32, n: usize, source: usize| {
        let q = ((p as f64 + 0.5) * n as f64 / source as f64 - 0.5).clamp(0.0, (n - 1) as f64);
        let low = q as usize;
        (low, (low + 1).min(n - 1), q - low as f64)
    };
    let mut out = Vec::with_capacity(yx.len() * c);
    for &[y, x] in yx {
        let (y0, y1, fy) = place(y, h, sh);
        let (x0, x1, fx) = place(x, w, sw);
        for k in 0..c {
            let at = |y: usize, x: usize| v[(y * w + x) * c + k].to_unit();
            let top = at(y0, x0) * (1.0 - fx) + at(y0, x1) * fx;
            let bottom = at(y1, x0) * (1.0 - fx) + at(y1, x1) * fx;
            out.push(T::from_unit(top * (1.0 - fy) + bottom * fy));
        }
    }
    T::wrap(out)
}
