//! `chaic fidelity`.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use anyhow::{Context as _, Result, anyhow};
use chaic_env::minds::BuiltIn;
use chaic_env::rules::differing_rules;
use chaic_eval::run::{Access, Progress, Run};
use chaic_fidelity::{
    ExperimentRequest, Matrix, Part, Sheet, check_document, parts, write_document,
};
use indicatif::HumanDuration;

use super::eval::{keep_workers_quiet, leave_report};
use super::{bars::RunBars, jobs};
use crate::arguments::FidelityArguments;
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, quoted_path, say};

/// Plays what is missing and writes the document.
pub fn run(arguments: &FidelityArguments) -> Result<Ended> {
    let wanted = wanted(arguments);
    let doc = arguments.doc.clone().unwrap_or_else(|| arguments.out.join("fidelity.md"));
    check_document(&doc)?;
    let matrix = if arguments.resume || arguments.only_document {
        Matrix::resume(&arguments.out, &wanted)?
    } else {
        Matrix::begin(&arguments.out, &wanted, &BuiltIn)?
    };
    if !arguments.only_document {
        let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
        keep_workers_quiet();
        let jobs = jobs(arguments.jobs);
        // Images of one moment are drawn in parallel too; more threads than jobs would only wait.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build_global();
        pool.context("can't start threads")?;
        let now = wanted_now(&wanted, &matrix);
        check_code(&matrix, &now, stop)?;
        let is_whole = play(jobs, &now, &matrix, stop);
        if !is_whole.map_err(|e| anyhow!("{e:#}\n{}", how_to_resume(&arguments.out)))? {
            complain(&format!("stopped; {}", how_to_resume(&arguments.out)));
            return Ok(Ended::Interrupted);
        }
    }
    finish(arguments, &matrix, &doc)
}

fn wanted(arguments: &FidelityArguments) -> ExperimentRequest {
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
        first: arguments.first,
        seeds: arguments.seeds,
        size: arguments.size,
        switches,
        switch_helpers: arguments.switch_helper.clone(),
        switch_seeds: arguments.switch_seeds,
    }
}

/// The parts that are wanted now.
fn wanted_now(wanted: &ExperimentRequest, matrix: &Matrix) -> Vec<Part> {
    let is_wanted = |part: &Part| match (&part.switch, &wanted.switches) {
        (Some(rule), Some(rules)) => rules.contains(rule),
        _ => true,
    };
    matrix.plan.parts().into_iter().filter(is_wanted).collect()
}

/// Plays these parts; returns whether they are whole.
fn play(jobs: usize, now: &[Part], matrix: &Matrix, stop: &AtomicBool) -> Result<bool> {
    let mut pace = Pace { jobs, ..Pace::default() };
    for (k, part) in now.iter().enumerate() {
        let (folder, mut run) = (matrix.folder(part), open(matrix, part)?);
        let extent = run.extent();
        let name = format!("part {} of {}, {}", k + 1, now.len(), part.name);
        if extent.finished - extent.errors == extent.total && folder.join("report.md").exists() {
            complain(&format!("{name}: its {} episode runs are finished already", extent.total));
            continue;
        }
        pace.to_go = to_go(matrix, &now[k..])?;
        complain(&format!("{name}: {} of {} episode runs", extent.finished, extent.total));
        let mut bars = RunBars::of_part(extent, &name);
        let played = run.play(jobs, &BuiltIn, stop, &mut |progress| {
            if let Progress::Finished(finished) = progress {
                pace.add(&finished.result.key.helper, finished.time);
                // Whole seconds: the estimate isn't any better.
                let left = HumanDuration(Duration::from_secs(pace.left().as_secs()));
                bars.say_beside(format!(", about {left} for all parts"));
            }
            bars.show(progress);
        });
        bars.clear();
        if !played? {
            return Ok(false);
        }
        leave_report(&run)?;
    }
    Ok(true)
}

fn open(matrix: &Matrix, part: &Part) -> Result<Run> {
    let (folder, given) = (matrix.folder(part), matrix.given(part)?);
    let (run, warnings) = Run::open(&folder, Access::Resume, &given, &BuiltIn)?;
    for warning in warnings {
        complain(&format!("warning: {warning}; that episode is played again"));
    }
    if let Some(note) = run.untraced_note() {
        complain(&format!("warning: {note}"));
    }
    Ok(run)
}

/// Before anything is added to the runs of both rule sets: whether this program plays as the one that
/// began them. Parts without results can't tell, and where all is played it makes no difference.
fn check_code(matrix: &Matrix, now: &[Part], stop: &AtomicBool) -> Result<()> {
    let mut begun: Vec<Part> = matrix.plan.parts();
    begun.retain(|p| p.switch.is_none() && matrix.folder(p).join("run.json").exists());
    if begun.is_empty() || to_go(matrix, now)?.is_empty() {
        return Ok(());
    }
    complain("playing some episodes again, to see whether this build plays as the one that began");
    for part in begun {
        open(matrix, &part)?.check_code(&BuiltIn, stop)?;
    }
    Ok(())
}

/// How many episode runs of each helper these parts still lack.
fn to_go(matrix: &Matrix, now: &[Part]) -> Result<BTreeMap<String, u32>> {
    let mut to_go = BTreeMap::new();
    for state in parts(matrix)?.iter().filter(|s| now.contains(&s.part)) {
        for key in state.missing() {
            *to_go.entry(key.helper.clone()).or_default() += 1;
        }
    }
    Ok(to_go)
}

/// What episode runs took so far, and how many are to go.
#[derive(Default)]
struct Pace {
    jobs: usize,
    taken: BTreeMap<String, (u32, Duration)>,
    to_go: BTreeMap<String, u32>,
}

impl Pace {
    fn add(&mut self, helper: &str, time: Duration) {
        let (n, sum) = self.taken.entry(helper.to_owned()).or_default();
        (*n, *sum) = (*n + 1, *sum + time);
        if let Some(n) = self.to_go.get_mut(helper) {
            *n = n.saturating_sub(1);
        }
    }

    /// By what runs with each helper took on the mean, or runs with any.
    fn left(&self) -> Duration {
        let (n, sum) =
            self.taken.values().fold((0, Duration::ZERO), |(n, sum), t| (n + t.0, sum + t.1));
        let any = sum / n.max(1);
        let mean = |helper| self.taken.get(helper).map_or(any, |(n, sum)| *sum / *n);
        let all: Duration = self.to_go.iter().map(|(helper, n)| mean(helper) * *n).sum();
        all / self.jobs.max(1) as u32
    }
}

fn finish(arguments: &FidelityArguments, matrix: &Matrix, doc: &Path) -> Result<Ended> {
    let states = parts(matrix)?;
    write_document(Sheet { plan: &matrix.plan, parts: &states }, doc)?;
    say(&format!("Document: {}\n", doc.display()))?;
    let missing: usize = states.iter().map(|s| s.missing().len()).sum();
    let broken: usize = states.iter().map(|s| s.n_broken()).sum();
    if missing > 0 {
        let hint = how_to_resume(&arguments.out);
        complain(&format!("warning: {missing} episode runs are missing, as it says; {hint}"));
    }
    if broken > 0 {
        complain(&format!("warning: {broken} episode runs broke down, as it says"));
    }
    Ok(if missing + broken > 0 { Ended::WithFindings } else { Ended::Well })
}

fn how_to_resume(out: &Path) -> String {
    format!("go on with: chaic fidelity --resume --out {}", quoted_path(out))
}
