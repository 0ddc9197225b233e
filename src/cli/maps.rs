//! The further maps of a material: which files they are, what they are called, where they go.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::builder::ValueParser;
use clap::{Arg, ArgAction, ArgMatches};

use crate::base::error::{Error, Result};
use crate::cli::work::Session;
use crate::cli::{args, files};
use crate::image::material::{MapKind, MapName, Sibling};
use crate::image::picture::Picture;
use crate::verb::inputs::Inputs;
use crate::verb::params::TileParams;

/// A map as asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Wanted {
    /// Its name, e.g. `normal`; ends the output's file name.
    pub(super) name: &'static str,
    /// The files, one of each photo.
    pub(super) paths: Vec<PathBuf>,
    /// What its numbers are.
    pub(super) kind: MapKind,
    /// Whether it was found beside the photo rather than typed.
    pub(super) found: bool,
}

/// The maps typed as NAME=FILE, once for each of `n_photos` in their order.
///
/// # Errors
/// [`Error::Parameter`] for a missing `=`, an unknown name, a name given more or less often.
pub(super) fn typed<'a>(
    specs: impl Iterator<Item = &'a OsString>,
    n_photos: usize,
) -> Result<Vec<Wanted>> {
    let mut maps: Vec<Wanted> = Vec::new();
    for spec in specs {
        let shown = || format!("`{}`", spec.to_string_lossy());
        let Some((name, path)) = split(spec) else {
            return Err(Error::parameter("map", "NAME=FILE, e.g. normal=brick_nrm.png", shown()));
        };
        let Some(MapName { name, kind, .. }) = MapName::named(&name) else {
            let expected = format!("NAME=FILE where NAME is one of {}", known_names());
            return Err(Error::parameter("map", expected, shown()));
        };
        match maps.iter_mut().find(|m| m.name == name) {
            None => maps.push(Wanted { name, paths: vec![path], kind, found: false }),
            Some(map) => map.paths.push(path),
        }
    }
    if let Some(Wanted { name, paths, .. }) = maps.iter().find(|m| m.paths.len() != n_photos) {
        let times = |n: usize| match n {
            1 => "once".to_owned(),
            2 => "twice".to_owned(),
            n => format!("{n} times"),
        };
        let expected = format!("given once for each photo, so {name} {}", times(n_photos));
        return Err(Error::parameter("map", expected, times(paths.len())));
    }
    Ok(maps)
}

/// The flag that maps are typed with; `what` they are.
pub(super) fn flag(what: &str) -> Arg {
    Arg::new("map")
        .long("map")
        .value_name("NAME=FILE")
        .action(ArgAction::Append)
        .value_parser(ValueParser::os_string())
        .help(format!("{what}. NAME is one of {}", known_names()))
}

/// The flags of a command that also takes the maps beside its photos.
pub(super) fn flags(what: &str) -> [Arg; 2] {
    let map = flag(what);
    let help = map.get_help().cloned().unwrap_or_default();
    [
        map.help(format!(
            "{help}. Maps whose file name is the photo's with such an ending are taken by themselves"
        )),
        args::switch("no-maps", "Leave alone the maps that lie beside the photo"),
    ]
}

/// The maps that a run is to take along.
#[derive(Debug)]
pub(super) struct Asked {
    /// Those that were typed.
    pub(super) typed: Vec<Wanted>,
    /// Whether those that lie beside the photos are taken too.
    pub(super) pick_up: bool,
}

/// A map that was read, of each photo.
#[derive(Debug)]
pub(super) struct Map {
    pub(super) wanted: Wanted,
    pub(super) pictures: Vec<Picture>,
}

impl Asked {
    /// What was typed for `n_photos` with [`flags`].
    ///
    /// # Errors
    /// Those of [`typed`].
    pub(super) fn from(matches: &ArgMatches, n_photos: usize) -> Result<Self> {
        let specs = matches.get_many::<OsString>("map").into_iter().flatten();
        Ok(Self { typed: typed(specs, n_photos)?, pick_up: !matches.get_flag("no-maps") })
    }

    /// The files of the maps that were typed.
    pub(super) fn paths(&self) -> impl Iterator<Item = &Path> {
        self.typed.iter().flat_map(|map| &map.paths).map(PathBuf::as_path)
    }

    /// Reads the maps that were typed and those that lie beside `photos`; `taken` are the other files
    /// that the run reads, `places` says where a map's outputs go. Of the maps that were found, those
    /// that do not fit are left out with a note: nobody asked for them.
    ///
    /// # Errors
    /// Of a map that was typed: it cannot be read, or does not fit.
    pub(super) fn read(
        &self,
        session: &Session,
        (photos, inputs, params): (&[PathBuf], &Inputs<'_>, &TileParams),
        taken: &[&Path],
        places: impl Fn(&str, &Picture) -> Vec<PathBuf>,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Map>> {
        let mut all = self.typed.clone();
        if self.pick_up {
            all.extend(self.beside(photos, taken, notes)?);
        }
        let mut maps = Vec::new();
        for wanted in all {
            let shown = wanted.paths[0].display().to_string();
            match wanted.read(session, inputs, params) {
                Ok(pictures) => {
                    if wanted.found {
                        let own = |to: &PathBuf| wanted.paths.iter().any(|p| same_place(to, p));
                        if places(wanted.name, &pictures[0]).iter().any(own) {
                            // What an earlier run made of a map is no map of the photo.
                            notes.push(format!(
                                "{shown} was left alone: it is where this run's map goes"
                            ));
                            continue;
                        }
                        let name = &wanted.name;
                        session.console.say(&format!(
                            "{shown}: taken as the photo's {name} map (--no-maps leaves it alone)"
                        ));
                    }
                    maps.push(Map { wanted, pictures });
                }
                Err(error @ Error::Cancelled) => return Err(error),
                Err(error) if wanted.found => {
                    notes.push(format!("{shown} was left alone: {error}"));
                }
                Err(error) => return Err(error),
            }
        }
        Ok(maps)
    }

    /// The maps that lie beside the photos and were not typed: those that every photo has.
    fn beside(
        &self,
        photos: &[PathBuf],
        taken: &[&Path],
        notes: &mut Vec<String>,
    ) -> Result<Vec<Wanted>> {
        let taken: Vec<&Path> = self.paths().chain(taken.iter().copied()).collect();
        let mut found: Vec<Vec<Sibling>> = Vec::new();
        for photo in photos {
            let mut siblings = files::siblings(photo)?;
            siblings.retain(|s| {
                let typed = self.typed.iter().any(|m| m.name == s.name);
                !typed && !taken.iter().any(|taken| same_place(taken, &s.path))
            });
            found.push(siblings);
        }
        // Shown as the photo was typed.
        let shown = |path: &Path| path.strip_prefix(".").unwrap_or(path).to_owned();
        let mut wanted = Vec::new();
        for Sibling { name, kind, path } in found.first().into_iter().flatten() {
            let of_photo =
                |all: &Vec<Sibling>| all.iter().find(|s| s.name == *name).map(|s| shown(&s.path));
            match found.iter().map(of_photo).collect() {
                Some(paths) => wanted.push(Wanted { name, paths, kind: *kind, found: true }),
                None => notes.push(format!(
                    "{} was left alone: not every photo has a {name} map",
                    shown(path).display()
                )),
            }
        }
        Ok(wanted)
    }
}

impl Wanted {
    /// Reads the map of each photo; all must fit.
    fn read(
        &self,
        session: &Session,
        inputs: &Inputs<'_>,
        params: &TileParams,
    ) -> Result<Vec<Picture>> {
        let mut pictures = Vec::new();
        for path in &self.paths {
            session.check()?;
            let map = files::read(path, self.kind)?;
            map.ensure_finite(&format!("the map `{}`", self.name))?;
            pictures.push(map);
        }
        let all: Vec<&Picture> = pictures.iter().collect();
        let shown = format!("{} ({})", self.name, self.paths[0].display());
        inputs.ensure_maps_fit(&shown, &all, self.kind, params)?;
        Ok(pictures)
    }
}

/// Whether two paths name the same file, as far as both exist.
fn same_place(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// The names that maps go by, for messages.
pub(super) fn known_names() -> String {
    MapName::ALL.map(|map| map.name).join(", ")
}

/// Splits at the first `=`; both sides must hold something.
fn split(spec: &OsStr) -> Option<(String, PathBuf)> {
    let (name, path) = split_os(spec)?;
    (!name.is_empty() && !path.is_empty()).then(|| (name, path.into()))
}

#[cfg(unix)]
fn split_os(spec: &OsStr) -> Option<(String, OsString)> {
    use std::os::unix::ffi::OsStrExt as _;
    let bytes = spec.as_bytes();
    let at = bytes.iter().position(|&b| b == b'=')?;
    let name = std::str::from_utf8(&bytes[..at]).ok()?.to_owned();
    Some((name, OsStr::from_bytes(&bytes[at + 1..]).to_owned()))
}

#[cfg(not(unix))]
fn split_os(spec: &OsStr) -> Option<(String, OsString)> {
    let (name, path) = spec.to_str()?.split_once('=')?;
    Some((name.to_owned(), path.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn specs(specs: &[&str]) -> Result<Vec<Wanted>> {
        let specs: Vec<OsString> = specs.iter().map(Into::into).collect();
        typed(specs.iter(), 1)
    }

    #[test]
    fn the_first_equals_sign_splits() {
        let maps = specs(&["normal=a=b.png", "roughness=r.png"]).expect("maps");
        assert_eq!(maps[0].paths, [Path::new("a=b.png")]);
        assert_eq!((maps[0].kind, maps[1].kind), (MapKind::Normal, MapKind::Data));
    }

    #[test]
    fn senseless_maps_are_refused() {
        for bad in [&["normal"][..], &["=a.png"], &["normal="], &["blorb=a.png"]] {
            assert!(matches!(specs(bad), Err(Error::Parameter { name: "map", .. })), "{bad:?}");
        }
        let error = specs(&["normal=a.png", "nrm=b.png"]).expect_err("twice");
        assert!(error.to_string().contains("twice"), "{error}");
    }

    #[test]
    fn every_photo_has_its_map() {
        let all = ["normal_gl=a.png", "height=h.png", "nor_gl=b.png", "height=i.png"];
        let all: Vec<OsString> = all.iter().map(Into::into).collect();
        let maps = typed(all.iter(), 2).expect("maps");
        assert_eq!(maps[0].paths, [Path::new("a.png"), Path::new("b.png")]);
        assert_eq!(maps[1].paths, [Path::new("h.png"), Path::new("i.png")]);
        let error = typed(all[..3].iter(), 2).expect_err("one height").to_string();
        assert!(error.contains("so height twice, got once"), "{error}");
    }
}
