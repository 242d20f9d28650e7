// SPDX-License-Identifier: MIT OR Apache-2.0
//! Progress of long work: a bar on a terminal, plain lines otherwise.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Time between two plain lines.
const LINE_INTERVAL: Duration = Duration::from_secs(10);

pub struct Meter {
    name: &'static str,
    bar: Option<ProgressBar>,
    started: Instant,
    /// What was done when it was first shown.
    first: Option<u64>,
    last_line: Instant,
}

impl Meter {
    pub fn new(name: &'static str) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent}% {eta} left");
            let bar = ProgressBar::new(0).with_message(name);
            // The template is fixed, and parses.
            bar.with_style(
                style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "),
            )
        });
        let now = Instant::now();
        Self { name, bar, started: now, first: None, last_line: now }
    }

    pub fn show(&mut self, done: u64, total: u64) {
        let first = *self.first.get_or_insert(done);
        if let Some(bar) = &self.bar {
            bar.set_length(total);
            bar.set_position(done);
        } else if self.last_line.elapsed() >= LINE_INTERVAL {
            self.last_line = Instant::now();
            let new = done.saturating_sub(first);
            let left = total.saturating_sub(done) as f64;
            let seconds = self.started.elapsed().as_secs_f64() / new as f64 * left;
            let left = if new > 0 { format!(", about {seconds:.0} s left") } else { String::new() };
            errln!("{}: {:.0} %{left}", self.name, 100.0 * done as f64 / total.max(1) as f64);
        }
    }

    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
