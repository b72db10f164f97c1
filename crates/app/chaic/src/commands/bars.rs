//! Progress bars. Where the standard error is no terminal, nothing is drawn.

use std::collections::BTreeMap;
use std::time::Duration;

use chaic_env::RunKey;
use chaic_eval::metrics::Ending;
use chaic_eval::run::{Extent, Finished, Progress};
use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressStyle};

use crate::output::{complain, printable};

/// A bar that counts something.
pub fn plain(total: u64, what: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(&format!(
        "{{bar:40}} {{pos}}/{{len}} {what} {{eta}}  {{msg}}"
    ));
    ProgressBar::new(total).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// The bars of a run: one for the whole, one for each worker.
pub struct RunBars {
    all: MultiProgress,
    total: ProgressBar,
    workers: BTreeMap<usize, (ProgressBar, RunKey)>,
    /// Which of several runs this is; before every line of the log.
    part: String,
    /// What is to be said besides the time that this run will take.
    beside: String,
    /// Most lines of the log, about.
    max_lines: u64,
}

impl RunBars {
    /// For a run that has come so far.
    pub fn new(extent: Extent) -> RunBars {
        let all = MultiProgress::new();
        let total = ProgressBar::new(extent.total as u64);
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len} episodes  {elapsed}  {msg}");
        total.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let total = all.add(total);
        total.set_position((extent.finished - extent.errors) as u64);
        total.set_message("time left: known after the first episode");
        total.enable_steady_tick(Duration::from_millis(500));
        let (part, beside) = (String::new(), String::new());
        RunBars { all, total, workers: BTreeMap::new(), part, beside, max_lines: 100 }
    }

    /// For one of several runs, of that name, that has come so far.
    pub fn of_part(extent: Extent, part: &str) -> RunBars {
        RunBars { part: format!("{part}: "), max_lines: 20, ..RunBars::new(extent) }
    }

    /// Says a line in between the bars, from any thread.
    pub fn voice(&self) -> impl Fn(&str) + Send + Sync + use<> {
        let all = self.all.clone();
        move |line| all.suspend(|| complain(line))
    }

    /// What the next messages say besides the time that this run will take.
    pub fn say_beside(&mut self, beside: String) {
        self.beside = beside;
    }

    /// Shows what has happened.
    pub fn show(&mut self, progress: &Progress) {
        match progress {
            Progress::Began { worker, key, horizon } => {
                let bar = ProgressBar::new(u64::from(*horizon));
                let style = ProgressStyle::with_template("{bar:20} {pos:>4}/{len} frames  {msg}");
                bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
                let bar = self.all.insert_before(&self.total, bar);
                let message = format!("{} with {}", key.episode, key.helper);
                bar.set_message(printable(&message).into_owned());
                if let Some((old, _)) = self.workers.insert(*worker, (bar, key.clone())) {
                    old.finish_and_clear();
                }
            }
            Progress::At { worker, frame } => {
                if let Some((bar, _)) = self.workers.get(worker) {
                    bar.set_position(u64::from(*frame));
                }
            }
            Progress::Finished(finished) => {
                if let Some((bar, _)) = self.workers.remove(&finished.worker) {
                    bar.finish_and_clear();
                }
                if let Ending::Error { message } = &finished.result.ending {
                    let key = &finished.result.key;
                    let line = format!("{} with {}: {message}", key.episode, key.helper);
                    self.all.suspend(|| complain(&line));
                }
                self.total.inc(1);
                self.log(finished);
                if let Some(left) = finished.left {
                    // Whole seconds: the estimate isn't any better.
                    let left = HumanDuration(Duration::from_secs(left.as_secs()));
                    let (part, beside) = (&self.part, &self.beside);
                    self.total.set_message(format!("{part}about {left} left{beside}"));
                }
            }
        }
    }

    /// Where there are no bars to see, in a log for example, a line now and then.
    fn log(&self, finished: &Finished) {
        let (done, total) = (self.total.position(), self.total.length().unwrap_or(0));
        if !self.total.is_hidden()
            || (!done.is_multiple_of(total / self.max_lines + 1) && done != total)
        {
            return;
        }
        let key = &finished.result.key;
        let rate = finished
            .result
            .summary()
            .map_or("broke down".to_owned(), |s| format!("{:.2}", s.rate()));
        let left = finished.left.map_or(String::new(), |left| {
            format!(", about {} left", HumanDuration(Duration::from_secs(left.as_secs())))
        });
        let (part, beside) = (&self.part, &self.beside);
        let what = format!("{} with {}: {rate}{left}{beside}", key.episode, key.helper);
        complain(&format!("{part}{done}/{total} {what}"));
    }

    /// Takes the bars away.
    pub fn clear(&self) {
        for (bar, _) in self.workers.values() {
            bar.finish_and_clear();
        }
        self.total.finish_and_clear();
    }
}
