//! Progress bars on standard error. They are hidden with `--quiet`, and where standard error is no terminal.

use std::collections::BTreeMap;
use std::time::Duration;

use chaic_env::RunKey;
use chaic_eval::metrics::RunStatus;
use chaic_eval::run::{FinishedJob, JobEvent, Run};
use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::output::{is_quiet, print_error, print_progress, printable};

/// Returns a bar that counts items.
pub fn count_bar(total: u64, items: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(&format!(
        "{{bar:40}} {{pos}}/{{len}} {items} {{eta}}  {{msg}}"
    ));
    let target =
        if is_quiet() { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    ProgressBar::with_draw_target(Some(total), target)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Bars of a run: one for the run, and one per worker.
pub struct RunBars {
    all: MultiProgress,
    total: ProgressBar,
    workers: BTreeMap<usize, (ProgressBar, RunKey)>,
    /// Prefix of all messages: the name of this run among several runs.
    part: String,
    /// Suffix of all messages: the remaining time of all runs.
    suffix: String,
    /// Approximate maximum number of log lines.
    max_lines: u64,
    /// True if the run has several seeds, which the messages then name.
    has_seeds: bool,
}

impl RunBars {
    /// Creates the bars of a run with its progress.
    pub fn new(run: &Run) -> RunBars {
        let (extent, has_seeds) = (run.progress(), run.options().seeds > 1);
        let all = MultiProgress::new();
        if is_quiet() {
            all.set_draw_target(ProgressDrawTarget::hidden());
        }
        let total = ProgressBar::new(extent.total as u64);
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len} episodes  {elapsed}  {msg}");
        total.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let total = all.add(total);
        total.set_position((extent.finished - extent.errors) as u64);
        total.set_message("time left: known after the first episode");
        total.enable_steady_tick(Duration::from_millis(500));
        let (part, suffix) = (String::new(), String::new());
        RunBars { all, total, workers: BTreeMap::new(), part, suffix, max_lines: 100, has_seeds }
    }

    /// Creates the bars of one of several runs.
    pub fn for_part(run: &Run, part: &str) -> RunBars {
        RunBars { part: format!("{part}: "), max_lines: 20, ..RunBars::new(run) }
    }

    /// Returns an episode run in words, with its seed if the run has several.
    fn name_of(&self, key: &RunKey) -> String {
        let seed = if self.has_seeds { format!(", seed {}", key.seed) } else { String::new() };
        format!("{} with {}{seed}", key.episode, key.helper)
    }

    /// Returns a function that prints a line above the bars, from any thread.
    pub fn line_printer(&self) -> impl Fn(&str) + Send + Sync + use<> {
        let all = self.all.clone();
        move |line| all.suspend(|| print_error(line))
    }

    /// Sets the suffix of the next messages.
    pub fn set_suffix(&mut self, suffix: String) {
        self.suffix = suffix;
    }

    /// Shows an event of the run.
    pub fn show(&mut self, event: &JobEvent) {
        match event {
            JobEvent::Started { worker, key, horizon } => {
                let bar = ProgressBar::new(u64::from(*horizon));
                let style = ProgressStyle::with_template("{bar:20} {pos:>4}/{len} frames  {msg}");
                bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
                let bar = self.all.insert_before(&self.total, bar);
                bar.set_message(printable(&self.name_of(key)).into_owned());
                if let Some((old, _)) = self.workers.insert(*worker, (bar, key.clone())) {
                    old.finish_and_clear();
                }
            }
            JobEvent::Progress { worker, frame } => {
                if let Some((bar, _)) = self.workers.get(worker) {
                    bar.set_position(u64::from(*frame));
                }
            }
            JobEvent::Finished(finished) => {
                if let Some((bar, _)) = self.workers.remove(&finished.worker) {
                    bar.finish_and_clear();
                }
                if let RunStatus::Error { message } = &finished.result.status {
                    let line = format!("{}: {message}", self.name_of(&finished.result.key));
                    self.all.suspend(|| print_error(&line));
                }
                self.total.inc(1);
                self.log(finished);
                if let Some(left) = finished.remaining {
                    let left = time_left(left);
                    let (part, suffix) = (&self.part, &self.suffix);
                    self.total.set_message(format!("{part}about {left} left{suffix}"));
                }
            }
        }
    }

    /// Prints a progress line from time to time if the bars are hidden, for example into a log
    /// file.
    fn log(&self, finished: &FinishedJob) {
        let (done, total) = (self.total.position(), self.total.length().unwrap_or(0));
        if !self.total.is_hidden()
            || (!done.is_multiple_of(total / self.max_lines + 1) && done != total)
        {
            return;
        }
        let rate = finished
            .result
            .summary()
            .map_or("failed".to_owned(), |summary| format!("{:.2}", summary.rate()));
        let left = finished
            .remaining
            .map_or(String::new(), |left| format!(", about {} left", time_left(left)));
        let (part, suffix) = (&self.part, &self.suffix);
        let result = format!("{}: {rate}{left}{suffix}", self.name_of(&finished.result.key));
        print_progress(&format!("{part}{done}/{total} {result}"));
    }

    /// Removes the bars.
    pub fn clear(&self) {
        for (bar, _) in self.workers.values() {
            bar.finish_and_clear();
        }
        self.total.finish_and_clear();
    }
}

/// Formats an estimated time in whole seconds.
pub fn time_left(time: Duration) -> HumanDuration {
    HumanDuration(Duration::from_secs(time.as_secs()))
}
