//! Options of `chaic eval`.

use std::path::{Path, PathBuf};

use chaic_core::capability::PersonChange;
use chaic_env::helper_registry::NONE;
use chaic_env::rules::RuleSetName;
use chaic_env::{Appearance, Track};
use chaic_episodes::Split;
use chaic_eval::run::Shard;
use clap::{Args, Subcommand};

use super::exec::{ExecArguments, HelperArgument, HelperList, helpers};
use super::{
    BehaviorArguments, DetectionArguments, OpponentArguments, Tasks, TracksArguments, ranges, tasks,
};

/// `chaic eval` with or without a subcommand.
#[derive(Args, Debug)]
#[command(args_conflicts_with_subcommands = true)]
pub struct EvalCommand {
    #[command(subcommand)]
    pub model: Option<ModelEvaluation>,
    #[command(flatten)]
    pub run: EvalArguments,
}

/// Networks that are evaluated on held-out episodes.
#[derive(Debug, Subcommand)]
pub enum ModelEvaluation {
    /// Evaluate the detector: average precision as in COCO, failures by cause.
    #[command(aliases = ["perception", "detector"])]
    Detection(DetectionArguments),
    /// Evaluate the behavior network: accuracy, confusion matrix, calibration.
    Behavior(BehaviorArguments),
    /// Evaluate the tracks of a perception: objects that a helper detects and remembers.
    Tracks(TracksArguments),
    /// Evaluate an opponent model: accuracy of goals and limits.
    Opponent(OpponentArguments),
}

/// Options of a benchmark run.
#[derive(Args, Clone, Debug)]
pub struct EvalArguments {
    /// Tasks, separated by commas, or `all`; `chaic list tasks` prints them [default: all].
    #[arg(long, alias = "tasks", value_name = "NAMES", value_parser = tasks)]
    pub task: Option<Tasks>,
    /// Helpers, separated by commas; repeatable; `chaic list helpers` prints them. Also a helper process,
    /// [NAME=]exec:COMMAND, or a policy of `chaic train`, [NAME=]policy:FILE. A process or a policy ends
    /// its list: repeat --helper to add more [default: none,random,rhp,oracle].
    #[arg(long, alias = "helpers", value_name = "NAMES", value_parser = helpers)]
    pub helper: Option<Vec<HelperList>>,
    /// Split of episodes: test, train, standard, gen:A..B or gen-standard:A..B, for example gen:0..100
    /// [default: test].
    #[arg(long)]
    pub split: Option<Split>,
    /// Play the episode files (*.json) of this folder instead of a split, in the order of their ids as text:
    /// gen/10 is before gen/2.
    #[arg(long, value_name = "DIR")]
    pub episodes: Option<PathBuf>,
    /// Only the first N episodes of each task, 1 to 1000000.
    #[arg(long, alias = "first", value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::N_EPISODES))]
    pub n_episodes: Option<u32>,
    /// Rule set: paper, or compat for the behavior of the original's code [default: paper].
    #[arg(long, value_name = "NAME")]
    pub rules: Option<RuleSetName>,
    /// Change one rule; repeatable. VALUE may be paper or compat; `chaic list rules` prints the rules.
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Number of seeds per episode, 1 to 10000, for example 5; the first is the episode's own [default: 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(ranges::SEEDS))]
    pub seeds: Option<u32>,
    /// Side of all images in pixels, 16 to 2048 [default: 512, or as each agent requests].
    #[arg(long, alias = "image-size", value_name = "PIXELS")]
    #[arg(value_parser = clap::value_parser!(u32).range(ranges::RUN_SIZE))]
    pub size: Option<u32>,
    /// Episodes in parallel, 1 to 1024; does not change results [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(ranges::JOBS))]
    pub jobs: Option<u16>,
    /// Agent that controls the partner; `chaic list partners` prints the names. Also drawn:SEED, habits:...,
    /// recorded:PATH (a trace or a folder of traces) or policy:FILE; docs/people.md [default: rules].
    #[arg(long, value_name = "NAME")]
    pub partner: Option<String>,
    #[arg(long, alias = "partner-is", value_name = "KIND", help = person_help())]
    pub person: Option<PersonChange>,
    /// Play with the ordinary partner and with each partner of a list: `suite` or a file; writes a run per
    /// partner and a report of robustness; docs/people.md.
    #[arg(long, value_name = "LIST", conflicts_with_all = ["partner", "person"])]
    pub partners: Option<String>,
    /// Light and colors: canonical, evening, or varied:SEED for domain randomization. Depth and ids stay
    /// the same [default: canonical].
    #[arg(long, value_name = "APPEARANCE")]
    pub appearance: Option<Appearance>,
    /// Track, for example hidden: unrestricted allows all grants; hidden limits helpers to images, their own body
    /// and goal_place, requires learned perception and behavior, and refuses rules that disclose hidden state;
    /// docs/grants.md [default: unrestricted].
    #[arg(long, value_name = "NAME")]
    pub track: Option<Track>,
    /// Object detection of helpers: gt (ids from ground truth), learned (the built-in detector),
    /// noisy, gt_names (each also as NAME:FILE), gt_masks or gt_tracks; docs/perception.md [default: gt].
    #[arg(long, value_name = "KIND")]
    pub perception: Option<String>,
    /// Behavior recognition of helpers: gt (granted state and held objects), learned (the built-in network)
    /// or learned:FILE [default: gt].
    #[arg(long, value_name = "KIND")]
    pub behavior: Option<String>,
    /// Folder of the run, for example runs/first [default: the next free runs/NAME].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Continue the run in --out with its recorded options.
    #[arg(long, requires = "out")]
    pub resume: bool,
    /// Write results without traces: less disk space, but no `chaic verify` and no `chaic replay`.
    #[arg(long)]
    pub no_traces: bool,
    /// Play part I of N parts, for example 2/4: every fourth episode from the second on, with all helpers.
    /// Each seed counts as an episode. Each part needs an --out of its own; `chaic merge` joins them.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    #[command(flatten)]
    pub exec: ExecArguments,
    #[command(flatten)]
    pub language: LanguageArguments,
}

fn person_help() -> String {
    format!("Kind of person that the partner of each episode is: {}", PersonChange::choices())
}

impl EvalArguments {
    /// Returns the perception as given or as the track requires.
    pub fn perception(&self) -> Option<String> {
        self.perception_or_track(self.perception.clone())
    }

    /// Returns the behavior recognition as given or as the track requires.
    pub fn behavior(&self) -> Option<String> {
        self.perception_or_track(self.behavior.clone())
    }

    /// Applies the default of the track. A resumed run has recorded its own.
    fn perception_or_track(&self, given: Option<String>) -> Option<String> {
        let track = self.track.filter(|_| !self.resume).unwrap_or_default();
        track.perception_or(given)
    }

    /// Returns the given helpers.
    pub fn helpers(&self) -> impl Iterator<Item = &HelperArgument> {
        self.helper.iter().flatten().flat_map(|list| &list.0)
    }

    /// Returns the names of all given helpers.
    pub fn helper_names(&self) -> Option<Vec<String>> {
        self.helper.as_ref()?;
        Some(self.helpers().flat_map(HelperArgument::names).collect())
    }

    /// Returns the helper processes.
    pub fn commands(&self) -> Vec<chaic_subprocess::HelperProgram> {
        let command = |argument: &HelperArgument| match argument {
            HelperArgument::Names(_) | HelperArgument::Policy { .. } => None,
            HelperArgument::Exec { name, line } => Some(self.exec.command(name, line)),
        };
        self.helpers().filter_map(command).collect()
    }

    /// Returns whether a helper uses the perception of the run; other processes have their own.
    pub fn has_perceiving_helpers(&self) -> bool {
        self.helper.is_none()
            || self.helpers().any(|argument| match argument {
                HelperArgument::Names(names) => names.iter().any(|name| name != NONE),
                HelperArgument::Policy { .. } => true,
                HelperArgument::Exec { .. } => false,
            })
    }

    /// Returns the policies: names and weight files.
    pub fn policies(&self) -> impl Iterator<Item = (&str, &Path)> {
        self.helpers().filter_map(|argument| match argument {
            HelperArgument::Policy { name, file } => Some((name.as_str(), file.as_path())),
            _ => None,
        })
    }
}

/// Source of the answers of language helpers: an endpoint or a recorded run.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Language helpers")]
pub struct LanguageArguments {
    #[command(flatten)]
    pub endpoint: EndpointArguments,
    /// Use the recorded answers of the run DIR (replay:DIR) and contact no endpoint.
    #[arg(long, value_name = "SOURCE", value_parser = chaic_llm::language::replay_folder,
        conflicts_with_all = ["endpoint", "model", "llm_key_env", "llm_allow_http", "llm_config"])]
    pub llm: Option<PathBuf>,
}

/// Endpoint of the language model.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Language helpers")]
pub struct EndpointArguments {
    /// Address of the language model, for example http://127.0.0.1:8000/v1. The key is read from the
    /// environment variable OPENAI_API_KEY. Repeat this option with --resume.
    #[arg(long, value_name = "URL")]
    pub endpoint: Option<String>,
    /// Name of the language model.
    #[arg(long, value_name = "NAME")]
    pub model: Option<String>,
    /// Environment variable with the key; "" sends no key [default: OPENAI_API_KEY, for Azure
    /// AZURE_OPENAI_API_KEY, and none for this machine].
    #[arg(long, value_name = "NAME")]
    pub llm_key_env: Option<String>,
    /// Allow plain http to another machine. The network can then read prompts and key.
    #[arg(long)]
    pub llm_allow_http: bool,
    /// Settings of language helpers; docs/language-helpers.md.
    #[arg(long, value_name = "FILE.toml")]
    pub llm_config: Option<PathBuf>,
}
