//! Promise: verification finds changes of traces, results, grants and the report.

use std::path::PathBuf;

use chaic_core::AgentId;
use chaic_env::Track;
use chaic_env::helper_registry::BuiltInHelpers;
use chaic_env::partner_suite::{PartnerSuite, SuitePartner};
use chaic_env::rules::{RuleSet, RuleSetName};
use chaic_env::trace::{Decision, Header, Participant, Record, Trace};
use chaic_render::Appearance;

use super::*;
use crate::suite::{Robustness, SuiteFolder};

/// Plays one short episode with the turner; returns the run, its trace and its folder.
fn played_once(helpers: &TestHelpers) -> (Run, PathBuf, tempfile::TempDir) {
    played_with(helpers, |_| ())
}

/// Plays it with changed options.
fn played_with(
    helpers: &TestHelpers,
    change: impl FnOnce(&mut RunRequest),
) -> (Run, PathBuf, tempfile::TempDir) {
    let files = episode_files(&[TaskId::LowTarget], 1);
    let dir = tempfile::tempdir().unwrap();
    let mut request = RunRequest { seeds: None, ..request(&files, &["turner"]) };
    change(&mut request);
    let (mut run, _) = Run::open(dir.path(), FolderMode::New, &request, helpers).unwrap();
    assert!(play(&mut run, 1, helpers));
    let path = run.folder().traces().unwrap().remove(0);
    (run, path, dir)
}

/// Verifies a run and returns the mismatches.
fn verified(run: &Run, helpers: &TestHelpers) -> Vec<String> {
    let report = crate::verify::verify_run(run.folder(), run.options(), helpers, 1, &|_| ());
    report.unwrap().mismatches.iter().map(ToString::to_string).collect()
}

#[test]
fn verification_finds_changes() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_once(&helpers);
    let text = fs::read_to_string(&path).unwrap();
    let verify = || crate::verify::verify_run(run.folder(), run.options(), &helpers, 1, &|_| ());
    let report = || verify().unwrap();
    assert_eq!(report().mismatches, []);
    let changes = [
        // The second decision of the helper: the next digest differs.
        ("1,\"turn_left\"", "1,\"turn_right\"", "digest"),
        ("\"out_of_reach\"", "\"blocked\"", "the re-simulation has"),
        ("\"complete\":false", "\"complete\":true", "the re-simulation has"),
        ("\"seed\":0", "", "results.jsonl has this run"),
        // The header: grants, rules and world.
        ("\"seed\":0", "\"seed\":1", "another episode run"),
        ("\"goal\":false", "\"goal\":true", "differs from the one that this run writes: people"),
        (
            "\"container_capacity\":3",
            "\"container_capacity\":4",
            "differs from the one that this run writes: rules",
        ),
        (
            "\"world_seed\":",
            "\"world_seed\":9",
            "differs from the one that this run writes: world_seed",
        ),
        ("\"setup\":\"", "\"setup\":\"0", "can't be checked"),
    ];
    for (from, to, message) in changes {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from} is there");
        if message.contains("results.jsonl") {
            fs::remove_file(&path).unwrap();
        } else {
            fs::write(&path, changed).unwrap();
        }
        let found = report();
        assert_eq!((found.mismatches.len(), found.findings), (1, vec![]), "{from}");
        let mismatch = found.mismatches[0].to_string();
        assert!(mismatch.contains(message) && mismatch.contains("short-0-s0.jsonl"), "{mismatch}");
        fs::write(&path, &text).unwrap();
    }
    assert_eq!(report().mismatches, []);
    // Another entry in place of the trace is one problem.
    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    let found = report();
    assert_eq!((found.mismatches.len(), found.findings), (1, vec![]));
    assert!(found.mismatches[0].problem.contains("it is a folder"), "{}", found.mismatches[0]);
}

#[test]
fn an_unknown_helper_is_checked_against_the_grants_of_the_run() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_once(&helpers);
    let text = fs::read_to_string(&path).unwrap();
    let report = || {
        let built_in = chaic_env::helper_registry::BuiltInHelpers;
        crate::verify::verify_run(run.folder(), run.options(), &built_in, 1, &|_| ()).unwrap()
    };
    assert_eq!(report().mismatches, []);
    fs::write(&path, text.replacen("\"goal\":false", "\"goal\":true", 1)).unwrap();
    let mismatches = report().mismatches;
    assert_eq!(mismatches.len(), 1);
    assert!(
        mismatches[0].problem.contains("differs from the one that this run writes: people"),
        "{mismatches:?}"
    );
}

#[test]
fn the_partner_of_the_run_is_expected_in_traces() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_with(&helpers, |r| r.partner = Some("slow".to_owned()));
    assert_eq!(verified(&run, &helpers), [""; 0]);
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen("\"slow\"", "\"fast\"", 1)).unwrap();
    assert!(verified(&run, &helpers)[0].contains("differs from the one that this run writes"));
}

#[test]
fn rules_and_appearance_of_the_run_are_expected_in_traces() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_with(&helpers, |request| {
        request.rules = Some(RuleSetName::Compat);
        request.appearance = Some(Appearance::Evening);
    });
    let Header { rules, appearance, .. } = crate::trace_file::read(&path).unwrap().0.header;
    assert_eq!((rules, appearance), (RuleSet::COMPAT, Appearance::Evening));
    assert_eq!(verified(&run, &helpers), [""; 0]);
}

#[test]
fn weights_that_agents_lack_are_no_part_of_traces() {
    let helpers = TestHelpers::new();
    let (run, path, dir) = played_once(&helpers);
    let text = fs::read_to_string(&path).unwrap();
    let (first, rest) = text.split_once('\n').unwrap();
    let people = "differs from the one that this run writes: people";
    let weights = "run.json names other weights of the helper";
    for (agent, message) in [(AgentId::PARTNER, people), (AgentId::HELPER, weights)] {
        let mut header: Header = serde_json::from_str(first).unwrap();
        header.people[agent.index()].weights = Some("0123456789abcdef".to_owned());
        let forged = serde_json::to_string(&header).unwrap();
        fs::write(&path, format!("{forged}\n{rest}")).unwrap();
        let problems = verified(&run, &helpers);
        assert!(problems.len() == 1 && problems[0].contains(message), "{agent}: {problems:?}");
    }
    // Nor if run.json names them as well.
    let run_file = dir.path().join("run.json");
    let mut forged: serde_json::Value =
        serde_json::from_slice(&fs::read(&run_file).unwrap()).unwrap();
    forged["granted"]["weights"] = serde_json::json!({ "turner": "0123456789abcdef" });
    fs::write(&run_file, forged.to_string()).unwrap();
    let (folder, options) = RunFolder::read(dir.path()).unwrap();
    let report = crate::verify::verify_run(&folder, &options, &helpers, 1, &|_| ());
    let problems = report.map_or_else(|e| e.to_string(), |r| format!("{:?}", r.mismatches));
    assert!(problems.contains(people), "{problems}");
}

#[test]
fn the_first_line_in_another_form_is_named() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_once(&helpers);
    let text = fs::read_to_string(&path).unwrap();
    let n_lines = text.lines().count();
    for (changed, message) in [
        (text.trim_end().to_owned() + " \n", format!("line {n_lines} differs from the form")),
        (text.clone() + "\n", format!("line {} follows the end", n_lines + 1)),
    ] {
        fs::write(&path, changed).unwrap();
        let problems = verified(&run, &helpers);
        assert!(problems.len() == 1 && problems[0].contains(&message), "{problems:?}");
    }
}

#[test]
fn verification_counts_results_and_compares_the_report() {
    let source = episode_files(&[TaskId::LowTarget, TaskId::Shopping], 1);
    let dir = tempfile::tempdir().unwrap();
    let helpers = TestHelpers::new();
    let request = RunRequest { seeds: None, ..request(&source, &["none", "turner"]) };
    let (mut run, _) = Run::open(dir.path(), FolderMode::New, &request, &helpers).unwrap();
    assert!(play(&mut run, 1, &helpers));
    let report =
        || crate::verify::verify_run(run.folder(), run.options(), &helpers, 2, &|_| ()).unwrap();
    let compared = |missing: &[&'static str], altered: &[&'static str]| ReportState::Compared {
        missing: missing.to_vec(),
        altered: altered.to_vec(),
    };
    let files = ["scores.json", "report.md", "figure.svg"];
    assert_eq!(report().report, compared(&files, &[]));
    assert!(!report().has_passed() && report().findings.is_empty());
    // Results without diagnostic metrics, and with a wrong value.
    let journal = run.folder().results();
    let lines = fs::read_to_string(&journal).unwrap();
    let changed = |change: &dyn Fn(&mut serde_json::Value)| {
        let line = |line: &str| {
            let mut result: serde_json::Value = serde_json::from_str(line).unwrap();
            change(&mut result);
            result.to_string() + "\n"
        };
        fs::write(&journal, lines.lines().map(line).collect::<String>()).unwrap();
        report().mismatches.len()
    };
    let measured = |r: &serde_json::Value| r.get("measures").is_some();
    assert!(lines.lines().any(|l| measured(&serde_json::from_str(l).unwrap())), "{lines}");
    assert!(changed(&|r| drop(r.as_object_mut().unwrap().remove("measures"))) > 0);
    let n_altered = changed(&|r| {
        if measured(r) {
            r["measures"]["partner_failures"] = 0.125.into();
        }
    });
    assert!(n_altered > 0);
    fs::write(&journal, &lines).unwrap();
    let run_report = crate::report::Report {
        version: chaic_env::CHAIC_VERSION,
        options: run.options(),
        results: run.results(),
        planned: run.planned(),
        granted: Some(run.granted()),
        formulas: crate::metrics::FormulaSet::Paper,
    };
    crate::report::write_files(run.folder(), &run_report).unwrap();
    assert_eq!(report().report, compared(&[], &[]));
    assert!(report().has_passed());
    assert_eq!(report().coverage.to_string(), "4 of 4 episode runs are finished");
    for name in files {
        let file = run.folder().join(name);
        let text = fs::read_to_string(&file).unwrap();
        for other in [text.replacen('0', "1", 1), format!("{text}\n"), String::new()] {
            fs::write(&file, other).unwrap();
            assert_eq!(report().report, compared(&[], &[name]));
            assert!(!report().has_passed());
        }
        fs::write(&file, text).unwrap();
    }
    // A missing line, and a line of a failed episode run.
    let journal = run.folder().results();
    let lines = fs::read_to_string(&journal).unwrap();
    let (first, rest) = lines.split_once('\n').unwrap();
    fs::write(&journal, rest).unwrap();
    let coverage = report().coverage.to_string();
    assert!(
        coverage.contains("3 of 4 episode runs are finished; missing: 1, first "),
        "{coverage}"
    );
    assert!(!report().has_passed());
    let key: RunKey = serde_json::from_str::<RunResult>(first).unwrap().key;
    let status = RunStatus::Error { message: "the episode broke down: out of ideas".to_owned() };
    let broken = serde_json::to_string(&RunResult { key, status }).unwrap();
    fs::write(&journal, format!("{broken}\n{rest}")).unwrap();
    let coverage = report().coverage.to_string();
    assert!(coverage.contains("3 of 4 episode runs are finished; failed: 1, first "), "{coverage}");
    assert!(!report().has_passed());
    fs::write(&journal, &lines).unwrap();
    assert!(report().has_passed());

    // A trace of another version concerns the whole run, so the error is one line.
    let trace = run.folder().traces().unwrap().remove(1);
    let now = format!("\"version\":{}", chaic_env::trace::VERSION);
    let text = fs::read_to_string(&trace).unwrap();
    fs::write(&trace, text.replacen(&now, "\"version\":99", 1)).unwrap();
    let error = crate::verify::verify_run(run.folder(), run.options(), &helpers, 2, &|_| ());
    let error = error.unwrap_err().to_string();
    assert!(error.contains("is chaic-trace version 99"), "{error}");
    assert!(error.contains("use the chaic that wrote it"), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
}

#[test]
fn an_episode_that_was_stopped_verifies_wherever_its_trace_stops() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_once(&helpers);
    let (trace, _) = chaic_env::trace::parse(&fs::read(&path).unwrap(), &path).unwrap();
    let files = episode_files(&[TaskId::LowTarget], 1);
    let file = fs::read_dir(files.path()).unwrap().next().unwrap().unwrap().path();
    let episode = Episode::parse(&fs::read(file).unwrap(), "episode").unwrap();
    let n_events = trace.records.iter().filter(|r| matches!(r, Record::Event(_))).count();
    assert!(trace.end().is_some() && n_events > 0);
    for n in 0..trace.records.len() {
        let stopped = Trace { records: trace.records[..n].to_vec(), ..trace.clone() };
        assert_eq!(crate::verify::verify(&stopped, &episode, &path).unwrap(), None, "{n} records");
    }
    // An episode of a run is not stopped: its result has no trace then.
    let text = fs::read_to_string(&path).unwrap();
    let (cut, _) = text.trim_end().rsplit_once('\n').unwrap();
    fs::write(&path, format!("{cut}\n")).unwrap();
    assert!(verified(&run, &helpers)[0].contains("differs from the one of the trace"));
}

#[test]
fn a_run_of_another_version_and_older_forms_of_traces_verify() {
    let helpers = TestHelpers::new();
    let (run, path, dir) = played_once(&helpers);
    let run_file = dir.path().join("run.json");
    let text = fs::read_to_string(&run_file).unwrap();
    fs::write(&run_file, text.replacen(chaic_env::CHAIC_VERSION, "0.0.9", 1)).unwrap();
    let (mut trace, _) = crate::trace_file::read(&path).unwrap();
    trace.header.chaic = "0.0.9".to_owned();
    for version in chaic_env::trace::MIN_VERSION..=chaic_env::trace::VERSION {
        trace.header.version = version;
        let text: String = trace.lines().map(|line| line + "\n").collect();
        fs::write(&path, text).unwrap();
        assert_eq!(verified(&run, &helpers), [""; 0], "version {version}");
    }
    // Older versions wrote no diagnostic metrics.
    let journal = run.folder().results();
    let mut result: serde_json::Value =
        serde_json::from_slice(&fs::read(&journal).unwrap()).unwrap();
    assert!(result.as_object_mut().unwrap().remove("measures").is_some());
    fs::write(&journal, format!("{result}\n")).unwrap();
    assert_eq!(verified(&run, &helpers), [""; 0]);
}

/// Agent that waits in a process of its own, and has trained weights.
struct TrainedAgent {
    weights: &'static str,
}

impl Agent for TrainedAgent {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> std::result::Result<Action, AgentError> {
        Ok(Action::Wait { frames: 10 })
    }

    fn perception(&self) -> Option<String> {
        Some(format!("learned {}", self.weights))
    }

    fn isolation(&self) -> Option<String> {
        Some("sandbox".to_owned())
    }

    fn weights(&self) -> Option<String> {
        Some(self.weights.to_owned())
    }
}

/// Registry of a helper and a partner with trained weights of this digest.
struct TrainedAgents(&'static str);

impl TrainedAgents {
    fn create(&self, name: &str) -> Option<Helper> {
        let agent = Box::new(TrainedAgent { weights: self.0 });
        (name == "trained").then(|| Helper { agent, grants: Grants::NONE })
    }
}

impl HelperRegistry for TrainedAgents {
    fn names(&self) -> Vec<String> {
        vec!["trained".to_owned()]
    }

    fn make(&self, name: &str, _: PlannerRules) -> Option<Helper> {
        self.create(name)
    }

    fn partner(&self, name: &str, _: Option<&RunKey>, _: PlannerRules) -> Option<Helper> {
        self.create(name)
    }
}

#[test]
fn weights_perception_and_isolation_in_traces_are_those_of_the_run() {
    type HeaderChange = fn(&mut Participant);
    fn other() -> Option<String> {
        Some("other".to_owned())
    }
    let (then, now) = (TrainedAgents("0123456789abcdef"), TrainedAgents("fedcba9876543210"));
    let (files, dir) = (episode_files(&[TaskId::LowTarget], 1), tempfile::tempdir().unwrap());
    let partner = Some("trained".to_owned());
    let request = RunRequest { seeds: None, partner, ..request(&files, &["trained"]) };
    let (mut run, _) = Run::open(dir.path(), FolderMode::New, &request, &then).unwrap();
    assert!(run.play(1, &then, &AtomicBool::new(false), &mut |_| ()).unwrap());
    let path = run.folder().traces().unwrap().remove(0);
    let (trace, _) = crate::trace_file::read(&path).unwrap();
    let people = "differs from the one that this run writes: people";
    let perception = "run.json names another perception of the helper";
    let isolation = "run.json names another isolation of the helper";
    let weights = "run.json names other weights of the helper";
    // Problems with agents whose weights have changed since, and with unknown agents.
    let changes: [(AgentId, HeaderChange, [&str; 2]); 10] = [
        (AgentId::PARTNER, |_| (), ["", ""]),
        // `run.json` has no weights and no isolation of partners.
        (AgentId::PARTNER, |p| p.weights = other(), ["", ""]),
        (AgentId::PARTNER, |p| p.isolation = other(), [people, ""]),
        (AgentId::PARTNER, |p| p.weights = None, [people, ""]),
        (AgentId::PARTNER, |p| p.grants.goal = true, [people, people]),
        (AgentId::HELPER, |p| p.weights = other(), [weights, weights]),
        (AgentId::HELPER, |p| p.weights = None, [weights, weights]),
        (AgentId::HELPER, |p| p.isolation = other(), [isolation, isolation]),
        (AgentId::HELPER, |p| p.perception = other(), [perception, perception]),
        (AgentId::HELPER, |p| p.grants.goal = true, [people, people]),
    ];
    let registries: [&dyn HelperRegistry; 2] = [&now, &BuiltInHelpers];
    for (k, (agent, change, expected)) in changes.into_iter().enumerate() {
        let mut changed = trace.clone();
        change(&mut changed.header.people[agent.index()]);
        for (helpers, expected) in registries.into_iter().zip(expected) {
            let (folder, options) = (run.folder(), run.options());
            let found = crate::verify::verify_trace(folder, options, helpers, &changed, &path);
            let problem = found.unwrap().map_or(String::new(), |mismatch| mismatch.problem);
            let is_expected =
                problem.contains(expected) && problem.is_empty() == expected.is_empty();
            assert!(is_expected, "change {k}: {problem:?} instead of {expected:?}");
        }
    }
}

#[test]
fn helpers_are_the_same_with_all_partners_of_a_list() {
    let agents = TrainedAgents("0123456789abcdef");
    let (files, dir) = (episode_files(&[TaskId::LowTarget], 1), tempfile::tempdir().unwrap());
    let person = Some("+speed150".parse().unwrap());
    let fast = SuitePartner { name: "fast".to_owned(), partner: None, person };
    let suite = PartnerSuite::new(vec![fast]).unwrap();
    let folder = SuiteFolder::start(&dir.path().join("list"), suite).unwrap();
    for entry in folder.partners() {
        let helpers = ["none", "trained"];
        let request = RunRequest { seeds: None, person: entry.person, ..request(&files, &helpers) };
        let path = folder.run_path(&entry);
        let (mut run, _) = Run::open(&path, FolderMode::New, &request, &agents).unwrap();
        assert!(run.play(1, &agents, &AtomicBool::new(false), &mut |_| ()).unwrap());
    }
    folder.write_report(&Robustness::from_runs(&folder.runs().unwrap().0)).unwrap();
    // Each run agrees with itself.
    let findings = || {
        let (runs, _) = folder.runs().unwrap();
        for run in &runs {
            let (part, options) = (&run.folder, &run.options);
            let report = crate::verify::verify_run(part, options, &BuiltInHelpers, 1, &|_| ());
            let report = report.unwrap();
            assert_eq!((report.mismatches, report.findings), (vec![], vec![]));
        }
        folder.findings(&runs).unwrap()
    };
    assert_eq!(findings(), []);
    let run = folder.path().join("fast");
    let mut files = RunFolder::read(&run).unwrap().0.traces().unwrap();
    files.push(run.join("run.json"));
    let whole: Vec<String> = files.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    for (from, to) in [("\"sandbox\"", "\"other\""), ("0123456789abcdef", "fedcba9876543210")] {
        for (file, text) in files.iter().zip(&whole) {
            fs::write(file, text.replace(from, to)).unwrap();
        }
        let found = findings();
        let [finding] = &found[..] else { panic!("{from}: {found:?}") };
        assert_eq!(finding.path, run);
        assert!(finding.problem.contains("isolation or weights of its helpers"), "{finding}");
    }
}

#[test]
fn the_track_limits_the_grants_of_helpers_in_traces() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_once(&helpers);
    let (mut trace, _) = crate::trace_file::read(&path).unwrap();
    let problem = |trace: &Trace, track| {
        let options = RunOptions { track, ..run.options().clone() };
        let found =
            crate::verify::verify_trace(run.folder(), &options, &helpers, trace, &path).unwrap();
        found.map(|mismatch| mismatch.problem)
    };
    assert!(trace.header.people[AgentId::PARTNER.index()].grants.goal, "partners are no helpers");
    assert_eq!(problem(&trace, Track::Hidden), None);
    trace.header.people[AgentId::HELPER.index()].grants.goal = true;
    let refused = problem(&trace, Track::Hidden).unwrap();
    let message = "helper `turner` is granted goal, which the hidden track refuses";
    assert!(refused.contains(message), "{refused}");
    let differs = problem(&trace, Track::Unrestricted).unwrap();
    assert!(differs.ends_with("differs from the one that this run writes: people"), "{differs}");
}

#[test]
fn the_first_differing_or_additional_record_is_named() {
    let helpers = TestHelpers::new();
    let (run, path, _dir) = played_once(&helpers);
    let (trace, _) = crate::trace_file::read(&path).unwrap();
    let episode = run.folder().episode(run.options(), &trace.header.key()).unwrap();
    let decisions: Vec<(usize, &Decision)> = (0..)
        .zip(&trace.records)
        .filter_map(|(k, record)| match record {
            Record::Decision(decision) => Some((k, decision)),
            _ => None,
        })
        .collect();
    let of_helper: Vec<usize> =
        (0..decisions.len()).filter(|n| decisions[*n].1.agent == AgentId::HELPER).collect();
    let ((first, _), (second, decision)) = (decisions[of_helper[0]], decisions[of_helper[1]]);
    let before = decisions[of_helper[1] - 1].1;
    let check = |records: Vec<Record>, frame: u32, agent: Option<AgentId>, problem: &str| {
        let changed = Trace { records, ..trace.clone() };
        let found = crate::verify::verify(&changed, &episode, &path).unwrap().expect(problem);
        assert_eq!((found.frame, found.agent, found.problem.as_str()), (frame, agent, problem));
    };
    let changed = |k: usize, change: &dyn Fn(&mut Decision)| {
        let mut records = trace.records.clone();
        if let Record::Decision(decision) = &mut records[k] {
            change(decision);
        }
        records
    };
    let helper = Some(AgentId::HELPER);

    let action = serde_json::to_string(&before.action).unwrap();
    let problem = format!(
        "the state's digest is {} in the trace, {} in the re-simulation; the decision before it is \
         the {}'s {action} at frame {}",
        Digest(1),
        decision.digest,
        before.agent,
        before.frame
    );
    let records = changed(second, &|decision| decision.digest = Digest(1));
    check(records.clone(), decision.frame, helper, &problem);
    // A trace that stops there.
    check(records[..=second].to_vec(), decision.frame, helper, &problem);

    let problem = "the trace has a decision at frame 1, but another agent decides next";
    check(changed(first, &|decision| decision.frame = 1), 0, helper, problem);

    let with = |record: &Record| [trace.records.as_slice(), std::slice::from_ref(record)].concat();
    let problem =
        format!("the trace has a decision at frame {}, but the episode is over", decision.frame);
    check(with(&trace.records[second]), HORIZON, helper, &problem);
    let event = trace.records.iter().find(|r| matches!(r, Record::Event(_))).unwrap();
    let problem = format!("the trace continues with {}", event.to_line());
    check(with(event), HORIZON, None, &problem);
}

#[test]
fn counters_belong_to_agents_that_are_not_built_in() {
    let helpers = TestHelpers::new();
    let runs: [(Option<&str>, &[&str]); 4] = [
        (None, &["helper.calls"]),
        (Some("slow"), &["helper.calls"]),
        (Some("habits:memory=90,noise=10"), &["helper.calls"]),
        (Some("stranger"), &["helper.calls", "partner.calls"]),
    ];
    for (partner, allowed) in runs {
        let (run, _, _dir) = played_with(&helpers, |r| r.partner = partner.map(str::to_owned));
        let journal = run.folder().results();
        let line = fs::read_to_string(&journal).unwrap();
        for name in ["helper.calls", "partner.calls", "child.calls"] {
            let counts = format!("\"counts\":{{\"{name}\":1}},\"digest\"");
            fs::write(&journal, line.replacen("\"digest\"", &counts, 1)).unwrap();
            let problems = verified(&run, &helpers);
            assert_eq!(problems.is_empty(), allowed.contains(&name), "{name}: {problems:?}");
            let message = format!("has the count {name}, but");
            assert!(problems.iter().all(|problem| problem.contains(&message)), "{problems:?}");
        }
    }
}

#[test]
fn progress_counts_the_verified_traces() {
    let (files, dir) = (episode_files(&[TaskId::LowTarget], 2), tempfile::tempdir().unwrap());
    let helpers = TestHelpers::new();
    let request = RunRequest { seeds: None, ..request(&files, &["turner"]) };
    let (mut run, _) = Run::open(dir.path(), FolderMode::New, &request, &helpers).unwrap();
    assert!(play(&mut run, 1, &helpers));
    let counted = std::sync::Mutex::new(Vec::new());
    let count = |n: usize| counted.lock().unwrap().push(n);
    let report = crate::verify::verify_run(run.folder(), run.options(), &helpers, 2, &count);
    let report = report.unwrap();
    let mut counted = counted.into_inner().unwrap();
    counted.sort_unstable();
    assert_eq!(counted, [1, 2]);
    let n_decisions = |path: &PathBuf| crate::trace_file::read(path).unwrap().0.decisions().count();
    let n_expected: usize = run.folder().traces().unwrap().iter().map(n_decisions).sum();
    assert_eq!((report.agreeing, report.decisions), (2, n_expected));
}

#[test]
fn a_stopped_verification_has_no_report() {
    let (files, dir) = (episode_files(&[TaskId::LowTarget], 2), tempfile::tempdir().unwrap());
    let helpers = TestHelpers::new();
    let request = RunRequest { seeds: None, ..request(&files, &["turner"]) };
    let (mut run, _) = Run::open(dir.path(), FolderMode::New, &request, &helpers).unwrap();
    assert!(play(&mut run, 1, &helpers));
    let stop = AtomicBool::new(false);
    let verify = |progress: &(dyn Fn(usize) + Sync)| {
        let (folder, options) = (run.folder(), run.options());
        crate::verify::verify_run_until(folder, options, &helpers, 1, &stop, progress).unwrap()
    };
    assert_eq!(verify(&|_| ()).map(|report| report.agreeing), Some(2));
    // The user stops it after the first trace.
    assert!(verify(&|_| stop.store(true, Ordering::Relaxed)).is_none());
}
