//! Playing many episodes on several threads.

use std::any::Any;
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

use chaic_core::{AgentError, Frame};
use chaic_env::minds::{self, Helpers};
use chaic_env::trace::Record;
use chaic_env::{Env, EpisodeConfig, Minds, RunKey};

use crate::error::{EvalError, Result};
use crate::metrics::{Ending, RunResult, Tally};
use crate::run::estimate::Estimate;
use crate::run::folder::RunFolder;
use crate::run::items::Item;
use crate::run::options::RunOptions;
use crate::trace_file::Writer;

/// A worker tells of its frames every so many decisions.
const NEWS_EVERY: u32 = 32;

/// Maximum length of a recorded error message, bytes: far more than a traceback, and short enough for a
/// line of the journal.
const MAX_MESSAGE_BYTES: usize = 1 << 20;

/// What happens during a run.
#[derive(Clone, Debug)]
pub enum Progress {
    /// A worker begins an episode run.
    Began {
        /// The worker, from 0.
        worker: usize,
        /// Which run.
        key: RunKey,
        /// How many frames it may take.
        horizon: Frame,
    },
    /// A worker has come to a frame.
    At {
        /// The worker.
        worker: usize,
        /// The frame.
        frame: Frame,
    },
    /// An episode run is finished and in the journal.
    Finished(Finished),
}

/// An episode run is finished.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The worker that played it.
    pub worker: usize,
    /// Its result.
    pub result: RunResult,
    /// How long it took.
    pub time: Duration,
    /// What is left of the whole run, as far as one can tell from the episodes so far.
    pub left: Option<Duration>,
}

/// What all workers share.
pub(super) struct Crew<'a> {
    pub folder: &'a RunFolder,
    pub options: &'a RunOptions,
    pub helpers: &'a dyn Helpers,
    pub stop: &'a AtomicBool,
}

/// What a worker says to the thread that keeps the journal.
enum News {
    Progress(Progress),
    Finished { worker: usize, result: RunResult, time: Duration },
    Failed(EvalError),
}

impl Crew<'_> {
    /// Plays all items; `keep` makes each result last. Returns whether nothing was left out.
    pub fn play(
        &self,
        items: &[Item],
        jobs: usize,
        progress: &mut dyn FnMut(&Progress),
        keep: &mut dyn FnMut(&RunResult) -> Result<()>,
    ) -> Result<bool> {
        let queues = Queues::of(items, |item| self.waits(&item.key));
        let n_waiting = self.helpers.waiting_jobs().min(queues.waiting.len());
        let jobs = jobs.min(items.len()).max(1);
        // Raised by a failure as well as by the caller's `stop`.
        let failed = AtomicBool::new(false);
        let mut outcome = Ok(());
        let mut to_go: BTreeSet<&RunKey> = items.iter().map(|i| &i.key).collect();
        let mut estimate = Estimate::default();
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            for worker in 0..jobs + n_waiting {
                let (sender, queues, failed) = (sender.clone(), &queues, &failed);
                let next = move || if worker < jobs { queues.any() } else { queues.waiting() };
                let work = move || self.work(worker, &next, failed, &sender);
                let name = format!("chaic-worker-{worker}");
                let spawned = std::thread::Builder::new().name(name).spawn_scoped(scope, work);
                if let Err(refusal) = spawned {
                    // Those that run already end with the episodes that they have begun.
                    failed.store(true, Ordering::Relaxed);
                    let (n, wanted) = (worker + 1, jobs + n_waiting);
                    outcome = Err(EvalError::NoThread { n, wanted, refusal });
                    break;
                }
            }
            drop(sender);
            for news in receiver {
                let told = match news {
                    News::Progress(news) => {
                        progress(&news);
                        Ok(())
                    }
                    News::Finished { worker, result, time } => keep(&result).map(|()| {
                        estimate.add(&result.key, time);
                        to_go.remove(&result.key);
                        let left = estimate.left(to_go.iter().copied(), jobs + n_waiting);
                        progress(&Progress::Finished(Finished { worker, result, time, left }));
                    }),
                    News::Failed(error) => Err(error),
                };
                if let Err(error) = told {
                    failed.store(true, Ordering::Relaxed);
                    if outcome.is_ok() {
                        outcome = Err(error);
                    }
                }
            }
        });
        outcome.map(|()| to_go.is_empty())
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Whether a mind of this episode run waits for somebody else's computer.
    pub fn waits(&self, key: &RunKey) -> bool {
        let partner = self.options.partner.as_deref();
        [Some(key.helper.as_str()), partner].into_iter().flatten().any(|n| self.helpers.waits(n))
    }

    fn work<'i>(
        &self,
        worker: usize,
        next: &dyn Fn() -> Option<&'i Item>,
        failed: &AtomicBool,
        sender: &Sender<News>,
    ) {
        loop {
            if self.is_stopped() || failed.load(Ordering::Relaxed) {
                return;
            }
            let Some(item) = next() else { return };
            let began = Instant::now();
            // The receiver lives as long as any worker does.
            let tell = |news| drop(sender.send(news));
            let (key, horizon) = (item.key.clone(), item.horizon);
            tell(News::Progress(Progress::Began { worker, key, horizon }));
            let mut at = |frame| tell(News::Progress(Progress::At { worker, frame }));
            match self.play_one(&item.key, &mut at) {
                Ok(None) => return,
                Ok(Some(result)) => {
                    tell(News::Finished { worker, result, time: began.elapsed() });
                }
                Err(error) => {
                    tell(News::Failed(error));
                    return;
                }
            }
        }
    }

    /// Plays one item; `None` if it was stopped.
    pub fn play_one(&self, key: &RunKey, at: &mut dyn FnMut(Frame)) -> Result<Option<RunResult>> {
        let mut writer = None;
        let played = catch_unwind(AssertUnwindSafe(|| self.play_to_end(key, &mut writer, at)));
        let (result, broken) = match played {
            // Who halts because the run stops says nothing new.
            Ok(Err(EvalError::Agent(AgentError::Halted(_)))) if self.is_stopped() => (None, None),
            Ok(Err(EvalError::Agent(AgentError::Broken(text)))) => (None, Some(text)),
            Ok(result) => (result?, None),
            Err(panic) => (None, Some(text_of(panic.as_ref()).to_owned())),
        };
        if let Some(text) = broken {
            let text = shortened(text, MAX_MESSAGE_BYTES);
            let ending = Ending::Error { message: format!("the episode broke down: {text}") };
            if let Some(writer) = writer.take() {
                writer.discard();
            }
            return Ok(Some(RunResult { key: key.clone(), ending }));
        }
        match (&result, writer) {
            (Some(_), Some(writer)) => writer.finish()?,
            (None, Some(writer)) => writer.discard(),
            (_, None) => {}
        }
        Ok(result)
    }

    fn play_to_end(
        &self,
        key: &RunKey,
        writer: &mut Option<Writer>,
        at: &mut dyn FnMut(Frame),
    ) -> Result<Option<RunResult>> {
        let episode = self.folder.episode(self.options, key)?;
        let rules = self.options.rules()?;
        let helper = minds::find_for(self.helpers, key, rules.planner)?;
        if let Some(helper) = &helper {
            let checked = self.options.track.check_grants(&key.helper, helper.grants);
            checked.map_err(EvalError::Options)?;
        }
        let name = self.options.partner.as_deref();
        let partner = minds::find_partner(self.helpers, name, Some(key), rules.planner)?;
        let config = EpisodeConfig {
            episode: &episode,
            seed: key.seed,
            rules,
            helper: &key.helper,
            partner: name,
            image_size: self.options.size,
            appearance: self.options.appearance()?,
        };
        let mut env = Env::new(config, Minds::of(helper, partner))?;
        if self.options.traces {
            let path = self.folder.trace(key);
            *writer = Some(Writer::create(self.folder.path(), &path, env.header())?);
        }
        let mut tally = Tally::new(env.header());
        let (mut result, mut decisions) = (None, 0);
        env.run(self.stop, None, &mut |record| -> Result<()> {
            if let Some(writer) = writer.as_mut() {
                writer.write(record)?;
            }
            result = tally.record(record).or(result.take());
            if let Record::Decision(decision) = record {
                decisions += 1;
                if decisions % NEWS_EVERY == 0 {
                    at(decision.frame);
                }
            }
            Ok(())
        })?;
        if let Some(Ending::Done(summary)) = result.as_mut().map(|r| &mut r.ending) {
            summary.counts = env.counts();
        }
        Ok(result)
    }
}

/// What is to be played, by whether it waits. Each queue is taken from by many.
struct Queues<'i> {
    own: Vec<&'i Item>,
    waiting: Vec<&'i Item>,
    next: [AtomicUsize; 2],
}

impl<'i> Queues<'i> {
    fn of(items: &'i [Item], waits: impl Fn(&Item) -> bool) -> Queues<'i> {
        let (waiting, own) = items.iter().partition(|item| waits(item));
        Queues { own, waiting, next: Default::default() }
    }

    /// What waits for nobody comes first: those who take care of what waits are many.
    fn any(&self) -> Option<&'i Item> {
        let own = self.own.get(self.next[0].fetch_add(1, Ordering::Relaxed));
        own.copied().or_else(|| self.waiting())
    }

    fn waiting(&self) -> Option<&'i Item> {
        self.waiting.get(self.next[1].fetch_add(1, Ordering::Relaxed)).copied()
    }
}

/// Truncates a text to at most `max_bytes`.
fn shortened(mut text: String, max_bytes: usize) -> String {
    text.truncate(text.floor_char_boundary(max_bytes));
    text
}

/// What a panic said.
fn text_of(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}
