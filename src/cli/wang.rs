//! `texforge wang`.

use std::path::{Path, PathBuf};

use clap::{Arg, ArgMatches, Command};
use serde_json::json;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::params::Value as _;
use crate::base::record::typed_params;
use crate::cli::maps::{self, Asked, Map};
use crate::cli::show::duration;
use crate::cli::small::{SCHEMA_VERSION, told};
use crate::cli::sources::Sources;
use crate::cli::summary::{Seconds, Written};
use crate::cli::work::Session;
use crate::cli::{args, files, folder};
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::verb::extract::WangParams;
use crate::verb::extract::wang::{WangFileContent, WangSet, wang, wang_file_names};
use crate::verb::inputs::Inputs;
use crate::verb::params::{Size, TileParams};

const EXAMPLES: &str = "\
Examples:
  texforge wang cloth.jpg -o cloth_wang
  texforge wang cloth.jpg -o cloth_wang --periods 4 --plane 2048x2048 --seed 3
  texforge wang facade.jpg -o facade_wang --periods 1 --set minimal
  texforge wang bricks.png -o wang --flatten 0.3 --map normal=bricks_nrm.png";

/// Rows and columns of tiles of the plane that is written unless its size is given.
const LAID: usize = 6;

/// The command as it is typed.
pub(super) fn command() -> Command {
    let command = Command::new(WangParams::VERB)
        .about("Makes Wang tiles of a photo that repeats: laid at random they fill a plane that does not repeat.")
        .before_help(EXAMPLES)
        .arg(Sources::photo())
        .arg(
            args::file("output", "DIR", "The folder to write to, made if it is not there: tile_01.png and so on, \
                 atlas.png (all tiles, neighbours fit), wang.json (their edges), plane.png (tiles laid at random) and \
                 index.png (which lies where: column and row in the atlas); pictures of floats are EXR")
                .short('o')
                .long("output")
                .required(true),
        )
        .args(WangParams::schema().into_iter().map(args::flag))
        .next_help_heading("Inputs")
        .arg(Sources::mask())
        .args(maps::flags("A further map of the same surface, made of the same places (atlas_NAME.png and so on); may be repeated"))
        .next_help_heading("Outputs")
        .arg(
            Arg::new("plane")
                .long("plane")
                .value_name("WxH")
                .default_value("auto")
                .help("Size of the plane in pixels; it repeats if that is whole tiles. auto: 6 x 6 tiles"),
        );
    args::usual(command)
}

/// What was typed.
#[derive(Debug)]
struct Request {
    photo: PathBuf,
    folder: PathBuf,
    params: WangParams,
    plane: Size,
    mask: Option<PathBuf>,
    maps: Asked,
    force: bool,
}

/// Runs `texforge wang`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let path = |id| matches.get_one::<PathBuf>(id).cloned();
    let plane = matches.get_one::<String>("plane").map_or("auto", String::as_str);
    let request = Request {
        photo: path("photo").unwrap_or_default(),
        folder: path("output").unwrap_or_default(),
        params: WangParams::from_texts(args::text(matches))?,
        plane: Size::parse(plane)
            .ok_or_else(|| Error::parameter("plane", Size::expected(), format!("`{plane}`")))?,
        mask: path("mask"),
        maps: Asked::from(matches, 1)?,
        force: matches.get_flag("force"),
    };
    let (ctx, session) = Session::begin(matches)?;
    let folder = request.folder.clone();
    let done = folder::filled(&folder, &session, move |session| work(session, &ctx, &request))?;
    told(matches, &session, &done)
}

impl Request {
    /// The files that are read besides those of the maps.
    fn inputs(&self) -> Vec<&Path> {
        [&self.photo].into_iter().chain(&self.mask).map(PathBuf::as_path).collect()
    }

    /// Where the files of a set like `picture` go.
    fn places_of(&self, map: Option<&str>, picture: &Picture) -> Vec<PathBuf> {
        let names = wang_file_names(self.params.set, map, picture);
        names.iter().map(|name| self.folder.join(name)).collect()
    }

    fn check_places(&self, photo: Option<&Picture>, maps: &[Map]) -> Result<()> {
        let mut files: Vec<PathBuf> =
            photo.iter().flat_map(|photo| self.places_of(None, photo)).collect();
        for Map { wanted, pictures } in maps {
            files.extend(self.places_of(Some(wanted.name), &pictures[0]));
        }
        let mut inputs = self.inputs();
        inputs.extend(self.maps.paths());
        inputs.extend(maps.iter().flat_map(|m| &m.wanted.paths).map(PathBuf::as_path));
        folder::check(&self.folder, &files, &inputs, self.force)
    }
}

fn work(
    session: &Session,
    ctx: &Ctx,
    request: &Request,
) -> Result<(serde_json::Value, Vec<String>)> {
    request.check_places(None, &[])?;
    let mut photo = files::read(&request.photo, MapKind::Color)?;
    let mut notes = std::mem::take(&mut photo.meta.notes);
    session.check()?;
    let mask = match &request.mask {
        None => None,
        Some(path) => Some(Mask::from_picture(&files::read(path, MapKind::Color)?)?),
    };
    let photos = std::slice::from_ref(&request.photo);
    let made_of = (photos, &Inputs::new(&photo), &TileParams::default());
    let places = |name: &str, map: &Picture| request.places_of(Some(name), map);
    let maps = request.maps.read(session, made_of, &request.inputs(), places, &mut notes)?;
    request.check_places(Some(&photo), &maps)?;
    session.check()?;

    let made = wang(ctx, &photo, mask.as_ref(), &request.params)?;
    notes.extend(made.report.notes.iter().cloned());
    let (w, h) = made.report.tile_size;
    let plane = match request.plane {
        Size::Auto => (LAID * h, LAID * w),
        Size::Pixels { width, height } => (height, width),
    };
    let written = write(session, (request, ctx.seed), &made, &maps, plane)?;

    notes.iter().for_each(|note| session.console.say(&format!("note: {note}")));
    let elapsed = session.console.elapsed();
    let count = made.report.tiles.len();
    let lines = vec![format!(
        "{}  {count} tiles of {w}x{h}, a plane of {}x{} pixels, {}",
        request.folder.display(),
        plane.1,
        plane.0,
        duration(elapsed)
    )];
    let report = made.report;
    let (width, height) = report.photo_size;
    let summary = json!({
        "schema_version": SCHEMA_VERSION,
        "verb": WangParams::VERB,
        "version": report.version,
        "seed": ctx.seed,
        "threads": ctx.threads(),
        "params": typed_params(&WangParams::schema(), &report.params),
        "photo": Written::new("photo", None, &request.photo, width, height),
        "period": report.period,
        "tile_size": report.tile_size,
        "scale": report.scale,
        "tiles": report.tiles,
        "atlas": report.atlas,
        "plane": [plane.1, plane.0],
        "files": written,
        "seconds": Seconds { stages: report.seconds, total: elapsed.as_secs_f64() },
        "notes": notes,
    });
    Ok((summary, lines))
}

/// Writes everything: all of it or nothing.
fn write(
    session: &Session,
    (request, seed): (&Request, u64),
    made: &WangSet,
    maps: &[Map],
    plane: (usize, usize),
) -> Result<Vec<Written>> {
    let mut atlases = Vec::new();
    for Map { wanted, pictures } in maps {
        let atlas = made.atlas_of(&pictures[0], wanted.kind)?;
        atlases.push((wanted.name.to_owned(), atlas, wanted.kind));
    }
    let mut all: Vec<(Written, Vec<u8>)> = Vec::new();
    for file in made.files(&atlases, plane, seed)? {
        session.check()?;
        let path = request.folder.join(&file.name);
        let (size, bytes) = match file.content {
            WangFileContent::Picture(picture, kind, record) => {
                let bytes = files::encode(&picture, Some(&path), kind, record.as_deref())?;
                ((picture.width(), picture.height()), bytes)
            }
            WangFileContent::Text(text) => ((0, 0), text.into_bytes()),
        };
        all.push((Written::new(file.role, file.map.as_deref(), &path, size.0, size.1), bytes));
    }
    if !request.folder.exists() {
        std::fs::create_dir(&request.folder).map_err(Error::io("write", &request.folder))?;
    }
    for (written, bytes) in &all {
        session.staging.stage(Path::new(&written.path), bytes)?;
    }
    session.staging.commit(request.force)?;
    Ok(all.into_iter().map(|(written, _)| written).collect())
}
