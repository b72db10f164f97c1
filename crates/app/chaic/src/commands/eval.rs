//! `chaic eval` without a subcommand: plays a benchmark.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use chaic_eval::run::{Run, RunFolder};
use chaic_eval::suite::SuiteFolder;
use chaic_llm::record;
use chaic_page::REPORT_FILE;
use chaic_sandbox::Launcher;

use super::eval_partners;
use super::eval_session::{
    EvalSession, PlayOutcome, how_to_complete, in_free_folder, request, write_reports,
};
use super::given_partners::{GivenPartners, is_partner_file};
use super::summary::{LineValue, print_scores, report_of};
use crate::arguments::EvalArguments;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, print_error, quoted, quoted_path};

/// Plays a benchmark.
pub fn run(
    arguments: &EvalArguments,
    format: OutputFormat,
    launcher: &Launcher,
) -> Result<ExitStatus> {
    let resumed = arguments.out.as_deref().filter(|_| arguments.resume);
    if arguments.partners.is_some() || resumed.is_some_and(SuiteFolder::is_suite) {
        return eval_partners::run(arguments, format, launcher);
    }
    let mut given = GivenPartners::default();
    let partner = arguments.partner.as_deref().map(|name| given.resolve(name)).transpose()?;
    let hint = arguments.partner.as_deref().filter(|name| is_partner_file(name));
    let hint = hint.map_or(String::new(), |name| format!(" --partner {}", quoted(name)));
    let arguments = &EvalArguments { partner, ..arguments.clone() };
    let (request, name) = request(arguments);
    if let Some(path) = resumed {
        RunFolder::check_started(path)?;
    }
    let session = EvalSession::new(arguments, launcher, given, hint)?;
    let start = Instant::now();
    let play = |path: &Path| session.play(arguments, path, &request, None);
    let played = match &arguments.out {
        Some(path) => play(path),
        None => in_free_folder(name, play),
    };
    match played? {
        PlayOutcome::Complete(run) => finish(&run, format, start),
        PlayOutcome::Shard(run) => {
            let path = run.folder().path();
            print_error(&format!(
                "shard {} is played: {} of {}; {}",
                session.shard,
                run.progress().finished,
                counted(run.progress().total, "episode run"),
                how_to_complete(path, record::folder(path).exists()),
            ));
            Ok(ExitStatus::from_findings(run.progress().errors > 0))
        }
        PlayOutcome::Stopped => Ok(ExitStatus::Interrupted),
    }
}

/// Writes the report of a complete run and prints the short report.
fn finish(run: &Run, format: OutputFormat, start: Instant) -> Result<ExitStatus> {
    write_reports(run)?;
    let report = report_of(run);
    let path = quoted_path(run.folder().path());
    let secs = start.elapsed().as_secs();
    let mut more = vec![
        ("Page", LineValue::Path(run.folder().join(REPORT_FILE))),
        ("Time", LineValue::Text(format!("{} min {:02} s", secs / 60, secs % 60))),
    ];
    // Only finished episode runs have a trace.
    let finished = || run.results().iter().filter(|r| r.summary().is_some());
    // The order of results depends on timing, so the example is selected by key.
    let of_rhp = finished().filter(|r| r.key.helper == "rhp").min_by_key(|r| &r.key);
    let example = of_rhp.or_else(|| finished().min_by_key(|r| &r.key));
    if let Some(example) = example.filter(|_| run.options().traces) {
        let (episode, helper) = (&example.key.episode, &example.key.helper);
        let replay = format!("chaic replay {path} {episode} --helper {helper} --out replay.mp4");
        more.push(("Replay", LineValue::Text(replay)));
        more.push(("View", LineValue::Text(format!("chaic view {path}"))));
        more.push(("Verify", LineValue::Text(format!("chaic verify {path}"))));
    }
    print_scores(format, &report, run.folder(), &more)?;
    Ok(ExitStatus::from_findings(run.progress().errors > 0))
}
