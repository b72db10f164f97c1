//! Facts about a data set of recorded episodes.

use chaic_env::trace::Header;

use super::{ACTION, EpisodeEntry, KINDS, LeRobotWriter, STATE};
use crate::card::{
    DataType, DatasetDescription, Field, FileGroup, LICENSE, RecordSet, ValueLocation, common,
};

/// Source of the decisions of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum People {
    /// Programs decide.
    Simulated,
    /// Programs decide, and one of them repeats or continues a recording.
    Recorded,
    /// A real person controls an agent.
    Real,
}

impl People {
    /// Returns the source that a trace names.
    pub(super) fn of(header: &Header) -> People {
        if header.people.iter().any(|person| person.input.is_some()) {
            People::Real
        } else if header.branch_of.is_some()
            || header.people.iter().any(|person| person.recording.is_some())
        {
            People::Recorded
        } else {
            People::Simulated
        }
    }
}

/// Number of episodes by the source of their decisions.
struct Sources {
    total: usize,
    recorded: usize,
    real: usize,
}

impl Sources {
    fn of(episodes: &[EpisodeEntry]) -> Sources {
        let count = |people| episodes.iter().filter(|entry| entry.people == people).count();
        Sources {
            total: episodes.len(),
            recorded: count(People::Recorded),
            real: count(People::Real),
        }
    }

    /// Returns the statement about personal data.
    fn personal_information(&self) -> String {
        let Sources { total, recorded, real } = self;
        let mut statements = Vec::new();
        if *real > 0 {
            statements.push(format!(
                "In {real} of {total} episodes a real person, such as a participant of a study or the player of a \
                 game, controlled an agent. The data hold the decisions of these people in the simulation."
            ));
        }
        if *recorded > 0 {
            statements.push(format!(
                "In {recorded} of {total} episodes an agent repeats or continues a recording, which can hold the \
                 decisions of a real person."
            ));
        }
        if statements.is_empty() {
            return common::NO_PERSONAL_INFORMATION.to_owned();
        }
        statements.push(
            "The data have no names, codes or addresses of people, and no dates or times of day. The consent of the \
             people limits who may use their decisions."
                .to_owned(),
        );
        statements.join(" ")
    }

    /// Returns the license; `None` if real people decide, or may have decided in a recording.
    fn license(&self) -> Option<&'static str> {
        (self.real + self.recorded == 0).then_some(LICENSE)
    }

    fn biases(&self) -> Vec<&'static str> {
        let mut biases = Vec::new();
        if self.real > 0 {
            biases.push(
                "The real people volunteered for a study or a game, so they are no random sample of a population.",
            );
            biases.push(
                "They control bodies with the constraints of the simulation, and need not have such constraints \
                 themselves.",
            );
        }
        if self.recorded > 0 {
            biases.push(
                "An agent that repeats a recording repeats its interactions; a planner chooses the steps between \
                 them.",
            );
        }
        biases.extend(common::BIASES);
        biases
    }
}

impl LeRobotWriter {
    /// Describes the data set with all episodes so far.
    pub(super) fn description(&self) -> DatasetDescription {
        let agent = self.options.agent;
        let n = self.episodes.len();
        let sources = Sources::of(&self.episodes);
        DatasetDescription {
            title: format!("chaic runs: {agent}"),
            summary: format!(
                "Observations and actions of the {agent} in {n} recorded episodes of the benchmark Constrained Human-AI \
                 Cooperation (CHAIC), in version 3.0 of the LeRobot format."
            ),
            creators: self.creators.clone(),
            collection: format!(
                "Recorded by chaic {} and played again for the images, which have {} pixels a side and {} samples per \
                 second (`chaic export lerobot`). Each trace was verified before.",
                env!("CARGO_PKG_VERSION"),
                self.options.image_size,
                self.fps()
            ),
            uses: &[
                "Imitation learning, offline reinforcement learning and models of behavior.",
                "Scores of trained helpers come from `chaic eval` on other episodes.",
            ],
            limitations: &[
                "The state vector holds the true position, which helpers on the hidden track estimate.",
                "Videos are compressed; `chaic replay` and `chaic render` give exact images.",
                "Depth images, object ids and the hidden goal are not included.",
            ],
            biases: sources.biases(),
            personal_information: sources.personal_information(),
            license: sources.license(),
            tags: &["LeRobot", "chaic", "embodied-ai", "human-ai-cooperation", "simulation"],
            files: file_groups(),
            records: RecordSet {
                name: "frames",
                files: "data-files",
                description: "one record per sampled frame, in the order of time.",
                fields: frame_fields(),
            },
        }
    }
}

fn file_groups() -> Vec<FileGroup> {
    let group = |name, pattern, media_type, description| FileGroup {
        name,
        pattern,
        media_type,
        description,
    };
    vec![
        group("data-files", "data/*/*.parquet", "application/x-parquet", "Frames of one episode"),
        group("video-files", "videos/*/*/*.mp4", "video/mp4", "First-person video of one episode"),
        group("task-files", "meta/tasks.parquet", "application/x-parquet", "Names of the tasks"),
        group(
            "episode-files",
            "meta/episodes/*/*.parquet",
            "application/x-parquet",
            "Task, length and files of each episode",
        ),
        group("meta-files", "meta/*.json", "application/json", "Features and statistics"),
    ]
}

/// Describes the columns that [`LeRobotWriter::write_episode`] writes.
fn frame_fields() -> Vec<Field> {
    let field = |name, data_type, description: &str| Field {
        name,
        data_type,
        is_list: false,
        description: description.to_owned(),
        place: ValueLocation::Column(name),
    };
    let list = |name, description: String| Field {
        is_list: true,
        description,
        ..field(name, DataType::Float, "")
    };
    vec![
        list("observation.state", format!("State of the agent: {}", STATE.join(", "))),
        list("action", format!("Action: {}; kinds are {}", ACTION.join(", "), KINDS.join(", "))),
        field("plan", DataType::Text, "Current plan in words; empty if there is none"),
        field(
            "next.reward",
            DataType::Float,
            "Increase of the delivered fraction until the next sample",
        ),
        field("next.done", DataType::Boolean, "Whether this is the last sample of the episode"),
        field(
            "timestamp",
            DataType::Float,
            "Time since the start of the episode, s at 30 frames per second",
        ),
        field("frame_index", DataType::Integer, "Number of the sample within the episode"),
        field("episode_index", DataType::Integer, "Number of the episode"),
        field("index", DataType::Integer, "Number of the sample within the data set"),
        field("task_index", DataType::Integer, "Number of the task in `meta/tasks.parquet`"),
    ]
}
