//! The one integration test binary; a module per subject.

mod cli;
mod house;
mod io;
#[path = "../support/mod.rs"]
mod support;
