//! The one integration test binary; a module per subject.

mod cli;
mod house;
#[path = "../support/mod.rs"]
mod support;
