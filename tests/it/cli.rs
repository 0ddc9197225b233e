//! The program as a user meets it: a process, real files, exit statuses.

use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use texforge::{Encoding, ErrorKind, Samples, TileParams};

use crate::support::{Folder, PROGRAM, Pixels};

/// A quick run: `texforge tile photo.png -o tile.png` and these.
fn quick<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let mut args =
        vec!["tile", "photo.png", "-o", "tile.png", "--size", "48", "--quality", "draft"];
    args.extend(more);
    args
}

fn json(folder: &Folder, args: &[&str]) -> serde_json::Value {
    let output = folder.run(args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object on standard output")
}

mod success {
    use super::*;

    #[test]
    fn a_tile_is_written_and_the_seed_is_said() {
        let folder = Folder::with_photo();
        let said = folder.does(&quick(&[]));
        assert!(said.contains("tile.png  48x48, seed 0, "), "{said}");
        assert!(said.contains("texture cost") && said.contains("stationarity cost"), "{said}");
        let tile = folder.png("tile.png");
        assert_eq!((tile.width, tile.height), (48, 48));
        assert_eq!(folder.names(), ["photo.png", "tile.png"]);
    }

    #[test]
    fn the_default_size_is_explained() {
        let folder = Folder::with_photo();
        let said = folder.does(&["tile", "photo.png", "-o", "tile.png", "--quality", "draft"]);
        assert!(said.contains("64x64 (default size for a 96x96 photo)"), "{said}");
    }

    #[test]
    fn json_holds_what_was_done() {
        let folder = Folder::with_photo();
        let v = json(&folder, &quick(&["--json", "--seed", "7", "--threads", "1"]));
        assert_eq!(v["schema_version"], 1);
        assert_eq!((&v["verb"], &v["seed"], &v["threads"]), (&"tile".into(), &7.into(), &1.into()));
        assert_eq!(v["params"]["size"], "48x48", "resolved");
        assert_eq!(v["params"]["patch"], 11, "a number");
        assert_eq!(v["photo"]["width"], 96);
        assert_eq!((&v["tile"]["path"], &v["tile"]["height"]), (&"tile.png".into(), &48.into()));
        assert!(v["costs"]["texture"].is_number() && v["costs"]["stationarity"].is_number());
        assert!(v["seconds"]["total"].is_number() && v["seconds"]["stages"].is_object());
        assert_eq!(v["files"][0]["role"], "tile");
        assert!(v["notes"].is_array());
    }

    #[test]
    fn json_keeps_the_stages_in_order() {
        let folder = Folder::with_photo();
        let output = folder.run(quick(&["--json"]));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let place = |stage: &str| text.find(&format!("\"{stage}\": ")).expect(stage);
        let stages = text.find("\"stages\"").expect("stages");
        let costs = text[stages..].find("\"costs\": ").expect("costs") + stages;
        assert!(stages < place("synthesis") && place("synthesis") < costs, "{text}");
    }

    #[test]
    fn quiet_says_nothing() {
        let folder = Folder::with_photo();
        assert_eq!(folder.does(&quick(&["-q"])), "");
    }

    #[test]
    fn force_overwrites() {
        let folder = Folder::with_photo();
        std::fs::write(folder.at("tile.png"), b"old").expect("old");
        folder.does(&quick(&["--force"]));
        assert_eq!(folder.png("tile.png").width, 48, "a picture now");
        assert_eq!(folder.names(), ["photo.png", "tile.png"], "nothing else is left");
    }

    #[test]
    fn the_same_seed_gives_the_same_file_at_any_thread_count() {
        let folder = Folder::with_photo();
        let tile = |threads: &str| {
            folder.does(&quick(&["--force", "--threads", threads]));
            std::fs::read(folder.at("tile.png")).expect("tile")
        };
        let one = tile("1");
        assert!(one == tile("2") && one == tile("5"));
        folder.does(&quick(&["--force", "--seed", "1"]));
        assert!(one != std::fs::read(folder.at("tile.png")).expect("tile"), "another seed");
    }

    #[test]
    fn preview_is_three_by_three() {
        let folder = Folder::with_photo();
        let said = folder.does(&quick(&["--preview"]));
        assert!(said.contains("tile.preview.png"), "{said}");
        let (tile, preview) = (folder.png("tile.png"), folder.png("tile.preview.png"));
        assert_eq!((preview.width, preview.height), (144, 144));
        for (x, y) in (0..144).flat_map(|y| (0..144).map(move |x| (x, y))) {
            assert_eq!(preview.at(x, y), tile.at(x % 48, y % 48), "at {x}, {y}");
        }
    }

    #[test]
    fn the_picture_goes_to_standard_output() {
        let folder = Folder::with_photo();
        let args = ["tile", "photo.png", "-o", "-", "--size", "48", "--quality", "draft"];
        let output = folder.run(args);
        assert!(output.status.success());
        let piped = Pixels::decode(&output.stdout);
        assert_eq!(folder.names(), ["photo.png"]);
        folder.does(&quick(&[]));
        assert!(piped == folder.png("tile.png"));
    }

    #[test]
    fn maps_follow_the_tile() {
        let folder = Folder::with_photo();
        folder.grey16("photo_height.png", 96, 96, 2);
        // The photo itself as a map: then map and tile must agree pixel by pixel.
        folder.rgb("copy.png", 96, 96, 1);
        let said = folder.does(&quick(&["--map", "emission=copy.png"]));
        assert!(said.contains("photo_height.png: taken as"), "{said}");
        assert!(folder.png("tile.png") == folder.png("tile_emission.png"));
        let height = folder.png("tile_height.png");
        assert_eq!((height.channels, height.deep), (1, true), "the map's own depth");
    }

    #[test]
    fn maps_beside_the_photo_can_be_left_alone() {
        let folder = Folder::with_photo();
        folder.grey16("photo_height.png", 96, 96, 2);
        folder.does(&quick(&["--no-maps"]));
        assert_eq!(folder.names(), ["photo.png", "photo_height.png", "tile.png"]);
    }

    #[test]
    fn a_map_beside_the_photo_that_does_not_fit_is_left_alone_with_a_note() {
        let folder = Folder::with_photo();
        folder.grey16("photo_height.png", 96, 40, 2);
        let said = folder.does(&quick(&[]));
        assert!(said.contains("note: photo_height.png was left alone"), "{said}");
        assert!(!folder.at("tile_height.png").exists());
    }

    #[test]
    fn apply_repeats_what_the_run_did_to_a_map() {
        let folder = Folder::with_photo();
        folder.grey16("h.png", 96, 96, 2);
        folder.does(&quick(&["--map", "height=h.png", "--save-source-map", "source.exr"]));
        let said =
            folder.does(&["apply", "source.exr", "h.png", "-o", "late.png", "--kind", "data"]);
        assert!(said.contains("late.png  48x48"), "{said}");
        let bytes = |name: &str| std::fs::read(folder.at(name)).expect("file");
        assert!(bytes("late.png") == bytes("tile_height.png"), "the identical bytes");
        let v = json(&folder, &["apply", "source.exr", "h.png", "-o", "later.png", "--json"]);
        assert_eq!((&v["verb"], &v["width"]), (&"apply".into(), &48.into()));
    }

    #[test]
    fn a_mask_keeps_the_rest_of_the_photo_out() {
        let folder = Folder::new();
        // Left half black, right half not: only the right one is allowed.
        folder.rgb_from("photo.png", 96, 96, |x, y| {
            if x < 48 { [0; 3] } else { [120 + (x * y % 100) as u8; 3] }
        });
        folder.mask("mask.png", 96, |x, _| x >= 48);
        folder.does(&quick(&["--mask", "mask.png"]));
        let tile = folder.png("tile.png");
        assert!(tile.samples.iter().all(|v| *v >= 120), "a masked pixel was used");
    }

    #[test]
    fn names_may_hold_any_letters() {
        let folder = Folder::new();
        folder.rgb("Ziegel 煉瓦 ö.png", 96, 96, 1);
        let long = format!("{}.png", "ü".repeat(100));
        let args = ["tile", "Ziegel 煉瓦 ö.png", "-o", &long, "--size", "48", "--quality", "draft"];
        folder.does(&args);
        assert!(folder.at(&long).exists());
    }

    #[test]
    fn info_tells_the_file() {
        let folder = Folder::with_photo();
        folder.does(&quick(&[]));
        let v = json(&folder, &["info", "tile.png", "--json"]);
        assert_eq!((&v["width"], &v["type"]), (&48.into(), &"uint8".into()));
        assert_eq!(v["record"]["params"]["size"], "48x48", "how it was made: {v}");
    }
}

mod telling {
    use super::*;

    #[test]
    fn no_arguments_are_answered_with_help_and_status_2() {
        let output = Folder::new().run([""; 0]);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains("Examples:"));
    }

    #[test]
    fn help_begins_with_examples_and_holds_the_schema() {
        let output = Folder::new().run(["tile", "--help"]);
        assert_eq!(output.status.code(), Some(0));
        let help = String::from_utf8(output.stdout).expect("text");
        assert!(help.starts_with("Examples:\n"), "{help}");
        for param in TileParams::schema() {
            assert!(help.contains(&format!("--{}", param.name.replace('_', "-"))), "{help}");
        }
    }

    #[test]
    fn version_params_completions_and_man() {
        let folder = Folder::new();
        let says = |args: &[&str]| {
            let output = folder.run(args);
            assert_eq!(output.status.code(), Some(0), "{args:?}");
            String::from_utf8(output.stdout).expect("text")
        };
        assert!(says(&["--version"]).starts_with("texforge "));
        assert!(says(&["params"]).contains("--uniformity"));
        assert!(says(&["params", "tile"]).contains("0.01 to 1"));
        let v = json(&folder, &["params", "--json"]);
        assert_eq!(v["tile"][0]["name"], "size");
        assert_eq!(v["lattice"][0]["flag"], "--min-confidence");
        let v = json(&folder, &["params", "lattice", "--json"]);
        assert_eq!(v["lattice"][1]["range"], "0 to 65536");
        assert!(v.get("tile").is_none(), "only what was asked for: {v}");
        assert!(says(&["completions", "bash"]).contains("--uniformity"));
        assert!(says(&["man", "tile"]).contains(".TH"));
    }
}

mod refusal {
    use super::*;

    #[test]
    fn outputs_that_cannot_be() {
        let folder = Folder::with_photo();
        folder.rgb("old.png", 8, 8, 1);
        let to = |output: &'static str| ["tile", "photo.png", "-o", output];
        folder.refuses(&to("old.png"), 1, "exists already");
        folder.refuses(&to("photo.png"), 1, "also an input");
        folder.refuses(&["tile", "photo.png", "-o", "photo.png", "--force"], 1, "also an input");
        folder.refuses(&to("tile.docx"), 1, "tile.docx");
        folder.refuses(&to("tile"), 1, "extension");
        folder.refuses(&to("missing/tile.png"), 1, "missing/tile.png");
        folder.refuses(&quick(&["--save-source-map", "tile.png"]), 2, "twice");
        folder.refuses(&quick(&["--preview", "--save-source-map", "old.png"]), 1, "old.png");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_folder_that_takes_no_files() {
        // Not even root can create files here.
        let folder = Folder::with_photo();
        folder.refuses(&["tile", "photo.png", "-o", "/proc/tile.png"], 1, "/proc/tile.png");
    }

    #[test]
    fn photos_that_are_none() {
        let folder = Folder::with_photo();
        let whole = std::fs::read(folder.at("photo.png")).expect("photo");
        std::fs::write(folder.at("half.png"), &whole[..whole.len() / 2]).expect("half");
        std::fs::write(folder.at("empty.png"), b"").expect("empty");
        std::fs::write(folder.at("text.png"), b"I am not a picture.").expect("text");
        for photo in ["half.png", "empty.png", "text.png", "missing.png"] {
            folder.refuses(&["tile", photo, "-o", "tile.png"], 1, photo);
        }
        folder.refuses(&["tile", ".", "-o", "tile.png"], 1, "cannot read");
        folder.refuses(&["info", "half.png"], 1, "half.png");
    }

    #[test]
    fn a_photo_with_nan() {
        let folder = Folder::new();
        exr::prelude::write_rgb_file(folder.at("nan.exr"), 64, 64, |x, y| {
            (if (x, y) == (5, 3) { f32::NAN } else { 0.5 }, 0.5, 0.5)
        })
        .expect("EXR");
        let args = ["tile", "nan.exr", "-o", "tile.exr", "--size", "48"];
        folder.refuses(&args, 1, "row 3, column 5");
    }

    #[test]
    fn values_that_the_format_cannot_hold_are_refused_before_the_work() {
        let folder = Folder::new();
        exr::prelude::write_rgb_file(folder.at("hdr.exr"), 96, 96, |x, y| {
            (if (x, y) == (90, 90) { 7.5 } else { 0.5 }, 0.5, 0.25)
        })
        .expect("EXR");
        // So large that the test would time out if it were tried.
        let args = ["tile", "hdr.exr", "-o", "tile.png", "--size", "8192", "--quality", "best"];
        folder.refuses(&args, 1, "7.5");
        folder.refuses(&["tile", "hdr.exr", "-o", "tile.jpg", "--size", "48"], 1, "tile.jpg");
    }

    #[test]
    fn a_photo_smaller_than_the_patch() {
        let folder = Folder::new();
        folder.rgb("photo.png", 8, 8, 1);
        folder.refuses(&quick(&["--patch", "11"]), 1, "8x8");
        // The same refusal by its name, for programs.
        let photo = texforge::Picture::new(8, 8, 1, Samples::U8(vec![7; 64]), Encoding::Srgb);
        let ctx = texforge::Ctx::new(0, 1).expect("context");
        let error = texforge::tile(&ctx, &photo.expect("photo"), None, &TileParams::default());
        assert_eq!(error.expect_err("too small").kind(), ErrorKind::TooSmall);
    }

    #[test]
    fn masks_that_do_not_fit() {
        let folder = Folder::with_photo();
        folder.mask("small.png", 50, |_, _| true);
        folder.mask("none.png", 96, |_, _| false);
        folder.mask("dots.png", 96, |x, y| x % 5 == 0 && y % 5 == 0);
        folder.refuses(&quick(&["--mask", "small.png"]), 1, "the mask is 50x50");
        folder.refuses(&quick(&["--mask", "none.png"]), 1, "the mask leaves no");
        folder.refuses(&quick(&["--mask", "dots.png"]), 1, "the mask leaves no");
    }

    #[test]
    fn maps_that_do_not_fit() {
        let folder = Folder::with_photo();
        folder.grey16("flat.png", 96, 40, 1);
        folder.grey16("good.png", 96, 96, 1);
        folder.refuses(&quick(&["--map", "height=flat.png"]), 1, "96x40");
        folder.refuses(&quick(&["--map", "blorb=good.png"]), 2, "blorb");
        folder.refuses(&quick(&["--map", "good.png"]), 2, "NAME=FILE");
        folder.refuses(&quick(&["--map", "height=missing.png"]), 1, "missing.png");
        let twice = ["--map", "height=good.png", "--map", "height=flat.png"];
        folder.refuses(&quick(&twice), 2, "twice");
        let blended = ["--method", "make-seamless", "--map", "height=good.png"];
        folder.refuses(&quick(&blended), 2, "`method`");
        std::fs::write(folder.at("tile_height.png"), b"mine").expect("file");
        folder.refuses(&quick(&["--map", "height=good.png"]), 1, "tile_height.png exists");
    }

    #[test]
    fn values_out_of_range() {
        let folder = Folder::with_photo();
        let with = |flag, value| ["tile", "photo.png", "-o", "tile.png", flag, value];
        folder.refuses(&with("--patch", "99"), 2, "`patch`");
        folder.refuses(&with("--patch", "many"), 2, "`patch`");
        folder.refuses(&with("--sigma", "NaN"), 2, "`sigma`");
        folder.refuses(&with("--sigma", "-1"), 2, "`sigma`");
        folder.refuses(&with("--size", "big"), 2, "`size`");
        folder.refuses(&with("--axis", "z"), 2, "--axis");
        folder.refuses(&with("--seed", "-1"), 2, "--seed");
        folder.refuses(&with("--threads", "99999"), 2, "`threads`");
        folder.refuses(&with("--blorb", "1"), 2, "--blorb");
    }

    #[test]
    fn sizes_that_hold_nothing_or_too_much() {
        let folder = Folder::with_photo();
        for size in ["0x5", "5x0", "99999999x99999999", "18446744073709551615x2", "60000x60000"] {
            let before = folder.contents();
            let output = folder.run(["tile", "photo.png", "-o", "tile.png", "--size", size]);
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(matches!(output.status.code(), Some(1 | 2)), "{size}: {said}");
            assert!(said.starts_with("texforge: ") && !said.contains("panicked"), "{size}: {said}");
            assert!(folder.contents() == before);
        }
    }

    #[test]
    fn standard_output_takes_one_thing() {
        let folder = Folder::with_photo();
        for flag in ["--json", "--preview", "--map=height=photo.png"] {
            folder.refuses(&["tile", "photo.png", "-o", "-", flag], 2, "standard output");
        }
    }

    #[test]
    fn source_maps_that_are_none() {
        let folder = Folder::with_photo();
        folder.refuses(&["apply", "photo.png", "photo.png", "-o", "map.png"], 1, "photo.png");
        folder.refuses(&["apply", "missing.exr", "photo.png", "-o", "map.png"], 1, "missing.exr");
    }
}

#[cfg(unix)]
mod interruption {
    use super::*;

    /// Longer than any test machine needs, shorter than a hang.
    const BOUND: Duration = Duration::from_secs(2);

    /// Starts a run that takes long and waits until it has looked at the map beside the photo.
    fn long_run(folder: &Folder) -> Child {
        folder.rgb("photo.png", 512, 512, 1);
        folder.rgb("photo_height.png", 512, 512, 2);
        let args = "tile photo.png -o tile.png --size 2048x2048 --quality best --preview";
        let mut child = Command::new(PROGRAM)
            .args(args.split(' '))
            .current_dir(folder.at(""))
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program runs");
        let mut said = BufReader::new(child.stderr.take().expect("piped"));
        let mut line = String::new();
        said.read_line(&mut line).expect("a line");
        assert!(line.contains("taken as"), "{line}");
        // Keep the pipe: the program still has something to say.
        child.stderr = Some(said.into_inner());
        std::thread::sleep(Duration::from_millis(100));
        child
    }

    fn signal(child: &Child, name: &str) {
        let sent = Command::new("kill").args([name, &child.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
    }

    fn stops(name: &str) {
        let folder = Folder::new();
        let mut child = long_run(&folder);
        let asked = Instant::now();
        signal(&child, name);
        let status = child.wait().expect("ended");
        assert!(asked.elapsed() < BOUND, "took {:?}", asked.elapsed());
        let mut said = String::new();
        child.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
        assert_eq!(status.code(), Some(130), "{said}");
        assert!(said.contains("interrupted"), "{said}");
        assert_eq!(folder.names(), ["photo.png", "photo_height.png"], "nothing is left");
    }

    #[test]
    fn ctrl_c_stops_the_run_and_leaves_nothing() {
        stops("-INT");
    }

    #[test]
    fn termination_stops_the_run_and_leaves_nothing() {
        stops("-TERM");
    }

    #[test]
    fn reading_can_be_interrupted() {
        // A pipe that nobody writes to: the read never returns.
        let folder = Folder::new();
        let made = Command::new("mkfifo").arg(folder.at("photo.png")).status();
        assert!(made.expect("mkfifo runs").success());
        let mut child = Command::new(PROGRAM)
            .args(["tile", "photo.png", "-o", "tile.png"])
            .current_dir(folder.at(""))
            .stderr(Stdio::null())
            .spawn()
            .expect("the program runs");
        std::thread::sleep(Duration::from_millis(300));
        let asked = Instant::now();
        signal(&child, "-INT");
        let status = child.wait().expect("ended");
        assert!(asked.elapsed() < BOUND, "took {:?}", asked.elapsed());
        assert_eq!(status.code(), Some(130));
        assert_eq!(folder.names(), [""; 0]);
    }

    #[test]
    fn a_reader_that_goes_away_is_no_failure() {
        let folder = Folder::with_photo();
        let end = |args: &[&str]| {
            let mut child = Command::new(PROGRAM)
                .args(args)
                .current_dir(folder.at(""))
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .expect("the program runs");
            drop(child.stdout.take());
            let output = child.wait_with_output().expect("ended");
            assert_eq!(output.status.code(), Some(0), "{args:?}");
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(!said.contains("texforge: ") && !said.contains("panicked"), "{said}");
        };
        end(&["completions", "bash"]);
        end(&["params", "--json"]);
        end(&["--help"]);
        end(&["tile", "photo.png", "-o", "-", "--size", "48", "--quality", "draft"]);
    }
}

#[test]
fn the_study_is_in_the_python_package() {
    let folder = Folder::with_photo();
    folder.refuses(&["study", ".", "-o", "out"], 1, "`study` comes with the Python package");
    folder.refuses(&["study", ".", "-o", "out", "--seeds", "0"], 2, "--seeds");
}
