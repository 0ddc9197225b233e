//! Pictures larger than memory: several files written side by side, some rows of each at a time.

use std::path::Path;
use std::sync::mpsc;

use super::{Staging, WriteOptions, write_rows};
use crate::base::error::{Error, Result};
use crate::image::picture::Picture;

/// How many pixels are made at a time: some hundred megabytes.
pub(crate) const STRIP_PIXELS: usize = 1 << 23;

/// Stages pictures of `height` rows under these files; every strip has the next rows of each, in the same order.
///
/// # Errors
/// Those of the strips, of [`write_rows`] and of the files.
pub(crate) fn write_strips(
    staging: &Staging,
    files: &[(&Path, WriteOptions)],
    height: usize,
    strips: impl Iterator<Item = Result<Vec<Picture>>>,
) -> Result<()> {
    std::thread::scope(|scope| {
        let (mut ends, mut writers) = (Vec::new(), Vec::new());
        for (path, options) in files {
            // One piece waits while the next is made.
            let (send, rows) = mpsc::sync_channel::<Picture>(1);
            ends.push(send);
            writers.push(scope.spawn(move || {
                staging.stage_with(path, |out| {
                    write_rows(out, path, height, rows.into_iter().map(Ok), options)
                })
            }));
        }
        let make = || {
            for strip in strips {
                for (piece, send) in strip?.into_iter().zip(&ends) {
                    if send.send(piece).is_err() {
                        // The writer has failed; it says why.
                        return Ok(());
                    }
                }
            }
            Ok(())
        };
        let made = make();
        drop(ends);
        let panicked = || Error::Internal { message: "a writer panicked".into() };
        let join = |writer: std::thread::ScopedJoinHandle<'_, Result<()>>| {
            writer.join().unwrap_or_else(|_| Err(panicked()))
        };
        // Without all rows the writers fail as well: the first reason is the one to tell.
        let written: Vec<Result<()>> = writers.into_iter().map(join).collect();
        made.and_then(|()| written.into_iter().collect())
    })
}
