//! The coefficients as a picture, for the languages that read a texture.

use super::{ExportFile, Program};
use crate::base::error::Result;
use crate::image::io::{Format, WriteOptions, encode};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Samples};
use crate::signal::wavelet_noise::Torus;

/// A coefficient is stored as the number that this makes of it, which is above 0.
pub(super) fn stored(coefficient: i16) -> u16 {
    (i32::from(coefficient) + 32768) as u16
}

/// `NAME_tile.png`: all tiles, one below the other, in 8 bits, which every program reads unchanged: the
/// stored number's high byte is red, its low byte green.
pub(super) fn tile_picture(name: &str, program: &Program) -> Result<ExportFile> {
    let coefficients = program.tiles.iter().flat_map(|(integers, _)| integers);
    let texels = coefficients.flat_map(|&v| {
        let [high, low] = stored(v).to_be_bytes();
        [high, low, 0]
    });
    let samples = Samples::U8(texels.collect());
    let height = Torus::SIDE * program.tiles.len();
    let picture = Picture::new(height, Torus::SIDE, 3, samples, Encoding::Data)?;
    let bytes = encode(&picture, Format::Png, &WriteOptions::new(MapKind::Data))?;
    Ok(ExportFile { name: format!("{name}_tile.png"), bytes })
}
