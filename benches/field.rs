//! Our nearest-neighbour field as a program, for `benches/peers.py`; not a benchmark by itself.
//!
//! `field TARGET SOURCE WIDTH HEIGHT PASSES RANDOM OUT`: TARGET and SOURCE are raw 8-bit RGB of
//! the same size. OUT gets, for each 11 x 11 patch of TARGET row by row, the row and column of the
//! top left corner of the patch of SOURCE that was found, as little-endian 16-bit numbers.

#![expect(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a program for one script, which sees its panics"
)]

mod common;

use common::{codes, nearest};
use texforge::Ctx;
use texforge::search::source::Source;

const PATCH: usize = 11;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [target, source, width, height, passes, n_random, out] = arguments.as_slice() else {
        println!("field TARGET SOURCE WIDTH HEIGHT PASSES RANDOM OUT: see benches/field.rs");
        return;
    };
    let (width, height): (usize, usize) = (width.parse().unwrap(), height.parse().unwrap());
    let picture = |file: &str| {
        let rgb = std::fs::read(file).unwrap();
        assert_eq!(rgb.len(), width * height * 3, "{file} is not {width} x {height} x 3 bytes");
        codes(height, width, |y, x| {
            let px = &rgb[(y * width + x) * 3..];
            [px[0] / 2, px[1] / 2, px[2] / 2, 0]
        })
    };
    let (passes, n_random) = (passes.parse().unwrap(), n_random.parse().unwrap());
    let (target, source) = (picture(target), Source::new(picture(source), PATCH, None).unwrap());
    let ctx = Ctx::new(0, 1).unwrap();
    let field = ctx.install(|| nearest(&ctx, &target, &source, passes, n_random)).unwrap();
    let bytes: Vec<u8> = field
        .pos
        .iter()
        .flat_map(|p| [p.y() as u16, p.x() as u16])
        .flat_map(u16::to_le_bytes)
        .collect();
    std::fs::write(out, bytes).unwrap();
}
