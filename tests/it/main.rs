//! The one integration test binary; a module per subject.

mod cli;
mod house;
mod io;
mod search;
#[path = "../support/mod.rs"]
mod support;
