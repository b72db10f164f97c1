//! Playing a trace's actions again, to see whether they lead where the trace says.

mod coverage;
mod folder_check;

pub use coverage::{Coverage, ReportState};
pub use folder_check::Finding;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use chaic_core::agent::ChildState;
use chaic_core::observation::Grants;
use chaic_core::{AgentId, Frame};
use chaic_env::minds::{self, BuiltIn, Helpers};
use chaic_env::rules::RuleSet;
use chaic_env::trace::{Decision, Header, Record, Trace, Warning, parse};
use chaic_env::{Choice, EnvError, EpisodeConfig, Minds, RunKey, header_of, run_loop, world_of};
use chaic_world::World;

use crate::error::{EvalError, Result};
use crate::metrics::{Ending, RunResult, tally};
use crate::run::{RunFolder, RunGrants, RunOptions, planned, read_journal};
use crate::trace_file;

use folder_check::FolderCheck;

/// The first place where a trace and its re-simulation differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
    /// The trace.
    pub path: PathBuf,
    /// When.
    pub frame: Frame,
    /// Whose decision, if it is one.
    pub agent: Option<AgentId>,
    /// What the trace says, and what comes out.
    pub problem: String,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: frame {}", self.path.display(), self.frame)?;
        if let Some(agent) = self.agent {
            write!(f, ", {agent}")?;
        }
        write!(f, ": {}", self.problem)
    }
}

/// What verifying a run found.
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// How many traces agree.
    pub agreeing: usize,
    /// How many decisions they hold.
    pub decisions: usize,
    /// The first difference of each trace that doesn't, by path.
    pub mismatches: Vec<Mismatch>,
    /// Other problems in the run's folder.
    pub findings: Vec<Finding>,
    /// Files that could only be read in part.
    pub warnings: Vec<Warning>,
    /// How many episode runs have results.
    pub coverage: Coverage,
    /// Whether the report is what the results give.
    pub report: ReportState,
}

impl Verdict {
    /// Returns whether the run is complete, and every check was made and passed.
    pub fn is_good(&self) -> bool {
        self.mismatches.is_empty()
            && self.findings.is_empty()
            && self.warnings.is_empty()
            && self.coverage.is_whole()
            && self.report.is_good()
    }
}

/// Re-simulates every trace of a run on `jobs` threads, and compares all that is recorded: who
/// took part by which rules, digests at each decision, events, the end, and the line of
/// `results.jsonl`. A trace that can't be checked counts as one that differs. Every finished result needs a
/// trace and every trace a finished result. Other entries among the traces are findings: links, special
/// files, unfinished and unplanned traces. Then it counts the results, and compares the report with them.
///
/// `options` are the run's, `helpers` those that played; what a helper asked for isn't checked
/// if its name is unknown.
///
/// # Errors
/// If the run's own files can't be read, it was played without traces, or a trace is of another
/// version of the format; if the system gives no thread for a job.
pub fn verify_run(
    folder: &RunFolder,
    options: &RunOptions,
    helpers: &dyn Helpers,
    jobs: usize,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Verdict> {
    if !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() });
    }
    // Where its episodes are gone, every trace says so.
    let plan = planned(folder, options);
    let gone = plan.as_ref().err().map(|e| format!("the run's episodes can't be read: {e}"));
    let planned = plan.unwrap_or_default();
    let journal = read_journal(&folder.results(), &planned)?;
    let results = journal.results;
    let keys: Vec<RunKey> = planned.iter().map(|item| item.key.clone()).collect();
    let found = FolderCheck { folder, options, planned: &keys, results: &results }
        .run(&journal.repeated)?;
    let paths = found.traces;
    let granted = folder.granted()?;
    let refused = granted.as_ref().and_then(|granted| granted.check_track(options).err());
    let check = Check {
        rules: options.rules()?,
        granted,
        chaic: folder.version()?,
        planned: keys.iter().collect(),
        finished: finished(&results),
        has_measures: results.iter().any(has_measures),
        folder,
        options,
        helpers,
    };
    let checked = check.files(&paths, jobs, progress)?;
    let mut verdict = Verdict {
        findings: found.findings,
        mismatches: found.missing,
        warnings: journal.warnings,
        coverage: Coverage::of(&planned, &results),
        report: ReportState::of(folder, options, &planned, &results)?,
        ..Verdict::default()
    };
    let unreadable = gone.map(|problem| Finding { path: folder.episode_files(), problem });
    verdict.findings.extend(unreadable);
    for (path, one) in paths.iter().zip(checked) {
        verdict.add(match one {
            Ok(one) => one,
            // It concerns the whole run, so once is enough.
            Err(error @ EvalError::Env(EnvError::OtherVersion { .. })) => return Err(error),
            Err(error) => One::unreadable(path, &error),
        });
    }
    verdict.compare_counts(folder, check.finished.len());
    verdict.mismatches.extend(refused.map(|problem| Mismatch {
        path: folder.join("run.json"),
        frame: 0,
        agent: None,
        problem: problem.to_string(),
    }));
    verdict.mismatches.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(verdict)
}

/// Whether a single trace of a run says what playing its actions again gives: its first line, and
/// every record. Returns the first difference.
///
/// # Errors
/// If the run's episode can't be read or isn't the one that was played.
pub fn verify_trace(
    folder: &RunFolder,
    options: &RunOptions,
    helpers: &dyn Helpers,
    trace: &Trace,
    path: &Path,
) -> Result<Option<Mismatch>> {
    let check = Check {
        folder,
        options,
        rules: options.rules()?,
        granted: folder.granted()?,
        chaic: folder.version()?,
        helpers,
        planned: BTreeSet::new(),
        finished: BTreeMap::new(),
        has_measures: false,
    };
    check.trace(trace, path)
}

/// Returns the results of episode runs that were played to their end.
fn finished(results: &[RunResult]) -> BTreeMap<&RunKey, &RunResult> {
    results.iter().filter(|r| r.summary().is_some()).map(|r| (&r.key, r)).collect()
}

/// Returns whether a result has further measures, which older versions did not write.
fn has_measures(result: &RunResult) -> bool {
    result.summary().is_some_and(|s| !s.measures.is_empty())
}

/// What verifying one trace found.
struct One {
    decisions: usize,
    mismatch: Option<Mismatch>,
    warnings: Vec<Warning>,
}

impl Verdict {
    fn add(&mut self, one: One) {
        self.decisions += one.decisions;
        self.agreeing += usize::from(one.mismatch.is_none());
        self.mismatches.extend(one.mismatch);
        self.warnings.extend(one.warnings);
    }

    /// Adds a finding if the number of verified traces differs from the number of finished results and no
    /// other check explains it.
    fn compare_counts(&mut self, folder: &RunFolder, n_finished: usize) {
        let n = self.agreeing;
        if self.mismatches.is_empty() && self.findings.is_empty() && n != n_finished {
            let problem = format!("{n_finished} results are finished, but {n} traces agree");
            self.findings.push(Finding { path: folder.results(), problem });
        }
    }
}

impl One {
    fn unreadable(path: &Path, error: &EvalError) -> One {
        let problem = format!("can't be checked: {error}");
        let mismatch = Mismatch { path: path.to_owned(), frame: 0, agent: None, problem };
        One { decisions: 0, mismatch: Some(mismatch), warnings: Vec::new() }
    }
}

/// What a trace is held against.
struct Check<'a> {
    folder: &'a RunFolder,
    options: &'a RunOptions,
    rules: RuleSet,
    /// What `run.json` says of grants.
    granted: Option<RunGrants>,
    helpers: &'a dyn Helpers,
    /// Version of chaic in `run.json`.
    chaic: Option<String>,
    /// All that the run plays; empty where nobody knows.
    planned: BTreeSet<&'a RunKey>,
    /// Results of episode runs that were played to their end.
    finished: BTreeMap<&'a RunKey, &'a RunResult>,
    /// True if any result has further measures.
    has_measures: bool,
}

impl Check<'_> {
    /// All traces on `jobs` threads, in their order.
    fn files(
        &self,
        paths: &[PathBuf],
        jobs: usize,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Result<One>>> {
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let wanted = jobs.clamp(1, paths.len().max(1));
        let checked = Mutex::new(Vec::with_capacity(paths.len()));
        let work = || {
            while let Some((k, path)) = numbered(paths, next.fetch_add(1, Ordering::Relaxed)) {
                let one = self.file(path);
                checked.lock().unwrap_or_else(|e| e.into_inner()).push((k, one));
                progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            }
        };
        std::thread::scope(|scope| {
            for n in 1..=wanted {
                let spawned = std::thread::Builder::new().spawn_scoped(scope, work);
                if let Err(refusal) = spawned {
                    // Those that run already end with the traces that they have begun.
                    next.store(paths.len(), Ordering::Relaxed);
                    return Err(EvalError::NoThread { n, wanted, refusal });
                }
            }
            Ok(())
        })?;
        let mut checked = checked.into_inner().unwrap_or_else(|e| e.into_inner());
        checked.sort_by_key(|(k, _)| *k);
        Ok(checked.into_iter().map(|(_, one)| one).collect())
    }

    fn file(&self, path: &Path) -> Result<One> {
        let bytes = trace_file::bytes(self.folder.path(), path)?;
        let (trace, warnings) = parse(&bytes, path)?;
        let mut mismatch = self.trace(&trace, path)?;
        if mismatch.is_none() {
            let problem = foreign_line(&trace, &bytes).or_else(|| self.result_problem(&trace));
            let frame = trace.end().map_or(0, |e| e.frame);
            let at_end = |problem| Mismatch { path: path.to_owned(), frame, agent: None, problem };
            mismatch = problem.map(at_end);
        }
        Ok(One { decisions: trace.decisions().count(), mismatch, warnings })
    }

    /// Compares the result in `results.jsonl` with the one that a trace gives; returns the problem.
    fn result_problem(&self, trace: &Trace) -> Option<String> {
        let Some(recorded) = self.finished.get(&trace.header.key()) else {
            return Some("results.jsonl has no finished result of this run".to_owned());
        };
        let found = tally(trace).map(|found| match self.has_measures {
            true => found,
            false => without_measures(found),
        });
        if found.as_ref() != Some(&without_counts(recorded)) {
            return Some("results.jsonl says something else of this run".to_owned());
        }
        let name = self.counts_of_mute_mind(recorded)?;
        Some(format!("results.jsonl has the count {name}, but a built-in mind counts nothing"))
    }

    /// Returns the name of the first count that is attributed to a built-in mind. Built-in minds count
    /// nothing, and traces hold no counts to compare with.
    fn counts_of_mute_mind<'r>(&self, recorded: &'r RunResult) -> Option<&'r String> {
        let is_mute = |name: &str| match name.split('.').next() {
            Some("helper") => {
                minds::find(&BuiltIn, &recorded.key.helper, self.rules.planner).is_ok()
            }
            Some("partner") => self.options.partner.is_none(),
            _ => true,
        };
        let mut counts = recorded.summary().into_iter().flat_map(|s| s.counts.keys());
        counts.find(|name| is_mute(name))
    }

    fn trace(&self, trace: &Trace, path: &Path) -> Result<Option<Mismatch>> {
        if let Some(problem) = self.header_problem(&trace.header, path)? {
            let path = path.to_owned();
            return Ok(Some(Mismatch { path, frame: 0, agent: None, problem }));
        }
        let mut world =
            world_of(&trace.header, &self.folder.episode(self.options, &trace.header.key())?)?;
        verify(trace, &mut world, path)
    }

    /// What `run.json` says that an agent is granted.
    fn recorded_grants(&self, agent: AgentId, helper: &str) -> Option<Grants> {
        let granted = self.granted.as_ref()?;
        match agent {
            AgentId::PARTNER => Some(granted.partner),
            AgentId::HELPER => granted.helpers.get(helper).copied(),
            _ => None,
        }
    }

    /// Compares the helper's perception in a trace with the one in `run.json`; returns the problem.
    fn perception_problem(&self, header: &Header) -> Option<String> {
        let granted = self.granted.as_ref()?;
        let helper = header.people.iter().find(|p| p.agent == AgentId::HELPER)?;
        let is_same = granted.perception.get(&header.helper) == helper.perception.as_ref();
        (!is_same).then(|| "run.json names another perception of the helper".to_owned())
    }

    /// What the first line of a trace says that isn't so.
    fn header_problem(&self, header: &Header, path: &Path) -> Result<Option<String>> {
        let key = header.key();
        if self.folder.trace(&key) != path {
            return Ok(Some("the first line is that of another episode run".to_owned()));
        }
        if !self.planned.is_empty() && !self.planned.contains(&key) {
            return Ok(Some("this run doesn't play that episode run".to_owned()));
        }
        if self.chaic.as_ref().is_some_and(|chaic| *chaic != header.chaic) {
            return Ok(Some("run.json names another version of chaic".to_owned()));
        }
        let episode = self.folder.episode(self.options, &key)?;
        let rules = self.rules.planner;
        let helper = minds::find(self.helpers, &key.helper, rules).ok();
        let name = self.options.partner.as_deref();
        let partner = minds::find_partner(self.helpers, name, None, rules);
        let config = EpisodeConfig {
            episode: &episode,
            seed: header.seed,
            rules: self.rules,
            helper: &key.helper,
            partner: name,
            image_size: self.options.size,
            appearance: self.options.appearance()?,
        };
        // A mind that only its author has: what it asked for is its own affair.
        let is_unknown = [partner.is_err(), helper.is_none()];
        let helper = match helper {
            Some(helper) => helper,
            None => minds::find(&BuiltIn, "random", rules)?,
        };
        let mut expected = header_of(config, Minds::of(helper, partner.ok().flatten()))?;
        if let Some(problem) = self.grants_problem(&mut expected, header, is_unknown) {
            return Ok(Some(problem));
        }
        if let Some(problem) = self.perception_problem(header) {
            return Ok(Some(problem));
        }
        let expected = Header { chaic: header.chaic.clone(), ..expected };
        let said = serde_json::to_value(header).expect("a header is plain data");
        let comes = serde_json::to_value(&expected).expect("a header is plain data");
        // What is absent in one of them is null in the comparison.
        let fields = [&said, &comes].map(|header| header.as_object().into_iter().flatten());
        let names: BTreeSet<&String> = fields.into_iter().flatten().map(|(name, _)| name).collect();
        let wrong: Vec<&str> = names
            .into_iter()
            .filter(|name| said[*name] != comes[*name])
            .map(String::as_str)
            .collect();
        let problem = || format!("the first line is not what this run has: {}", wrong.join(", "));
        Ok((!wrong.is_empty()).then(problem))
    }

    /// Returns what the people of a header are granted that `run.json` or the track does not allow. Copies to
    /// the expected header what only the author of an unknown mind knows.
    fn grants_problem(
        &self,
        expected: &mut Header,
        header: &Header,
        is_unknown: [bool; 2],
    ) -> Option<String> {
        for (expected, said) in expected.people.iter_mut().zip(&header.people) {
            let recorded = self.recorded_grants(expected.agent, &header.helper);
            if expected.perception.is_some() == said.perception.is_some() {
                // Weights may have changed since.
                expected.perception.clone_from(&said.perception);
            }
            if is_unknown.get(expected.agent.index()).is_some_and(|unknown| *unknown) {
                expected.grants = recorded.unwrap_or(said.grants);
                expected.senses = said.senses;
                expected.perception.clone_from(&said.perception);
                if expected.agent == AgentId::HELPER {
                    // What the machine of the run enforced stands in run.json.
                    let granted = self.granted.as_ref();
                    expected.isolation =
                        granted.and_then(|g| g.isolation.get(&header.helper)).cloned();
                }
            } else if recorded.is_some_and(|grants| grants != expected.grants) {
                let problem = format!("run.json says that the {} is granted", expected.agent);
                return Some(problem + " something else than such a mind is");
            }
        }
        let helper = header.people.iter().find(|person| person.agent == AgentId::HELPER);
        let grants = helper.map_or(Grants::NONE, |helper| helper.grants);
        self.options.track.check_grants(&header.helper, grants).err()
    }
}

fn numbered(paths: &[PathBuf], k: usize) -> Option<(usize, &PathBuf)> {
    paths.get(k).map(|path| (k, path))
}

/// Returns a problem if a trace has other bytes than chaic writes for its records.
fn foreign_line(trace: &Trace, bytes: &[u8]) -> Option<String> {
    let line = trace_file::first_foreign_line(trace, bytes)?;
    Some(if line > trace.records.len() + 1 && trace.end().is_some() {
        format!("line {line} follows the end of the trace")
    } else {
        format!("line {line} differs from the form that chaic writes")
    })
}

/// Removes the further measures, which older versions of chaic did not write.
fn without_measures(mut found: RunResult) -> RunResult {
    if let Ending::Done(summary) = &mut found.ending {
        summary.measures.clear();
    }
    found
}

/// A result as a trace can tell it.
fn without_counts(result: &RunResult) -> RunResult {
    let mut result = result.clone();
    if let Ending::Done(summary) = &mut result.ending {
        summary.counts.clear();
    }
    result
}

/// Plays the actions of a trace in its world, and finds the first record that comes out different.
///
/// # Errors
/// None of its own; those of a broken world.
pub fn verify(trace: &Trace, world: &mut World, path: &Path) -> Result<Option<Mismatch>> {
    let mut decisions: VecDeque<(&Decision, Option<ChildState>)> = decisions_of(trace);
    let mut recorded = trace.records.iter();
    let mut found = None;
    let mut last: Option<Decision> = None;
    let mut decide = |world: &World, waiting: &[AgentId]| {
        let mut choices = Vec::new();
        let frame = world.state().frame;
        while let Some((d, child)) = decisions.front() {
            let is_now = d.frame == frame
                && waiting.contains(&d.agent)
                && !choices.iter().any(|c: &Choice| c.agent == d.agent);
            if !is_now {
                break;
            }
            let Decision { agent, action, ref thought, .. } = **d;
            choices.push(Choice { agent, action, thought: thought.clone(), child: *child });
            decisions.pop_front();
        }
        // Everybody who waited in this frame has decided, if the trace goes so far.
        Ok((!choices.is_empty()).then_some(choices))
    };
    let played = run_loop(world, &mut decide, &mut |record| {
        let said = recorded.next();
        if said == Some(record) {
            if let Record::Decision(decision) = record {
                last = Some(decision.clone());
            }
            return Ok(());
        }
        found = Some(mismatch(path, said, record, last.as_ref()));
        Err(EvalError::Difference(String::new()))
    });
    match played {
        Err(EvalError::Difference(_)) => Ok(found),
        Err(error) => Err(error),
        Ok(has_ended) => Ok(leftover(path, has_ended, recorded.next(), world)),
    }
}

/// The decisions of a trace, each with what the child does from it on if the trace says so.
fn decisions_of(trace: &Trace) -> VecDeque<(&Decision, Option<ChildState>)> {
    let mut decisions: VecDeque<(&Decision, Option<ChildState>)> = VecDeque::new();
    for record in &trace.records {
        match record {
            Record::Decision(decision) => decisions.push_back((decision, None)),
            Record::Child(child) => {
                if let Some((_, state)) = decisions.back_mut() {
                    *state = Some(child.state);
                }
            }
            Record::Event(_) | Record::End(_) => {}
        }
    }
    decisions
}

/// What the trace says that never came out.
fn leftover(
    path: &Path,
    has_ended: bool,
    next: Option<&Record>,
    world: &World,
) -> Option<Mismatch> {
    let frame = world.state().frame;
    let (agent, problem) = match (has_ended, next) {
        (_, Some(Record::Decision(d))) => {
            let waits = if has_ended { "the episode is over" } else { "somebody else waits" };
            (Some(d.agent), format!("the trace has a decision at frame {}, but {waits}", d.frame))
        }
        (_, Some(other)) => (None, format!("the trace goes on with {}", other.to_line())),
        // The trace stops early: a warning says so already, and all that it says is true.
        (_, None) => return None,
    };
    Some(Mismatch { path: path.to_owned(), frame, agent, problem })
}

fn mismatch(
    path: &Path,
    said: Option<&Record>,
    comes: &Record,
    last: Option<&Decision>,
) -> Mismatch {
    let place = |record: &Record| match record {
        Record::Decision(d) => (d.frame, Some(d.agent)),
        Record::Child(c) => (c.frame, Some(AgentId::CHILD)),
        Record::Event(e) => (e.event.frame, None),
        Record::End(e) => (e.frame, None),
    };
    let (frame, agent) = place(comes);
    let problem = match (said, comes) {
        (Some(Record::Decision(a)), Record::Decision(b)) if a.digest != b.digest => {
            format!(
                "the state's digest is {} in the trace, {} when played again",
                a.digest, b.digest
            )
        }
        (Some(said), comes) => {
            format!("the trace says {}, played again it is {}", said.to_line(), comes.to_line())
        }
        (None, comes) => format!("the trace ends, played again there is {}", comes.to_line()),
    };
    // A changed action shows in the state that it leads to.
    let before = last.map_or(String::new(), |d| {
        let action = serde_json::to_string(&d.action).expect("an action has string keys");
        format!("; the decision before it is the {}'s {action} at frame {}", d.agent, d.frame)
    });
    let problem = problem + &before;
    Mismatch { path: path.to_owned(), frame, agent, problem }
}
