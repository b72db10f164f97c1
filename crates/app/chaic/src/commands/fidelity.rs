//! `chaic fidelity`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use anyhow::Result;
use chaic_env::helper_registry::BuiltInHelpers;
use chaic_env::rules::differing_rules;
use chaic_eval::report::write_files;
use chaic_eval::run::{FolderMode, JobEvent, Run};
use chaic_fidelity::{
    ExperimentFolder, ExperimentPart, ExperimentRequest, ReportInputs, check_document, parts,
    write_document,
};
use serde_json::json;

use super::bars::{RunBars, time_left};
use super::eval_session::{hide_worker_panics, warn_of_run};
use super::summary::report_of;
use super::{jobs, start_threads};
use crate::arguments::FidelityArguments;
use crate::exit::{ExitStatus, with_hint};
use crate::interrupt;
use crate::output::{
    OutputFormat, counted, json_path, print_error, print_progress, print_result, print_warning,
    quoted_path,
};

/// Plays the missing episode runs and writes the document.
pub fn run(arguments: &FidelityArguments, format: OutputFormat) -> Result<ExitStatus> {
    let request = request(arguments);
    let doc = arguments.doc.clone().unwrap_or_else(|| arguments.out.join("fidelity.md"));
    check_document(&doc)?;
    let experiment = if arguments.resume || arguments.only_document {
        ExperimentFolder::resume(&arguments.out, &request)?
    } else {
        ExperimentFolder::create(&arguments.out, &request, &BuiltInHelpers)?
    };
    if !arguments.only_document {
        let stop = interrupt::stop_flag()?;
        hide_worker_panics();
        let jobs = jobs(arguments.jobs);
        start_threads(jobs)?;
        let parts = requested_parts(&request, &experiment);
        check_build(&experiment, &parts, stop)?;
        let is_complete = play(jobs, &parts, &experiment, stop);
        let hint = how_to_resume(arguments, &experiment);
        if !is_complete.map_err(|error| with_hint(error, &hint))? {
            print_error(&format!("stopped; {hint}"));
            return Ok(ExitStatus::Interrupted);
        }
    }
    finish(arguments, &experiment, &doc, format)
}

fn request(arguments: &FidelityArguments) -> ExperimentRequest {
    let is_all = |rules: &Vec<String>| rules.iter().any(|r| r == "all");
    let switches = match &arguments.switch {
        _ if arguments.no_switches => Some(Vec::new()),
        Some(rules) if is_all(rules) => Some(differing_rules()),
        rules => rules.clone(),
    };
    ExperimentRequest {
        episodes: arguments.episodes.clone(),
        tasks: arguments.task.as_ref().map(|t| t.0.clone()),
        helpers: arguments.helper.clone(),
        n_episodes: arguments.n_episodes,
        seeds: arguments.seeds,
        image_size: arguments.size,
        switches,
        switch_helpers: arguments.switch_helper.clone(),
        switch_seeds: arguments.switch_seeds,
    }
}

/// Returns the parts to play now.
fn requested_parts(
    request: &ExperimentRequest,
    experiment: &ExperimentFolder,
) -> Vec<ExperimentPart> {
    let is_requested = |part: &ExperimentPart| match (&part.switch, &request.switches) {
        (Some(rule), Some(rules)) => rules.contains(rule),
        _ => true,
    };
    experiment.plan.parts().into_iter().filter(is_requested).collect()
}

/// Plays these parts; returns whether they are complete.
fn play(
    jobs: usize,
    requested: &[ExperimentPart],
    experiment: &ExperimentFolder,
    stop: &AtomicBool,
) -> Result<bool> {
    let mut estimate = TimeEstimate { jobs, ..TimeEstimate::default() };
    for (k, part) in requested.iter().enumerate() {
        let (folder, mut run) = (experiment.folder(part), open(experiment, part)?);
        let extent = run.progress();
        let name = format!("part {} of {}, {}", k + 1, requested.len(), part.name);
        if extent.finished - extent.errors == extent.total && folder.join("report.md").exists() {
            let runs = counted(extent.total, "episode run");
            print_progress(&format!("{name}: {runs}, finished already"));
            continue;
        }
        estimate.remaining = remaining_runs(experiment, &requested[k..])?;
        let total = counted(extent.total, "episode run");
        print_progress(&format!("{name}: {} of {total}", extent.finished));
        let mut bars = RunBars::for_part(&run, &name);
        let played = run.play(jobs, &BuiltInHelpers, stop, &mut |event| {
            if let JobEvent::Finished(finished) = event {
                estimate.add(&finished.result.key.helper, finished.time);
                let left = time_left(estimate.remaining_time());
                bars.set_suffix(format!(", about {left} for all parts"));
            }
            bars.show(event);
        });
        bars.clear();
        if !played? {
            return Ok(false);
        }
        write_files(run.folder(), &report_of(&run))?;
    }
    Ok(true)
}

fn open(experiment: &ExperimentFolder, part: &ExperimentPart) -> Result<Run> {
    let (folder, given) = (experiment.folder(part), experiment.run_request(part)?);
    let (run, warnings) = Run::open(&folder, FolderMode::Resume, &given, &BuiltInHelpers)?;
    warn_of_run(&run, &warnings);
    Ok(run)
}

/// Checks that this build plays like the one that started the runs of both rule sets.
///
/// The check is skipped if there are no results to compare, or if no episode run is missing.
fn check_build(
    experiment: &ExperimentFolder,
    requested: &[ExperimentPart],
    stop: &AtomicBool,
) -> Result<()> {
    let mut started: Vec<ExperimentPart> = experiment.plan.parts();
    started.retain(|p| p.switch.is_none() && experiment.folder(p).join("run.json").exists());
    if started.is_empty() || remaining_runs(experiment, requested)?.is_empty() {
        return Ok(());
    }
    print_progress("playing some episodes again to compare this build with the one of the runs");
    for part in started {
        open(experiment, &part)?.check_build(&BuiltInHelpers, stop)?;
    }
    Ok(())
}

/// Counts the missing episode runs of these parts by helper.
fn remaining_runs(
    experiment: &ExperimentFolder,
    requested: &[ExperimentPart],
) -> Result<BTreeMap<String, u32>> {
    let mut remaining = BTreeMap::new();
    for state in parts(experiment)?.iter().filter(|s| requested.contains(&s.part)) {
        for key in state.missing() {
            *remaining.entry(key.helper.clone()).or_default() += 1;
        }
    }
    Ok(remaining)
}

/// Data for an estimate of the remaining time: times of finished episode runs, and counts of
/// remaining ones.
#[derive(Default)]
struct TimeEstimate {
    jobs: usize,
    /// Count and total time of finished episode runs by helper.
    finished: BTreeMap<String, (u32, Duration)>,
    /// Count of remaining episode runs by helper.
    remaining: BTreeMap<String, u32>,
}

impl TimeEstimate {
    fn add(&mut self, helper: &str, time: Duration) {
        let (n, sum) = self.finished.entry(helper.to_owned()).or_default();
        (*n, *sum) = (*n + 1, *sum + time);
        if let Some(n) = self.remaining.get_mut(helper) {
            *n = n.saturating_sub(1);
        }
    }

    /// Estimates the remaining time from the mean time of each helper, or of all helpers.
    fn remaining_time(&self) -> Duration {
        let (n, sum) =
            self.finished.values().fold((0, Duration::ZERO), |(n, sum), t| (n + t.0, sum + t.1));
        let overall = sum / n.max(1);
        let mean = |helper| self.finished.get(helper).map_or(overall, |(n, sum)| *sum / *n);
        let all: Duration = self.remaining.iter().map(|(helper, n)| mean(helper) * *n).sum();
        all / self.jobs.max(1) as u32
    }
}

fn finish(
    arguments: &FidelityArguments,
    experiment: &ExperimentFolder,
    doc: &Path,
    format: OutputFormat,
) -> Result<ExitStatus> {
    let states = parts(experiment)?;
    write_document(ReportInputs { plan: &experiment.plan, parts: &states }, doc)?;
    let missing: usize = states.iter().map(|s| s.missing().len()).sum();
    let broken: usize = states.iter().map(|s| s.n_failed()).sum();
    let json = json!({ "document": json_path(doc), "missing": missing, "failed": broken });
    print_result(format, &json, &format!("Document: {}\n", doc.display()))?;
    if missing > 0 {
        let hint = how_to_resume(arguments, experiment);
        let are = if missing == 1 { "is" } else { "are" };
        print_warning(&format!("{} {are} missing; {hint}", counted(missing, "episode run")));
    }
    if broken > 0 {
        let runs = counted(broken, "episode run");
        print_warning(&format!("{runs} failed; the document names them"));
    }
    Ok(ExitStatus::from_findings(missing + broken > 0))
}

fn how_to_resume(arguments: &FidelityArguments, experiment: &ExperimentFolder) -> String {
    let episodes = arguments.episodes.as_deref().filter(|_| !experiment.has_run());
    let episodes = episodes.map(|folder| format!(" --episodes {}", quoted_path(folder)));
    let doc = arguments.doc.as_deref().map(|doc| format!(" --doc {}", quoted_path(doc)));
    let switches = arguments.switch.as_ref().map(|names| format!(" --switch {}", names.join(",")));
    let out = quoted_path(&arguments.out);
    let options = [episodes, doc, switches].into_iter().flatten().collect::<String>();
    format!("continue with: chaic fidelity --resume --out {out}{options}")
}
