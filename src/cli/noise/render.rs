//! `texforge noise render`.

use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;
use clap::{Arg, ArgMatches, Command, value_parser};
use serde_json::json;

use super::{document, path, read, shown, target};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::params::Value as _;
use crate::base::record::{Typed, record_of};
use crate::cli::output::{Target, to_stdout};
use crate::cli::show::duration;
use crate::cli::small::{SCHEMA_VERSION, print_json};
use crate::cli::summary::Written;
use crate::cli::work::{Session, supervise};
use crate::cli::{args, files};
use crate::image::io::{Format, STRIP_PIXELS, WriteOptions, write_strips};
use crate::image::material::{MapKind, is_plain, output_path};
use crate::verb::noise::{NoiseTexture, RenderParams, SampleType};
use crate::verb::params::Size;

const EXAMPLES: &str = "\
Examples:
  texforge noise render granite.json -o granite.png
  texforge noise render granite.json -o granite.png --size 2048x1024 --tileable
  texforge noise render granite.json -o large.tif --size 16384 --bits 16
  texforge noise render granite.json -o part.exr --size 512 --origin 100000,-2500
  texforge noise render granite.json -o near.png --scale 0.25
  texforge noise render granite.json -o far.png --scale 8 --keep-contrast";

/// The command as it is typed.
pub(super) fn command() -> Command {
    let command = Command::new("render")
        .about("Makes a picture of a texture: any part of it, of any size, and of each of its maps.")
        .before_help(EXAMPLES)
        .arg(document("document", "TEXTURE"))
        .arg(
            args::file("output", "FILE", "The picture to write; the extension chooses the format. Further maps of the \
                 texture lie beside it (FILE_NAME.png, floats FILE_NAME.exr). PNG, TIFF and EXR are written row by \
                 row, so that they may be larger than memory. `-`: PNG to standard output")
                .short('o')
                .long("output")
                .required(true),
        )
        .next_help_heading("Parameters")
        .arg(number("size", "WxH", "auto", "Width and height of the picture; auto is the photo's [1 to 65536, px]"))
        .arg(number("scale", "N", "1", "Distance of pixels in pixels of the photo: 0.5 shows features twice as large, 2 half as \
             large and without what is too fine [0.001 to 10000]"))
        .arg(number("origin", "X,Y", "0,0", "Where in the endless texture the upper left corner lies, in pixels of the photo")
            .allow_hyphen_values(true))
        .arg(args::switch("tileable", "Make right fit left, and bottom top: another texture with the same statistics"))
        .arg(args::switch("keep-contrast", "Make up for what a scale above 1 takes away, so that the contrast stays"))
        .arg(
            Arg::new("bits")
                .long("bits")
                .value_name("WORD")
                .default_value("auto")
                .value_parser(PossibleValuesParser::new(["auto", "8", "16", "float"]))
                .help("Bits of a sample; float is not clipped and needs EXR or TIFF. auto: float for EXR, else 8"),
        );
    args::without_chance(command)
}

fn number(
    name: &'static str,
    value: &'static str,
    default: &'static str,
    help: &'static str,
) -> Arg {
    Arg::new(name)
        .long(name)
        .value_name(value)
        .default_value(default)
        .value_parser(value_parser!(String))
        .allow_negative_numbers(true)
        .help(help)
}

/// What was typed.
#[derive(Debug)]
struct Request {
    document: PathBuf,
    output: Target,
    size: Size,
    /// Of the size 1 x 1.
    params: RenderParams,
    force: bool,
}

/// Runs `texforge noise render`.
///
/// # Errors
/// Whatever keeps it from being done; then no file was written.
pub(super) fn run(matches: &ArgMatches) -> Result<()> {
    let text = |id: &str| matches.get_one::<String>(id).map_or("", String::as_str);
    let output = target(matches)?;
    let quoted = |id: &str| format!("`{}`", text(id));
    let size = Size::parse(text("size"))
        .ok_or_else(|| Error::parameter("size", Size::expected(), quoted("size")))?;
    let scale = text("scale")
        .parse()
        .map_err(|_| Error::parameter("scale", "a number", quoted("scale")))?;
    let origin = text("origin").split_once(',').and_then(|(x, y)| {
        let [x, y] = [x, y].map(|number| number.trim().parse().ok());
        Some([x?, y?])
    });
    let origin = origin.ok_or_else(|| {
        let expected = "two numbers with a comma in between, e.g. 100,-50";
        Error::parameter("origin", expected, quoted("origin"))
    })?;
    let format = output.file().map_or(Some(Format::Png), Format::from_extension);
    let samples = match text("bits") {
        "16" => SampleType::U16,
        "float" if !matches!(format, Some(Format::Exr | Format::Tiff)) => {
            let expected = "8 or 16 for this format; EXR and TIFF hold floats";
            return Err(Error::parameter("bits", expected, "`float`"));
        }
        "float" => SampleType::F32,
        "auto" if format == Some(Format::Exr) => SampleType::F32,
        _ => SampleType::U8,
    };
    let params = RenderParams {
        scale,
        origin,
        tileable: matches.get_flag("tileable"),
        keep_contrast: matches.get_flag("keep-contrast"),
        samples,
        ..RenderParams::new((1, 1))
    };
    let force = matches.get_flag("force");
    let request = Request { document: path(matches, "document"), output, size, params, force };
    let (ctx, session) = Session::begin(matches)?;
    let summary = supervise(&session, move |session| work(session, &ctx, &request))?;
    if matches.get_flag("json") { print_json(&summary) } else { Ok(()) }
}

fn work(session: &Session, ctx: &Ctx, request: &Request) -> Result<serde_json::Value> {
    let texture = read(&request.document)?;
    let size = match request.size {
        Size::Auto => texture.document().size.map(|n| n as usize).into(),
        Size::Pixels { width, height } => (width, height),
    };
    let params = RenderParams { size, ..request.params };
    let outputs = places(&texture, ctx, request)?;
    let record = record(&texture, &params);
    let options = |i: usize, kind| WriteOptions {
        kind,
        record: (i == 0).then(|| record.clone()),
        force: true,
    };
    let streams =
        |(path, _): &(PathBuf, MapKind)| Format::from_extension(path).is_some_and(Format::streams);
    let mut piped = None;
    if request.output == Target::Stdout {
        let (_, kind, picture) = texture.render(ctx, &params)?.remove(0);
        piped = Some(files::encode(&picture, None, kind, Some(&record))?);
    } else if outputs.iter().all(streams) {
        let files: Vec<(&Path, WriteOptions)> = outputs
            .iter()
            .enumerate()
            .map(|(i, (path, kind))| (path.as_path(), options(i, *kind)))
            .collect();
        let strips = texture.strips(ctx, &params, STRIP_PIXELS)?;
        let pictures = strips.map(|strip| Ok(strip?.into_iter().map(|(_, _, p)| p).collect()));
        write_strips(&session.staging, &files, size.1, pictures)?;
    } else {
        let maps = texture.render(ctx, &params)?;
        for (i, ((path, kind), (_, _, picture))) in outputs.iter().zip(&maps).enumerate() {
            session.check()?;
            let record = options(i, *kind).record;
            let bytes = files::encode(picture, Some(path), *kind, record.as_deref())?;
            session.staging.stage(path, &bytes)?;
        }
    }
    session.staging.commit(request.force)?;
    if let Some(bytes) = piped {
        to_stdout(&bytes)?;
    }
    let (width, height) = size;
    for (path, _) in outputs.iter().skip(1) {
        session.console.say(&format!("{}  {width}x{height}", path.display()));
    }
    let elapsed = session.console.elapsed();
    let line = format!("{}  {width}x{height}, {}", shown(&request.output), duration(elapsed));
    session.console.say(&line);
    let written = texture
        .document()
        .maps
        .iter()
        .zip(&outputs)
        .map(|(map, (path, _))| Written::new("map", Some(&map.name), path, width, height));
    Ok(json!({
        "schema_version": SCHEMA_VERSION,
        "verb": "noise render",
        "version": env!("CARGO_PKG_VERSION"),
        "threads": ctx.threads(),
        "params": described(&params),
        "files": written.collect::<Vec<_>>(),
        "seconds": { "total": elapsed.as_secs_f64() },
    }))
}

/// The file of every map; fails if one cannot be written.
fn places(texture: &NoiseTexture, ctx: &Ctx, request: &Request) -> Result<Vec<(PathBuf, MapKind)>> {
    let maps = &texture.document().maps;
    let first = match request.output.file() {
        None if maps.len() > 1 => {
            let expected = "a file for a texture of several maps";
            return Err(Error::parameter("output", expected, "`-`"));
        }
        None => return Ok(Vec::new()),
        Some(first) => first,
    };
    // A pixel shows whether the formats can hold the maps.
    let pixels = texture.render(ctx, &request.params)?;
    let mut places: Vec<(PathBuf, MapKind)> = Vec::new();
    for (i, (name, kind, pixel)) in pixels.iter().enumerate() {
        if !is_plain(name) {
            return Err(Error::Decode {
                path: request.document.clone(),
                reason: format!("a file cannot be named after its map `{name}`; call it otherwise"),
            });
        }
        let path = if i == 0 { first.to_owned() } else { output_path(first, name, pixel) };
        if places.iter().any(|(other, _)| *other == path) {
            let got = format!("{} twice", path.display());
            return Err(Error::parameter("output", "a file of its own for each map", got));
        }
        files::check_place(&path, &[&request.document], request.force)?;
        files::ensure_can_hold(pixel, Some(&path), *kind)?;
        places.push((path, *kind));
    }
    Ok(places)
}

fn described(params: &RenderParams) -> Typed {
    let bits = match params.samples {
        SampleType::U8 => "8",
        SampleType::U16 => "16",
        SampleType::F32 => "float",
    };
    let (width, height) = params.size;
    Typed::from([
        ("size", json!(format!("{width}x{height}"))),
        ("scale", json!(params.scale)),
        ("origin", json!(params.origin)),
        ("tileable", json!(params.tileable)),
        ("keep_contrast", json!(params.keep_contrast)),
        ("bits", json!(bits)),
    ])
}

/// How the picture was made, for the file itself.
fn record(texture: &NoiseTexture, params: &RenderParams) -> String {
    let seed = u64::from(texture.document().seed);
    record_of("noise render", env!("CARGO_PKG_VERSION"), seed, &described(params)).to_string()
}
