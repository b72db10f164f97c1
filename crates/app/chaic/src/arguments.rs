//! The command line: commands, options and their help.

mod bench;
mod contest;
mod episodes;
mod eval;
mod examples;
mod exec;
mod export;
mod fidelity;
mod help;
mod llm;
mod opponent;
mod perception;
mod ranges;
mod runs;
mod study;
mod tools;

use std::ops::Range;

use chaic_core::task::TASKS;
use chaic_core::{AgentId, TaskId};
use chaic_episodes::{SeedRange, Split};
use clap::{Args, ColorChoice, Parser, Subcommand, ValueEnum};

pub use self::bench::{
    BenchCommand, EnvBenchArguments, EnvChoice, GpuAdapter, RenderBenchArguments, ScalingArguments,
    SceneBenchArguments, SceneChoice, SceneCommand, SceneName, WorldBenchArguments,
};
pub use self::contest::{
    LeaderboardBuildArguments, LeaderboardCommand, SubmitCheckArguments, SubmitCommand,
    SubmitPackArguments, SubmitRunArguments, SubmitScoreArguments, SubmitVerifyArguments,
};
pub use self::episodes::{EpisodesCommand, ImportCommand, ImportSplit, OriginalArguments};
pub use self::eval::{
    EndpointArguments, EvalArguments, EvalCommand, LanguageArguments, ModelEvaluation,
};
pub use self::exec::{
    ExecArguments, HelperArgument, HelperCheckArguments, HelperCommand, HelperServeArguments,
};
pub use self::export::{EpisodesArguments, ExportCommand, LeRobotArguments};
pub use self::fidelity::FidelityArguments;
pub use self::help::command;
pub use self::llm::LlmCommand;
pub use self::opponent::{CollectOpponentArguments, OpponentArguments, WindowArguments};
pub use self::perception::{
    AppearanceArgument, BehaviorArguments, ClipArguments, CollectBehaviorArguments, CollectCommand,
    CollectDetectionArguments, DetectionArguments, PerceptionEvaluation, SceneSelection,
    TracksArguments, TrainArguments, TrainCommand,
};
pub use self::runs::{
    ExplainArguments, MergeArguments, PlayArguments, RenderArguments, ReplayArguments,
    ReportArguments, ShowArguments, VerifyArguments, ViewArguments,
};
pub use self::study::{
    StudyBuildArguments, StudyCheckArguments, StudyCommand, StudyDeleteArguments,
    StudyExportArguments, StudyServeArguments,
};
pub use self::tools::{CompletionsArguments, ListCommand, ManArguments};

use crate::output::OutputFormat;
use crate::suggest::with_suggestion;

/// Simulator and benchmark for constrained human-AI cooperation.
#[derive(Debug, Parser)]
#[command(name = "chaic", version, arg_required_else_help = true)]
pub struct Arguments {
    #[command(flatten)]
    pub output: OutputArguments,
    #[command(subcommand)]
    pub command: Command,
}

/// Options of every command.
#[derive(Args, Clone, Copy, Debug)]
pub struct OutputArguments {
    /// Format of the result: text or json; `chaic report` also writes md and csv.
    #[arg(long, global = true, value_enum, value_name = "FORMAT", default_value = "text")]
    #[arg(hide_possible_values = true, help_heading = "Output")]
    pub format: OutputFormat,
    /// Colors of help, warnings and errors.
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    #[arg(help_heading = "Output")]
    pub color: ColorChoice,
    /// Print no progress. Results, warnings and errors remain.
    #[arg(short, long, global = true, help_heading = "Output")]
    pub quiet: bool,
}

/// Commands. [`help`] groups them and has their examples.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Play a benchmark, or evaluate a network.
    #[command(
        long_about = "Play a benchmark, or evaluate a network. Without options it plays a small, \
                      complete benchmark of about a minute."
    )]
    Eval(Box<EvalCommand>),
    /// Join the shards of a run.
    Merge(MergeArguments),
    /// List, show, generate and validate episodes.
    #[command(subcommand)]
    Episodes(EpisodesCommand),
    /// Convert episodes of other projects.
    #[command(subcommand)]
    Import(ImportCommand),
    /// Test or run a helper process; docs/subprocess-helpers.md.
    #[command(subcommand)]
    Helper(HelperCommand),
    /// Prompts, records and endpoints of language models; docs/language-helpers.md.
    #[command(subcommand)]
    Llm(LlmCommand),

    /// Print the scores of a run.
    Report(ReportArguments),
    /// Summarize a run: options, progress and scores.
    Show(ShowArguments),
    /// List helpers, partners, tasks, people, rules or runs.
    #[command(subcommand)]
    List(ListCommand),
    /// Print what the helper of a recorded episode believed and planned.
    Explain(ExplainArguments),
    /// Make a video of a recorded episode.
    Replay(ReplayArguments),
    /// Write a page with replays for a browser: one file that needs no network.
    View(ViewArguments),
    /// Write a page in which a person plays episodes, as partner or helper.
    Play(PlayArguments),
    /// Studies with people who play episodes in a browser; docs/studies.md.
    #[command(subcommand)]
    Study(StudyCommand),
    /// Render one frame of an episode: color, depth, ids, classes and normals.
    Render(RenderArguments),
    /// Export a scene for other programs.
    #[command(subcommand)]
    Scene(SceneCommand),

    /// Collect training data; docs/perception.md, docs/learning.md.
    #[command(subcommand)]
    Collect(CollectCommand),
    /// Train networks; docs/perception.md, docs/learning.md.
    #[command(subcommand)]
    Train(TrainCommand),
    /// Export recorded episodes as a data set; docs/learning.md.
    #[command(subcommand)]
    Export(ExportCommand),

    /// Simulate the recorded actions of a run again, and compare states, results and report.
    #[command(
        long_about = "Simulate the recorded actions of a run again, and compare states, results and \
                      report. The exit code is 1 if something differs or is missing."
    )]
    Verify(VerifyArguments),
    /// Compare both rule sets with the published results; docs/reference/fidelity.md.
    Fidelity(FidelityArguments),
    /// Measure speed on this machine; docs/contributing/performance.md.
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Check this machine: processor, sandbox, weights, writable folders.
    Doctor,

    /// Pack, check, play, score and verify submissions to a contest; docs/arena.md.
    #[command(subcommand)]
    Submit(SubmitCommand),
    /// Compare scored submissions in tables on a page; docs/arena.md.
    #[command(subcommand)]
    Leaderboard(LeaderboardCommand),

    /// Print a completion script for a shell.
    Completions(CompletionsArguments),
    /// Write manual pages.
    Man(ManArguments),

    /// Old spelling of `chaic eval detection` and `chaic eval behavior`.
    #[command(subcommand, hide = true)]
    EvalPerception(PerceptionEvaluation),
    /// Old spelling of `chaic eval behavior`.
    #[command(hide = true)]
    EvalBehavior(BehaviorArguments),
    /// Old spelling of `chaic eval opponent`.
    #[command(hide = true)]
    EvalOpponent(OpponentArguments),
}

/// Part of the data. Environments of the test part are reserved for evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SplitArgument {
    /// Environments for training.
    #[value(alias = "training")]
    Train,
    /// Environments for model selection.
    Validation,
}

/// A comma-separated list, or `all`.
#[derive(Clone, Debug)]
pub struct Tasks(pub Vec<TaskId>);

/// Parses task names, separated by commas. A repeated name counts once.
fn tasks(text: &str) -> Result<Tasks, String> {
    if text == "all" {
        return Ok(Tasks(TaskId::paper().collect()));
    }
    let mut tasks: Vec<TaskId> = Vec::new();
    for name in text.split(',') {
        let id = task(name)?;
        if !tasks.contains(&id) {
            tasks.push(id);
        }
    }
    Ok(Tasks(tasks))
}

fn task(name: &str) -> Result<TaskId, String> {
    name.parse::<TaskId>()
        .map_err(|e| with_suggestion(e.to_string(), name, TASKS.iter().map(|task| task.name)))
}

fn agent(text: &str) -> Result<AgentId, String> {
    let all = [AgentId::PARTNER, AgentId::HELPER, AgentId::CHILD];
    let found = all.into_iter().find(|a| a.role_name() == text);
    found.ok_or_else(|| format!("no agent `{text}`; write partner, helper or child"))
}

/// Parses the seeds of `--split gen:A..B`.
fn seed_range(text: &str) -> Result<Range<u64>, String> {
    match format!("gen:{text}").parse::<Split>() {
        Ok(Split::Generated(seeds)) => Ok(seeds),
        _ => {
            let max = SeedRange::BUNDLED_TRAIN.first;
            Err(format!(
                "`{text}` is not a range; write A..B with A < B <= {max}, for example 0..10"
            ))
        }
    }
}

#[cfg(test)]
mod tests;
