//! Worker threads that play episode runs.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

use chaic_core::{AgentError, Frame};
use chaic_env::helper_registry::{self, HelperRegistry};
use chaic_env::trace::Record;
use chaic_env::{Env, EpisodeAgents, EpisodeConfig, RunKey};

use crate::error::{EvalError, Result};
use crate::metrics::{ResultAccumulator, RunResult, RunStatus};
use crate::run::estimate::Estimate;
use crate::run::folder::RunFolder;
use crate::run::options::RunOptions;
use crate::run::plan::EpisodeJob;
use crate::trace_file::TraceWriter;

/// Number of decisions between two progress events of a worker.
const PROGRESS_INTERVAL: u32 = 32;

/// Maximum length of a recorded error message, bytes: far more than a stack trace, and short enough
/// for a line of the journal.
const MAX_MESSAGE_BYTES: usize = 1 << 20;

/// Event during a run.
#[derive(Clone, Debug)]
pub enum JobEvent {
    /// A worker started an episode run.
    Started {
        /// Index of the worker, from 0.
        worker: usize,
        /// The episode run.
        key: RunKey,
        /// Maximum number of frames.
        horizon: Frame,
    },
    /// A worker reached a frame.
    Progress {
        /// Index of the worker.
        worker: usize,
        /// Current frame.
        frame: Frame,
    },
    /// An episode run is finished and in the journal.
    Finished(FinishedJob),
}

/// A finished episode run.
#[derive(Clone, Debug)]
pub struct FinishedJob {
    /// Index of the worker that played it.
    pub worker: usize,
    /// Result of the episode run.
    pub result: RunResult,
    /// Wall-clock time.
    pub time: Duration,
    /// Estimated remaining time of the whole run; `None` if unknown.
    pub remaining: Option<Duration>,
}

/// State that all workers share.
pub(super) struct WorkerPool<'a> {
    pub folder: &'a RunFolder,
    pub options: &'a RunOptions,
    pub helpers: &'a dyn HelperRegistry,
    pub stop: &'a AtomicBool,
}

/// Message from a worker to the thread that writes the journal.
enum WorkerMessage {
    Progress(JobEvent),
    Finished { worker: usize, result: RunResult, time: Duration },
    Failed(EvalError),
}

impl WorkerPool<'_> {
    /// Plays all jobs; `store` saves each result. Returns whether all of them were played.
    pub fn play(
        &self,
        planned: &[EpisodeJob],
        n_workers: usize,
        progress: &mut dyn FnMut(&JobEvent),
        store: &mut dyn FnMut(&RunResult) -> Result<()>,
    ) -> Result<bool> {
        let queues = Queues::new(planned, |job| self.waits(&job.key));
        let n_waiting = self.helpers.waiting_jobs().min(queues.waiting.len());
        let n_workers = n_workers.min(planned.len()).max(1);
        // Set after a failure; workers then stop.
        let failed = AtomicBool::new(false);
        let mut outcome = Ok(());
        let mut estimate = Estimate::new(planned.iter().map(|job| &job.key));
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            for worker in 0..n_workers + n_waiting {
                let (sender, queues, failed) = (sender.clone(), &queues, &failed);
                let next = move || {
                    if worker < n_workers { queues.next_any() } else { queues.next_waiting() }
                };
                let work = move || self.work(worker, &next, failed, &sender);
                let name = format!("chaic-worker-{worker}");
                let spawned = std::thread::Builder::new().name(name).spawn_scoped(scope, work);
                if let Err(error) = spawned {
                    // Workers that run already finish their current episodes.
                    failed.store(true, Ordering::Relaxed);
                    let (n, wanted) = (worker + 1, n_workers + n_waiting);
                    outcome = Err(EvalError::NoThread { n, wanted, error });
                    break;
                }
            }
            drop(sender);
            for message in receiver {
                let handled = match message {
                    WorkerMessage::Progress(event) => {
                        progress(&event);
                        Ok(())
                    }
                    WorkerMessage::Finished { worker, result, time } => store(&result).map(|()| {
                        estimate.finish(&result.key, time);
                        let remaining = estimate.remaining(n_workers + n_waiting);
                        progress(&JobEvent::Finished(FinishedJob {
                            worker,
                            result,
                            time,
                            remaining,
                        }));
                    }),
                    WorkerMessage::Failed(error) => Err(error),
                };
                if let Err(error) = handled {
                    failed.store(true, Ordering::Relaxed);
                    if outcome.is_ok() {
                        outcome = Err(error);
                    }
                }
            }
        });
        outcome.map(|()| estimate.is_finished())
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Returns whether an agent of this episode run waits for a remote service.
    pub fn waits(&self, key: &RunKey) -> bool {
        let partner = self.options.partner.as_deref();
        [Some(key.helper.as_str()), partner].into_iter().flatten().any(|n| self.helpers.is_slow(n))
    }

    fn work<'i>(
        &self,
        worker: usize,
        next: &dyn Fn() -> Option<&'i EpisodeJob>,
        failed: &AtomicBool,
        sender: &Sender<WorkerMessage>,
    ) {
        loop {
            if self.is_stopped() || failed.load(Ordering::Relaxed) {
                return;
            }
            let Some(job) = next() else { return };
            let start = Instant::now();
            // The receiver outlives the workers.
            let send = |message| drop(sender.send(message));
            let (key, horizon) = (job.key.clone(), job.horizon);
            send(WorkerMessage::Progress(JobEvent::Started { worker, key, horizon }));
            let mut on_frame =
                |frame| send(WorkerMessage::Progress(JobEvent::Progress { worker, frame }));
            match self.play_one(&job.key, &mut on_frame) {
                Ok(None) => return,
                Ok(Some(result)) => {
                    send(WorkerMessage::Finished { worker, result, time: start.elapsed() });
                }
                Err(error) => {
                    send(WorkerMessage::Failed(error));
                    return;
                }
            }
        }
    }

    /// Plays one episode run; `None` if it was stopped.
    pub fn play_one(
        &self,
        key: &RunKey,
        on_frame: &mut dyn FnMut(Frame),
    ) -> Result<Option<RunResult>> {
        let mut writer = None;
        let played =
            catch_unwind(AssertUnwindSafe(|| self.play_to_end(key, &mut writer, on_frame)));
        let (result, failure) = match played {
            // An agent that halts because the run stops is no failure.
            Ok(Err(EvalError::Agent(AgentError::Halted(_)))) if self.is_stopped() => (None, None),
            Ok(Err(EvalError::Agent(AgentError::Broken(text)))) => (None, Some(text)),
            Ok(result) => (result?, None),
            Err(panic) => (None, Some(panic_message(panic.as_ref()).to_owned())),
        };
        if let Some(text) = failure {
            let text = truncated(text, MAX_MESSAGE_BYTES);
            let status = RunStatus::Error { message: format!("the episode broke down: {text}") };
            if let Some(writer) = writer.take() {
                writer.discard();
            }
            return Ok(Some(RunResult { key: key.clone(), status }));
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
        writer: &mut Option<TraceWriter>,
        on_frame: &mut dyn FnMut(Frame),
    ) -> Result<Option<RunResult>> {
        let episode = self.folder.episode(self.options, key)?;
        let rules = self.options.rules()?;
        let helper = helper_registry::find_for(self.helpers, key, rules.planner)?;
        if let Some(helper) = &helper {
            let checked = self.options.track.check_grants(&key.helper, helper.grants);
            checked.map_err(EvalError::Options)?;
        }
        let name = self.options.partner.as_deref();
        let partner = helper_registry::find_partner(self.helpers, name, Some(key), rules.planner)?;
        let config = EpisodeConfig {
            seed: key.seed,
            rules,
            partner: name,
            image_size: self.options.image_size,
            appearance: self.options.appearance()?,
            ..EpisodeConfig::new(&episode, &key.helper)
        };
        let mut env = Env::new(config, EpisodeAgents::new(helper, partner))?;
        if self.options.traces {
            let path = self.folder.trace(key);
            *writer = Some(TraceWriter::create(self.folder.path(), &path, env.header())?);
        }
        let mut tally = ResultAccumulator::new(env.header());
        let (mut result, mut decisions) = (None, 0);
        env.run(self.stop, None, &mut |record| -> Result<()> {
            if let Some(writer) = writer.as_mut() {
                writer.write(record)?;
            }
            result = tally.add(record).or(result.take());
            if let Record::Decision(decision) = record {
                decisions += 1;
                if decisions % PROGRESS_INTERVAL == 0 {
                    on_frame(decision.frame);
                }
            }
            Ok(())
        })?;
        if let Some(RunStatus::Done(summary)) = result.as_mut().map(|r| &mut r.status) {
            summary.counts = env.counts();
        }
        Ok(result)
    }
}

/// Episode runs in two queues that all workers share: with and without waiting for remote services.
struct Queues<'i> {
    local: Vec<&'i EpisodeJob>,
    waiting: Vec<&'i EpisodeJob>,
    next: [AtomicUsize; 2],
}

impl<'i> Queues<'i> {
    fn new(jobs: &'i [EpisodeJob], waits: impl Fn(&EpisodeJob) -> bool) -> Queues<'i> {
        let (waiting, local) = jobs.iter().partition(|job| waits(job));
        Queues { local, waiting, next: Default::default() }
    }

    /// Prefers jobs that do not wait, because other threads serve the waiting ones.
    fn next_any(&self) -> Option<&'i EpisodeJob> {
        let local = self.local.get(self.next[0].fetch_add(1, Ordering::Relaxed));
        local.copied().or_else(|| self.next_waiting())
    }

    fn next_waiting(&self) -> Option<&'i EpisodeJob> {
        self.waiting.get(self.next[1].fetch_add(1, Ordering::Relaxed)).copied()
    }
}

/// Truncates a text to at most `max_bytes`.
fn truncated(mut text: String, max_bytes: usize) -> String {
    text.truncate(text.floor_char_boundary(max_bytes));
    text
}

/// Returns the message of a panic.
fn panic_message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}
