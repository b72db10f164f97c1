//! What can be said on the command line.

mod bench;
mod exec;
mod export;
mod fidelity;
mod opponent;
mod perception;
mod ranges;

use std::ops::Range;
use std::path::{Path, PathBuf};

use chaic_core::capability::PersonKind;
use chaic_core::{AgentId, TaskId};
use chaic_env::rules::RuleSetName;
use chaic_env::{Appearance, Track};
use chaic_episodes::Split;
use chaic_eval::metrics::FormulaSet;
use chaic_eval::report::Format;
use chaic_eval::run::Shard;
use clap::{Args, Parser, Subcommand};

pub use self::bench::{
    BenchCommand, BenchFormat, EnvBenchArguments, LookedAt, RenderBenchArguments,
    SceneBenchArguments, SceneCommand, SceneName, WorldBenchArguments,
};
pub use self::exec::{
    ExecArguments, HelperArgument, HelperCheckArguments, HelperCommand, HelperServeArguments,
};
pub use self::export::{ExportCommand, LeRobotArguments};
pub use self::fidelity::FidelityArguments;
pub use self::opponent::{CollectOpponentArguments, OpponentArguments, WindowArguments};
pub use self::perception::{
    BehaviorArguments, ClipArguments, CollectBehaviorArguments, CollectCommand,
    CollectDetectionArguments, DetectionArguments, EvalPerceptionCommand, Look, Of, Scenes,
    TrainArguments, TrainCommand,
};

fn partner_is_help() -> String {
    let choices = PersonKind::choices();
    format!("What kind of person the partner is, in place of who it is in each episode: {choices}")
}

/// Simulator and benchmark for constrained human-AI cooperation.
#[derive(Debug, Parser)]
#[command(name = "chaic", version, arg_required_else_help = true)]
#[command(
    after_help = "Exit codes: 0 well, 1 failed or found something wrong, 2 can't be asked for, \
                        130 Ctrl-C; docs/reference/exit-codes.md."
)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Play a benchmark; without options a small, complete one of about two minutes.
    Eval(Box<EvalArguments>),
    /// Join the shards of a run.
    Merge(MergeArguments),
    /// Print the scores of a run, computed anew from its results or traces.
    Report(ReportArguments),
    /// Play the recorded actions of a run again, count its results and compare its report; exit code
    /// 1 on any difference, or if results are missing.
    Verify(VerifyArguments),
    /// Play both rule sets and single rules, and write how near that is to the paper's results.
    Fidelity(FidelityArguments),
    /// Write what networks learn from into files; docs/perception.md.
    #[command(subcommand)]
    Collect(CollectCommand),
    /// Train networks; docs/perception.md, docs/learning.md.
    #[command(subcommand)]
    Train(TrainCommand),
    /// Tell how good learned perception is on episodes that nothing was learned from.
    #[command(subcommand)]
    EvalPerception(EvalPerceptionCommand),
    /// Tell how good an opponent model is on episodes that nothing was learned from; docs/learning.md.
    EvalOpponent(OpponentArguments),
    /// Make a video of a recorded episode.
    Replay(ReplayArguments),
    /// Write recorded episodes as a data set that other programs read; docs/learning.md.
    #[command(subcommand)]
    Export(ExportCommand),
    /// Make pictures of what somebody sees at some frame: RGB, depth, instance ids.
    Render(RenderArguments),
    /// List, show, make and check episodes.
    #[command(subcommand)]
    Episodes(EpisodesCommand),
    /// Write a scene for other programs.
    #[command(subcommand)]
    Scene(SceneCommand),
    /// Measure what this machine reaches; docs/contributing/performance.md.
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Turn episodes from elsewhere into episode files.
    #[command(subcommand)]
    Import(ImportCommand),
    /// Helpers in other processes: try whether one keeps to the protocol, or be one;
    /// docs/subprocess-helpers.md.
    #[command(subcommand)]
    Helper(HelperCommand),
    /// Language helpers: prompts, records, endpoints; docs/language-helpers.md.
    #[command(subcommand)]
    Llm(LlmCommand),
}

/// A comma-separated list, or `all`.
#[derive(Clone, Debug)]
pub struct Tasks(pub Vec<TaskId>);

fn tasks(text: &str) -> Result<Tasks, String> {
    if text == "all" {
        return Ok(Tasks(TaskId::paper().collect()));
    }
    let parsed: Result<Vec<TaskId>, _> = text.split(',').map(str::parse).collect();
    parsed.map(Tasks).map_err(|e| e.to_string())
}

fn agent(text: &str) -> Result<AgentId, String> {
    let all = [AgentId::PARTNER, AgentId::HELPER, AgentId::CHILD];
    let found = all.into_iter().find(|a| a.word() == text);
    found.ok_or_else(|| format!("no agent `{text}`; write partner, helper or child"))
}

fn seed_range(text: &str) -> Result<Range<u64>, String> {
    let parsed = text.split_once("..").and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    let range = parsed.map(|(a, b): (u64, u64)| a..b).filter(|r| !r.is_empty());
    range.ok_or_else(|| format!("no range `{text}`; write A..B with A < B, for example 0..10"))
}

/// `chaic eval`.
#[derive(Args, Debug)]
pub struct EvalArguments {
    /// Tasks, separated by commas, or `all`.
    #[arg(long, value_name = "NAMES", value_parser = tasks)]
    pub task: Option<Tasks>,
    /// Helpers, separated by commas: none, random, rhp, oracle, follow; llm, llm-told, vlm, vlm-told. Or
    /// one in another process, exec:COMMAND or NAME=exec:COMMAND, or a policy of `chaic train ppo`,
    /// NAME=policy:FILE. May be given often.
    #[arg(long, value_name = "NAMES", value_parser = exec::helper)]
    pub helper: Option<Vec<HelperArgument>>,
    /// Episodes: test, train, standard, gen:A..B or gen-standard:A..B.
    #[arg(long)]
    pub split: Option<Split>,
    /// Play the episode files (*.json) of this folder instead of a split.
    #[arg(long, value_name = "DIR")]
    pub episodes: Option<PathBuf>,
    /// Only the first N episodes of each task, 1 to 1000000.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(ranges::FIRST))]
    pub first: Option<u32>,
    /// paper (usual), or compat for what the original's code does.
    #[arg(long, value_name = "NAME")]
    pub rules: Option<RuleSetName>,
    /// Set one rule otherwise; may be given often. VALUE may be paper or compat.
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Play each episode with N seeds, 1 to 10000; the first is the episode's own.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(ranges::SEEDS))]
    pub seeds: Option<u32>,
    /// Side of all images in pixels, 16 to 2048, instead of what each agent asks for (512).
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(ranges::RUN_SIZE))]
    pub size: Option<u32>,
    /// Episodes at a time, 1 to 1024; changes no result. Usual: one for each core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
    #[arg(long, value_name = "KIND", help = partner_is_help())]
    pub partner_is: Option<PersonKind>,
    /// Who drives the partner: rules (usual), or llm or vlm.
    #[arg(long, value_name = "NAME")]
    pub partner: Option<String>,
    /// Light and colors of all that is seen: canonical (usual), evening, or varied:SEED, which
    /// draws them from a seed (domain randomization). Changes neither depth nor ids.
    #[arg(long, value_name = "LOOK")]
    pub appearance: Option<Appearance>,
    /// Bound on what helpers of all kinds may be granted: told (default), any grants; or hidden, pixels,
    /// the own body and goal_place only, with --perception learned --behavior learned and no rules that
    /// disclose hidden state; docs/grants.md.
    #[arg(long, value_name = "NAME")]
    pub track: Option<Track>,
    /// By what helpers tell what is in their images: gt (usual), ids from ground truth; or learned, the
    /// detector that comes with chaic, or learned:FILE, other weights of it.
    #[arg(long, value_name = "KIND")]
    pub perception: Option<String>,
    /// By what helpers who aren't told the goal tell what their partner does: gt (usual), what they are
    /// granted and what follows from things in hands; or learned, the network that comes with chaic and
    /// watches, or learned:FILE, other weights of it.
    #[arg(long, value_name = "KIND")]
    pub behavior: Option<String>,
    #[command(flatten)]
    pub exec: ExecArguments,
    #[command(flatten)]
    pub language: LanguageArguments,
    /// The run's folder. Usual: the next free `runs/NAME`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Go on with the run in --out; what it plays is recorded there.
    #[arg(long, requires = "out")]
    pub resume: bool,
    /// Keep results only: little room, but nothing to verify or to replay.
    #[arg(long)]
    pub no_traces: bool,
    /// Play one of several shares of the run, for example 2/4: every fourth episode run from the second
    /// on. Each goes into an --out of its own; `chaic merge` joins them.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
}

/// `chaic merge`.
#[derive(Debug, Args)]
pub struct MergeArguments {
    /// The folders of the shards.
    #[arg(required = true)]
    pub runs: Vec<PathBuf>,
    /// A new folder for the whole run.
    #[arg(long)]
    pub out: PathBuf,
}

impl EvalArguments {
    /// By what helpers see, as it was given or as the track has it.
    pub fn perception(&self) -> Option<String> {
        self.sight_or(self.perception.clone())
    }

    /// By what they recognize what others do, as it was given or as the track has it.
    pub fn behavior(&self) -> Option<String> {
        self.sight_or(self.behavior.clone())
    }

    /// A run that goes on has recorded its own.
    fn sight_or(&self, given: Option<String>) -> Option<String> {
        let track = self.track.filter(|_| !self.resume).unwrap_or_default();
        track.sight_or(given)
    }

    /// The names of the helpers that were given.
    pub fn helper_names(&self) -> Option<Vec<String>> {
        let given = self.helper.as_ref()?;
        Some(given.iter().flat_map(HelperArgument::names).collect())
    }

    /// The helpers in other processes.
    pub fn commands(&self) -> Vec<chaic_subprocess::Command> {
        let command = |argument: &HelperArgument| match argument {
            HelperArgument::Names(_) | HelperArgument::Policy { .. } => None,
            HelperArgument::Exec { name, line } => Some(self.exec.command(name, line)),
        };
        self.helper.iter().flatten().filter_map(command).collect()
    }

    /// The policies: names and files of weights.
    pub fn policies(&self) -> impl Iterator<Item = (&str, &Path)> {
        self.helper.iter().flatten().filter_map(|argument| match argument {
            HelperArgument::Policy { name, file } => Some((name.as_str(), file.as_path())),
            _ => None,
        })
    }
}

/// Whom language helpers ask.
#[derive(Args, Debug, Default)]
pub struct LanguageArguments {
    /// The language model's address, for example http://127.0.0.1:8000/v1; its key comes from the
    /// environment variable OPENAI_API_KEY. To be named again with --resume.
    #[arg(long, value_name = "URL", help_heading = "Language helpers")]
    pub endpoint: Option<String>,
    /// The language model's name.
    #[arg(long, value_name = "NAME", help_heading = "Language helpers")]
    pub model: Option<String>,
    /// Take the key from another environment variable; "" sends none.
    #[arg(long, value_name = "NAME", help_heading = "Language helpers")]
    pub llm_key_env: Option<String>,
    /// Send questions and key by plain http, even to another machine: all on the way can read them.
    #[arg(long, help_heading = "Language helpers")]
    pub llm_allow_http: bool,
    /// All settings of language helpers, see docs/language-helpers.md.
    #[arg(long, value_name = "FILE.toml", help_heading = "Language helpers")]
    pub llm_config: Option<PathBuf>,
    /// replay:DIR plays with the answers recorded in the run DIR, and asks nobody.
    #[arg(long, value_name = "SOURCE", value_parser = chaic_llm::language::replay_folder,
        conflicts_with_all = ["endpoint", "model", "llm_key_env", "llm_allow_http", "llm_config"],
        help_heading = "Language helpers")]
    pub llm: Option<PathBuf>,
}

/// `chaic llm`.
#[derive(Debug, Subcommand)]
pub enum LlmCommand {
    /// Write the templates of the prompts into a folder, to be edited.
    Templates {
        /// The folder.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Print prompts, answers and choices of an episode beside what happened.
    Show {
        /// The run's folder.
        run: PathBuf,
        /// The episode's id, for example obstacle/test/00.
        episode: String,
        /// With which helper. Usual: the first that asked a language model.
        #[arg(long, value_name = "NAME")]
        helper: Option<String>,
        /// With which of the run's seeds, 0 to 9999. Usual: the lowest.
        #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(ranges::SEED))]
        seed: Option<u32>,
        /// Whose decisions: helper or partner.
        #[arg(long, default_value = "helper", value_parser = agent)]
        agent: AgentId,
        /// Leave the prompts out.
        #[arg(long)]
        brief: bool,
    },
    /// Ask the endpoint one small question, to see whether everything is set up.
    Check {
        #[command(flatten)]
        language: LanguageArguments,
    },
}

/// `chaic report`.
#[derive(Args, Debug)]
pub struct ReportArguments {
    /// The run's folder.
    pub run: PathBuf,
    /// table, md, csv or json.
    #[arg(long, default_value = "table")]
    pub format: Format,
    /// paper, or original for the formulas of the original's scripts.
    #[arg(long, default_value = "paper")]
    pub formulas: FormulaSet,
    /// Score the traces themselves, not the results noted while playing.
    #[arg(long)]
    pub from_traces: bool,
    /// Write the figure with error bars to this .svg or .png file instead of printing.
    #[arg(long, value_name = "FILE")]
    pub figure: Option<PathBuf>,
}

/// `chaic verify`.
#[derive(Args, Debug)]
pub struct VerifyArguments {
    /// The run's folder.
    pub run: PathBuf,
    /// Traces at a time, 1 to 1024. Usual: one for each core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
}

/// `chaic replay`.
#[derive(Args, Debug)]
pub struct ReplayArguments {
    /// The run's folder.
    pub run: PathBuf,
    /// The episode's id, for example obstacle/test/00.
    pub episode: String,
    /// The video: .mp4, or .gif.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// With which helper. Usual: rhp if the run has it.
    #[arg(long, value_name = "NAME")]
    pub helper: Option<String>,
    /// With which of the run's seeds, 0 to 9999. Usual: the lowest.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(ranges::SEED))]
    pub seed: Option<u32>,
    /// Pictures a second, 1 to 240.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(ranges::FPS))]
    pub fps: u32,
    /// Draw every N-th frame, 1 to 10000; 30 frames are a second of walking.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(ranges::EVERY))]
    pub every: u32,
    /// Draw over what the helper sees what a detector finds in it: the one by which the run's helpers
    /// saw, or else the one that comes with chaic.
    #[arg(long)]
    pub masks: bool,
}

/// `chaic render`.
#[derive(Args, Debug)]
pub struct RenderArguments {
    /// The episode's id, for example obstacle/test/00, or an episode file.
    pub episode: String,
    /// Whose eyes: partner, helper or child.
    #[arg(long, default_value = "helper", value_parser = agent)]
    pub agent: AgentId,
    /// The frame, 0 to 1000000; the first one from it on in which somebody decides is shown.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u32).range(ranges::FRAME))]
    pub frame: u32,
    /// Folder for rgb.png, depth.png (16 bit, millimetres), ids.png (16 bit) and ids.json, classes.png
    /// and classes.json, normals.png (in the world), and plan.png.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Side of the images, 16 to 4096 pixels.
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub size: u32,
    /// The helper that takes part.
    #[arg(long, default_value = "rhp")]
    pub helper: String,
    /// The seed, 0 to 9999.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u32).range(ranges::SEED))]
    pub seed: u32,
    /// paper, or compat for what the original's code does.
    #[arg(long, value_name = "NAME", default_value = "paper")]
    pub rules: RuleSetName,
    /// Light and colors: canonical, evening, or varied:SEED, which draws them from a seed.
    #[arg(long, value_name = "LOOK", default_value = "canonical")]
    pub appearance: Appearance,
}

/// `chaic episodes`.
#[derive(Debug, Subcommand)]
pub enum EpisodesCommand {
    /// List the episodes of a split.
    List {
        /// test, train, standard, gen:A..B or gen-standard:A..B.
        #[arg(long, default_value = "test")]
        split: Split,
        /// Tasks, separated by commas, or `all`.
        #[arg(long, value_name = "NAMES", value_parser = tasks, default_value = "all")]
        task: Tasks,
        /// Print JSON.
        #[arg(long, default_value = "table")]
        format: ListFormat,
    },
    /// Draw the map of an episode's beginning.
    Show {
        /// The episode's id, for example obstacle/test/00, or an episode file.
        episode: String,
        /// The picture, .png.
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Its width, 64 to 8192 pixels.
        #[arg(long, default_value_t = 1200, value_parser = clap::value_parser!(u32).range(64..=8192))]
        width: u32,
    },
    /// Make episodes and write them as files.
    Generate {
        /// The task.
        #[arg(long)]
        task: TaskId,
        /// Their seeds, A..B: short for --split gen:A..B.
        #[arg(long, value_name = "A..B", value_parser = seed_range)]
        #[arg(conflicts_with = "split", required_unless_present = "split")]
        seeds: Option<Range<u64>>,
        /// standard, gen:A..B, gen-standard:A..B, or a bundled split.
        #[arg(long)]
        split: Option<Split>,
        /// The folder for the files.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Check episode files, or all episodes of a split; exit code 1 if one can't be played.
    Validate {
        /// The files.
        #[arg(required_unless_present = "split", conflicts_with = "split")]
        files: Vec<PathBuf>,
        /// A split instead; of standard each episode must have its committed digest, too.
        #[arg(long)]
        split: Option<Split>,
    },
    /// Print the JSON schema of an episode file.
    Schema,
}

/// `chaic import`.
#[derive(Debug, Subcommand)]
pub enum ImportCommand {
    /// Import the original CHAIC data set, which is public; docs/import.md says how to get it.
    Original(OriginalArguments),
}

/// `chaic import original`.
#[derive(Args, Debug)]
pub struct OriginalArguments {
    /// The data set folder of the CHAIC repository: holds train_dataset and test_dataset.
    #[arg(long, value_name = "DIR")]
    pub dataset: PathBuf,
    /// The unpacked tdw Python package, version 1.12.27.x, or the folder that holds it.
    #[arg(long, value_name = "DIR")]
    pub tdw: PathBuf,
    /// The folder for the episode files.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Only one half: train or test. Usual: every half that is there.
    #[arg(long, value_name = "HALF")]
    pub split: Option<ImportHalf>,
    /// Import what can be imported and list the rest; exit code 1 if anything was left out.
    #[arg(long)]
    pub keep_going: bool,
}

/// A half of the original data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ImportHalf {
    /// Floor plans 1 and 4.
    Train,
    /// Floor plans 2 and 5.
    Test,
}

/// How a list is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ListFormat {
    /// A table.
    Table,
    /// JSON.
    Json,
}

#[cfg(test)]
mod tests;
