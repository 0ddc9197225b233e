//! The options of a tile beyond size and seed: each does what it says, and fails clearly.

use texforge::{
    Ctx, Error, ErrorKind, Inputs, Mask, Method, Quality, Size, Tile, TileParams, tile, tile_from,
};

use crate::support::Folder;
use crate::support::exemplar::grain;

fn draft(width: usize, height: usize) -> TileParams {
    let size = Size::Pixels { width, height };
    TileParams { size, quality: Quality::Draft, ..Default::default() }
}

fn ctx() -> Ctx {
    Ctx::new(0, 2).expect("pool")
}

fn made(inputs: &Inputs<'_>, params: &TileParams) -> Tile {
    tile_from(&ctx(), inputs, params).expect("a tile")
}

/// Positions of a tile that copies.
fn positions(tile: &Tile) -> &[[u32; 2]] {
    tile.source_map.as_ref().expect("a source map").positions()
}

/// `texforge tile photo.png -o tile.png`, quickly, and these.
fn quick<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let mut args =
        vec!["tile", "photo.png", "-o", "tile.png", "--size", "48", "--quality", "draft"];
    args.extend(more);
    args
}

mod avoiding {
    use super::*;

    fn marks(side: usize, marked: impl Fn(usize, usize) -> bool) -> Mask {
        let marks = (0..side * side).map(|i| marked(i / side, i % side)).collect();
        Mask::new(side, side, marks).expect("marks")
    }

    #[test]
    fn nothing_near_a_mark_is_copied() {
        let photo = grain(80, 80, 1).picture();
        // A line and a dot; an earlier mark hides from the disc of a later one.
        let spots = marks(80, |y, x| (y == 30 && (20..50).contains(&x)) || (y, x) == (60, 9));
        let near = |&[y, x]: &[u32; 2]| {
            let to = |v: u32, u: u32| f64::from(y.abs_diff(v)).hypot(f64::from(x.abs_diff(u)));
            (20..50).map(|u| to(30, u)).fold(to(60, 9), f64::min)
        };
        let plain = made(&Inputs::new(&photo), &draft(64, 64));
        assert!(positions(&plain).iter().any(|p| near(p) <= 7.0), "the marks are in the way");
        for (avoid_grow, method) in [(0, Method::Stationary), (7, Method::WrapOnly)] {
            let params = TileParams { avoid_grow, method, ..draft(64, 64) };
            let inputs = Inputs { avoid: Some(&spots), ..Inputs::new(&photo) };
            let tile = made(&inputs, &params);
            assert!(positions(&tile).iter().all(|p| near(p) > avoid_grow as f64), "{avoid_grow}");
            // The same as the mask that says it in other words.
            let mask = spots.clear_of(avoid_grow);
            let params = TileParams { avoid_grow: 0, ..params };
            let same =
                tile_from(&ctx(), &Inputs { mask: Some(&mask), ..Inputs::new(&photo) }, &params);
            assert!(positions(&tile) == positions(&same.expect("a tile")));
        }
    }

    #[test]
    fn both_masks_count() {
        let photo = grain(80, 80, 1).picture();
        let (left, top) = (marks(80, |_, x| x < 40), marks(80, |y, _| y < 40));
        let inputs = Inputs { mask: Some(&left), avoid: Some(&top), ..Inputs::new(&photo) };
        let tile = made(&inputs, &draft(48, 48));
        assert!(positions(&tile).iter().all(|&[y, x]| x < 40 && y >= 40));
    }

    #[test]
    fn what_leaves_nothing_or_does_not_fit() {
        let photo = grain(60, 60, 1).picture();
        let refusal = |avoid: Option<&Mask>, avoid_grow| {
            let inputs = Inputs { avoid, ..Inputs::new(&photo) };
            let params = TileParams { avoid_grow, ..draft(48, 48) };
            tile_from(&ctx(), &inputs, &params).expect_err("refused")
        };
        let dots = marks(60, |y, x| y % 20 == 10 && x % 20 == 10);
        assert!(tile(&ctx(), &photo, Some(&dots.clear_of(0)), &draft(48, 48)).is_ok());
        assert_eq!(refusal(Some(&dots), 12).kind(), ErrorKind::EmptyMask);
        assert_eq!(refusal(Some(&dots), 10_000).kind(), ErrorKind::EmptyMask);
        let error = refusal(Some(&marks(61, |_, _| false)), 0);
        assert_eq!(error.kind(), ErrorKind::SizeMismatch);
        assert!(error.to_string().starts_with("the avoid mask is 61x61"), "{error}");
        for (avoid, grow) in [(None, 3), (Some(&dots), 10_001)] {
            let error = refusal(avoid, grow);
            assert!(matches!(error, Error::Parameter { name: "avoid_grow", .. }), "{error}");
        }
    }

    #[test]
    fn the_program_takes_marks() {
        let folder = Folder::new();
        folder.rgb_from("photo.png", 96, 96, |x, y| {
            if x < 40 { [255, 0, 0] } else { [20, 100 + (x * y % 100) as u8, 100] }
        });
        folder.mask("left.png", 96, |x, _| x < 30);
        folder.does(&quick(&["--avoid", "left.png", "--avoid-grow", "10"]));
        let tile = folder.png("tile.png");
        assert!(tile.samples.chunks(3).all(|px| px[0] == 20), "an avoided pixel was used");
        folder.does(&quick(&["--avoid", "left.png", "--avoid-grow", "9", "--force"]));
        assert!(folder.png("tile.png") != tile, "one pixel less is another tile");
    }

    #[test]
    fn the_program_refuses_in_one_sentence() {
        let folder = Folder::with_photo();
        folder.mask("small.png", 50, |_, _| false);
        folder.mask("all.png", 96, |_, _| true);
        folder.mask("dot.png", 96, |x, y| (x, y) == (48, 48));
        folder.refuses(&quick(&["--avoid", "small.png"]), 1, "the avoid mask is 50x50");
        folder.refuses(&quick(&["--avoid", "all.png"]), 1, "the mask leaves no");
        let grown = ["--avoid", "dot.png", "--avoid-grow", "70"];
        folder.refuses(&quick(&grown), 1, "the mask leaves no");
        folder.refuses(&quick(&["--avoid-grow", "4"]), 2, "`avoid_grow` must be 0");
        folder.refuses(&quick(&["--avoid", "dot.png", "--avoid-grow", "-1"]), 2, "`avoid_grow`");
        folder.refuses(&quick(&["--avoid", "missing.png"]), 1, "missing.png");
        folder.refuses(
            &["tile", "photo.png", "--avoid", "dot.png", "-o", "dot.png"],
            1,
            "an input",
        );
    }
}
