//! `texforge tile`.

use std::path::{Path, PathBuf};

use clap::ArgMatches;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::cli::maps::{Asked, Map};
use crate::cli::output::{Target, to_stdout};
use crate::cli::small::told;
use crate::cli::sources::Sources;
use crate::cli::summary::{self, Summary, Written};
use crate::cli::work::{Session, supervise};
use crate::cli::{args, files};
use crate::image::material::{MapKind, output_path};
use crate::image::picture::Picture;
use crate::image::rect::Rect;
use crate::image::sheet;
use crate::verb::inputs::Inputs;
use crate::verb::params::{Method, TileParams};
use crate::verb::redo::Redo;
use crate::verb::tile::{Draft, Tile, tiles_meanwhile};

/// Longest side of a preview in pixels; what a screen shows at once.
const PREVIEW_SIDE: usize = 2048;

/// What was typed, checked as far as it can be without looking at a file.
#[derive(Debug)]
struct Request {
    sources: Sources,
    /// Where each tile goes.
    places: Vec<Place>,
    params: TileParams,
    /// The rectangle to make anew, and the tile's source map.
    redo: Option<(Rect, PathBuf)>,
    maps: Asked,
    force: bool,
}

/// Where a tile and what belongs to it goes.
#[derive(Debug)]
struct Place {
    tile: Target,
    source_map: Option<PathBuf>,
    preview: Option<PathBuf>,
}

/// What became of a tile.
struct Staged {
    /// The files that wait for their names.
    written: Vec<Written>,
    /// What goes to standard output.
    piped: Option<Vec<u8>>,
}

impl Place {
    /// Encodes and stages all files of a tile; the maps follow it.
    fn stage(
        &self,
        session: &Session,
        draft: &Draft<'_>,
        record: &str,
        maps: &[Map],
    ) -> Result<Staged> {
        let mut staged = Staged { written: Vec::new(), piped: None };
        let mut stage =
            |role, name: Option<&str>, path: &Path, bytes: Vec<u8>, picture: &Picture| {
                session.check()?;
                session.staging.stage(path, &bytes)?;
                let (width, height) = (picture.width(), picture.height());
                staged.written.push(Written::new(role, name, path, width, height));
                Ok(())
            };
        let picture = draft.picture;
        let file = self.tile.file();
        let bytes = files::encode(picture, file, MapKind::Color, Some(record))?;
        match file {
            Some(path) => stage("tile", None, path, bytes, picture)?,
            None => staged.piped = Some(bytes),
        }
        if let Some(source_map) = draft.source_map {
            for Map { wanted, pictures } in maps {
                let maps: Vec<&Picture> = pictures.iter().collect();
                let map = source_map.apply_all(&maps, wanted.kind)?;
                let to = self.map(wanted.name, &map);
                let bytes = files::encode(&map, Some(&to), wanted.kind, None)?;
                stage("map", Some(wanted.name), &to, bytes, &map)?;
            }
            if let Some(path) = &self.source_map {
                let bytes = files::encode_source_map(source_map, path)?;
                stage("source_map", None, path, bytes, picture)?;
            }
        }
        if let Some(path) = &self.preview {
            let tiling = sheet::repeated(picture, 3, PREVIEW_SIDE)?;
            let bytes = files::encode(&tiling, Some(path), MapKind::Color, None)?;
            stage("preview", None, path, bytes, &tiling)?;
        }
        Ok(staged)
    }

    /// The file of a map of the tile.
    fn map(&self, name: &str, map: &Picture) -> PathBuf {
        output_path(self.tile.file().unwrap_or(Path::new("tile.png")), name, map)
    }
}

/// Runs `texforge tile`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let request = Request::typed(matches)?;
    let (ctx, session) = Session::begin(matches)?;
    let done = supervise(&session, move |session| work(session, &ctx, &request))?;
    told(matches, &session, &done)
}

impl Request {
    fn typed(matches: &ArgMatches) -> Result<Self> {
        let path = |id| matches.get_one::<PathBuf>(id).cloned();
        let params = TileParams::from_texts(args::text(matches))?;
        let target = Target::typed(&path("output").unwrap_or_default())?;
        let sources = Sources::typed(matches);
        let mut maps = Asked::from(matches, sources.photos.len())?;
        let source_map = path("save-source-map");
        let rect = matches.get_one::<String>("redo").map(|text| {
            let expected = "a rectangle as WIDTHxHEIGHT+X+Y";
            Rect::parse(text).ok_or_else(|| Error::parameter("redo", expected, format!("`{text}`")))
        });
        let rect = rect.transpose()?;
        let wants = |flag| matches.get_flag(flag);
        let count = matches.get_one::<usize>("variants").copied().unwrap_or(1);
        // Name what contradicts what, before any file is touched.
        if target == Target::Stdout && wants("preview") {
            return Err(needs_file("preview"));
        }
        if target == Target::Stdout && count > 1 {
            return Err(needs_file("variants"));
        }
        if target == Target::Stdout && !maps.typed.is_empty() {
            return Err(needs_file("map"));
        }
        if target == Target::Stdout && wants("json") {
            return Err(needs_file("json"));
        }
        if params.method == Method::MakeSeamless && (source_map.is_some() || !maps.typed.is_empty())
        {
            let expected = "one that copies pixels, when maps or a source map are wanted";
            return Err(Error::parameter("method", expected, "`make-seamless`, which blends"));
        }
        maps.pick_up &= target != Target::Stdout && params.method != Method::MakeSeamless;
        Ok(Self {
            sources,
            places: places(&target, source_map.as_deref(), wants("preview"), count),
            params,
            redo: rect.zip(path("redo-of")),
            maps,
            force: wants("force"),
        })
    }

    /// The files that are read besides those of the maps.
    fn inputs(&self) -> Vec<&Path> {
        let of = self.redo.as_ref().map(|(_, map)| map.as_path());
        of.into_iter().chain(self.sources.paths()).collect()
    }

    /// Fails if an output cannot be written, or two outputs are the same file.
    fn check_outputs(&self, maps: &[Map]) -> Result<()> {
        let mut inputs = self.inputs();
        inputs.extend(self.maps.paths());
        inputs.extend(maps.iter().flat_map(|m| &m.wanted.paths).map(PathBuf::as_path));
        let outputs = self.places.iter().flat_map(|place| {
            let tile = place.tile.file().map(|p| ("output", p.to_owned()));
            let source_map = place.source_map.clone().map(|p| ("save-source-map", p));
            let preview = place.preview.clone().map(|p| ("preview", p));
            let maps = maps.iter().map(|m| ("map", place.map(m.wanted.name, &m.pictures[0])));
            tile.into_iter().chain(source_map).chain(preview).chain(maps)
        });
        files::check_outputs(outputs, &inputs, self.force)
    }
}

/// The places of `count` tiles: those that were typed, or numbered ones from 1 on.
fn places(target: &Target, source_map: Option<&Path>, preview: bool, count: usize) -> Vec<Place> {
    let place = |i: usize| {
        let numbered =
            |path: &Path| if count > 1 { files::numbered(path, i) } else { path.to_owned() };
        let tile = target.file().map(numbered);
        Place {
            preview: tile.as_deref().filter(|_| preview).map(|p| p.with_extension("preview.png")),
            source_map: source_map.map(numbered),
            tile: tile.map_or(Target::Stdout, Target::File),
        }
    };
    (1..=count).map(place).collect()
}

fn needs_file(flag: &'static str) -> Error {
    Error::parameter(flag, "left out when the tile goes to standard output", "`-o -`")
}

/// Everything between the checked command line and the renamed files.
fn work(session: &Session, ctx: &Ctx, request: &Request) -> Result<(Summary, Vec<String>)> {
    // Look at the places before anything is read: the cheapest refusal first.
    request.check_outputs(&[])?;

    let mut pictures = request.sources.read(session)?;
    let mut notes = std::mem::take(&mut pictures.notes);
    let redone = match &request.redo {
        None => None,
        Some((rect, path)) => Some((*rect, files::read_source_map(path)?)),
    };
    let redone_rect = redone.as_ref().map(|(rect, _)| *rect);
    let redo = redone.as_ref().map(|(rect, of)| Redo { of, rect: *rect });
    let (photo, inputs) = (&pictures.photo, Inputs { redo, ..pictures.inputs() });
    let places = |name: &str, map: &Picture| -> Vec<PathBuf> {
        request.places.iter().map(|place| place.map(name, map)).collect()
    };
    let made_of = (&request.sources.photos[..], &inputs, &request.params);
    let maps = request.maps.read(session, made_of, &request.inputs(), places, &mut notes)?;
    request.check_outputs(&maps)?;
    files::ensure_can_hold(photo, request.places[0].tile.file(), MapKind::Color)?;
    session.check()?;

    // The long work. Every file is staged as soon as its pixels are there.
    let record = |draft: &Draft<'_>| summary::record(draft.seed, draft.params, redone_rect);
    let made = tiles_meanwhile(ctx, &inputs, &request.params, request.places.len(), |draft| {
        request.places[draft.number].stage(session, draft, &record(draft), &maps)
    })?;
    notes.extend(made[0].0.report.notes.iter().cloned());
    let mut written = Vec::new();
    let mut done = Vec::new();
    let mut piped = None;
    for (place, (Tile { report, .. }, staged)) in request.places.iter().zip(made) {
        done.push((place.tile.clone(), report));
        written.extend(staged.written);
        piped = piped.or(staged.piped);
    }

    // All is computed: now the files get their names, all or none.
    session.staging.commit(request.force)?;
    if let Some(bytes) = piped {
        to_stdout(&bytes)?;
    }
    for file in written.iter().filter(|w| w.role != "tile") {
        let (width, height) = (file.width, file.height);
        session.console.say(&format!("{}  {width}x{height} ({})", file.path, file.what()));
    }
    for note in &notes {
        session.console.say(&format!("note: {note}"));
    }
    let elapsed = session.console.elapsed();
    let line = |(target, report): &_| summary::line(&request.params, target, report, elapsed);
    let lines = done.iter().map(line).collect();
    Ok((summary::summary(ctx, &request.sources.photos, &done, notes, written, elapsed), lines))
}
