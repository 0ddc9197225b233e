//! Reading and writing real photographs: the shared exemplars, where they are at hand.

use std::path::{Path, PathBuf};

use texforge::image::io::{WriteOptions, check_output, read, read_bytes, write};
use texforge::image::material::siblings;
use texforge::{Encoding, MapKind, Mask, Picture, Samples, SourceMap};

/// A file of the exemplars, or `None` and a printed line.
#[expect(clippy::print_stderr, reason = "a test that does nothing must say so")]
fn exemplar(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/exemplars").join(name);
    if !path.exists() {
        eprintln!("skipped: the exemplar {name} is not here");
        return None;
    }
    Some(path)
}

fn load(name: &str, kind: MapKind) -> Option<Picture> {
    Some(read(&exemplar(name)?, kind).expect(name))
}

fn shape(picture: &Picture) -> (usize, usize, usize, &'static str) {
    (picture.width(), picture.height(), picture.channels(), picture.samples().dtype())
}

fn mean(picture: &Picture) -> [f64; 3] {
    let n = picture.width() * picture.height();
    let c = picture.channels();
    std::array::from_fn(|k| {
        (0..n).map(|i| picture.samples().unit(i * c + k.min(c - 1))).sum::<f64>() / n as f64 * 255.0
    })
}

#[test]
fn hard_exemplars_come_out_as_they_should() {
    for (name, want) in [
        ("hard/exif_rotated_cobbles.jpg", (966, 518, 3, "uint8")),
        ("hard/sand_grey_16bit.png", (512, 512, 1, "uint16")),
        ("hard/palette_png_brick.png", (501, 333, 3, "uint8")),
        ("hard/asphalt_rgba_partial_alpha.png", (648, 486, 4, "uint8")),
        ("hard/grey_l8_setts.png", (512, 512, 1, "uint8")),
        ("hard/cmyk_marble.jpg", (1024, 727, 3, "uint8")),
        ("hard/rug_with_book_on_it_4288.jpg", (4288, 2848, 3, "uint8")),
        ("hdr/bronze_cannon_patina_16bit.png", (780, 566, 3, "uint16")),
    ] {
        let Some(picture) = load(name, MapKind::Color) else { continue };
        assert_eq!(shape(&picture), want, "{name}");
        assert_eq!(picture.encoding, Encoding::Srgb, "{name}");
    }
}

#[test]
fn every_exemplar_is_read_without_complaint() {
    let Some(root) = exemplar("") else { return };
    let mut folders = vec![root];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("folder") {
            let path = entry.expect("entry").path();
            let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push(path);
            } else if matches!(extension.as_str(), "png" | "jpg" | "exr") {
                let picture = read(&path, MapKind::Color).expect("readable");
                let noted = picture.meta.notes.iter().all(|note| {
                    ["orientation", "CMYK", "converted"].iter().any(|word| note.contains(word))
                });
                assert!(noted, "{}: {:?}", path.display(), picture.meta.notes);
            }
        }
    }
}

#[test]
fn orientation_is_applied_once() {
    let Some(picture) = load("hard/exif_rotated_cobbles.jpg", MapKind::Color) else { return };
    assert!(picture.meta.notes.iter().any(|n| n.contains("orientation")), "{:?}", picture.meta);
    let dir = tempfile::tempdir().expect("folder");
    for name in ["a.jpg", "a.png", "a.tif"] {
        let path = dir.path().join(name);
        write(&path, &picture, &WriteOptions::new(MapKind::Color)).expect(name);
        let again = read(&path, MapKind::Color).expect(name);
        assert_eq!(shape(&again), shape(&picture), "{name}");
        assert!(again.meta.notes.is_empty(), "{name}: {:?}", again.meta.notes);
    }
}

#[test]
fn ink_pictures_get_plausible_colors() {
    let Some(ink) = load("hard/cmyk_marble.jpg", MapKind::Color) else { return };
    let Some(rgb) = load("anisotropic/breccia_marble_slab.png", MapKind::Color) else { return };
    let (ink, rgb) = (mean(&ink), mean(&rgb));
    let near = ink.iter().zip(rgb).all(|(a, b)| (a - b).abs() < 12.0);
    assert!(near, "{ink:.1?} is not near {rgb:.1?}");
}

#[test]
fn transparency_reaches_the_mask() {
    let Some(picture) = load("hard/asphalt_rgba_partial_alpha.png", MapKind::Color) else { return };
    let mask = Mask::from_alpha(&picture).expect("alpha");
    let n = picture.width() * picture.height();
    assert!(mask.count() > 0 && mask.count() < n, "{} of {n}", mask.count());
}

#[test]
fn values_above_one_survive_a_gather_and_a_file() {
    let dir = tempfile::tempdir().expect("folder");
    for name in ["bronze_cannon_patina", "lawn_low_sun", "powerplant_floor_stained"] {
        let Some(photo) = load(&format!("hdr/{name}.exr"), MapKind::Color) else { continue };
        assert_eq!(photo.encoding, Encoding::Linear, "{name}");
        assert!(photo.samples().is_float(), "{name}");
        // The tile: pixels of the photo, mirrored and from its brightest place on.
        let (h, w) = (photo.height(), photo.width());
        let positions = (0..64 * 48).map(|i| {
            let (y, x) = (i / 64 * 7 % h, i % 64 * 5 % w);
            [(h - 1 - y) as u32, (w - 1 - x) as u32]
        });
        let map = SourceMap::new((48, 64), (h, w), positions.collect()).expect("map");
        let tile = map.apply(&photo, MapKind::Color).expect("gather");
        let path = dir.path().join(format!("{name}.exr"));
        write(&path, &tile, &WriteOptions::new(MapKind::Color)).expect("write");
        let back = read(&path, MapKind::Color).expect("read");
        assert_eq!(back.samples(), tile.samples(), "{name}: bit for bit");
        assert_eq!(back.encoding, tile.encoding, "{name}");
    }
    let bright = Samples::F32(vec![0.5, 7.5, 300.0, 1.0, 2.0, 3.0]);
    let photo = Picture::new(1, 2, 3, bright, Encoding::Linear).expect("photo");
    let map = SourceMap::new((2, 1), (1, 2), vec![[0, 1], [0, 0]]).expect("map");
    let tile = map.apply(&photo, MapKind::Color).expect("gather");
    let path = dir.path().join("bright.exr");
    write(&path, &tile, &WriteOptions::new(MapKind::Color)).expect("write");
    let back = read(&path, MapKind::Color).expect("read");
    assert_eq!(back.samples(), &Samples::F32(vec![1.0, 2.0, 3.0, 0.5, 7.5, 300.0]));
}

#[test]
fn materials_of_the_exemplars_are_found() {
    for (folder, want) in [
        ("gingham_fabric_pattern_07", &["arm", "normal_gl"][..]),
        ("sand_ground054", &["ao", "height", "normal_dx", "normal_gl", "roughness"]),
        ("stone_wall_bricks102", &["ao", "height", "normal_dx", "normal_gl", "roughness"]),
    ] {
        let Some(photo) = exemplar(&format!("pbr/{folder}/basecolor.jpg")) else { continue };
        let found = siblings(&photo).expect("list");
        let names: Vec<_> = found.iter().map(|s| s.name).collect();
        assert_eq!(names, want, "{folder}");
        for sibling in found {
            let map = read(&sibling.path, sibling.kind).expect(sibling.name);
            assert_eq!(map.encoding, Encoding::Data, "{folder}/{}", sibling.name);
        }
    }
}

#[test]
fn cut_photographs_are_refused() {
    for name in ["hard/cmyk_marble.jpg", "hard/palette_png_brick.png", "hdr/lawn_low_sun.exr"] {
        let Some(path) = exemplar(name) else { continue };
        let bytes = std::fs::read(path).expect(name);
        for part in 1..12 {
            let cut = &bytes[..bytes.len() * part / 12];
            let error = read_bytes(cut, name, MapKind::Color).expect_err(name);
            assert!(error.to_string().starts_with("cannot read"), "{error}");
        }
    }
}

#[test]
fn nothing_is_written_over_an_input() {
    let dir = tempfile::tempdir().expect("folder");
    let photo = dir.path().join("photo.png");
    let samples = Samples::U8(vec![1, 2, 3]);
    let picture = Picture::new(1, 1, 3, samples, Encoding::Srgb).expect("picture");
    write(&photo, &picture, &WriteOptions::new(MapKind::Color)).expect("write");
    let error = check_output(&photo, &[&photo], true).expect_err("same file");
    assert!(error.to_string().contains("also an input"), "{error}");
    let error = write(&photo, &picture, &WriteOptions::new(MapKind::Color)).expect_err("exists");
    assert!(error.to_string().contains("--force"), "{error}");
}
