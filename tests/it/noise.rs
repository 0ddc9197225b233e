//! `texforge noise` as a user meets it: files, exit statuses, what is refused.

use proptest::prelude::*;
use texforge::{Ctx, ErrorKind, NoiseTexture, RenderParams, SampleType, Samples};

use crate::support::{Folder, Pixels};

/// A texture of colours and heights.
const DOCUMENT: &str = r#"{"format":"texforge-noise","version":1,"seed":3,"size":[96,64],"maps":[
    {"name":"basecolor","kind":"color","encoding":"srgb","channels":3},
    {"name":"height","kind":"data","encoding":"data","channels":1}],
    "mean":[0.5,0.4,0.3,0.6],"matrix":[[0.6,0.2],[0.5,-0.3],[0.4,0.1],[0.2,0.7]],
    "model":{"wavelet":{"bands":"round","channels":[
        {"weights":[0.02,0.05,0.04,0.01]},{"weights":[0.0,0.01,0.02,0.03]}]}},
    "score":{"fit":0.8,"recommended":"wavelet"}}"#;

/// A folder with a photo, and its texture as `stone.json`.
fn fitted() -> Folder {
    let folder = Folder::with_photo();
    folder.does(&["noise", "fit", "photo.png", "-o", "stone.json", "-q"]);
    folder
}

fn text(folder: &Folder, name: &str) -> String {
    std::fs::read_to_string(folder.at(name)).expect("a document")
}

fn document(folder: &Folder, name: &str) -> serde_json::Value {
    serde_json::from_str(&text(folder, name)).expect("JSON")
}

fn json(folder: &Folder, args: &[&str]) -> serde_json::Value {
    let output = folder.run(args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object on standard output")
}

mod fit {
    use super::*;

    #[test]
    fn a_document_is_written_and_described() {
        let folder = Folder::with_photo();
        let said = folder.does(&["noise", "fit", "photo.png", "-o", "stone.json", "--seed", "7"]);
        assert!(said.contains("stone.json  ") && said.contains(" bytes, "), "{said}");
        assert!(said.contains("bands, seed 7, fit "), "{said}");
        let stone = document(&folder, "stone.json");
        assert_eq!((&stone["format"], &stone["version"]), (&"texforge-noise".into(), &1.into()));
        assert_eq!((&stone["seed"], &stone["size"][1]), (&7.into(), &96.into()));
        assert!(text(&folder, "stone.json").len() < 2048);
        assert_eq!(folder.names(), ["photo.png", "stone.json"]);
    }

    #[test]
    fn json_holds_what_was_done() {
        let folder = Folder::with_photo();
        let args = ["noise", "fit", "photo.png", "-o", "a.json", "--json", "--bands", "square"];
        let v = json(&folder, &args);
        assert_eq!((&v["schema_version"], &v["verb"]), (&1.into(), &"noise fit".into()));
        assert_eq!(v["params"]["bands"], "square");
        assert_eq!((&v["photo"]["width"], &v["path"]), (&96.into(), &"a.json".into()));
        assert_eq!(v["bytes"], text(&folder, "a.json").len() - 1);
        assert!(v["score"]["fit"].is_number() && v["seconds"]["total"].is_number());
    }

    #[test]
    fn the_same_photo_gives_the_same_document_at_any_thread_count() {
        let folder = Folder::with_photo();
        let fit = |threads: &str| {
            let args = ["noise", "fit", "photo.png", "-o", "-", "-q", "--threads", threads];
            folder.run(args).stdout
        };
        let one = fit("1");
        assert!(one == fit("2") && one == fit("5"));
        folder.does(&["noise", "fit", "photo.png", "-o", "file.json"]);
        assert_eq!(text(&folder, "file.json").into_bytes(), one);
    }

    #[test]
    fn maps_are_fitted_together_and_rendered_side_by_side() {
        let folder = Folder::with_photo();
        folder.grey16("height.png", 96, 96, 2);
        let args = ["noise", "fit", "photo.png", "-o", "wall.json", "--map", "height=height.png"];
        folder.does(&args);
        folder.does(&["noise", "render", "wall.json", "-o", "wall.png", "--size", "40x30"]);
        assert_eq!(folder.png("wall.png").channels, 3);
        let height = folder.png("wall_height.png");
        assert_eq!((height.width, height.height, height.channels), (40, 30, 1));
        folder.refuses(
            &["noise", "render", "wall.json", "-o", "-"],
            2,
            "a file for a texture of several maps",
        );
        folder.refuses(&["noise", "render", "wall.json", "-o", "wall.png"], 1, "exists already");
    }

    #[test]
    fn a_mask_leaves_out() {
        let folder = Folder::new();
        // The right half is black.
        folder.rgb_from("photo.png", 96, 96, |x, y| {
            if x < 48 { [200 + (x * 7 + y * 13) as u8 % 40; 3] } else { [0; 3] }
        });
        folder.mask("mask.png", 96, |x, _| x < 48);
        folder.does(&["noise", "fit", "photo.png", "-o", "a.json", "--mask", "mask.png"]);
        let mean = document(&folder, "a.json")["mean"][0].as_f64().expect("mean");
        assert!((0.8..0.95).contains(&mean), "{mean}");
    }

    #[test]
    fn photos_without_texture_are_refused() {
        let folder = Folder::with_photo();
        folder.rgb_from("plain.png", 64, 64, |_, _| [7, 8, 9]);
        folder.rgb_from("dot.png", 1, 1, |_, _| [7, 8, 9]);
        folder.rgb("small.png", 48, 48, 1);
        folder.mask("none.png", 96, |_, _| false);
        let fit = |more: &[&'static str]| {
            let mut args = vec!["noise", "fit"];
            args.extend(more);
            args.extend(["-o", "a.json"]);
            args
        };
        folder.refuses(&fit(&["plain.png"]), 1, "one colour only");
        folder.refuses(&fit(&["dot.png"]), 1, "1x1 pixels");
        folder.refuses(&fit(&["photo.png", "--mask", "none.png"]), 1, "usable pixels");
        folder.refuses(&fit(&["photo.png", "--mask", "small.png"]), 1, "expected 96x96");
        folder.refuses(&fit(&["photo.png", "--map", "height=small.png"]), 1, "expected 96x96");
        folder.refuses(&fit(&["photo.png", "--seed", "4294967296"]), 2, "`seed` must be at most");
        folder.refuses(&fit(&["photo.png", "--bands", "oval"]), 2, "oval");
        folder.refuses(&fit(&["none.jpg"]), 1, "cannot read none.jpg");
        let same = ["noise", "fit", "photo.png", "-o", "photo.png", "--force"];
        folder.refuses(&same, 1, "is also an input");
        folder.refuses(&["noise", "fit", "photo.png", "-o", "x/a.json"], 1, "cannot write");
        folder.refuses(&["noise", "fit", "photo.png", "-o", "-", "--json"], 2, "left out");
    }
}

mod render {
    use super::*;

    #[test]
    fn any_part_in_any_type() {
        let folder = fitted();
        folder.does(&["noise", "render", "stone.json", "-o", "whole.png", "--size", "80x60"]);
        let args = ["noise", "render", "stone.json", "-o", "part.png", "--size", "20x10"];
        folder.does(&[&args[..], &["--origin", "30,-5"]].concat());
        let (whole, part) = (folder.png("whole.png"), folder.png("part.png"));
        for (x, y) in (0..20).flat_map(|x| (5..10).map(move |y| (x, y))) {
            assert_eq!(part.at(x, y), whole.at(x + 30, y - 5), "{x} {y}");
        }
        folder.does(&["noise", "render", "stone.json", "-o", "a.tif", "--bits", "float"]);
        folder.does(&["noise", "render", "stone.json", "-o", "deep.png", "--bits", "16"]);
        assert!(folder.png("deep.png").deep);
        assert_eq!(folder.png("deep.png").width, 96, "the photo's size");
        folder.does(&["noise", "render", "stone.json", "-o", "a.jpg", "--size", "32"]);
        folder.does(&["noise", "render", "stone.json", "-o", "a.exr", "--size", "32"]);
        assert_eq!(json(&folder, &["info", "a.exr", "--json"])["type"], "float32");
        let piped = folder.run(["noise", "render", "stone.json", "-o", "-", "--size", "80x60"]);
        assert!(Pixels::decode(&piped.stdout) == whole);
        let info = json(&folder, &["info", "part.png", "--json"]);
        assert_eq!(info["record"]["verb"], "noise render");
        assert_eq!(info["record"]["params"]["origin"][1], -5.0);
    }

    #[test]
    fn the_same_bytes_with_any_number_of_threads() {
        let folder = fitted();
        for tileable in [&[][..], &["--tileable"]] {
            let of = |threads: &str| {
                let args = ["noise", "render", "stone.json", "-o", "-", "--size", "200x77"];
                let more = ["--scale", "0.7", "--threads", threads];
                folder.run([&args[..], &more, tileable].concat()).stdout
            };
            let one = of("1");
            assert!(!one.is_empty() && one == of("2") && one == of("3"));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn strips_are_the_whole(
            width in 1usize..60, height in 1usize..60, pixels in 1usize..900, tileable: bool,
            scale in 0.2..3.0f64, seed in 0u32..9,
        ) {
            let json = DOCUMENT.replace("\"seed\":3", &format!("\"seed\":{seed}"));
            let texture = NoiseTexture::from_json(&json).expect("a document");
            let ctx = Ctx::new(0, 2).expect("threads");
            let origin = [-31.5, 1e6];
            let params = RenderParams { scale, tileable, origin, ..RenderParams::new((width, height)) };
            let whole = texture.render(&ctx, &params).expect("whole");
            for (i, (_, _, picture)) in whole.iter().enumerate() {
                let mut rows = Vec::new();
                for strip in texture.strips(&ctx, &params, pixels).expect("strips") {
                    let Samples::U8(samples) = strip.expect("strip")[i].2.samples().clone() else { panic!("8 bits") };
                    rows.extend(samples);
                }
                prop_assert_eq!(&Samples::U8(rows), picture.samples());
            }
        }
    }

    /// By how much more power waves that run across have than those that run down, as a share, in the
    /// octaves of 1, 2 and 4 waves a picture on.
    fn directions(values: &[f32], n: usize) -> [f64; 3] {
        let turn = |k: usize| std::f64::consts::TAU * (k % n) as f64 / n as f64;
        let table: Vec<_> = (0..n).map(|k| turn(k).sin_cos()).collect();
        let (mut sums, mut powers) = ([0.0; 3], [0.0; 3]);
        for (x, y) in (0_i32..8).flat_map(|x| (0_i32..16).map(move |y| (x, y - 8))) {
            let square = f64::from(x * x + y * y);
            let octave = (0.5 * square.max(0.1).log2()).floor() as i32;
            if !(0..3).contains(&octave) || (x == 0 && y < 0) {
                continue;
            }
            let (mut re, mut im) = (0.0, 0.0);
            for (i, &v) in values.iter().enumerate() {
                let down = (y.rem_euclid(n as i32)) as usize * (i / n);
                let (sin, cos) = table[(x as usize * (i % n) + down) % n];
                (re, im) = (re + f64::from(v) * cos, im + f64::from(v) * sin);
            }
            let power = re * re + im * im;
            powers[octave as usize] += power;
            sums[octave as usize] += power * f64::from(x * x - y * y) / square;
        }
        [0, 1, 2].map(|k| sums[k] / powers[k])
    }

    #[test]
    fn small_tiles_have_no_stripes() {
        let ctx = Ctx::new(0, 2).expect("threads");
        for bands in ["round", "square"] {
            let mut mean = [0.0; 3];
            for seed in 0..8 {
                let json = format!(
                    r#"{{"format":"texforge-noise","version":1,"seed":{seed},"size":[64,64],"maps":[
                    {{"name":"height","kind":"data","encoding":"data","channels":1}}],
                    "mean":[0.5],"matrix":[[1.0]],"model":{{"wavelet":{{"bands":"{bands}",
                    "channels":[{{"weights":[0.1,0.1,0.1,0.1,0.1]}}]}}}},
                    "score":{{"fit":0.8,"recommended":"wavelet"}}}}"#
                );
                let texture = NoiseTexture::from_json(&json).expect("a document");
                let params = RenderParams {
                    tileable: true,
                    samples: SampleType::F32,
                    ..RenderParams::new((64, 64))
                };
                let picture = texture.render(&ctx, &params).expect("a picture").remove(0).2;
                let Samples::F32(values) = picture.samples() else { panic!("floats") };
                let found = directions(values, 64);
                mean.iter_mut().zip(found).for_each(|(mean, d)| *mean += d / 8.0);
            }
            // By chance octaves that overlap strengthen or weaken each other.
            assert!(mean.iter().all(|d| d.abs() < 0.15), "{bands}: {mean:?}");
        }
    }

    #[test]
    fn what_cannot_be_rendered_is_refused() {
        let folder = fitted();
        let cases: [(&[&str], &str); 11] = [
            (&["--size", "0"], "`size` must be"),
            (&["--size", "65537x3"], "`size` must be"),
            (&["--size", "-4"], "`size` must be"),
            (&["--scale", "0"], "`scale` must be"),
            (&["--scale", "nan"], "`scale` must be"),
            (&["--scale", "wide"], "`scale` must be a number"),
            (&["--origin", "3"], "`origin` must be two numbers"),
            (&["--origin", "0,1e10"], "`origin` must be within"),
            (&["--origin", "inf,0"], "`origin` must be within"),
            (&["--bits", "float"], "`bits` must be 8 or 16"),
            (&["--bits", "12"], "12"),
        ];
        for (more, needle) in cases {
            let args = ["noise", "render", "stone.json", "-o", "a.png"];
            folder.refuses(&[&args[..], more].concat(), 2, needle);
        }
        folder.refuses(&["noise", "render", "stone.json", "-o", "a.gif"], 1, "extension");
        folder.refuses(&["noise", "render", "stone.json", "-o", "stone.json"], 1, "stone.json");
    }

    #[test]
    fn bad_documents_get_one_sentence() {
        let folder = fitted();
        let good = text(&folder, "stone.json");
        let mut cases: Vec<(Vec<u8>, &str)> = vec![
            (b"".to_vec(), "cannot read bad.json"),
            (b"\xff\xfe{".to_vec(), "not text"),
            (b"[]".to_vec(), "not made by `noise fit`"),
            (b"{\"format\":\"texforge-noise\",\"version\":1}".to_vec(), "missing field"),
            (good[..good.len() / 2].into(), "it is not JSON"),
            (vec![b'['; 100_000], "it is not JSON"),
        ];
        for (from, to, needle) in [
            ("\"version\":1", "\"version\":2", "a newer texforge may read it"),
            ("\"version\":1", "\"version\":0", "its version is 0"),
            ("\"version\":1", "\"version\":\"1\"", "its version is none"),
            ("\"seed\":0", "\"seed\":-1", "invalid value"),
            ("\"seed\":0", "\"seed\":1e99", "invalid type"),
            ("\"seed\":0", "\"seed\":0,\"extra\":1", "unknown field"),
            ("\"size\":[96,96]", "\"size\":[0,96]", "its size is 0x96"),
            ("\"mean\":[", "\"mean\":[1e300,", "`mean` has 4 numbers"),
            ("\"mean\":[", "\"mean\":[NaN,", "it is not JSON"),
            ("\"matrix\":[[", "\"matrix\":[[2.0,", "a row of `matrix`"),
            ("\"kind\":\"color\"", "\"kind\":\"colour\"", "the kind of its map"),
            ("\"name\":\"basecolor\"", "\"name\":\"../a/b\"", "named after its map"),
            ("\"weights\":[", "\"weights\":[0.5,", "weights"),
            ("\"histogram\":[", "\"histogram\":[9.0,", "the histogram of"),
        ] {
            assert!(good.contains(from), "{from} is in {good}");
            let bad = good.replacen(from, to, 1);
            // A name is only bad for files.
            if !needle.contains("named after") {
                let error = NoiseTexture::from_json(&bad).expect_err(to);
                assert_eq!(error.kind(), ErrorKind::Document, "{error}");
            }
            cases.push((bad.into_bytes(), needle));
        }
        for (bytes, needle) in cases {
            std::fs::write(folder.at("bad.json"), bytes).expect("file");
            folder.refuses(&["noise", "render", "bad.json", "-o", "a.png"], 1, needle);
        }
        folder.refuses(
            &["noise", "render", "none.json", "-o", "a.png"],
            1,
            "cannot read none.json",
        );
        folder.refuses(&["noise", "render", "photo.png", "-o", "a.png"], 1, "photo.png");
        std::fs::remove_file(folder.at("bad.json")).expect("there");
    }
}

mod change {
    use super::*;

    #[test]
    fn morphs_lie_between() {
        let folder = fitted();
        folder.rgb_from("other.png", 80, 64, |x, y| {
            [(x * y * 7 % 90) as u8, (x * 31 + y * 17) as u8 % 60, 9]
        });
        folder.does(&["noise", "fit", "other.png", "-o", "other.json"]);
        let mean = |name: &str| document(&folder, name)["mean"][0].as_f64().expect("mean");
        let at = |t: &str, name: &str| {
            folder.does(&["noise", "morph", "stone.json", "other.json", "--at", t, "-o", name]);
        };
        at("0", "start.json");
        at("1", "end.json");
        at("0.25", "between.json");
        assert_eq!(text(&folder, "start.json"), text(&folder, "stone.json"));
        assert_eq!(text(&folder, "end.json"), text(&folder, "other.json"));
        let want = 0.75 * mean("stone.json") + 0.25 * mean("other.json");
        assert!((mean("between.json") - want).abs() < 1e-6);
        folder.does(&["noise", "render", "between.json", "-o", "between.png"]);
        let morph = |t| ["noise", "morph", "stone.json", "other.json", "-o", "bad.json", "--at", t];
        folder.refuses(&morph("1.01"), 2, "`at` must be 0 to 1");
        folder.refuses(&morph("-0.1"), 2, "hint: change --at; `texforge noise morph --help`");
        folder.refuses(&morph("half"), 2, "half");
        folder.does(&["noise", "fit", "photo.png", "-o", "square.json", "--bands", "square"]);
        let args = ["noise", "morph", "stone.json", "square.json", "-o", "bad.json"];
        folder.refuses(&args, 2, "`second` must be noise of round bands");
    }

    #[test]
    fn edits_are_seen() {
        let folder = fitted();
        let edit = |more: &[&str]| {
            folder.does(
                &[&["noise", "edit", "stone.json", "-o", "e.json", "--force"], more].concat(),
            );
            document(&folder, "e.json")
        };
        let stone = document(&folder, "stone.json");
        assert_eq!(edit(&[]), stone);
        assert_eq!(edit(&["--seed", "9"])["seed"], 9);
        let red = edit(&["--mean", "basecolor=#ff8000"])["mean"].clone();
        assert_eq!(red, serde_json::json!([1.0, 0.501_961, 0.0]));
        let first = |v: &serde_json::Value| v["matrix"][0][0].as_f64().expect("a number");
        assert!((first(&edit(&["--contrast", "2"])) - 2.0 * first(&stone)).abs() < 2e-5);
        let smooth = edit(&["--gains", "0", "--histogram", "normal"]);
        assert_eq!(smooth["model"]["wavelet"]["channels"][0]["weights"][0], 0.0);
        for (more, needle) in [
            (["--contrast", "11"], "`contrast` must be 0 to 10"),
            (["--contrast", "-1"], "`contrast` must be 0 to 10"),
            (["--feature-size", "3"], "`feature_size` must be a power of two"),
            (["--gains", "a"], "`gains` must be numbers"),
            (["--gains", "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15"], "`gains` must be at most"),
            (["--mean", "red"], "`mean` must be MAP=#rrggbb"),
            (["--mean", "height=1"], "`mean` must be for a map of the texture (basecolor)"),
            (["--histogram", "flat"], "flat"),
            (["--seed", "-1"], "-1"),
        ] {
            let args = ["noise", "edit", "stone.json", "-o", "bad.json"];
            folder.refuses(&[&args[..], &more].concat(), 2, needle);
        }
        let same = ["noise", "edit", "stone.json", "-o", "stone.json", "--force"];
        folder.refuses(&same, 1, "is also an input");
    }

    #[test]
    fn a_sheet_shows_photo_and_octaves() {
        let folder = fitted();
        folder.does(&["noise", "sheet", "photo.png", "-o", "sheet.png"]);
        folder.does(&["noise", "sheet", "stone.json", "-o", "alone.png"]);
        let (sheet, alone) = (folder.png("sheet.png"), folder.png("alone.png"));
        let octaves = document(&folder, "stone.json")["model"]["wavelet"]["channels"][0]["weights"]
            .as_array()
            .expect("weights")
            .len();
        let length = |cells: usize| 16 + cells * (96 + 16);
        assert_eq!(sheet.height, length(1 + octaves.div_ceil(4)));
        assert_eq!((sheet.width, alone.width), (length(4), length(4)));
        // The photo is the first cell.
        let photo = folder.png("photo.png");
        for (x, y) in (0..96).flat_map(|x| (0..96).map(move |y| (x, y))) {
            assert_eq!(sheet.at(16 + x, 16 + y), photo.at(x, y));
        }
    }

    #[test]
    fn exports_are_files_in_a_folder() {
        let folder = fitted();
        // All there are: they share one folder.
        let all = "glsl,glsl-es,wgsl,hlsl,osl,materialx,blender";
        let args = ["noise", "export", "stone.json", "--to", all, "-o", "out"];
        let v = json(&folder, &[&args[..], &["--json"]].concat());
        let files = v["files"].as_array().expect("files");
        assert!(files.iter().any(|f| f["target"] == "glsl"));
        assert!(files.iter().any(|f| f["target"] == "wgsl"));
        for file in files {
            let bytes = std::fs::read(folder.at(file["path"].as_str().expect("path")));
            assert_eq!(bytes.expect("a file").len() as u64, file["bytes"]);
        }
        folder.refuses(&args, 1, "exists already");
        folder.does(&[&args[..], &["--force"]].concat());
        folder.refuses(&["noise", "export", "stone.json", "--to", "basic", "-o", "x"], 2, "basic");
        folder.refuses(
            &["noise", "export", "photo.png", "--to", "glsl", "-o", "x"],
            1,
            "photo.png",
        );
        assert!(!folder.at("x").exists());
        let there = ["noise", "export", "stone.json", "--to", "glsl", "-o", "photo.png"];
        folder.refuses(&there, 1, "photo.png exists already");
        folder.refuses(
            &["noise", "export", "stone.json", "--to", "glsl", "-o", "-"],
            2,
            "a folder",
        );
    }
}
