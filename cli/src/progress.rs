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
        Self { name, bar, last_line: Instant::now() }
    }

    pub fn show(&mut self, done: u64, total: u64) {
        if let Some(bar) = &self.bar {
            bar.set_length(total);
            bar.set_position(done);
        } else if self.last_line.elapsed() >= LINE_INTERVAL {
            self.last_line = Instant::now();
            errln!("{}: {:.0} %", self.name, 100.0 * done as f64 / total.max(1) as f64);
        }
    }

    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
