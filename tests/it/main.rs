//! The one integration test binary; a module per subject.

mod band;
mod cli;
mod costs;
mod extract;
mod golden;
mod house;
mod io;
mod lattice;
mod measures;
mod noise;
mod options;
mod quality;
mod redo;
mod regular;
mod regular_subpixel;
mod search;
#[path = "../support/mod.rs"]
mod support;
mod tile;
mod views;
mod wang;
