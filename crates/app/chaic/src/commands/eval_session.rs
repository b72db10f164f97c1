//! Runs of `chaic eval`: options, helpers, progress and reports.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Result, bail};
use chaic_env::helper_registry::{BuiltInWithPerception, HelperRegistry};
use chaic_env::recording::RecordedPartners;
use chaic_eval::EvalError;
use chaic_eval::report::write_files;
use chaic_eval::run::{FolderMode, HelperFiles, Run, RunRequest, Shard, file_digests};
use chaic_learn::helpers::{NamedPolicy, PolicyRegistry};
use chaic_llm::LanguageHelpers;
use chaic_page::write_report;
use chaic_sandbox::{Launcher, named_files};
use chaic_subprocess::{CommandRegistry, HelperProgram};

use super::given_partners::GivenPartners;
use super::summary::report_of;
use super::{bars::RunBars, jobs, llm, run_perception, start_threads};
use crate::arguments::{EvalArguments, ExecArguments, HelperArgument};
use crate::exit::with_hint;
use crate::interrupt;
use crate::output::{counted, print_error, print_progress, print_warning, quoted, quoted_path};

/// Episodes of each task in the small benchmark: with all helpers about a minute on two cores.
const QUICK_EPISODES: u32 = 2;

/// State that all runs of one command share.
pub(super) struct EvalSession<'a> {
    launcher: &'a Launcher,
    stop: &'static AtomicBool,
    jobs: usize,
    pub shard: Shard,
    /// Partners from files.
    partners: GivenPartners,
    /// Command-line options that name these partners; a resumed run needs them again.
    partner_options: String,
    /// Command-line options of language models; a resumed run needs them again. A later partner may need a
    /// language model even if the interrupted one did not.
    language_options: String,
}

/// Result of playing a run.
pub(super) enum PlayOutcome {
    /// All episode runs are finished.
    Complete(Box<Run>),
    /// The episode runs of the shard are finished.
    Shard(Box<Run>),
    /// The user stopped the run, and a message was printed.
    Stopped,
}

impl<'a> EvalSession<'a> {
    /// Starts the threads. A process has one session. `partner_options` name the partners from files.
    ///
    /// # Errors
    /// If the system refuses the threads.
    pub fn new(
        arguments: &EvalArguments,
        launcher: &'a Launcher,
        partners: GivenPartners,
        partner_options: String,
    ) -> Result<EvalSession<'a>> {
        let stop = interrupt::stop_flag()?;
        let jobs = jobs(arguments.jobs);
        start_threads(jobs)?;
        hide_worker_panics();
        let shard = arguments.shard.unwrap_or(Shard::WHOLE);
        let language_options = llm::resume_options(&arguments.language);
        Ok(EvalSession { launcher, stop, jobs, shard, partners, partner_options, language_options })
    }

    /// Plays the run in a folder. `part` names it among the runs of the command.
    ///
    /// # Errors
    /// If the options are invalid, or a file can't be read or written.
    pub fn play(
        &self,
        arguments: &EvalArguments,
        path: &Path,
        request: &RunRequest,
        part: Option<&str>,
    ) -> Result<PlayOutcome> {
        self.with_helpers(arguments, path, |helpers, language| {
            let mode = if arguments.resume { FolderMode::Resume } else { FolderMode::New };
            let (mut run, warnings) = Run::open(path, mode, request, helpers)?;
            warn_of_run(&run, &warnings);
            print_start(&run, path);
            if language.is_some() && self.shard != Shard::WHOLE {
                print_warning(
                    "records of language models can't be merged; play all shards in this folder, one after the \
                     other, with --resume",
                );
            }
            let mut bars = match part {
                Some(part) => RunBars::for_part(&run, part),
                None => RunBars::new(&run),
            };
            if let Some(language) = language {
                language.listen(Box::new(bars.line_printer()));
            }
            let played = run.play_shard(self.shard, self.jobs, helpers, self.stop, &mut |event| {
                bars.show(event)
            });
            bars.clear();
            let folder = part.and(path.parent()).unwrap_or(path);
            let resume = self.how_to_resume(folder, arguments);
            let is_complete = played.map_err(|error| with_hint(error.into(), &resume))?;
            if let Some(problem) = language.and_then(LanguageHelpers::problem) {
                bail!("paused: {problem}\n{resume}");
            }
            let extent = run.progress();
            if !is_complete {
                let done = extent.finished - extent.errors;
                print_error(&format!(
                    "stopped after {done} of {}",
                    counted(extent.total, "episode run")
                ));
                print_error(&resume);
                return Ok(PlayOutcome::Stopped);
            }
            let run = Box::new(run);
            Ok(if extent.finished < extent.total { PlayOutcome::Shard(run) } else { PlayOutcome::Complete(run) })
        })
    }

    /// Calls a function with the helpers of the run in a folder.
    ///
    /// # Errors
    /// If a helper is unknown or can't be made, and those of the function.
    pub fn with_helpers<T>(
        &self,
        arguments: &EvalArguments,
        path: &Path,
        then: impl FnOnce(&dyn HelperRegistry, Option<&LanguageHelpers>) -> Result<T>,
    ) -> Result<T> {
        let perception = run_perception::perception_of_run(arguments, path)?;
        let built_in = BuiltInWithPerception { perception };
        let language = llm::language(arguments, path, self.stop)?;
        let language =
            language.map(|language| language.with_perception(Arc::clone(&built_in.perception)));
        let registry: &dyn HelperRegistry = match &language {
            Some(language) => language,
            None => &built_in,
        };
        let policies: chaic_env::Result<Vec<NamedPolicy>> =
            arguments.policies().map(|(name, file)| NamedPolicy::read(name, file)).collect();
        let policies = PolicyRegistry::bundled(registry, Arc::clone(&built_in.perception))
            .with_partners(&self.partners.policies)
            .with_policies(policies?)?;
        let policies = RecordedPartners::new(&policies, &self.partners.recordings);
        let processes = confined(arguments, path, self.launcher)?;
        let commands = CommandRegistry::new(&policies, processes, self.stop)?;
        if arguments.resume {
            commands.check_resumed(path)?;
        }
        arguments.exec.check_used(arguments.commands().len())?;
        then(&commands, language.as_ref())
    }

    /// Returns the command that continues a run.
    fn how_to_resume(&self, path: &Path, arguments: &EvalArguments) -> String {
        let EvalSession { partner_options: partners, language_options: language, .. } = self;
        let helpers = resume_options(arguments);
        let shard = arguments.shard.map_or_else(String::new, |shard| format!(" --shard {shard}"));
        format!(
            "continue with: chaic eval --resume --out {}{shard}{partners}{helpers}{language}",
            quoted_path(path)
        )
    }
}

/// Returns how the folder of a played shard is completed.
pub(super) fn how_to_complete(folder: &Path, has_language_records: bool) -> String {
    let path = quoted_path(folder);
    if has_language_records {
        return format!(
            "play the other shards in the same folder with: chaic eval --resume --out {path} --shard I/N ..."
        );
    }
    format!("join the shards with: chaic merge --out WHOLE {path} ...")
}

/// Prints the extent of a run before it is played.
fn print_start(run: &Run, path: &Path) {
    let extent = run.progress();
    let (tasks, names) = (&run.options().tasks, &run.options().helpers);
    print_progress(&format!(
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
}

/// Prints the problems that opening a run found.
pub(super) fn warn_of_run(run: &Run, warnings: &[impl std::fmt::Display]) {
    for warning in warnings {
        print_warning(&format!("{warning}; that episode is played again"));
    }
    if let Some(note) = run.untraced_note() {
        print_warning(&note);
    }
}

/// Returns the helper processes, each in its sandbox. The folders of the run and of `--episodes` are hidden from them.
fn confined(
    arguments: &EvalArguments,
    run: &Path,
    launcher: &Launcher,
) -> Result<Vec<HelperProgram>> {
    let mut commands = arguments.commands();
    let masked: Vec<PathBuf> =
        [run.to_owned()].into_iter().chain(arguments.episodes.clone()).collect();
    for command in &mut commands {
        arguments.exec.confine(command, launcher, &masked)?;
    }
    Ok(commands)
}

/// Writes the files and the page of a report into the folder of a run.
pub(super) fn write_reports(run: &Run) -> Result<()> {
    let report = report_of(run);
    write_files(run.folder(), &report)?;
    write_report(run.folder(), &report, &llm::shown_language(run.folder().path()))?;
    Ok(())
}

/// Returns the requested run, and a name for its folder. Without any option, the request is the small
/// benchmark.
pub(super) fn request(arguments: &EvalArguments) -> (RunRequest, &'static str) {
    let EvalArguments { task, split, episodes, n_episodes, rules, set, seeds, size, .. } =
        arguments;
    let request = RunRequest {
        tasks: task.as_ref().map(|t| t.0.clone()),
        helpers: arguments.helper_names(),
        split: split.clone(),
        n_episodes: *n_episodes,
        seeds: *seeds,
        image_size: *size,
        episodes: episodes.clone(),
        rules: *rules,
        rule_overrides: set.clone(),
        no_traces: arguments.no_traces,
        partner: arguments.partner.clone(),
        person: arguments.person,
        appearance: arguments.appearance,
        perception: arguments.perception(),
        behavior: arguments.behavior(),
        track: arguments.track,
        helper_files: helper_files(arguments),
    };
    if request == RunRequest::default() && !arguments.resume {
        return (RunRequest { n_episodes: Some(QUICK_EPISODES), ..request }, "quick");
    }
    (request, "eval")
}

/// Returns the files that the commands of helper processes name.
fn helper_files(arguments: &EvalArguments) -> HelperFiles {
    let files = |argument: &HelperArgument| match argument {
        HelperArgument::Names(_) | HelperArgument::Policy { .. } => None,
        HelperArgument::Exec { name, line } => {
            Some((name.clone(), file_digests(named_files(line))))
        }
    };
    arguments.helpers().filter_map(files).collect()
}

/// Calls a function with the first of `runs/NAME`, `runs/NAME-2`, ... that does not exist. If another command
/// creates that folder first, calls it with the next name.
///
/// # Errors
/// Those of the function, and if all folders are taken.
pub(super) fn in_free_folder<T>(
    name: &str,
    mut begin: impl FnMut(&Path) -> Result<T>,
) -> Result<T> {
    /// Maximum number of tried names.
    const MAX_RUNS: u32 = 10_000;
    let numbered = |k: u32| if k == 1 { name.to_owned() } else { format!("{name}-{k}") };
    let candidates = (1..MAX_RUNS).map(|k| Path::new("runs").join(numbered(k)));
    for path in candidates.filter(|path| !path.exists()) {
        match begin(&path) {
            Err(error) if is_taken(&error) => {}
            result => return result,
        }
    }
    bail!("every runs/... folder is taken; give one with --out")
}

/// Returns whether the folder of a new run is locked or not empty.
fn is_taken(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(EvalError::Locked { .. } | EvalError::NotEmpty { .. }))
}

/// Hides panic messages of workers, which would interrupt the bars. The run records and prints them.
pub(super) fn hide_worker_panics() {
    let default_hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let is_worker = |name: &str| name.starts_with("chaic-worker");
        if !std::thread::current().name().is_some_and(is_worker) {
            default_hook(info);
        }
    }));
}

/// Returns the options of helper processes and policies, which a resumed run needs again.
///
/// For safety, the folder of a run does not determine which command runs or with which rights. It
/// contains no weights, and no path of the episode files, which stay hidden from helper processes.
fn resume_options(arguments: &EvalArguments) -> String {
    if arguments.commands().is_empty() && arguments.policies().next().is_none() {
        return String::new();
    }
    let given = arguments.helpers().map(|helper| match helper {
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
    let is_hidden = |_: &&PathBuf| !arguments.commands().is_empty();
    let hidden = arguments.episodes.iter().filter(is_hidden);
    let hidden = hidden.map(|path| format!(" --episodes {}", quoted_path(path)));
    let sandbox = readable.chain(trust).chain(hidden);
    given.chain(granted).chain(times).chain(memory).chain(variables).chain(sandbox).collect()
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::arguments::{Arguments, Command};

    #[test]
    fn the_next_folder_is_used_if_another_command_takes_the_first() {
        let name = "a-name-of-this-test";
        let folder = |end: &str| Path::new("runs").join(format!("{name}{end}"));
        let mut tried = Vec::new();
        let used = in_free_folder(name, |path| {
            tried.push(path.to_owned());
            let path = path.to_owned();
            match tried.len() {
                1 => Err(EvalError::Locked { path }.into()),
                2 => Err(EvalError::NotEmpty { path }.into()),
                _ => Ok(path),
            }
        });
        assert_eq!(used.expect("the third is free"), folder("-3"));
        assert_eq!(tried, ["", "-2", "-3"].map(folder));
        let mut n_tried = 0;
        let refused = in_free_folder(name, |_| -> Result<()> {
            n_tried += 1;
            bail!("another problem")
        });
        assert!(refused.is_err() && n_tried == 1, "other errors end the search");
    }

    #[test]
    fn a_resumed_run_hides_its_episode_files_from_helper_processes() {
        for (helper, expected) in [
            ("mine=exec:./mine", " --helper mine=exec:./mine --episodes 'my files'"),
            ("rhp,mine=policy:a", " --helper rhp --helper mine=policy:a"),
            ("rhp", ""),
        ] {
            let line = ["chaic", "eval", "--episodes", "my files", "--helper", helper];
            let arguments = Arguments::try_parse_from(line).expect("a valid command");
            let Command::Eval(eval) = arguments.command else { panic!("{line:?}") };
            assert_eq!(resume_options(&eval.run), expected);
        }
    }
}
