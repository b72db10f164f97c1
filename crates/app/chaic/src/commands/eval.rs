//! `chaic eval`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context as _, Result, anyhow, bail};
use chaic_env::minds::{Helpers, Seeing};
use chaic_eval::metrics::FormulaSet;
use chaic_eval::report::{Format, Report, write_files};
use chaic_eval::run::{Access, Run, RunFolder, RunRequest, Shard};
use chaic_learn::helpers::{NamedPolicy, Policies};
use chaic_llm::Language;
use chaic_sandbox::Launcher;
use chaic_subprocess::{Command, Commands};

use super::{bars::RunBars, jobs, llm, sight};
use crate::arguments::{EvalArguments, ExecArguments, HelperArgument};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{complain, counted, quoted, quoted_path, say};

/// Episodes of each task in the small benchmark: with all helpers about two minutes on two cores.
const QUICK_EPISODES: u32 = 2;

/// Plays a benchmark.
pub fn run(arguments: &EvalArguments, launcher: &Launcher) -> Result<Ended> {
    let (given, name) = given(arguments);
    let path = arguments.out.clone().map_or_else(|| free_folder(name), Ok)?;
    let access = if arguments.resume { Access::Resume } else { Access::Begin };
    if arguments.resume {
        RunFolder::check_begun(&path)?;
    }
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let seeing = Seeing { sight: sight::of_run(arguments, &path)? };
    let language = llm::language(arguments, &path, stop)?;
    let language = language.map(|language| language.with_sight(Arc::clone(&seeing.sight)));
    let others: &dyn Helpers = match &language {
        Some(language) => language,
        None => &seeing,
    };
    let policies: chaic_env::Result<Vec<NamedPolicy>> =
        arguments.policies().map(|(name, file)| NamedPolicy::read(name, file)).collect();
    let policies = Policies::beside(others, policies?, Arc::clone(&seeing.sight))?;
    let commands = Commands::beside(&policies, confined(arguments, &path, launcher)?, stop)?;
    if arguments.resume {
        commands.check_begun(&path)?;
    }
    let helpers: &dyn Helpers = &commands;
    let (mut run, warnings) = Run::open(&path, access, &given, helpers)?;
    for warning in warnings {
        complain(&format!("warning: {warning}; that episode is played again"));
    }
    if let Some(note) = run.untraced_note() {
        complain(&format!("warning: {note}"));
    }
    keep_workers_quiet();
    let extent = run.extent();
    let (tasks, names) = (&run.options().tasks, &run.options().helpers);
    complain(&format!(
        "{}: {}, {}, {} {}{}",
        path.display(),
        counted(extent.total, "episode run"),
        counted(tasks.len(), "task"),
        if names.len() == 1 { "helper" } else { "helpers" },
        names.join(", "),
        match extent.finished - extent.errors {
            0 => String::new(),
            n => format!("; finished already: {n}"),
        }
    ));
    let jobs = jobs(arguments.jobs);
    // Images of one moment are drawn in parallel too; more threads than jobs would only wait.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build_global();
    pool.context("can't start threads")?;
    let began = Instant::now();
    let mut bars = RunBars::new(extent);
    if let Some(language) = &language {
        language.listen(Box::new(bars.voice()));
    }
    let shard = arguments.shard.unwrap_or(Shard::WHOLE);
    let played = run.play_shard(shard, jobs, helpers, stop, &mut |progress| bars.show(progress));
    bars.clear();
    let is_whole = played.map_err(|e| anyhow!("{e:#}\n{}", how_to_resume(&path, arguments)))?;
    if let Some(problem) = language.as_ref().and_then(Language::problem) {
        bail!("paused: {problem}\n{}", how_to_resume(&path, arguments));
    }
    if !is_whole {
        let extent = run.extent();
        let done = extent.finished - extent.errors;
        complain(&format!("stopped after {done} of {}", counted(extent.total, "episode run")));
        complain(&how_to_resume(&path, arguments));
        return Ok(Ended::Interrupted);
    }
    let extent = run.extent();
    if extent.finished < extent.total {
        complain(&format!(
            "shard {shard} is played: {} of {}; join it with the others by: chaic merge --out WHOLE {} ...",
            extent.finished,
            counted(extent.total, "episode run"),
            quoted_path(&path),
        ));
        return Ok(if extent.errors > 0 { Ended::WithFindings } else { Ended::Well });
    }
    finish(&run, began)
}

/// The helpers in other processes, each in its sandbox. The run's own folder is empty for them.
fn confined(arguments: &EvalArguments, run: &Path, launcher: &Launcher) -> Result<Vec<Command>> {
    let mut commands = arguments.commands();
    for command in &mut commands {
        arguments.exec.confine(command, launcher, &[run.to_owned()])?;
    }
    Ok(commands)
}

fn finish(run: &Run, began: Instant) -> Result<Ended> {
    let mut text = leave_report(run)?;
    let path = run.folder().path().display();
    let run_at = quoted_path(run.folder().path());
    let secs = began.elapsed().as_secs();
    let some = run.results().iter().find(|r| r.key.helper == "rhp").or(run.results().first());
    text += &format!("\nPlayed in {} min {:02} s.\n", secs / 60, secs % 60);
    text += &format!("Report:  {path}/report.md, {path}/figure.svg\n");
    if let Some(some) = some.filter(|_| run.options().traces) {
        let (episode, helper) = (&some.key.episode, &some.key.helper);
        text += &format!(
            "Replay:  chaic replay {run_at} {episode} --helper {helper} --out replay.mp4\n"
        );
    }
    if run.options().traces {
        text += &format!("Verify:  chaic verify {run_at}\n");
    }
    say(&text)?;
    Ok(if run.extent().errors > 0 { Ended::WithFindings } else { Ended::Well })
}

/// Writes report and figures into the run's folder, and returns the report for a terminal.
pub(super) fn leave_report(run: &Run) -> Result<String> {
    let report = report_of(run);
    write_files(run.folder(), &report)?;
    Ok(report.text(Format::Table))
}

/// Returns the report of a run.
pub(super) fn report_of(run: &Run) -> Report<'_> {
    let (options, planned) = (run.options(), run.planned());
    let (results, granted, formulas) = (run.results(), Some(run.granted()), FormulaSet::Paper);
    Report { options, results, planned, granted, formulas }
}

/// What is asked for, and the name of a folder for it. Nothing said at all is the small benchmark.
fn given(arguments: &EvalArguments) -> (RunRequest, &'static str) {
    let EvalArguments {
        task,
        split,
        episodes,
        first,
        rules,
        set,
        seeds,
        size,
        no_traces,
        partner_is,
        ..
    } = arguments;
    let (partner, appearance) = (arguments.partner.clone(), arguments.appearance);
    let given = RunRequest {
        tasks: task.as_ref().map(|t| t.0.clone()),
        helpers: arguments.helper_names(),
        split: split.clone(),
        first: *first,
        seeds: *seeds,
        size: *size,
        episodes: episodes.clone(),
        rules: *rules,
        set: set.clone(),
        no_traces: *no_traces,
        partner,
        partner_is: *partner_is,
        appearance,
        perception: arguments.perception(),
        behavior: arguments.behavior(),
        track: arguments.track,
    };
    if given == RunRequest::default() && !arguments.resume {
        return (RunRequest { first: Some(QUICK_EPISODES), ..given }, "quick");
    }
    (given, "eval")
}

/// The first of `runs/NAME`, `runs/NAME-2`, ... that isn't there.
fn free_folder(name: &str) -> Result<PathBuf> {
    /// Whoever has more should tidy up.
    const MAX_RUNS: u32 = 10_000;
    let numbered = |k: u32| if k == 1 { name.to_owned() } else { format!("{name}-{k}") };
    let mut candidates = (1..MAX_RUNS).map(|k| Path::new("runs").join(numbered(k)));
    candidates.find(|p| !p.exists()).context("every runs/... folder is taken; give one with --out")
}

fn how_to_resume(path: &Path, arguments: &EvalArguments) -> String {
    let language = llm::to_resume(&arguments.language);
    let helpers = exec_to_resume(arguments);
    let shard = arguments.shard.map_or_else(String::new, |shard| format!(" --shard {shard}"));
    format!("go on with: chaic eval --resume --out {}{shard}{helpers}{language}", quoted_path(path))
}

/// What an agent says when it breaks down is shown and noted by the run; the usual message would
/// come in between the bars.
pub(super) fn keep_workers_quiet() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let is_worker = |name: &str| name.starts_with("chaic-worker");
        if !std::thread::current().name().is_some_and(is_worker) {
            usual(info);
        }
    }));
}

/// What is to be said again where helpers run in other processes or come from files: a run's folder
/// decides neither which command is run nor what it may take, and has no weights.
fn exec_to_resume(arguments: &EvalArguments) -> String {
    if arguments.commands().is_empty() && arguments.policies().next().is_none() {
        return String::new();
    }
    let given = arguments.helper.iter().flatten().map(|helper| match helper {
        HelperArgument::Names(names) => format!(" --helper {}", quoted(&names.join(","))),
        HelperArgument::Exec { name, line } => {
            format!(" --helper {}", quoted(&format!("{name}=exec:{line}")))
        }
        HelperArgument::Policy { name, file } => {
            format!(" --helper {}", quoted(&format!("{name}=policy:{}", file.display())))
        }
    });
    let ExecArguments {
        exec_grants,
        exec_decision_s,
        exec_start_s,
        exec_episode_s,
        exec_memory_mib,
        exec_env,
        exec_read,
        exec_trust,
    } = &arguments.exec;
    let granted = exec_grants.iter().map(|grants| {
        let names = grants.named().into_iter().filter(|(_, is_given)| *is_given);
        format!(" --exec-grants {}", names.map(|(name, _)| name).collect::<Vec<_>>().join(","))
    });
    let times =
        [("decision", exec_decision_s), ("start", exec_start_s), ("episode", exec_episode_s)];
    let times = times.into_iter().filter_map(|(name, time)| {
        time.map(|time| format!(" --exec-{name}-s {}", time.as_secs_f64()))
    });
    let memory = exec_memory_mib.iter().map(|mib| format!(" --exec-memory-mib {mib}"));
    let variables = exec_env.iter().map(|name| format!(" --exec-env {}", quoted(name)));
    let readable = exec_read.iter().map(|path| format!(" --exec-read {}", quoted_path(path)));
    let trust = exec_trust.then(|| " --exec-trust".to_owned());
    let sandbox = readable.chain(trust);
    given.chain(granted).chain(times).chain(memory).chain(variables).chain(sandbox).collect()
}
