//! `chaic submit`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::Result;
use chaic_arena::archive::pack;
use chaic_arena::{
    Commitment, Evaluation, EvaluationReport, HelperSource, Manifest, Submission, SubmissionScore,
    UnpackedSubmission,
};
use chaic_core::{FRAMES_PER_SECOND, TaskId};
use chaic_env::helper_registry::NONE;
use chaic_env::partner_suite::SUITE;
use chaic_eval::metrics::Score;
use chaic_eval::report::rounded;
use chaic_eval::run::{RunFolder, RunRequest, tasks_of_files};
use chaic_files::write_atomically;
use chaic_sandbox::Launcher;
use chaic_subprocess::conformance::check;
use serde_json::{Value, json};

use super::eval_partners::read_partners;
use super::eval_session::hide_worker_panics;
use super::given_partners::GivenPartners;
use super::recorded::RecordedHelpers;
use super::sealed::read_commitment;
use super::submit_run::{SubmissionPlayer, refuse_language_partners};
use super::submitted::{SandboxOptions, SubmittedHelpers};
use super::{bars, jobs, start_threads};
use crate::arguments::{
    SubmitCheckArguments, SubmitCommand, SubmitPackArguments, SubmitRunArguments,
    SubmitScoreArguments, SubmitVerifyArguments,
};
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{OutputFormat, counted, json_path, print, print_result};

/// Helper that plays as the reference with `--rhp`.
const RHP: &str = "rhp";

/// Packs, checks, plays, scores or verifies a submission.
pub fn run(
    command: &SubmitCommand,
    format: OutputFormat,
    launcher: &Launcher,
) -> Result<ExitStatus> {
    match command {
        SubmitCommand::Pack(arguments) => pack_folder(arguments, format),
        SubmitCommand::Check(arguments) => check_submission(arguments, format, launcher),
        SubmitCommand::Run(arguments) => play(arguments, format, launcher),
        SubmitCommand::Score(arguments) => score(arguments, format),
        SubmitCommand::Verify(arguments) => verify(arguments, format),
    }
}

fn pack_folder(arguments: &SubmitPackArguments, format: OutputFormat) -> Result<ExitStatus> {
    // Refuses a folder that is not a submission, before an archive is written.
    Submission::read(&arguments.folder)?;
    let packed = pack(&arguments.folder, &arguments.out)?;
    let json = json!({
        "archive": json_path(&arguments.out), "files": packed.n_files, "bytes": packed.bytes,
        "sha256": packed.sha256,
    });
    let text = format!(
        "{}: {}, {} bytes, SHA-256 {}\n",
        arguments.out.display(),
        counted(packed.n_files, "file"),
        packed.bytes,
        packed.sha256
    );
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}

/// Results of the checks of a submission.
struct Checks {
    format: OutputFormat,
    results: Vec<(String, Option<String>)>,
}

impl Checks {
    /// Adds the result of a check and prints it.
    fn add(&mut self, name: &str, problem: Option<String>) -> Result<()> {
        if self.format != OutputFormat::Json {
            print(&match &problem {
                None => format!("ok      {name}\n"),
                Some(problem) => format!("FAILED  {name}\n        {problem}\n"),
            })?;
        }
        self.results.push((name.to_owned(), problem));
        Ok(())
    }
}

fn check_submission(
    arguments: &SubmitCheckArguments,
    format: OutputFormat,
    launcher: &Launcher,
) -> Result<ExitStatus> {
    let stop = interrupt::stop_flag()?;
    let unpacked = UnpackedSubmission::read(&arguments.submission)?;
    let submission = unpacked.submission();
    let Manifest { name, release, license, .. } = submission.manifest();
    let mut checks = Checks { format, results: Vec::new() };
    checks.add(&format!("archive, SHA-256 {}", submission.sha256()), None)?;
    checks.add(&format!("manifest of {name} {release}, license {license}"), None)?;
    let allows_partial = arguments.allow_partial_sandbox;
    let sandbox = SandboxOptions { launcher, masked: &[], allows_partial };
    check_helper(submission, sandbox, stop, &mut checks)?;
    if stop.load(Ordering::Relaxed) {
        return Ok(ExitStatus::Interrupted);
    }
    let public = submission.public_run();
    let verified = RunFolder::read(&public)
        .map_err(anyhow::Error::from)
        .and_then(|(_, options)| RecordedHelpers::new(&public, &options))
        .map(|helpers| {
            let bar = bars::count_bar(0, "traces");
            let progress = |done: usize| bar.set_position(done as u64);
            let jobs = jobs(arguments.jobs);
            let report = submission.check_public_run(&helpers.registry(), jobs, stop, &progress);
            bar.finish_and_clear();
            report
        });
    match verified {
        Ok(Ok(None)) => return Ok(ExitStatus::Interrupted),
        Ok(Ok(Some(report))) => {
            let traces = counted(report.agreeing, "trace");
            checks.add(&format!("public run: {traces}, all digests agree"), None)?;
        }
        Ok(Err(error)) => checks.add("public run", Some(error.to_string()))?,
        Err(error) => {
            let problem = submission.with_label(&format!("{error:#}"));
            checks.add("public run", Some(problem))?;
        }
    }
    let n_failed = checks.results.iter().filter(|(_, problem)| problem.is_some()).count();
    let records: Vec<_> = checks
        .results
        .iter()
        .map(|(check, problem)| json!({ "check": check, "problem": problem }))
        .collect();
    let json = json!({
        "passed": n_failed == 0, "sha256": submission.sha256(), "checks": records,
    });
    let text = match n_failed {
        0 => "The submission is complete.\n".to_owned(),
        n => format!("{} failed.\n", counted(n, "check")),
    };
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(n_failed > 0))
}

/// Checks that the helper loads with the grants of the manifest, and follows the protocol if it is a program.
fn check_helper(
    submission: &Submission,
    sandbox: SandboxOptions<'_>,
    stop: &'static AtomicBool,
    checks: &mut Checks,
) -> Result<()> {
    let helpers = SubmittedHelpers::new(submission, sandbox, stop)?;
    let granted = helpers.check_grants(submission);
    let kind = match submission.manifest().helper {
        HelperSource::Command(_) => "program",
        HelperSource::Policy(_) => "policy",
        HelperSource::BuiltIn(_) => "built-in helper",
    };
    let problem = granted.err().map(|error| format!("{error:#}"));
    checks.add(&format!("the {kind} has the grants of the manifest"), problem)?;
    let Some(program) = helpers.program() else { return Ok(()) };
    let mut printed = Ok(());
    check(&Arc::new(program.clone()), stop, &mut |check| {
        if !stop.load(Ordering::Relaxed) && printed.is_ok() {
            let problem = check.result.as_ref().err().map(|p| submission.with_label(p));
            printed = checks.add(check.requirement, problem);
        }
    });
    printed
}

fn play(
    arguments: &SubmitRunArguments,
    format: OutputFormat,
    launcher: &Launcher,
) -> Result<ExitStatus> {
    let stop = interrupt::stop_flag()?;
    let list = arguments.partners.as_deref();
    let mut files = GivenPartners::default();
    let partners = list.map(|list| read_partners(list, &mut files)).transpose()?;
    partners.as_ref().map_or(Ok(()), refuse_language_partners)?;
    // This check comes first, so that a wrong folder of episodes leaves no files.
    tasks_of_files(&arguments.episodes)?;
    let evaluation = Evaluation::at(&arguments.out);
    let submission = evaluation.add_submission(&arguments.submission)?;
    let run = evaluation.run_folder();
    // The sandbox makes no folder readable that contains one of these paths.
    let masked: Vec<PathBuf> = [run.clone(), arguments.episodes.clone()]
        .into_iter()
        .chain(list.filter(|list| *list != SUITE).map(PathBuf::from))
        .collect();
    let allows_partial = arguments.allow_partial_sandbox;
    let sandbox = SandboxOptions { launcher, masked: &masked, allows_partial };
    let helpers = SubmittedHelpers::new(&submission, sandbox, stop)?.with_partners(files);
    helpers.check_grants(&submission)?;
    let request = request(&submission, arguments);
    let jobs = jobs(arguments.jobs);
    start_threads(jobs)?;
    hide_worker_panics();
    helpers.with_registry(|registry| {
        let (evaluation, run, request) = (evaluation.folder(), run.as_path(), &request);
        let player = SubmissionPlayer { evaluation, run, request, registry, jobs, stop, format };
        player.play(partners)
    })
}

/// Returns the run of a submission on the sealed episodes.
fn request(submission: &Submission, arguments: &SubmitRunArguments) -> RunRequest {
    let Manifest { name, play, .. } = submission.manifest();
    let reference = arguments.rhp.then_some(RHP);
    let names = [NONE].into_iter().chain(reference).chain([name.as_str()]);
    RunRequest {
        helpers: Some(names.map(str::to_owned).collect()),
        episodes: Some(arguments.episodes.clone()),
        track: Some(play.track),
        perception: Some(play.perception.clone()),
        behavior: Some(play.behavior.clone()),
        ..RunRequest::default()
    }
}

fn score(arguments: &SubmitScoreArguments, format: OutputFormat) -> Result<ExitStatus> {
    let evaluation = Evaluation::at(&arguments.folder);
    let score = evaluation.score()?;
    let path = arguments.out.clone().unwrap_or_else(|| evaluation.score_file());
    write_atomically(&path, score.to_json().as_bytes())?;
    let rates = mean_rates(&score, &score.tasks);
    let mut json = json!({
        "score": json_path(&path), "helper": score.submission.name, "tr": rates_json(&rates),
    });
    let mut text = format!(
        "{}: transport rate, mean over {}: {}\n",
        path.display(),
        counted(score.tasks.len(), "task"),
        rates_text(&rates)
    );
    if let Some(partners) = &score.partners {
        let rates = mean_rates(&score, &partners.tasks);
        json["tr_partners"] = rates_json(&rates);
        let n_partners = counted(partners.list.len(), "partner");
        text += &format!("With the list of {n_partners}: {}\n", rates_text(&rates));
    }
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}

/// Returns the mean transport rate over tasks of each helper.
fn mean_rates<'a>(
    score: &'a SubmissionScore,
    tasks: &BTreeMap<TaskId, BTreeMap<String, Score>>,
) -> Vec<(&'a str, f64)> {
    let mean = |name: &str| {
        let rates: Vec<f64> = tasks.values().filter_map(|row| Some(row.get(name)?.tr)).collect();
        rates.iter().sum::<f64>() / rates.len().max(1) as f64
    };
    score.grants.keys().map(|name| (name.as_str(), mean(name))).collect()
}

fn rates_json(rates: &[(&str, f64)]) -> Value {
    rates.iter().map(|(name, rate)| ((*name).to_owned(), json!(rate))).collect()
}

fn rates_text(rates: &[(&str, f64)]) -> String {
    let rates = rates.iter().map(|(name, rate)| format!("{name} {}", rounded(*rate)));
    rates.collect::<Vec<String>>().join(", ")
}

fn verify(arguments: &SubmitVerifyArguments, format: OutputFormat) -> Result<ExitStatus> {
    let commitment = arguments.commitment.as_deref().map(read_commitment).transpose()?;
    let evaluation = Evaluation::at(&arguments.folder);
    let start = Instant::now();
    let report = verify_evaluation(&evaluation, commitment.as_ref(), jobs(arguments.jobs))?;
    let elapsed_s = start.elapsed().as_secs_f64().max(1e-3);
    let simulated_s = report.simulated_frames() / u64::from(FRAMES_PER_SECOND);
    let json = json!({
        "passed": report.problems.is_empty(),
        "traces": report.traces,
        "decisions": report.decisions,
        "simulated_s": simulated_s,
        "problems": report.problems,
    });
    let mut text: String =
        report.problems.iter().map(|problem| format!("DIFFERS {problem}\n")).collect();
    if report.problems.is_empty() {
        let (traces, decisions) = (report.traces, report.decisions);
        text = format!(
            "{}: confirmed by {} with {}\n{} min of episodes in {elapsed_s:.1} s: {:.0} times real time\n",
            evaluation.score_file().display(),
            counted(traces, "trace"),
            counted(decisions, "decision"),
            simulated_s / 60,
            simulated_s as f64 / elapsed_s
        );
    }
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(!report.problems.is_empty()))
}

/// Verifies an evaluated submission on several threads, with a bar.
///
/// # Errors
/// Those of [`Evaluation::check_parts`] and [`Evaluation::verify`].
pub(super) fn verify_evaluation(
    evaluation: &Evaluation,
    commitment: Option<&Commitment>,
    jobs: usize,
) -> Result<EvaluationReport> {
    evaluation.check_parts()?;
    let runs = evaluation.partner_runs()?;
    let ordinary = runs.first().expect("every evaluation has the run with the ordinary partner");
    // The runs differ only in the partner, so they have the same helpers.
    let (_, options) = RunFolder::read(ordinary)?;
    let helpers = RecordedHelpers::new(ordinary, &options)?;
    // The verification reports a run that can't be read.
    let folders = runs.iter().filter_map(|path| Some(RunFolder::read(path).ok()?.0));
    let n_traces: usize = folders.filter_map(|folder| Some(folder.traces().ok()?.len())).sum();
    let bar = bars::count_bar(n_traces as u64, "traces");
    let progress = |done: usize| bar.set_position(done as u64);
    let report = evaluation.verify(&helpers.registry(), commitment, jobs, &progress);
    bar.finish_and_clear();
    Ok(report?)
}
