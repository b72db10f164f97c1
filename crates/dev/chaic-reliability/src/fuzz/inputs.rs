//! Valid inputs to start from.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use chaic_arena::archive::pack;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{AgentId, TaskId};
use chaic_env::partner_suite::PartnerSuite;
use chaic_env::{AgentSlot, Env, EpisodeAgents, EpisodeConfig, RunKey};
use chaic_episodes::{Episode, find_episode};
use chaic_llm::exchange::{ChatRequest, Exchange, Message, Purpose, Reply, Role, Usage};
use chaic_llm::record::{RecordEntry, RecordHeader};
use chaic_llm::templates::Templates;
use chaic_nn::{Kernel, Network, weights};
use chaic_study::data::{DataRecord, TrialEnd};
use chaic_study::{Study, StudyPlan};
use chaic_subprocess::frame::MessageFrame;
use chaic_subprocess::message::{PROTOCOL, RequestMessage, observation_frame};
use chaic_training::checkpoint::{Checkpoint, Identity};
use serde_json::json;

use crate::commands::run_ok;
use crate::scenario::{EPISODE_STEPS, PLAY, Step, prepare, words};

/// Kind of the small network in weights files and checkpoints.
pub const KIND: &str = "fuzz 1";

/// Valid inputs, and a folder for files.
pub struct Inputs {
    /// Folder for the files that parsers read.
    pub scratch: PathBuf,
    /// Finished run of short episodes.
    pub run: PathBuf,
    /// Commitment to a sealed split.
    commitment: PathBuf,
    /// Windows of an opponent model.
    windows: PathBuf,
    /// Submission of a built-in helper.
    submission: PathBuf,
    /// Study of [`Inputs::participant`].
    pub study: StudyPlan,
    /// Episode of [`Inputs::trace`].
    pub episode: Episode,
}

impl Inputs {
    /// Plays a short run in an empty folder.
    ///
    /// # Errors
    /// If the run fails.
    pub fn new(folder: &Path) -> Result<Inputs> {
        prepare(&EPISODE_STEPS, folder)?;
        prepare(&[Step::Submission], folder)?;
        run_ok(folder, &words(PLAY))?;
        let scratch = folder.join("scratch");
        fs::create_dir(&scratch)?;
        let copy = fs::read(folder.join("run/episodes/shopping-gen-0.json"))?;
        let episode = Episode::parse(&copy, "the episode")?;
        run_ok(
            folder,
            &words("episodes seal --secret s --task shopping --n-episodes 1 --out seal"),
        )?;
        let commitment = folder.join("seal/commitment.json");
        run_ok(
            folder,
            &words("collect opponent --out w --of-each 1 --episodes 1 --image-size 16"),
        )?;
        let [run, windows, submission] = ["run", "w", "mine"].map(|name| folder.join(name));
        let study = study_plan(folder)?;
        Ok(Inputs { scratch, run, commitment, windows, submission, study, episode })
    }

    /// Reads a file of the run.
    ///
    /// # Errors
    /// If it does not exist.
    pub fn file(&self, name: &str) -> Result<Vec<u8>> {
        fs::read(self.run.join(name)).with_context(|| format!("the run has no {name}"))
    }

    /// Returns windows of an opponent model.
    ///
    /// # Errors
    /// If there are none.
    pub fn windows(&self) -> Result<Vec<u8>> {
        fs::read(&self.windows).context("no windows")
    }

    /// Returns a template of a prompt.
    ///
    /// # Errors
    /// If the templates cannot be written.
    pub fn template(&self) -> Result<Vec<Vec<u8>>> {
        let folder = self.scratch.join("built_in");
        Templates::load(None)?.write(&folder)?;
        Ok(vec![fs::read(folder.join("ask_text.txt"))?])
    }

    /// Returns the commitment to a sealed split.
    ///
    /// # Errors
    /// If there is none.
    pub fn commitment(&self) -> Result<Vec<u8>> {
        fs::read(&self.commitment).context("no commitment")
    }

    /// Returns manifests of a built-in helper and of a program.
    ///
    /// # Errors
    /// If there is none.
    pub fn manifests(&self) -> Result<Vec<Vec<u8>>> {
        let built_in = fs::read_to_string(self.submission.join("submission.toml"))?;
        let command = built_in.replace("built_in = \"random\"", "command = [\"sh\", \"a.sh\"]");
        let command = command + "tasks = [\"obstacle\"]\nn_episodes = 2\n";
        Ok(vec![built_in.into(), command.into()])
    }

    /// Returns the archive of a submission.
    ///
    /// # Errors
    /// If the submission cannot be packed.
    pub fn archive(&self) -> Result<Vec<u8>> {
        let archive = self.scratch.join("packed.tar");
        pack(&self.submission, &archive)?;
        Ok(fs::read(archive)?)
    }

    /// Returns the file of a participant of [`Inputs::study`].
    pub fn participant(&self) -> Vec<u8> {
        let slot = 2;
        let start = DataRecord::start(self.study.digest(), "K7QXM2RBTA", slot);
        let mut records = vec![start, DataRecord::Instructed {}];
        for trial in 0..self.study.trials(slot).len() {
            records.push(DataRecord::Trial { trial });
            records.push(DataRecord::Trace { trial, text: "{}\n".to_owned() });
            records.push(DataRecord::TrialEnd { trial, outcome: TrialEnd::Stopped });
        }
        for (name, form) in self.study.forms() {
            let is_at_end = self.study.study().forms.at_end.iter().any(|due| due == name);
            let ratings = form.items.iter().map(|item| (item.id.clone(), Some(form.last)));
            let (position, ratings) = (u32::from(!is_at_end), ratings.collect());
            records.push(DataRecord::Answers { position, form: name.to_owned(), ratings });
        }
        records.push(DataRecord::Complete {});
        records.iter().map(DataRecord::to_line).collect::<String>().into_bytes()
    }

    /// Returns a trace of [`Inputs::episode`].
    ///
    /// # Errors
    /// If the run has none.
    pub fn trace(&self) -> Result<Vec<u8>> {
        self.file("traces/shopping/rhp/gen-0-s0.jsonl")
    }
}

/// Definition of a study with two conditions and a practice episode.
const STUDY: &str = r#"title = "Shelves"
consent = "text.txt"
instructions = "text.txt"
debrief = "text.txt"
completion_code = "SHELVES-7"
participants = 4
timeout_minutes = 60
design = "latin_square"
practice = ["no_constraint/train/00"]
episodes = ["high_target/test/00", "high_target/test/01"]

[factors]
helper = ["none", "rhp"]

[forms]
after_condition = ["trust"]
at_end = ["sus"]
"#;

/// Writes and reads the definition of a study.
fn study_plan(folder: &Path) -> Result<StudyPlan> {
    let path = folder.join("study.toml");
    fs::write(folder.join("text.txt"), "Plain words.\n")?;
    fs::write(&path, STUDY)?;
    Ok(StudyPlan::new(Study::read(&path)?, &path)?)
}

/// Returns lists of partners: the bundled one, and one with drawn and listed habits.
pub fn partner_lists() -> Vec<Vec<u8>> {
    let habits = "habits:order=farthest,noise=20,pause=90,memory=300,load=1,containers=no";
    let partners = json!([
        {"name": "a", "partner": "drawn:7", "person": "child+tires+speed80"},
        {"name": "b", "partner": habits},
    ]);
    let list = json!({"format": "chaic-partners", "version": 1, "partners": partners});
    vec![PartnerSuite::bundled().to_json().into_bytes(), list.to_string().into_bytes()]
}

/// Returns requests of the page of a study for the next picture.
pub fn turns() -> Vec<Vec<u8>> {
    let pixel = json!({"pixel": {"column": 3, "row": 4}});
    let pick_up = json!({"pick_up": {"object": pixel, "hand": "left"}});
    let turns = [
        json!({"frames": 15, "view_px": 512}),
        json!({"frames": 1, "view_px": 64, "input": {"plan": "explore"}}),
        json!({"frames": 0, "view_px": 128, "input": {"action": pick_up}}),
        json!({"frames": 240, "view_px": 512, "input": {"action": {"wait": {"frames": 3}}}}),
    ];
    turns.map(|turn| turn.to_string().into_bytes()).into()
}

/// Returns a network with every kind of parameter.
pub fn network() -> Network {
    let mut net = Network::default();
    let input = net.input(3);
    let conv = net.conv("conv", input, Kernel { size: 3, stride: 2 }, 16);
    let norm = net.norm_relu("norm", conv);
    net.output_head("head", norm, 4);
    net
}

/// Returns a weights file of [`network`].
pub fn weights_file() -> Vec<u8> {
    let net = network();
    weights::to_bytes(&net, &net.init_parameters(1), KIND).expect("the parameters are finite")
}

/// Returns a checkpoint of [`network`].
pub fn checkpoint() -> Vec<u8> {
    let mut checkpoint = Checkpoint::default();
    checkpoint.insert_integers("steps", vec![7, u64::MAX]);
    checkpoint.insert_floats("parameters", vec![1.0, -2.5, 0.0]);
    checkpoint.insert_doubles("powers", vec![0.5]);
    checkpoint.insert_bytes("choices", vec![1, 2, 3]);
    checkpoint.to_bytes(&Identity::new(KIND, &network())).expect("the numbers are finite")
}

/// Returns a request of a language helper.
pub fn request() -> ChatRequest {
    let message =
        Message { role: Role::User, text: "Choose a plan".to_owned(), images: Vec::new() };
    let (model, messages) = ("m".to_owned(), vec![message]);
    ChatRequest { model, purpose: Purpose::Decide, messages, n_schema_plans: Some(3) }
}

/// Returns the record of a language helper.
pub fn record() -> Vec<u8> {
    let key = RunKey {
        task: TaskId::Shopping,
        helper: "llm".to_owned(),
        episode: "shopping/gen/0".to_owned(),
        seed: 0,
    };
    let usage = Usage { prompt: 10, answer: 3, estimated: false };
    let text = "Plan: 2".to_owned();
    let reply = Reply::Answer { text, finish: Some("stop".to_owned()), usage, latency_ms: 5 };
    let exchange = Exchange::new(7, request(), Vec::new(), reply);
    let header = RecordHeader::new(&key, AgentId::HELPER, "m");
    let header = serde_json::to_string(&header).expect("a header serializes to JSON");
    let entry = RecordEntry::Exchange(Box::new(exchange));
    let entry = serde_json::to_string(&entry).expect("an entry serializes to JSON");
    format!("{header}\n{entry}\n{entry}\n").into_bytes()
}

/// Answers of a language model to a list of three plans.
const ANSWERS: [&str; 5] = [
    "Plan: 2",
    "{\"reasoning\": \"near\", \"plan\": 2}",
    "I choose option **3**, to explore.",
    "plan 1 or plan 2? The answer is (2)",
    "go to the box",
];

/// Returns answers of a language model.
pub fn answers() -> Vec<Vec<u8>> {
    ANSWERS.map(|text| text.as_bytes().to_vec()).into()
}

/// Returns replies of an endpoint.
pub fn replies() -> Vec<Vec<u8>> {
    let usage = json!({"prompt_tokens": 10, "completion_tokens": 3});
    let whole = |text: &str| {
        let message = json!({"role": "assistant", "content": text});
        json!({"choices": [{"message": message, "finish_reason": "stop"}], "usage": usage})
    };
    let parts = json!({"choices": [{"message": {"content": [{"type": "text", "text": "2"}]}}]});
    let all = ANSWERS.iter().map(|text| whole(text)).chain([parts]);
    all.map(|reply| reply.to_string().into_bytes()).collect()
}

/// Returns messages to a helper in another process, one after the other.
///
/// # Errors
/// If the episode cannot be started.
pub fn request_frames() -> Result<Vec<u8>> {
    let episode = find_episode("shopping/test/00")?;
    let config = EpisodeConfig { image_size: Some(16), ..EpisodeConfig::new(&episode, "fuzz") };
    let sensors =
        SensorConfig { image_size: 16, rgb: true, depth: true, ids: false, frame_history: None };
    let helper = Some(AgentSlot::external(Grants::NONE, sensors));
    let mut env = Env::new(config, EpisodeAgents { helper, partner: None })?;
    let briefing = env.briefing(AgentId::HELPER);
    env.advance(Some(1))?;
    let hello = RequestMessage::Hello { protocol: PROTOCOL, chaic: "0.1.0".to_owned() };
    let mut frames =
        vec![head(&hello), head(&RequestMessage::Reset { briefing: Box::new(briefing) })];
    frames.extend(env.observe(AgentId::HELPER).map(observation_frame));
    frames.push(head(&RequestMessage::Bye));
    Ok(to_bytes(&frames))
}

/// Returns a message without images.
pub fn head(message: &impl serde::Serialize) -> MessageFrame {
    let head = serde_json::to_vec(message).expect("a message serializes to JSON");
    MessageFrame { head, body: Vec::new() }
}

/// Returns messages as they are on the pipe.
pub fn to_bytes(frames: &[MessageFrame]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for frame in frames {
        frame.write(&mut bytes).expect("the lengths are within the limits");
    }
    bytes
}
