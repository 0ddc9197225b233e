//! The files that tiles are made from.

use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, ArgMatches};

use crate::base::error::Result;
use crate::cli::args::file;
use crate::cli::files;
use crate::cli::work::Session;
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::image::sigma_map::SigmaMap;
use crate::verb::inputs::Inputs;

/// Their names, as typed.
#[derive(Debug)]
pub(super) struct Sources {
    /// The photo and those mixed with it.
    pub(super) photos: Vec<PathBuf>,
    mask: Option<PathBuf>,
    avoid: Option<PathBuf>,
    sigma_map: Option<PathBuf>,
}

/// What they hold, found to fit together.
#[derive(Debug)]
pub(super) struct Pictures {
    pub(super) photo: Picture,
    also: Vec<Picture>,
    mask: Option<Mask>,
    avoid: Option<Mask>,
    sigma_map: Option<SigmaMap>,
    /// What the user should know of them.
    pub(super) notes: Vec<String>,
}

impl Sources {
    /// The photo as an argument.
    pub(super) fn photo() -> Arg {
        file("photo", "PHOTO", "The photo: PNG, JPEG, TIFF, WebP, EXR and others").required(true)
    }

    /// Where the photo may be used.
    pub(super) fn mask() -> Arg {
        file("mask", "FILE", "Picture of the photo's size: usable is where its first channel is at least half of \
             full scale and its alpha, if any, too; the photo's own transparent pixels are never used")
            .long("mask")
    }

    /// What else can be typed, for any command that makes tiles.
    pub(super) fn args() -> [Arg; 3] {
        [
            file("also", "PHOTO", "A further photo to mix with the first, of the same sample type and channels and of \
                 any size; may be repeated")
                .long("also")
                .action(ArgAction::Append),
            Self::mask(),
            file("avoid", "FILE", "Picture of the photo's size whose marks are never copied: where its first channel is \
                 at least half of full scale and its alpha, if any, too; --avoid-grow widens the marks")
                .long("avoid"),
        ]
    }

    /// What was typed.
    pub(super) fn typed(matches: &ArgMatches) -> Self {
        let path = |id| matches.try_get_one::<PathBuf>(id).ok().flatten().cloned();
        let photo = path("photo").unwrap_or_default();
        let also = matches.get_many::<PathBuf>("also").into_iter().flatten().cloned();
        Self {
            photos: [photo].into_iter().chain(also).collect(),
            mask: path("mask"),
            avoid: path("avoid"),
            sigma_map: path("sigma-map"),
        }
    }

    /// All files.
    pub(super) fn paths(&self) -> impl Iterator<Item = &Path> {
        let others = self.mask.iter().chain(&self.avoid).chain(&self.sigma_map);
        self.photos.iter().chain(others).map(PathBuf::as_path)
    }

    /// Reads all and lets them prove that they fit together.
    ///
    /// # Errors
    /// Of a file that cannot be read, or that does not fit the photo.
    pub(super) fn read(&self, session: &Session) -> Result<Pictures> {
        let mut photo = files::read(&self.photos[0], MapKind::Color)?;
        let mut also = Vec::new();
        let mut notes = std::mem::take(&mut photo.meta.notes);
        for path in &self.photos[1..] {
            session.check()?;
            let mut picture = files::read(path, MapKind::Color)?;
            let shown = path.display();
            notes.extend(picture.meta.notes.drain(..).map(|note| format!("{shown}: {note}")));
            also.push(picture);
        }
        session.check()?;
        let read_mask = |path: &Option<PathBuf>, what| {
            let Some(path) = path else { return Ok(None) };
            let mask = Mask::from_picture(&files::read(path, MapKind::Color)?)?;
            mask.ensure_size(what, photo.height(), photo.width())?;
            Ok(Some(mask))
        };
        let mask = read_mask(&self.mask, "the mask")?;
        let avoid = read_mask(&self.avoid, "the avoid mask")?;
        let sigma_map = match &self.sigma_map {
            None => None,
            Some(path) => Some(SigmaMap::from_picture(&files::read(path, MapKind::Data)?)?),
        };
        Ok(Pictures { photo, also, mask, avoid, sigma_map, notes })
    }
}

impl Pictures {
    /// As the verbs take them.
    pub(super) fn inputs(&self) -> Inputs<'_> {
        Inputs {
            also: &self.also,
            mask: self.mask.as_ref(),
            avoid: self.avoid.as_ref(),
            sigma_map: self.sigma_map.as_ref(),
            ..Inputs::new(&self.photo)
        }
    }
}
