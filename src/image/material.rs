//! Maps of a material: what each is, and by which names it goes.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::base::error::{Error, Result};
use crate::base::params::choice;
use crate::image::io::files_beside;
use crate::image::picture::Picture;

choice! {
    /// What a map's numbers are.
    pub enum MapKind {
        /// Colours (base colour, emission).
        Color = "color",
        /// Numbers without a gamma curve (roughness, height, occlusion, ...).
        Data = "data",
        /// Unit vectors, stored as `(n + 1) / 2`; nobody knows whether green points up or down.
        Normal = "normal",
        /// Normals whose green points up (OpenGL).
        NormalGl = "normal_gl",
        /// Normals whose green points down (DirectX).
        NormalDx = "normal_dx",
    }
}

impl MapKind {
    /// Whether the numbers are vectors.
    pub fn is_normal(self) -> bool {
        matches!(self, Self::Normal | Self::NormalGl | Self::NormalDx)
    }

    /// Fails for normals of unknown handedness where photos are `turned` by a quarter: red and green
    /// change places, and the signs depend on it. (Mirrors and half turns need not know.)
    ///
    /// # Errors
    /// [`Error::Parameter`].
    pub fn ensure_turnable(self, turned: bool) -> Result<()> {
        if !turned || self != Self::Normal {
            return Ok(());
        }
        let expected = "normal_gl (green points up) or normal_dx (down) for a map of normals that \
                        is turned, by its name or its kind";
        Err(Error::parameter("map", expected, "`normal`"))
    }
}

/// A map that materials are made of, and the endings by which files say so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapName {
    /// Our name.
    pub name: &'static str,
    /// What its numbers are.
    pub kind: MapKind,
    /// The last words of file names, in lower case and without separators between them.
    pub aliases: &'static [&'static str],
}

/// Name of the map that a photo is.
const BASE: &str = "basecolor";

impl MapName {
    /// Every map that is known. Normal maps of the two conventions (the sign of green) are maps of
    /// their own; a plain `normal` does not say which it is, and nobody guesses.
    pub const ALL: [Self; 14] = {
        use MapKind::{Color, Data, Normal, NormalDx, NormalGl};
        const fn map(
            name: &'static str,
            kind: MapKind,
            aliases: &'static [&'static str],
        ) -> MapName {
            MapName { name, kind, aliases }
        }
        [
            map("ao", Data, &["ao", "occlusion", "ambientocclusion", "occ"]),
            map("arm", Data, &["arm"]),
            map(
                BASE,
                Color,
                &["basecolor", "basecolour", "albedo", "diffuse", "diff", "color", "colour", "col"],
            ),
            map("emission", Color, &["emission", "emissive", "emit"]),
            map("gloss", Data, &["gloss", "glossiness", "smoothness"]),
            map("height", Data, &["height", "displacement", "disp", "bump"]),
            map("metallic", Data, &["metallic", "metal", "metalness"]),
            map("normal", Normal, &["normal", "normals", "nrm", "nor", "norm"]),
            map("normal_dx", NormalDx, &["normaldx", "nordx", "nrmdx", "normaldirectx"]),
            map("normal_gl", NormalGl, &["normalgl", "norgl", "nrmgl", "normalopengl"]),
            map("opacity", Data, &["opacity", "alpha"]),
            map("orm", Data, &["orm"]),
            map("roughness", Data, &["roughness", "rough"]),
            map("specular", Data, &["specular", "spec"]),
        ]
    };

    /// The map that goes by this name or alias, in any spelling (`normal`, `Normal-GL`).
    pub(crate) fn named(name: &str) -> Option<Self> {
        let plain: String = name.chars().filter(|c| !is_separator(*c)).collect();
        let plain = plain.to_lowercase();
        Self::of_alias(&plain)
    }

    fn of_alias(alias: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|map| map.aliases.contains(&alias))
    }
}

/// The map that a file is by the last words of its name, e.g. `("normal_gl", NormalGl)` for
/// `Foo_NormalGL.jpg`, `foo_normal_gl.png` and `foo_nor_gl_4k.exr`. Words are separated by
/// `_`, `-`, `.` or blanks; sizes and formats (`4k`, `2048`, `png`) may follow.
pub fn classify(file_name: &str) -> Option<(&'static str, MapKind)> {
    let parts = parts(file_name)?;
    Some((parts.map.name, parts.map.kind))
}

/// A file name taken apart: `prefix_ALIAS_suffix.extension`; the outer two in lower case.
struct Parts {
    prefix: String,
    map: MapName,
    suffix: String,
}

fn is_separator(c: char) -> bool {
    matches!(c, '_' | '-' | '.' | ' ')
}

fn parts(file_name: &str) -> Option<Parts> {
    let stem = Path::new(file_name).file_stem()?.to_str()?.to_lowercase();
    let words: Vec<&str> = stem.split(is_separator).filter(|word| !word.is_empty()).collect();
    let is_size = |word: &&&str| {
        let digits = word.trim_end_matches('k');
        let size = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
        size || matches!(**word, "png" | "jpg" | "jpeg" | "exr" | "tif" | "8bit" | "16bit")
    };
    let end = words.len() - words.iter().rev().take_while(is_size).count();
    // The longest alias wins: `normal_gl` before `gl`.
    (1..=end.min(3)).rev().find_map(|n| {
        let map = MapName::of_alias(&words[end - n..end].concat())?;
        Some(Parts { prefix: words[..end - n].join("_"), map, suffix: words[end..].join("_") })
    })
}

/// The stem of a tile's name without the ending that calls it a base color, if it has one:
/// `brick_base_color` becomes `brick`, `basecolor` nothing.
pub(crate) fn without_color_ending(stem: &str) -> &str {
    let is_color = |word: &str| MapName::named(word).is_some_and(|map| map.name == BASE);
    if is_color(stem) {
        return "";
    }
    let mut cuts = stem.char_indices().filter(|(_, c)| is_separator(*c));
    cuts.find(|(at, _)| is_color(&stem[at + 1..])).map_or(stem, |(at, _)| &stem[..at])
}

/// Whether a file can be named after a map of this name.
pub(crate) fn is_plain(name: &str) -> bool {
    let plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-');
    (1..=64).contains(&name.len()) && name.chars().all(plain)
}

/// Where a map of `tile` goes: `brick.png` and `normal` make `brick_normal.png`, and so does
/// `brick_basecolor.png`. Integers become PNG, floats EXR, as both keep every bit.
pub(crate) fn output_path(tile: &Path, name: &str, map: &Picture) -> PathBuf {
    let extension = if map.samples().is_float() { "exr" } else { "png" };
    let stem = tile.file_stem().unwrap_or_default();
    let stem = stem.to_str().map_or(stem, |s| OsStr::new(without_color_ending(s)));
    let mut file = stem.to_owned();
    if !file.is_empty() {
        file.push("_");
    }
    file.push(format!("{name}.{extension}"));
    tile.with_file_name(file)
}

/// A map found beside a photo.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sibling {
    /// Which map, as [`MapName::name`].
    pub name: &'static str,
    /// What its numbers are.
    pub kind: MapKind,
    /// The file.
    pub path: PathBuf,
}

/// The maps in the photo's folder that belong to it, sorted by name.
///
/// If the photo's name ends in an alias of the base color (`wall_albedo.jpg`, `basecolor.jpg`),
/// these are the files with the same name but another alias; otherwise the files that carry an
/// alias behind the photo's whole name and a separator (`photo.jpg`, `photo_normal.png`). Case
/// does not matter. If several files claim the same map, the most exact format wins (EXR, TIFF,
/// PNG, others).
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) if the folder cannot be listed.
pub fn siblings(photo: &Path) -> Result<Vec<Sibling>> {
    let Some(photo_name) = photo.file_name().and_then(|name| name.to_str()) else {
        return Ok(Vec::new());
    };
    let (prefix, suffix) = match parts(photo_name) {
        Some(parts) if parts.map.name == BASE => (parts.prefix, parts.suffix),
        _ => {
            let stem = Path::new(photo_name).file_stem().unwrap_or_default().to_string_lossy();
            let stem = stem.to_lowercase();
            let words: Vec<&str> = stem.split(is_separator).filter(|w| !w.is_empty()).collect();
            if words.is_empty() {
                return Ok(Vec::new());
            }
            (words.join("_"), String::new())
        }
    };
    let mut found = Vec::new();
    for path in files_beside(photo)? {
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { continue };
        let Some(parts) = parts(name) else { continue };
        if name != photo_name
            && parts.map.name != BASE
            && (&parts.prefix, &parts.suffix) == (&prefix, &suffix)
        {
            found.push(Sibling { name: parts.map.name, kind: parts.map.kind, path });
        }
    }
    let exactness = |path: &Path| {
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        ["exr", "tif", "tiff", "png"].iter().position(|e| extension == *e).unwrap_or(usize::MAX)
    };
    found.sort_by(|a, b| {
        let key = |s: &Sibling| (s.name, exactness(&s.path), s.path.clone());
        key(a).cmp(&key(b))
    });
    found.dedup_by_key(|sibling| sibling.name);
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::picture::{Encoding, Samples};

    #[test]
    fn names_are_classified_by_their_last_words() {
        use MapKind::{Color, Data, Normal, NormalDx, NormalGl};
        for (file, want) in [
            ("foo_normal_gl.png", Some(("normal_gl", NormalGl))),
            ("Foo_NormalGL.jpg", Some(("normal_gl", NormalGl))),
            ("foo_nor_gl_4k.exr", Some(("normal_gl", NormalGl))),
            ("normal_dx.jpg", Some(("normal_dx", NormalDx))),
            ("foo-nrm.png", Some(("normal", Normal))),
            ("ground054_2K_Color.jpg", Some(("basecolor", Color))),
            ("Ground054_2K-JPG_Displacement.jpg", Some(("height", Data))),
            ("basecolor.jpg", Some(("basecolor", Color))),
            ("Wall_Base_Color.tga", Some(("basecolor", Color))),
            ("wall_ambient_occlusion.png", Some(("ao", Data))),
            ("wall.bump.tif", Some(("height", Data))),
            ("wall roughness.png", Some(("roughness", Data))),
            ("wall_arm_2048.png", Some(("arm", Data))),
            ("wall_ORM.png", Some(("orm", Data))),
            ("lamp_emissive.png", Some(("emission", Color))),
            ("watercolor.jpg", None),
            ("normal_map_of_norway.jpg", None),
            ("photo.jpg", None),
            ("4k.jpg", None),
            ("", None),
            ("_.png", None),
        ] {
            assert_eq!(classify(file), want, "{file}");
        }
    }

    #[test]
    fn no_alias_means_two_maps_and_the_table_is_sorted() {
        let mut aliases: Vec<_> = MapName::ALL.iter().flat_map(|m| m.aliases).collect();
        let n = aliases.len();
        aliases.sort_unstable();
        aliases.dedup();
        assert_eq!(aliases.len(), n, "every alias once");
        assert!(MapName::ALL.is_sorted_by_key(|m| m.name), "by name");
    }

    fn found(files: &[&str], photo: &str) -> Vec<(String, String)> {
        let dir = tempfile::tempdir().expect("folder");
        for file in files {
            std::fs::write(dir.path().join(file), b"").expect("file");
        }
        std::fs::create_dir(dir.path().join("photo_height.png")).expect("a folder is no map");
        let found = siblings(&dir.path().join(photo)).expect("list");
        let name = |s: &Sibling| s.path.file_name().expect("name").to_string_lossy().into_owned();
        found.iter().map(|s| (s.name.to_owned(), name(s))).collect()
    }

    fn pairs(list: &[(&str, &str)]) -> Vec<(String, String)> {
        list.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect()
    }

    #[test]
    fn a_folder_of_bare_map_names_is_one_material() {
        let files = [
            "ao.jpg",
            "basecolor.jpg",
            "height.jpg",
            "normal_dx.jpg",
            "normal_gl.jpg",
            "roughness.jpg",
            "other_height.jpg",
            "readme_height.txt",
        ];
        let want = pairs(&[
            ("ao", "ao.jpg"),
            ("height", "height.jpg"),
            ("normal_dx", "normal_dx.jpg"),
            ("normal_gl", "normal_gl.jpg"),
            ("roughness", "roughness.jpg"),
        ]);
        assert_eq!(found(&files, "basecolor.jpg"), want);
        let fabric = ["arm.jpg", "basecolor.jpg", "normal_gl.jpg"];
        let want = pairs(&[("arm", "arm.jpg"), ("normal_gl", "normal_gl.jpg")]);
        assert_eq!(found(&fabric, "basecolor.jpg"), want);
    }

    #[test]
    fn stems_and_sizes_must_agree() {
        let files = [
            "Wall_Albedo_4k.jpg",
            "wall_nor_gl_4k.exr",
            "wall_rough_2k.png",
            "wall2_rough_4k.png",
            "wall_disp_4k.jpg",
            "wall_disp_4k.tif",
            "wall_col_4k.png",
        ];
        let want = pairs(&[("height", "wall_disp_4k.tif"), ("normal_gl", "wall_nor_gl_4k.exr")]);
        assert_eq!(found(&files, "Wall_Albedo_4k.jpg"), want);
    }

    #[test]
    fn a_plain_photo_takes_what_carries_its_whole_name() {
        let files = [
            "photo.jpg",
            "photo_normal.png",
            "photograph_ao.png",
            "photo2_ao.png",
            "normal.png",
            "photo_tile.png",
            "photoheight.png",
            "photo_albedo.png",
        ];
        assert_eq!(found(&files, "photo.jpg"), pairs(&[("normal", "photo_normal.png")]));
        assert_eq!(found(&["rusty_metal.jpg", "rusty_rough.jpg"], "rusty_metal.jpg"), []);
        assert_eq!(found(&["a.jpg", "b_normal.jpg"], "a.jpg"), []);
    }

    #[test]
    fn the_color_ending_is_found() {
        let cases = [
            ("brick", "brick"),
            ("brick_base_color", "brick"),
            ("old brick-Albedo", "old brick"),
            ("watercolor", "watercolor"),
            ("basecolor", ""),
        ];
        for (stem, want) in cases {
            assert_eq!(without_color_ending(stem), want, "{stem}");
        }
    }

    #[test]
    fn names_go_by_their_aliases() {
        assert_eq!(MapName::named("Normal-GL").map(|m| m.name), Some("normal_gl"));
        assert_eq!(MapName::named("my_normal"), None);
    }

    #[test]
    fn outputs_are_named_after_the_tile() {
        let of = |samples| Picture::new(1, 1, 1, samples, Encoding::Data).expect("picture");
        let (int, float) = (of(Samples::U16(vec![7])), of(Samples::F32(vec![0.5])));
        let name = |tile: &str, map| output_path(Path::new(tile), "normal", map);
        assert_eq!(name("x/brick.png", &int), Path::new("x/brick_normal.png"));
        assert_eq!(name("x/brick.tif", &float), Path::new("x/brick_normal.exr"));
        assert_eq!(name("brick_basecolor.png", &int), Path::new("brick_normal.png"));
        assert_eq!(name("basecolor.png", &int), Path::new("normal.png"));
    }
}
