//! Commands that write files, with their inputs and the recovery after an interruption.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use chaic_env::CHAIC_VERSION;

use crate::commands::run_ok;
use crate::folder::{Contents, contents};

/// Frames of the episodes: a few decisions of each agent.
const FRAMES: u32 = 40;

/// Step that prepares the inputs of a scenario.
#[derive(Clone, Copy)]
pub enum Step {
    /// Runs `chaic` with these arguments, separated by spaces.
    Run(&'static str),
    /// Shortens the episodes in a folder to [`FRAMES`].
    Shorten(&'static str),
    /// Writes the configuration `c.toml` of a training with this number of steps.
    TrainingConfig(u64),
    /// Writes the submission of a built-in helper to `mine`.
    Submission,
}

/// Way to complete an interrupted command.
#[derive(Clone, Copy)]
pub enum Recovery {
    /// Run the same command again.
    Repeat,
    /// Run another command if a file exists, and otherwise the same one again.
    Resume {
        /// File that marks what can be resumed.
        marker: &'static str,
        /// Arguments of the command that resumes.
        command: &'static str,
    },
    /// Remove the outputs and run the same command again.
    StartOver,
}

/// Command that reads the result of a scenario.
#[derive(Clone, Copy)]
pub struct Reader {
    /// Its arguments.
    pub command: &'static str,
    /// True if it must refuse an interrupted result, or print the same as for a complete one.
    pub is_exact: bool,
}

/// A command that writes files.
pub struct Scenario {
    /// Name for the command line.
    pub name: &'static str,
    /// True if the scenario takes seconds; it then runs only if the command line names it.
    pub is_long: bool,
    /// Preparation in an empty folder.
    pub steps: &'static [Step],
    /// Arguments of the command.
    pub command: &'static str,
    /// Files and folders that it writes.
    pub outputs: &'static [&'static str],
    /// True if the contents of its files are random, so that only their names are compared.
    pub has_random_contents: bool,
    /// Recovery after an interruption.
    pub recovery: Recovery,
    /// Readers of the result, which run after the interruption and again after the recovery.
    pub readers: &'static [Reader],
}

/// Step that generates an episode in `e`.
pub const GENERATE: Step = Step::Run("episodes generate --task shopping --seeds 0..1 --out e");
/// Steps that generate a short episode in `e`.
pub const EPISODE_STEPS: [Step; 2] = [GENERATE, Step::Shorten("e")];
/// Arguments that play this episode into the run folder `run`.
pub const PLAY: &str = "eval --episodes e --helper none,rhp --size 16 --jobs 1 --out run";
const PLAYED: [Step; 3] = [GENERATE, Step::Shorten("e"), Step::Run(PLAY)];
const RESUME_RUN: Recovery =
    Recovery::Resume { marker: "run/run.json", command: "eval --resume --jobs 1 --out run" };
const COLLECT: Step =
    Step::Run("collect opponent --out w --of-each 20 --episodes 1 --image-size 32");
const RESUME_TRAINING: Recovery =
    Recovery::Resume { marker: "t/config.toml", command: "train opponent --resume --out t" };
/// Readers of an unfinished run accept what is finished.
const RUN_READERS: [Reader; 2] = [
    Reader { command: "verify run", is_exact: false },
    Reader { command: "report run --from-traces", is_exact: false },
];

/// All scenarios.
pub const SCENARIOS: [Scenario; 11] = [
    Scenario {
        name: "run",
        is_long: false,
        steps: &EPISODE_STEPS,
        command: PLAY,
        outputs: &["run"],
        has_random_contents: false,
        recovery: RESUME_RUN,
        readers: &RUN_READERS,
    },
    Scenario {
        name: "resume",
        is_long: false,
        steps: &[
            GENERATE,
            Step::Shorten("e"),
            Step::Run(
                "eval --episodes e --helper rhp --seeds 2 --size 16 --jobs 1 --shard 1/2 --out run",
            ),
        ],
        command: "eval --resume --jobs 1 --out run",
        outputs: &["run"],
        has_random_contents: false,
        recovery: Recovery::Repeat,
        readers: &RUN_READERS,
    },
    Scenario {
        name: "merge",
        is_long: false,
        steps: &[
            GENERATE,
            Step::Shorten("e"),
            Step::Run(
                "eval --episodes e --helper rhp --seeds 2 --size 16 --jobs 1 --shard 1/2 --out a",
            ),
            Step::Run(
                "eval --episodes e --helper rhp --seeds 2 --size 16 --jobs 1 --shard 2/2 --out b",
            ),
        ],
        command: "merge --out run a b",
        outputs: &["run"],
        has_random_contents: false,
        recovery: RESUME_RUN,
        readers: &[
            Reader { command: "verify run", is_exact: true },
            Reader { command: "report run", is_exact: true },
        ],
    },
    Scenario {
        name: "report",
        is_long: false,
        steps: &PLAYED,
        command: "report run --figure f.png",
        outputs: &["f.png"],
        has_random_contents: false,
        recovery: Recovery::Repeat,
        readers: &[Reader { command: "verify run", is_exact: true }],
    },
    Scenario {
        name: "replay",
        is_long: false,
        steps: &PLAYED,
        command: "replay run shopping/gen/0 --out r.gif --every 10",
        outputs: &["r.gif"],
        has_random_contents: false,
        recovery: Recovery::Repeat,
        readers: &[],
    },
    Scenario {
        name: "export",
        is_long: false,
        steps: &PLAYED,
        command: "export lerobot run --out set --every 30 --size 32",
        outputs: &["set"],
        has_random_contents: false,
        recovery: Recovery::StartOver,
        readers: &[],
    },
    Scenario {
        name: "submit",
        is_long: false,
        steps: &[GENERATE, Step::Shorten("e"), Step::Submission],
        command: "submit run mine --episodes e --jobs 1 --out results",
        outputs: &["results"],
        has_random_contents: false,
        recovery: Recovery::Repeat,
        readers: &[Reader { command: "submit score results --out s.json", is_exact: true }],
    },
    Scenario {
        name: "train",
        is_long: false,
        steps: &[COLLECT, Step::TrainingConfig(200)],
        command: "train opponent --config c.toml --out t",
        outputs: &["t"],
        has_random_contents: false,
        recovery: RESUME_TRAINING,
        readers: &[],
    },
    Scenario {
        name: "long-train",
        is_long: true,
        steps: &[COLLECT, Step::TrainingConfig(3000)],
        command: "train opponent --config c.toml --out t",
        outputs: &["t"],
        has_random_contents: false,
        recovery: RESUME_TRAINING,
        readers: &[],
    },
    Scenario {
        name: "seal",
        is_long: false,
        steps: &[Step::Run("episodes seal --secret s --task shopping --n-episodes 2 --out first")],
        command: "episodes seal --secret s --task shopping --n-episodes 2 --out sealed",
        outputs: &["sealed"],
        has_random_contents: false,
        recovery: Recovery::Repeat,
        readers: &[Reader {
            command: "episodes open --secret s --commitment sealed/commitment.json --out opened",
            is_exact: true,
        }],
    },
    Scenario {
        name: "secret",
        is_long: false,
        steps: &[],
        command: "episodes seal --secret s --task shopping --n-episodes 1 --out sealed",
        outputs: &["s", "sealed"],
        has_random_contents: true,
        recovery: Recovery::Repeat,
        readers: &[Reader {
            command: "episodes open --secret s --commitment sealed/commitment.json --out opened",
            is_exact: false,
        }],
    },
];

/// Configuration of a fast training.
const TRAINING: &str = "warm_up = 1\nbatch_size = 1\nvalidation_max_per_class = 5\n\
                        windows = \"w\"\n[collect]\nepisodes = 1\nimage_size = 32\n";

/// Manifest of the submission of a built-in helper, without the version of chaic.
const MANIFEST: &str = "version = 1\nname = \"random\"\nrelease = \"1.0\"\nauthors = [\"A. Author\"]\n\
                        license = \"MIT\"\ndescription = \"Random valid plans.\"\n\
                        [helper]\nbuilt_in = \"random\"\n[play]\ngrants = [\"ids\", \"goal_place\"]\n\
                        [training]\nhardware = \"none\"\ncore_hours = 0\n[public]\nsplit = \"standard\"\n";

impl Scenario {
    /// Prepares the inputs in a new folder below `folder`, and returns it.
    ///
    /// # Errors
    /// If a step fails.
    pub fn prepare_inputs(&self, folder: &Path) -> Result<PathBuf> {
        let inputs = folder.join("inputs");
        fs::create_dir(&inputs)?;
        prepare(self.steps, &inputs).with_context(|| format!("scenario {}", self.name))?;
        Ok(inputs)
    }

    /// Reads the files of the result in the folder `at`, with empty contents if those are random.
    ///
    /// # Errors
    /// If the file system refuses.
    pub fn result(&self, at: &Path) -> Result<Contents> {
        let mut found = contents(at, self.outputs)?;
        if self.has_random_contents {
            found.values_mut().for_each(Vec::clear);
        }
        Ok(found)
    }
}

/// Prepares inputs in an empty folder.
///
/// # Errors
/// If a step fails.
pub fn prepare(steps: &[Step], folder: &Path) -> Result<()> {
    for step in steps {
        match step {
            Step::Run(command) => drop(run_ok(folder, &words(command))?),
            Step::Shorten(episodes) => shorten(&folder.join(episodes), FRAMES)?,
            Step::TrainingConfig(steps) => {
                fs::write(folder.join("c.toml"), format!("steps = {steps}\n{TRAINING}"))?;
            }
            Step::Submission => write_submission(&folder.join("mine"))?,
        }
    }
    Ok(())
}

fn write_submission(folder: &Path) -> Result<()> {
    fs::create_dir(folder)?;
    let manifest = format!("chaic = \"{CHAIC_VERSION}\"\n{MANIFEST}");
    fs::write(folder.join("submission.toml"), manifest)?;
    Ok(fs::write(folder.join("README.md"), "# random\n")?)
}

/// Splits arguments at spaces.
pub fn words(line: &str) -> Vec<&str> {
    line.split(' ').collect()
}

/// Shortens the episode files of a folder.
///
/// # Errors
/// If a file is no episode or cannot be written.
pub fn shorten(folder: &Path, frames: u32) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let text = fs::read_to_string(&path)?;
        let mut episode: serde_json::Value = serde_json::from_str(&text)?;
        let horizon = episode.pointer_mut("/setup/horizon").context("an episode has a horizon")?;
        *horizon = frames.into();
        fs::write(&path, serde_json::to_string(&episode)?)?;
    }
    Ok(())
}

/// Returns the scenarios of these names; all short ones for an empty list.
///
/// # Errors
/// If a name is unknown.
pub fn select(names: &[String]) -> Result<Vec<&'static Scenario>> {
    if let Some(unknown) = names.iter().find(|name| !SCENARIOS.iter().any(|s| s.name == **name)) {
        let known: Vec<&str> = SCENARIOS.iter().map(|s| s.name).collect();
        bail!("no scenario `{unknown}`; the scenarios are {}", known.join(", "));
    }
    let is_selected = |s: &&Scenario| match names {
        [] => !s.is_long,
        names => names.iter().any(|name| name == s.name),
    };
    Ok(SCENARIOS.iter().filter(is_selected).collect())
}
