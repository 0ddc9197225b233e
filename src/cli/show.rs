//! What people see on standard error: progress, messages, the line at the end.

use std::io::{IsTerminal as _, Write as _};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Steps of the bar.
const STEPS: u64 = 1000;
/// Runs shorter than this show no bar; it would only flicker.
const BAR_AFTER: Duration = Duration::from_millis(150);
/// Without a terminal: when the first line about progress is due, and how long to the next.
const FIRST_LINE: Duration = Duration::from_secs(5);
const NEXT_LINE: Duration = Duration::from_secs(20);

/// Standard error. All colours are left out, so `NO_COLOR` has nothing to switch off here.
#[derive(Debug)]
pub(super) struct Console {
    quiet: bool,
    terminal: bool,
    started: Instant,
    progress: Mutex<Progress>,
}

#[derive(Debug)]
struct Progress {
    bar: Option<ProgressBar>,
    next_line: Duration,
}

impl Console {
    /// A console that says nothing but errors if `quiet`.
    pub(super) fn new(quiet: bool) -> Self {
        Self {
            quiet,
            terminal: std::io::stderr().is_terminal(),
            started: Instant::now(),
            progress: Mutex::new(Progress { bar: None, next_line: FIRST_LINE }),
        }
    }

    /// Time since the run began.
    pub(super) fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// Says one sentence, above the bar if there is one.
    pub(super) fn say(&self, line: &str) {
        if self.quiet {
            return;
        }
        match &self.lock().bar {
            Some(bar) => bar.suspend(|| write_line(line)),
            None => write_line(line),
        }
    }

    /// Shows how far the run is. `fraction` is 0 while nothing is known.
    pub(super) fn tick(&self, fraction: f64) {
        let elapsed = self.elapsed();
        if self.quiet || (self.terminal && elapsed < BAR_AFTER) {
            return;
        }
        let mut progress = self.lock();
        if self.terminal {
            let bar = progress.bar.get_or_insert_with(bar);
            bar.set_position((fraction * STEPS as f64) as u64);
        } else if elapsed >= progress.next_line {
            progress.next_line = elapsed + NEXT_LINE;
            write_line(&format!("{:.0} % after {} s", fraction * 100.0, elapsed.as_secs()));
        }
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
        if let Some(bar) = self.lock().bar.take() {
            bar.finish_and_clear();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr_with_hz(20));
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed}  {eta} left");
    // The template is a constant; if it were wrong, the plain bar would do.
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar
}

/// Writes one line to standard error; there is nobody to tell if that fails.
pub(super) fn write_line(line: &str) {
    let mut err = std::io::stderr().lock();
    let _ = writeln!(err, "{line}");
}

/// "1.2 s", "340 ms", "2 min 5 s".
pub(super) fn duration(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    if seconds < 0.9995 {
        format!("{:.0} ms", seconds * 1e3)
    } else if seconds < 99.95 {
        format!("{seconds:.1} s")
    } else {
        format!("{} min {} s", time.as_secs() / 60, time.as_secs() % 60)
    }
}

/// Rows as columns of equal width, two blanks between them; the last column is not padded.
pub(super) fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |i: usize| {
        rows.iter().filter_map(|r| r.get(i)).map(|c| c.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<_> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(&widths) {
            line.extend([cell.as_str(), &" ".repeat(width - cell.chars().count() + 2)]);
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_well() {
        let ms = |n| duration(Duration::from_millis(n));
        assert_eq!([ms(34), ms(1250), ms(125_000)], ["34 ms", "1.2 s", "2 min 5 s"]);
    }

    #[test]
    fn columns_line_up() {
        let row = |a: &str, b: &str| vec![a.to_owned(), b.to_owned()];
        assert_eq!(table(&[row("a", "long"), row("bcd", "x")]), "a    long\nbcd  x\n");
    }
}
