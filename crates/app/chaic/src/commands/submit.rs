//! `chaic submit`.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::Result;
use chaic_arena::archive::pack;
use chaic_arena::{
    Commitment, Evaluation, EvaluationReport, HelperSource, Manifest, Submission, SubmissionScore,
    UnpackedSubmission,
};
use chaic_core::FRAMES_PER_SECOND;
use chaic_env::helper_registry::{HelperRegistry, NONE};
use chaic_eval::report::{rounded, write_files};
use chaic_eval::run::{FolderMode, Run, RunFolder, RunProgress, RunRequest};
use chaic_files::write_atomically;
use chaic_page::{no_language, write_report};
use chaic_sandbox::Launcher;
use chaic_subprocess::conformance::check;
use serde_json::json;

use super::bars::RunBars;
use super::eval_session::{hide_worker_panics, warn_of_run};
use super::recorded::RecordedHelpers;
use super::sealed::read_commitment;
use super::submitted::SubmittedHelpers;
use super::summary::report_of;
use super::{bars, jobs, start_threads};
use crate::arguments::{
    SubmitCheckArguments, SubmitCommand, SubmitPackArguments, SubmitRunArguments,
    SubmitScoreArguments, SubmitVerifyArguments,
};
use crate::exit::{ExitStatus, with_hint};
use crate::interrupt;
use crate::output::{
    OutputFormat, counted, print, print_error, print_progress, print_result, quoted_path,
};

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
    // A folder that is no submission is refused before an archive exists.
    Submission::read(&arguments.folder)?;
    let packed = pack(&arguments.folder, &arguments.out)?;
    let json = json!({
        "archive": arguments.out, "files": packed.n_files, "bytes": packed.bytes,
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
    check_helper(submission, launcher, stop, &mut checks)?;
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
    launcher: &Launcher,
    stop: &'static AtomicBool,
    checks: &mut Checks,
) -> Result<()> {
    let helpers = SubmittedHelpers::new(submission, &[], launcher, stop)?;
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
    let evaluation = Evaluation::at(&arguments.out);
    let submission = evaluation.add_submission(&arguments.submission)?;
    let masked = [evaluation.run_folder(), arguments.episodes.clone()];
    let helpers = SubmittedHelpers::new(&submission, &masked, launcher, stop)?;
    helpers.check_grants(&submission)?;
    let request = request(&submission, arguments);
    helpers.with_registry(|registry| {
        play_run(&evaluation, &request, registry, arguments, stop, format)
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

fn play_run(
    evaluation: &Evaluation,
    request: &RunRequest,
    registry: &dyn HelperRegistry,
    arguments: &SubmitRunArguments,
    stop: &'static AtomicBool,
    format: OutputFormat,
) -> Result<ExitStatus> {
    let path = evaluation.run_folder();
    let (mut run, warnings) = Run::open(&path, FolderMode::Resume, request, registry)?;
    warn_of_run(&run, &warnings);
    hide_worker_panics();
    let extent = run.progress();
    print_progress(&format!(
        "{}: {}, helpers {}",
        path.display(),
        counted(extent.total, "episode run"),
        run.options().helpers.join(", ")
    ));
    let jobs = jobs(arguments.jobs);
    start_threads(jobs)?;
    let mut bars = RunBars::new(extent);
    let played = run.play(jobs, registry, stop, &mut |event| bars.show(event));
    bars.clear();
    let how_to_continue = "the same command continues";
    if !played.map_err(|error| with_hint(error.into(), how_to_continue))? {
        let extent = run.progress();
        let total = counted(extent.total, "episode run");
        print_error(&format!("stopped after {} of {total}; {how_to_continue}", extent.finished));
        return Ok(ExitStatus::Interrupted);
    }
    let report = report_of(&run);
    write_files(run.folder(), &report)?;
    write_report(run.folder(), &report, &no_language)?;
    let RunProgress { total, errors, .. } = run.progress();
    let json = json!({ "run": path, "episode_runs": total, "failed": errors });
    let failed = if errors > 0 { format!("; failed, zero each: {errors}") } else { String::new() };
    let text = format!(
        "{}: {}{failed}\nScore: chaic submit score {}\n",
        path.display(),
        counted(total, "episode run"),
        quoted_path(evaluation.folder())
    );
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(errors > 0))
}

fn score(arguments: &SubmitScoreArguments, format: OutputFormat) -> Result<ExitStatus> {
    let evaluation = Evaluation::at(&arguments.folder);
    let score = evaluation.score()?;
    let path = arguments.out.clone().unwrap_or_else(|| evaluation.score_file());
    write_atomically(&path, score.to_json().as_bytes())?;
    let rates = mean_rates(&score);
    let json = json!({
        "score": path, "helper": score.submission.name,
        "tr": rates.iter().map(|(name, rate)| ((*name).to_owned(), json!(rate))).collect::<serde_json::Map<_, _>>(),
    });
    let rates: Vec<String> =
        rates.iter().map(|(name, rate)| format!("{name} {}", rounded(*rate))).collect();
    let text = format!(
        "{}: transport rate, mean over {}: {}\n",
        path.display(),
        counted(score.tasks.len(), "task"),
        rates.join(", ")
    );
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}

/// Returns the mean transport rate over tasks of each helper.
fn mean_rates(score: &SubmissionScore) -> Vec<(&str, f64)> {
    let mean = |name: &str| {
        let rates: Vec<f64> =
            score.tasks.values().filter_map(|row| Some(row.get(name)?.tr)).collect();
        rates.iter().sum::<f64>() / rates.len().max(1) as f64
    };
    score.grants.keys().map(|name| (name.as_str(), mean(name))).collect()
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
        "traces": report.verification.agreeing,
        "decisions": report.verification.decisions,
        "simulated_s": simulated_s,
        "problems": report.problems,
    });
    let mut text: String =
        report.problems.iter().map(|problem| format!("DIFFERS {problem}\n")).collect();
    if report.problems.is_empty() {
        let (traces, decisions) = (report.verification.agreeing, report.verification.decisions);
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
/// Those of [`Evaluation::verify`].
pub(super) fn verify_evaluation(
    evaluation: &Evaluation,
    commitment: Option<&Commitment>,
    jobs: usize,
) -> Result<EvaluationReport> {
    let path = evaluation.run_folder();
    let (folder, options) = RunFolder::read(&path)?;
    let n_traces = folder.traces()?.len();
    let helpers = RecordedHelpers::new(&path, &options)?;
    let bar = bars::count_bar(n_traces as u64, "traces");
    let progress = |done: usize| bar.set_position(done as u64);
    let report = evaluation.verify(&helpers.registry(), commitment, jobs, &progress);
    bar.finish_and_clear();
    Ok(report?)
}
