//! Values of noise at pixels and points as a program, for `benches/noise_peers.py`; not a benchmark by
//! itself.
//!
//! `octaves WHAT THREADS RUNS`: WHAT is `picture`, `picture-1` (of one octave alone), `plane` or `space`. Prints
//! the number of values of one octave that a run gives, and every run's seconds: of one thread those that the
//! process computed, which other work on the machine disturbs least, of more those that went by.

#![expect(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a program for one script, which sees its panics"
)]

mod common;

use common::{process_cpu_seconds, wall_seconds};
use texforge::base::rng::Rng;
use texforge::{Ctx, Filter, NoiseTexture, RenderParams, SampleType, Samples};

const SIDE: usize = 1024;

/// A grey texture with the histogram of a photo of gravel.
fn texture(weights: &str) -> NoiseTexture {
    let document = format!(
        r#"{{"format":"texforge-noise","version":1,"seed":0,"size":[512,512],"maps":[
        {{"name":"basecolor","kind":"color","encoding":"srgb","channels":1}}],
        "mean":[0.5],"matrix":[[1.0]],"model":{{"wavelet":{{"bands":"round","channels":[{{
        "weights":[{weights}],"histogram":[-0.464,-0.392,-0.280,-0.161,-0.062,0.023,0.092,0.147,
        0.206,0.277,0.373]}}]}}}},"score":{{"fit":0.44,"recommended":"none"}}}}"#
    );
    NoiseTexture::from_json(&document).unwrap()
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [what, threads, runs] = arguments.as_slice() else {
        println!("octaves WHAT THREADS RUNS: see benches/octaves.rs");
        return;
    };
    let threads: usize = threads.parse().unwrap();
    let now = if threads == 1 { process_cpu_seconds } else { wall_seconds };
    let ctx = Ctx::new(0, threads).unwrap();
    let eight = "0.0284,0.0671,0.0879,0.0858,0.0406,0.0238,0.0134,0.0095";
    let texture = texture(if what == "picture-1" { "0.1" } else { eight });
    let place = |i: usize, axis: u32| f64::from(Rng::new(3, axis, 0, i as u64).next_u32()) / 1e5;
    let count = if what.starts_with("picture") { 0 } else { SIDE * SIDE };
    let plane: Vec<_> = (0..count).map(|i| [place(i, 0), place(i, 1)]).collect();
    let space: Vec<_> = (0..count).map(|i| [place(i, 0), place(i, 1), place(i, 2)]).collect();
    let params = RenderParams { samples: SampleType::F32, ..RenderParams::new((SIDE, SIDE)) };
    let values = || match what.as_str() {
        "plane" => texture.at(&ctx, &plane, Filter::NONE).unwrap(),
        "space" => texture.solid(&ctx, &space, None, Filter::NONE).unwrap(),
        _ => match texture.render(&ctx, &params).unwrap().remove(0).2.into_samples() {
            Samples::F32(values) => values,
            _ => Vec::new(),
        },
    };
    // The answer first; it also warms up.
    let first = values();
    assert!(first.len() == SIDE * SIDE && first.iter().all(|v| v.is_finite()));
    let seconds = |_| {
        let start = now();
        assert_eq!(values().len(), first.len());
        now() - start
    };
    let seconds: Vec<f64> = (0..runs.parse().unwrap()).map(seconds).collect();
    println!("{} {seconds:?}", SIDE * SIDE * texture.document().terms().len());
}
