//! Rarity: how far each place of a picture is from looking like any other place of it.
//!
//! A black dot, a leaf, a nail: a stationary texture has no place for what the photo shows once. In
//! the search such a patch wins wherever it has been copied, because the copy looks like it and
//! nothing else does. Its distance to the patch most like it elsewhere is by how much it wins; that,
//! as a cost, gives the others a chance.

use crate::base::ctx::Ctx;
use crate::base::rng::Rng;
use crate::search::field::Pos;
use crate::search::patch::{Kernel, WithKernel, with_kernel};
use crate::search::place_cost::{ELSEWHERE, PlaceCost};
use crate::search::source::Source;

/// Patch comparisons for one picture, about.
const COMPARISONS: usize = 1 << 17;

/// Share of the patches that is not rare.
const COMMON: f64 = 0.75;

/// By how much each place's distance to the patch most like it (that does not overlap it) exceeds
/// what is common in this picture. Where the places are too many to compare with all others, with
/// a random few.
///
/// # Determinism
/// Depends on the source alone, so that tiles of several seeds share it.
pub fn rarity(ctx: &Ctx, source: &Source) -> PlaceCost {
    const STAGE: u32 = 6;
    let n = (COMPARISONS / PlaceCost::free(source).n_cells()).max(64);
    let picture = |pos: Pos| {
        let view = source.atlas.view_at(pos.y(), pos.x());
        view.map(|view| source.atlas.views()[view].picture)
    };
    let n_pictures = source.atlas.views().last().map_or(1, |view| view.picture + 1);
    // Of several photos, what is rare in its own: a small photo is not rare as a whole.
    let mut others = vec![Vec::new(); n_pictures];
    for i in 0..n * n_pictures {
        let pos = source.random(&mut Rng::new(0, STAGE, 0, i as u64));
        if let Some(picture) = picture(pos) {
            others[picture].push(pos);
        }
    }
    let within = |(own, others): (usize, &Vec<Pos>)| {
        PlaceCost::of_each(source, |pos| match picture(pos) {
            Some(picture) if picture == own => {
                with_kernel(ctx.simd, source.patch, Nearest { source, pos, others })
            }
            _ => ELSEWHERE,
        })
        .excess_over(COMMON)
    };
    let each = others.iter().enumerate().map(within);
    each.reduce(|all, one| all.plus(1.0, &one)).unwrap_or_else(|| PlaceCost::free(source))
}

/// Distance to the nearest of `others` that does not overlap; 0 if there is none.
struct Nearest<'a> {
    source: &'a Source,
    pos: Pos,
    others: &'a [Pos],
}

impl WithKernel for Nearest<'_> {
    type Output = i32;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> i32 {
        let Self { source, pos, others } = self;
        if !source.is_usable(pos) {
            return 0;
        }
        let mut query = kernel.query();
        kernel.hold(&mut query, &source.image, source.at(pos));
        let mut nearest = i32::MAX;
        for &other in others {
            let apart = other.y().abs_diff(pos.y()).max(other.x().abs_diff(pos.x()));
            if apart >= source.patch {
                nearest = nearest.min(kernel.distance(&query, &source.image, source.at(other)));
            }
        }
        if nearest == i32::MAX { 0 } else { nearest }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::patch::{MatchImage, distance_squared};

    fn source() -> Source {
        let mut image = MatchImage::new(90, 100);
        image.fill_rows(|y, row| {
            for (x, px) in row.iter_mut().enumerate() {
                let noise = Rng::new(1, 0, 0, (y * 100 + x) as u64).next_u32().to_le_bytes();
                let dot = (40..46).contains(&y) && (60..66).contains(&x);
                *px = if dot { [120; 4] } else { noise.map(|v| 20 + v % 8) };
            }
        });
        Source::new(image, 9, None).expect("large enough")
    }

    /// By the definition: the nearest patch of all that do not overlap, and what is common.
    #[test]
    fn a_dot_is_rare_and_grain_is_not() {
        let source = source();
        let rarity = rarity(&Ctx::new(0, 2).expect("pool"), &source);
        let exact = |pos: Pos| {
            let all = (0..source.rows() * source.cols())
                .map(|i| Pos::new(i / source.cols(), i % source.cols()))
                .filter(|o| o.y().abs_diff(pos.y()).max(o.x().abs_diff(pos.x())) >= 9);
            let image = &source.image;
            let distance = |o| distance_squared(image, source.at(pos), image, source.at(o), 9);
            all.map(distance).min().expect("some")
        };
        // Middles of cells. The dot has 36 of the patch's 81 pixels, each about 96 codes off.
        let (on, off) = (Pos::new(38, 58), Pos::new(10, 10));
        let (rare, common) = (exact(on), exact(off));
        assert!(rare > 50 * common, "{rare} and {common}");
        let cost = rarity.of(on);
        assert!((cost - rare).abs() < rare / 20, "cost {cost}, exactly {}", rare - common);
        assert!(rarity.of(off) < common / 4, "grain costs {}", rarity.of(off));
    }

    #[test]
    fn a_source_smaller_than_two_patches_has_no_rare_places() {
        let source = Source::new(MatchImage::new(12, 12), 9, None).expect("one patch fits");
        assert_eq!(rarity(&Ctx::new(0, 1).expect("pool"), &source).of(Pos::new(2, 1)), 0);
    }
}
