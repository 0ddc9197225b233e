//! `texforge regular`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{ArgMatches, Command};
use serde::Serialize;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::record::{record_of, typed_params};
use crate::cli::maps::{self, Asked, Map};
use crate::cli::output::{Target, to_stdout};
use crate::cli::show::duration;
use crate::cli::small::{SCHEMA_VERSION, print_json};
use crate::cli::sources::Sources;
use crate::cli::summary::{Seconds, Written};
use crate::cli::work::{Session, supervise};
use crate::cli::{args, files};
use crate::image::io::{Format, STRIP_PIXELS, WriteOptions, write_strips};
use crate::image::mask::Mask;
use crate::image::material::{MapKind, output_path};
use crate::image::picture::Picture;
use crate::signal::basis::Basis;
use crate::verb::inputs::Inputs;
use crate::verb::params::TileParams;
use crate::verb::regular::{RegularMaker, RegularParams, RegularReport, Subpixel};

const EXAMPLES: &str = "\
Examples:
  texforge regular bricks.jpg -o wall.png --size 4096x4096
  texforge regular bricks.jpg -o wall.png --tileable both
  texforge regular bricks.jpg -o wall.tif --size 16384x16384 --seed 7
  texforge regular scan.png -o wall.png --size 2048 --map normal=scan_nrm.png
  texforge regular cloth.jpg -o cloth.png --lattice 84.9,0.1,-0.2,127.3
  texforge regular gravel.jpg -o gravel.png --size 2048 --lattice none";

/// The command as it is typed.
pub(super) fn command() -> Command {
    let command = Command::new(RegularParams::VERB)
        .about("Makes a near-regular texture (bricks, tiles, cloth, windows) of any size from a photo of one.")
        .before_help(EXAMPLES)
        .arg(Sources::photo())
        .arg(
            args::file("output", "TEXTURE", "The texture to write; the extension chooses the format. PNG, TIFF and EXR are \
                 written row by row, so that they may be larger than memory. `-`: PNG to standard output")
                .short('o')
                .long("output")
                .required(true),
        )
        .args(RegularParams::schema().into_iter().map(args::flag))
        .next_help_heading("Inputs")
        .arg(Sources::mask())
        .args(maps::flags("A further map of the same surface that follows the texture pixel by pixel; may be repeated"))
        .next_help_heading("Outputs")
        .arg(
            args::file("save-source-map", "FILE.exr", "Also write which photo pixel each pixel is (where two are mixed, the one \
                 that there is more of), for `texforge apply`; the whole must fit into memory then")
                .long("save-source-map"),
        );
    args::usual(command)
}

/// What was typed.
#[derive(Debug)]
struct Request {
    photo: PathBuf,
    output: Target,
    params: RegularParams,
    mask: Option<PathBuf>,
    maps: Asked,
    source_map: Option<PathBuf>,
    force: bool,
}

/// A picture to be written.
struct Output<'a> {
    role: &'static str,
    name: Option<&'static str>,
    path: PathBuf,
    /// What it is of: the photo, or a map of it.
    of: &'a Picture,
    kind: MapKind,
    record: Option<String>,
}

/// The `--json` object.
#[derive(Debug, Serialize)]
struct Summary {
    schema_version: u32,
    verb: &'static str,
    version: &'static str,
    seed: u64,
    threads: usize,
    params: BTreeMap<&'static str, serde_json::Value>,
    photo: Written,
    texture: Written,
    lattice: Option<Basis>,
    lattice_of_texture: Option<Basis>,
    confidence: Option<f64>,
    straightened: (f64, f64),
    seconds: Seconds,
    files: Vec<Written>,
    notes: Vec<String>,
}

/// Runs `texforge regular`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let path = |id| matches.get_one::<PathBuf>(id).cloned();
    let mut request = Request {
        photo: path("photo").unwrap_or_default(),
        output: Target::typed(&path("output").unwrap_or_default())?,
        params: RegularParams::from_texts(args::text(matches))?,
        mask: path("mask"),
        maps: Asked::from(matches, 1)?,
        source_map: path("save-source-map"),
        force: matches.get_flag("force"),
    };
    let json = matches.get_flag("json");
    if request.output == Target::Stdout {
        let taken = [("map", !request.maps.typed.is_empty()), ("json", json)];
        if let Some((flag, _)) = taken.into_iter().find(|(_, typed)| *typed) {
            let expected = "left out when the texture goes to standard output";
            return Err(Error::parameter(flag, expected, "`-o -`"));
        }
        request.maps.pick_up = false;
    }
    if let Some(path) =
        request.source_map.as_ref().filter(|_| request.params.subpixel == Subpixel::On)
    {
        let expected =
            "left out with `subpixel` on, as pixels are no copies then; give the maps with `--map`";
        return Err(Error::parameter("save-source-map", expected, path.display()));
    }
    let (ctx, session) = Session::begin(matches)?;
    let (summary, line) = supervise(&session, move |session| work(session, &ctx, &request))?;
    session.console.say(&line);
    if json { print_json(&summary) } else { Ok(()) }
}

impl Request {
    /// The files that are read besides those of the maps.
    fn inputs(&self) -> Vec<&Path> {
        [&self.photo].into_iter().chain(&self.mask).map(PathBuf::as_path).collect()
    }

    /// Fails if an output cannot be written, or two are the same file.
    fn check_places(&self, maps: &[Map]) -> Result<()> {
        let mut inputs = self.inputs();
        inputs.extend(self.maps.paths());
        inputs.extend(maps.iter().flat_map(|m| &m.wanted.paths).map(PathBuf::as_path));
        let texture = self.output.file().map(|path| ("output", path.to_owned()));
        let source_map = self.source_map.clone().map(|path| ("save-source-map", path));
        let maps = maps.iter().map(|m| ("map", self.place_of(m.wanted.name, &m.pictures[0])));
        let all = texture.into_iter().chain(source_map).chain(maps);
        files::check_outputs(all, &inputs, self.force)
    }

    fn place_of(&self, name: &str, map: &Picture) -> PathBuf {
        output_path(self.output.file().unwrap_or(Path::new("texture.png")), name, map)
    }
}

fn work(session: &Session, ctx: &Ctx, request: &Request) -> Result<(Summary, String)> {
    request.check_places(&[])?;
    let mut photo = files::read(&request.photo, MapKind::Color)?;
    let mut notes = std::mem::take(&mut photo.meta.notes);
    session.check()?;
    let mask = match &request.mask {
        None => None,
        Some(path) => Some(Mask::from_picture(&files::read(path, MapKind::Color)?)?),
    };
    let photos = std::slice::from_ref(&request.photo);
    let made_of = (photos, &Inputs::new(&photo), &TileParams::default());
    let places = |name: &str, map: &Picture| vec![request.place_of(name, map)];
    let maps = request.maps.read(session, made_of, &request.inputs(), places, &mut notes)?;
    request.check_places(&maps)?;
    files::ensure_can_hold(&photo, request.output.file(), MapKind::Color)?;
    session.check()?;

    let maker = RegularMaker::new(ctx, &photo, mask.as_ref(), &request.params)?;
    let mut report = maker.report().clone();
    notes.extend(report.notes.iter().cloned());
    let record = record_of(
        RegularParams::VERB,
        report.version,
        report.seed,
        &typed_params(&RegularParams::schema(), &report.params),
    )
    .to_string();
    let start = Instant::now();
    let (width, height) = maker.size();
    let mut outputs = Vec::new();
    for Map { wanted, pictures } in &maps {
        let of = &pictures[0];
        let (name, kind, path) =
            (Some(wanted.name), wanted.kind, request.place_of(wanted.name, of));
        outputs.push(Output { role: "map", name, path, of, kind, record: None });
    }
    if let Some(path) = request.output.file() {
        let (path, record) = (path.to_owned(), Some(record.clone()));
        let (of, kind) = (maker.photo(), MapKind::Color);
        outputs.insert(0, Output { role: "texture", name: None, path, of, kind, record });
    }
    let mut files = Vec::new();
    for Output { role, name, path, .. } in &outputs {
        files.push(Written::new(role, *name, path, width, height));
    }
    let streams =
        |output: &Output<'_>| Format::from_extension(&output.path).is_some_and(Format::streams);
    let to_files = request.output != Target::Stdout;
    let mut piped = None;
    let of_maps: Vec<_> =
        outputs.iter().filter(|o| o.role == "map").map(|o| (o.of, o.kind)).collect();
    if to_files && request.source_map.is_none() && outputs.iter().all(streams) {
        let options =
            |o: &Output<'_>| WriteOptions { kind: o.kind, record: o.record.clone(), force: true };
        let files: Vec<_> = outputs.iter().map(|o| (o.path.as_path(), options(o))).collect();
        let pictures = maker.pictures(ctx, STRIP_PIXELS, &of_maps)?;
        write_strips(&session.staging, &files, height, pictures)?;
    } else {
        let (texture, of_maps) = maker.make(ctx, &of_maps)?;
        let pictures = to_files.then_some(&texture.picture).into_iter().chain(&of_maps);
        for (output, picture) in outputs.iter().zip(pictures) {
            session.check()?;
            let record = output.record.as_deref();
            let bytes = files::encode(picture, Some(&output.path), output.kind, record)?;
            session.staging.stage(&output.path, &bytes)?;
        }
        if let Some(path) = &request.source_map {
            let bytes = files::encode_source_map(&texture.source_map, path)?;
            session.staging.stage(path, &bytes)?;
            files.push(Written::new("source_map", None, path, width, height));
        }
        if !to_files {
            piped = Some(files::encode(&texture.picture, None, MapKind::Color, Some(&record))?);
        }
    }
    session.staging.commit(request.force)?;
    if let Some(bytes) = piped {
        to_stdout(&bytes)?;
    }
    report.seconds.push(("synthesis", start.elapsed().as_secs_f64()));
    for file in files.iter().filter(|f| f.role != "texture") {
        session.console.say(&format!("{}  {width}x{height} ({})", file.path, file.what()));
    }
    notes.iter().for_each(|note| session.console.say(&format!("note: {note}")));
    let elapsed = session.console.elapsed();
    let line = line(request, &report, elapsed);
    Ok((summary(ctx, request, report, files, notes, elapsed.as_secs_f64()), line))
}

fn line(request: &Request, report: &RegularReport, elapsed: std::time::Duration) -> String {
    let (width, height) = report.size;
    let place = match &request.output {
        Target::Stdout => "standard output".into(),
        Target::File(path) => path.display().to_string(),
    };
    let lattice = report.lattice.map_or("no lattice".to_owned(), |[[ax, ay], [bx, by]]| {
        let sure = report.confidence.map_or(String::new(), |c| format!(" (confidence {c:.2})"));
        format!("lattice {ax:.1},{ay:.1},{bx:.1},{by:.1}{sure}")
    });
    format!("{place}  {width}x{height}, seed {}, {lattice}, {}", report.seed, duration(elapsed))
}

fn summary(
    ctx: &Ctx,
    request: &Request,
    report: RegularReport,
    files: Vec<Written>,
    notes: Vec<String>,
    total: f64,
) -> Summary {
    let (photo_width, photo_height) = report.photo_size;
    let (width, height) = report.size;
    let place = request.output.file().unwrap_or(Path::new("-"));
    Summary {
        schema_version: SCHEMA_VERSION,
        verb: RegularParams::VERB,
        version: report.version,
        seed: report.seed,
        threads: ctx.threads(),
        params: typed_params(&RegularParams::schema(), &report.params),
        photo: Written::new("photo", None, &request.photo, photo_width, photo_height),
        texture: Written::new("texture", None, place, width, height),
        lattice: report.lattice,
        lattice_of_texture: report.lattice_of_texture,
        confidence: report.confidence,
        straightened: report.straightened,
        seconds: Seconds { stages: report.seconds, total },
        files,
        notes,
    }
}
