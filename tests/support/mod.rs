//! Small pictures made by code, folders that notice what is written into them, runs of the program.

pub(crate) mod exemplar;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::Duration;

/// The program under test.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_texforge");

/// A temporary folder in which the program runs.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    /// An empty folder.
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("temporary folder"))
    }

    /// A folder that holds `photo.png`: 96x96, RGB.
    pub(crate) fn with_photo() -> Self {
        let folder = Self::new();
        folder.rgb("photo.png", 96, 96, 1);
        folder
    }

    /// The path of a file in the folder.
    pub(crate) fn at(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes an RGB picture of blotches and grain; another `seed` is another picture.
    pub(crate) fn rgb(&self, name: &str, width: usize, height: usize, seed: u32) {
        self.rgb_from(name, width, height, |x, y| [0, 1, 2].map(|c| texel(x, y, c, seed)));
    }

    /// Writes an RGB picture.
    pub(crate) fn rgb_from(
        &self,
        name: &str,
        width: usize,
        height: usize,
        pixel: impl Fn(u32, u32) -> [u8; 3],
    ) {
        let samples = places(width, height).flat_map(|(x, y)| pixel(x, y)).collect();
        Pixels { width, height, channels: 3, deep: false, samples }.save(&self.at(name));
    }

    /// Writes a 16-bit grey picture.
    pub(crate) fn grey16(&self, name: &str, width: usize, height: usize, seed: u32) {
        let value = |(x, y)| u16::from(texel(x, y, 0, seed)) * 256 + (x * 3 + y) as u16 % 256;
        let samples = places(width, height).flat_map(|at| value(at).to_be_bytes()).collect();
        Pixels { width, height, channels: 1, deep: true, samples }.save(&self.at(name));
    }

    /// Writes a square mask that is white where `usable` says so.
    pub(crate) fn mask(&self, name: &str, side: usize, usable: impl Fn(u32, u32) -> bool) {
        let samples = places(side, side).map(|(x, y)| if usable(x, y) { 255 } else { 0 }).collect();
        Pixels { width: side, height: side, channels: 1, deep: false, samples }
            .save(&self.at(name));
    }

    /// Reads a PNG.
    pub(crate) fn png(&self, name: &str) -> Pixels {
        Pixels::decode(&std::fs::read(self.at(name)).expect("a file"))
    }

    /// Names and contents of all files.
    pub(crate) fn contents(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let entries = std::fs::read_dir(self.0.path()).expect("folder");
        let paths = entries.map(|e| e.expect("entry").path()).filter(|p| p.is_file());
        paths.map(|p| (p.clone(), std::fs::read(&p).unwrap_or_default())).collect()
    }

    /// Names of all files, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let name = |p: &PathBuf| p.file_name().map(|n| n.to_string_lossy().into_owned());
        self.contents().keys().filter_map(name).collect()
    }

    /// Runs the program in the folder.
    pub(crate) fn run(&self, args: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Output {
        assert_cmd::Command::new(PROGRAM)
            .args(args)
            .current_dir(self.0.path())
            // A hang is a failure, not a wait.
            .timeout(Duration::from_secs(120))
            .output()
            .expect("the program runs")
    }

    /// Runs the program and expects success; returns what it says on standard error.
    pub(crate) fn does(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{args:?}: {said}");
        said
    }

    /// Runs the program and expects a refusal: this status, one sentence that holds `needle`, at
    /// most one hint, nothing on standard output, no file touched.
    pub(crate) fn refuses(&self, args: &[&str], status: i32, needle: &str) {
        let before = self.contents();
        let output = self.run(args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(status), "{args:?}: {said}");
        assert!(said.contains(needle), "{args:?} should say `{needle}`: {said}");
        assert!(!said.contains("panicked"), "{args:?}: {said}");
        let sentences = said.lines().filter(|l| l.starts_with("texforge: ")).count();
        let hints = said.lines().filter(|l| l.starts_with("hint: ")).count();
        assert!(sentences == 1 && hints <= 1, "{args:?}: {said}");
        assert!(output.stdout.is_empty(), "{args:?} wrote to standard output");
        assert!(self.contents() == before, "{args:?} touched files: {:?}", self.names());
    }
}

/// What a PNG holds; written and read by the `png` crate, so that the program's own reader and
/// writer are not their only witnesses.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Pixels {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) channels: usize,
    /// 16 bits, most significant byte first.
    pub(crate) deep: bool,
    pub(crate) samples: Vec<u8>,
}

impl Pixels {
    /// Decodes a PNG.
    pub(crate) fn decode(bytes: &[u8]) -> Self {
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().expect("a PNG");
        let mut samples = vec![0; reader.output_buffer_size().expect("fits")];
        let frame = reader.next_frame(&mut samples).expect("pixels");
        samples.truncate(frame.buffer_size());
        Self {
            width: frame.width as usize,
            height: frame.height as usize,
            channels: frame.color_type.samples(),
            deep: frame.bit_depth == png::BitDepth::Sixteen,
            samples,
        }
    }

    /// The samples of one pixel.
    pub(crate) fn at(&self, x: usize, y: usize) -> &[u8] {
        let n = self.channels * if self.deep { 2 } else { 1 };
        &self.samples[(y * self.width + x) * n..][..n]
    }

    fn save(&self, path: &Path) {
        std::fs::write(path, self.encode()).expect("file");
    }

    /// The bytes of a PNG, as small as it gets.
    pub(crate) fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(if self.channels == 3 {
            png::ColorType::Rgb
        } else {
            png::ColorType::Grayscale
        });
        encoder.set_depth(if self.deep { png::BitDepth::Sixteen } else { png::BitDepth::Eight });
        encoder.set_compression(png::Compression::High);
        encoder.set_filter(png::Filter::Adaptive);
        let mut writer = encoder.write_header().expect("header");
        writer.write_image_data(&self.samples).expect("pixels");
        writer.finish().expect("end");
        bytes
    }
}

fn places(width: usize, height: usize) -> impl Iterator<Item = (u32, u32)> {
    (0..height as u32).flat_map(move |y| (0..width as u32).map(move |x| (x, y)))
}

/// One sample of a picture without any period: blotches and grain from a hash.
fn texel(x: u32, y: u32, channel: u32, seed: u32) -> u8 {
    let hash = |x: u32, y: u32| {
        let mut v = x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b);
        v ^= (channel * 31 + seed).wrapping_mul(0xc2b2_ae35);
        v = (v ^ (v >> 15)).wrapping_mul(0x2c1b_3c6d);
        v = (v ^ (v >> 12)).wrapping_mul(0x297a_2d39);
        (v >> 16) & 0xff
    };
    ((hash(x / 6, y / 6) * 2 + hash(x, y)) / 3) as u8
}
