//! Verification: re-simulates the actions of traces and compares the records.

mod coverage;
mod folder_check;
mod mismatch;
mod report;

pub use coverage::{Coverage, ReportState};
pub use folder_check::Finding;
pub use mismatch::Mismatch;
pub use report::VerificationReport;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use chaic_core::AgentId;
use chaic_core::observation::Grants;
use chaic_env::helper_registry::{self, BuiltInHelpers, HelperRegistry};
use chaic_env::rules::RuleSet;
use chaic_env::trace::{Decision, End, Header, Record, Trace, TraceWarning, parse};
use chaic_env::{EnvError, EpisodeAgents, EpisodeConfig, Playback, RunKey, trace_header};
use chaic_episodes::Episode;
use chaic_world::World;

use crate::error::{EvalError, Result};
use crate::metrics::{RunResult, RunStatus, result_of_trace};
use crate::run::{RunFolder, RunGrants, RunOptions, planned, read_journal};
use crate::trace_file;

use folder_check::FolderCheck;

/// Re-simulates every trace of a run on `jobs` threads and compares all records: header, digests at
/// each decision, events, the end, and the line in `results.jsonl`.
///
/// A trace that can't be checked counts as a mismatch. Every finished result needs a trace, and
/// every trace a finished result. Other entries in the folder of traces are findings: links,
/// special files, unfinished and unplanned traces. Also counts the results, and compares the report
/// with them.
///
/// `options` are those of the run, `helpers` those that played. For an unknown helper, its
/// requested grants and sensors are not checked.
///
/// # Errors
/// If the run's own files can't be read, it was played without traces, or a trace has another
/// format version; if a thread can't be started.
pub fn verify_run(
    folder: &RunFolder,
    options: &RunOptions,
    helpers: &dyn HelperRegistry,
    jobs: usize,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<VerificationReport> {
    let never = AtomicBool::new(false);
    let report = verify_run_until(folder, options, helpers, jobs, &never, progress)?;
    Ok(report.expect("the stop flag is never raised"))
}

/// Verifies a run like [`verify_run`]. Returns `None` if `stop` is raised before the last trace is
/// started.
///
/// # Errors
/// Those of [`verify_run`].
pub fn verify_run_until(
    folder: &RunFolder,
    options: &RunOptions,
    helpers: &dyn HelperRegistry,
    jobs: usize,
    stop: &AtomicBool,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Option<VerificationReport>> {
    if !options.traces {
        return Err(EvalError::NoTraces { path: folder.path().to_owned() });
    }
    // Without episodes, every trace has an error.
    let plan = planned(folder, options);
    let plan_problem =
        plan.as_ref().err().map(|e| format!("the run's episodes can't be read: {e}"));
    let planned = plan.unwrap_or_default();
    let journal = read_journal(&folder.results(), &planned)?;
    let results = journal.results;
    let keys: Vec<RunKey> = planned.iter().map(|job| job.key.clone()).collect();
    let contents = FolderCheck { folder, options, planned: &keys, results: &results }
        .run(&journal.repeated)?;
    let paths = contents.traces;
    let granted = folder.granted()?;
    let violation = granted.as_ref().and_then(|granted| granted.check_track(options).err());
    let verifier = TraceVerifier {
        rules: options.rules()?,
        granted,
        chaic: folder.version()?,
        finished: finished(&results),
        has_diagnostics: folder.other_version()?.is_none() || results.iter().any(has_diagnostics),
        folder,
        options,
        helpers,
    };
    let Some(checked) = verifier.check_all(&paths, jobs, stop, progress)? else {
        return Ok(None);
    };
    let mut report = VerificationReport {
        findings: contents.findings,
        mismatches: contents.missing,
        warnings: journal.warnings,
        coverage: Coverage::new(&planned, &results),
        report: ReportState::compare(folder, options, &planned, &results)?,
        ..VerificationReport::default()
    };
    let unreadable = plan_problem.map(|problem| Finding { path: folder.episode_files(), problem });
    report.findings.extend(unreadable);
    for (path, checked) in paths.iter().zip(checked) {
        report.add(match checked {
            Ok(result) => result,
            // The error concerns the whole run, so it is reported once.
            Err(error @ EvalError::Env(EnvError::OtherVersion { .. })) => return Err(error),
            Err(error) => TraceResult::unreadable(path, &error),
        });
    }
    report.compare_counts(folder, verifier.finished.len());
    report.mismatches.extend(violation.map(|problem| Mismatch {
        path: folder.join("run.json"),
        frame: 0,
        agent: None,
        problem: problem.to_string(),
    }));
    report.mismatches.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(Some(report))
}

/// Verifies the header and the records of a single trace; returns the first difference.
///
/// # Errors
/// If the run's episode can't be read or is not the one of the trace.
pub fn verify_trace(
    folder: &RunFolder,
    options: &RunOptions,
    helpers: &dyn HelperRegistry,
    trace: &Trace,
    path: &Path,
) -> Result<Option<Mismatch>> {
    let verifier = TraceVerifier {
        folder,
        options,
        rules: options.rules()?,
        granted: folder.granted()?,
        chaic: folder.version()?,
        helpers,
        finished: BTreeMap::new(),
        has_diagnostics: false,
    };
    verifier.check_trace(trace, path)
}

/// Returns the results of episode runs that were played to their end.
fn finished(results: &[RunResult]) -> BTreeMap<&RunKey, &RunResult> {
    results.iter().filter(|r| r.summary().is_some()).map(|r| (&r.key, r)).collect()
}

/// Returns whether a result has diagnostic metrics; older versions did not write them.
fn has_diagnostics(result: &RunResult) -> bool {
    result.summary().is_some_and(|s| !s.diagnostics.is_empty())
}

/// Result of verifying one trace.
struct TraceResult {
    decisions: usize,
    mismatch: Option<Mismatch>,
    warnings: Vec<TraceWarning>,
}

impl VerificationReport {
    fn add(&mut self, result: TraceResult) {
        self.decisions += result.decisions;
        self.agreeing += usize::from(result.mismatch.is_none());
        self.mismatches.extend(result.mismatch);
        self.warnings.extend(result.warnings);
    }

    /// Adds a finding if the numbers of verified traces and finished results differ and no other
    /// check explains it.
    fn compare_counts(&mut self, folder: &RunFolder, n_finished: usize) {
        let n = self.agreeing;
        if self.mismatches.is_empty() && self.findings.is_empty() && n != n_finished {
            let problem = format!("{n_finished} results are finished, but {n} traces agree");
            self.findings.push(Finding { path: folder.results(), problem });
        }
    }
}

impl TraceResult {
    fn unreadable(path: &Path, error: &EvalError) -> TraceResult {
        let problem = format!("can't be checked: {error}");
        let mismatch = Mismatch { path: path.to_owned(), frame: 0, agent: None, problem };
        TraceResult { decisions: 0, mismatch: Some(mismatch), warnings: Vec::new() }
    }
}

/// Data that a trace is compared with.
struct TraceVerifier<'a> {
    folder: &'a RunFolder,
    options: &'a RunOptions,
    rules: RuleSet,
    /// Grants in `run.json`.
    granted: Option<RunGrants>,
    helpers: &'a dyn HelperRegistry,
    /// Version of chaic in `run.json`.
    chaic: Option<String>,
    /// Results of episode runs that were played to their end.
    finished: BTreeMap<&'a RunKey, &'a RunResult>,
    /// True if results must have diagnostic metrics: those of this version, and those of another
    /// one if any has them.
    has_diagnostics: bool,
}

impl TraceVerifier<'_> {
    /// Checks all traces on `jobs` threads; returns the results in the order of the traces, or `None`
    /// if `stop` is raised.
    fn check_all(
        &self,
        paths: &[PathBuf],
        jobs: usize,
        stop: &AtomicBool,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Option<Vec<Result<TraceResult>>>> {
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let wanted = jobs.clamp(1, paths.len().max(1));
        let checked = Mutex::new(Vec::with_capacity(paths.len()));
        let work = || {
            while !stop.load(Ordering::Relaxed) {
                let k = next.fetch_add(1, Ordering::Relaxed);
                let Some(path) = paths.get(k) else { break };
                let result = self.check_file(path);
                checked.lock().unwrap_or_else(|e| e.into_inner()).push((k, result));
                progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            }
        };
        std::thread::scope(|scope| {
            for n in 1..=wanted {
                let spawned = std::thread::Builder::new().spawn_scoped(scope, work);
                if let Err(error) = spawned {
                    // Threads that run already finish their current traces.
                    next.store(paths.len(), Ordering::Relaxed);
                    return Err(EvalError::NoThread { n, wanted, error });
                }
            }
            Ok(())
        })?;
        let mut checked = checked.into_inner().unwrap_or_else(|e| e.into_inner());
        if checked.len() < paths.len() {
            return Ok(None);
        }
        checked.sort_by_key(|(k, _)| *k);
        Ok(Some(checked.into_iter().map(|(_, result)| result).collect()))
    }

    fn check_file(&self, path: &Path) -> Result<TraceResult> {
        let bytes = trace_file::bytes(self.folder.path(), path)?;
        let (trace, warnings) = parse(&bytes, path)?;
        let mut mismatch = self.check_trace(&trace, path)?;
        if mismatch.is_none() {
            let problem = format_problem(&trace, &bytes).or_else(|| self.result_problem(&trace));
            let frame = trace.end().map_or(0, |e| e.frame);
            let at_end = |problem| Mismatch { path: path.to_owned(), frame, agent: None, problem };
            mismatch = problem.map(at_end);
        }
        Ok(TraceResult { decisions: trace.decisions().count(), mismatch, warnings })
    }

    /// Compares the result in `results.jsonl` with the one of the trace; returns the problem.
    fn result_problem(&self, trace: &Trace) -> Option<String> {
        let Some(recorded) = self.finished.get(&trace.header.key()) else {
            return Some("results.jsonl has no finished result of this run".to_owned());
        };
        let found = result_of_trace(trace).map(|found| match self.has_diagnostics {
            true => found,
            false => without_diagnostics(found),
        });
        if found.as_ref() != Some(&without_counts(recorded)) {
            return Some(
                "the result in results.jsonl differs from the one of the trace".to_owned(),
            );
        }
        let name = self.counter_of_built_in_agent(recorded)?;
        Some(format!("results.jsonl has the count {name}, but built-in agents have no counters"))
    }

    /// Returns the name of the first counter that is attributed to a built-in agent. Built-in
    /// agents have no counters, and traces hold none to compare with.
    fn counter_of_built_in_agent<'r>(&self, recorded: &'r RunResult) -> Option<&'r String> {
        let rules = self.rules.planner;
        let partner = self.options.partner.as_deref();
        let is_built_in = |name: &str| match name.split('.').next() {
            Some("helper") => {
                helper_registry::find(&BuiltInHelpers, &recorded.key.helper, rules).is_ok()
            }
            Some("partner") => {
                helper_registry::find_partner(&BuiltInHelpers, partner, None, rules).is_ok()
            }
            _ => true,
        };
        let mut counts = recorded.summary().into_iter().flat_map(|s| s.counts.keys());
        counts.find(|name| is_built_in(name))
    }

    fn check_trace(&self, trace: &Trace, path: &Path) -> Result<Option<Mismatch>> {
        if let Some(problem) = self.header_problem(&trace.header, path)? {
            let path = path.to_owned();
            return Ok(Some(Mismatch { path, frame: 0, agent: None, problem }));
        }
        let episode = self.folder.episode(self.options, &trace.header.key())?;
        verify(trace, &episode, path)
    }

    /// Returns the grants of an agent in `run.json`.
    fn recorded_grants(&self, agent: AgentId, helper: &str) -> Option<Grants> {
        let granted = self.granted.as_ref()?;
        match agent {
            AgentId::PARTNER => Some(granted.partner),
            AgentId::HELPER => granted.helpers.get(helper).copied(),
            _ => None,
        }
    }

    /// Compares perception, isolation and weights of the helper in a trace with those in
    /// `run.json`; returns the problem.
    fn run_file_problem(&self, header: &Header) -> Option<String> {
        let granted = self.granted.as_ref()?;
        let helper = header.people.iter().find(|p| p.agent == AgentId::HELPER)?;
        let fields = [
            ("another perception", &granted.perception, &helper.perception),
            ("another isolation", &granted.isolation, &helper.isolation),
            ("other weights", &granted.weights, &helper.weights),
        ];
        let (difference, _, _) = fields
            .into_iter()
            .find(|&(_, recorded, actual)| recorded.get(&header.helper) != actual.as_ref())?;
        Some(format!("run.json names {difference} of the helper"))
    }

    /// Compares the header of a trace with the expected one; returns the problem.
    fn header_problem(&self, header: &Header, path: &Path) -> Result<Option<String>> {
        let key = header.key();
        if self.folder.trace(&key) != path {
            return Ok(Some("the first line is the one of another episode run".to_owned()));
        }
        if self.chaic.as_ref().is_some_and(|chaic| *chaic != header.chaic) {
            return Ok(Some("run.json names another version of chaic".to_owned()));
        }
        let episode = match self.folder.episode(self.options, &key) {
            Err(EvalError::Split(problem)) => return Ok(Some(problem.to_string())),
            episode => episode?,
        };
        let rules = self.rules.planner;
        let helper = helper_registry::find(self.helpers, &key.helper, rules).ok();
        let name = self.options.partner.as_deref();
        let partner = helper_registry::find_partner(self.helpers, name, None, rules);
        let config = EpisodeConfig {
            seed: header.seed,
            rules: self.rules,
            partner: name,
            image_size: self.options.image_size,
            appearance: self.options.appearance()?,
            ..EpisodeConfig::new(&episode, &key.helper)
        };
        // For unknown helpers, the requested grants and sensors can't be checked.
        let is_unknown = [partner.is_err(), helper.is_none()];
        let helper = match helper {
            Some(helper) => helper,
            None => helper_registry::find(&BuiltInHelpers, "random", rules)?,
        };
        let mut expected =
            trace_header(config, EpisodeAgents::new(helper, partner.ok().flatten()))?;
        if let Some(problem) = self.grants_problem(&mut expected, header, is_unknown) {
            return Ok(Some(problem));
        }
        if let Some(problem) = self.run_file_problem(header) {
            return Ok(Some(problem));
        }
        let expected = Header { chaic: header.chaic.clone(), version: header.version, ..expected };
        let recorded = serde_json::to_value(header).expect("a header is plain data");
        let expected = serde_json::to_value(&expected).expect("a header is plain data");
        // A field that is absent in one of them is null in the comparison.
        let fields = [&recorded, &expected].map(|header| header.as_object().into_iter().flatten());
        let names: BTreeSet<&String> = fields.into_iter().flatten().map(|(name, _)| name).collect();
        let differing: Vec<&str> = names
            .into_iter()
            .filter(|name| recorded[*name] != expected[*name])
            .map(String::as_str)
            .collect();
        let problem = || {
            let names = differing.join(", ");
            format!("the first line differs from the one that this run writes: {names}")
        };
        Ok((!differing.is_empty()).then(problem))
    }

    /// Checks the grants in a header against `run.json` and the track; returns the problem. Copies
    /// to the expected header what can't be determined for an unknown helper.
    fn grants_problem(
        &self,
        expected: &mut Header,
        header: &Header,
        is_unknown: [bool; 2],
    ) -> Option<String> {
        // The run determined isolation and weights of its helpers, so `run.json` has them.
        let of_run = |values: fn(&RunGrants) -> &BTreeMap<String, String>| {
            self.granted.as_ref().and_then(|g| values(g).get(&header.helper)).cloned()
        };
        for (expected, actual) in expected.people.iter_mut().zip(&header.people) {
            let is_helper = expected.agent == AgentId::HELPER;
            let recorded = self.recorded_grants(expected.agent, &header.helper);
            if expected.perception.is_some() == actual.perception.is_some() {
                // The weights may have changed since.
                expected.perception.clone_from(&actual.perception);
            }
            if !is_helper && expected.weights.is_some() == actual.weights.is_some() {
                expected.weights.clone_from(&actual.weights);
            }
            let is_unknown_agent = is_unknown.get(expected.agent.index()).is_some_and(|u| *u);
            if is_helper && (is_unknown_agent || expected.weights.is_some()) {
                expected.weights = of_run(|granted| &granted.weights);
            }
            if is_unknown_agent {
                expected.grants = recorded.unwrap_or(actual.grants);
                expected.sensors = actual.sensors;
                expected.recording.clone_from(&actual.recording);
                expected.perception.clone_from(&actual.perception);
                if is_helper {
                    expected.isolation = of_run(|granted| &granted.isolation);
                } else {
                    // `run.json` has neither of a partner.
                    expected.isolation.clone_from(&actual.isolation);
                    expected.weights.clone_from(&actual.weights);
                }
            } else if recorded.is_some_and(|grants| grants != expected.grants) {
                return Some(format!(
                    "the grants of the {} in run.json are not those that such an agent requests",
                    expected.agent
                ));
            }
        }
        let helper = header.people.iter().find(|person| person.agent == AgentId::HELPER);
        let grants = helper.map_or(Grants::NONE, |helper| helper.grants);
        self.options.track.check_grants(&header.helper, grants).err()
    }
}

/// Returns a problem if a trace has other bytes than chaic writes for its records.
fn format_problem(trace: &Trace, bytes: &[u8]) -> Option<String> {
    let line = trace_file::first_differing_line(trace, bytes)?;
    Some(if line > trace.records.len() + 1 && trace.end().is_some() {
        format!("line {line} follows the end of the trace")
    } else {
        format!("line {line} differs from the form that chaic writes")
    })
}

/// Removes diagnostic metrics, which older versions of chaic did not write.
fn without_diagnostics(mut found: RunResult) -> RunResult {
    if let RunStatus::Done(summary) = &mut found.status {
        summary.diagnostics.clear();
    }
    found
}

/// Removes agents' counters, which traces do not contain.
fn without_counts(result: &RunResult) -> RunResult {
    let mut result = result.clone();
    if let RunStatus::Done(summary) = &mut result.status {
        summary.counts.clear();
    }
    result
}

/// Re-simulates the decisions of a trace; returns the first record that differs.
///
/// # Errors
/// If the episode is not the one of the trace.
pub fn verify(trace: &Trace, episode: &Episode, path: &Path) -> Result<Option<Mismatch>> {
    let mut playback = Playback::new(trace, episode)?;
    let mut recorded = trace.records.iter();
    let mut last_decision: Option<Decision> = None;
    let is_stopped = trace.end().is_none();
    let mut compare = |simulated: Record| {
        let expected = recorded.next();
        // An episode may be stopped while actions run; later events are not recorded.
        if is_stopped && expected.is_none() {
            return None;
        }
        if expected != Some(&simulated) {
            return Some(mismatch(path, expected, &simulated, last_decision.as_ref()));
        }
        if let Record::Decision(decision) = simulated {
            last_decision = Some(decision);
        }
        None
    };
    while let Some(records) = playback.next_records() {
        if let Some(mismatch) = records.into_iter().find_map(&mut compare) {
            return Ok(Some(mismatch));
        }
    }
    let world = playback.world();
    if world.is_over()
        && let Some(mismatch) = compare(Record::End(End::new(world)))
    {
        return Ok(Some(mismatch));
    }
    Ok(extra_record(path, recorded.next(), world))
}

/// Returns a problem if the trace has more records than the re-simulation.
fn extra_record(path: &Path, next: Option<&Record>, world: &World) -> Option<Mismatch> {
    let (frame, has_ended) = (world.state().frame, world.is_over());
    let (agent, problem) = match (has_ended, next) {
        (_, Some(Record::Decision(d))) => {
            let reason =
                if has_ended { "the episode is over" } else { "another agent decides next" };
            (Some(d.agent), format!("the trace has a decision at frame {}, but {reason}", d.frame))
        }
        (_, Some(other)) => (None, format!("the trace continues with {}", other.to_line())),
        // The trace stops early. A warning reports that, and all its records are correct.
        (_, None) => return None,
    };
    Some(Mismatch { path: path.to_owned(), frame, agent, problem })
}

fn mismatch(
    path: &Path,
    recorded: Option<&Record>,
    simulated: &Record,
    last_decision: Option<&Decision>,
) -> Mismatch {
    let position = |record: &Record| match record {
        Record::Decision(d) => (d.frame, Some(d.agent)),
        Record::Child(c) => (c.frame, Some(AgentId::CHILD)),
        Record::Event(e) => (e.event.frame, None),
        Record::End(e) => (e.frame, None),
    };
    let (frame, agent) = position(simulated);
    let problem = match (recorded, simulated) {
        (Some(Record::Decision(a)), Record::Decision(b)) if a.digest != b.digest => {
            format!(
                "the state's digest is {} in the trace, {} in the re-simulation",
                a.digest, b.digest
            )
        }
        (Some(recorded), simulated) => {
            format!(
                "the trace has {}, the re-simulation has {}",
                recorded.to_line(),
                simulated.to_line()
            )
        }
        (None, simulated) => {
            format!("the trace ends, the re-simulation has {}", simulated.to_line())
        }
    };
    // A changed action shows in the digest of a later state.
    let context = last_decision.map_or(String::new(), |d| {
        let action = serde_json::to_string(&d.action).expect("an action has string keys");
        format!("; the decision before it is the {}'s {action} at frame {}", d.agent, d.frame)
    });
    let problem = problem + &context;
    Mismatch { path: path.to_owned(), frame, agent, problem }
}

#[cfg(test)]
mod tests;
