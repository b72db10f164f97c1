//! Parsers of data from outside.

use std::fmt::Display;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Result;
use chaic_arena::{Commitment, Manifest, Secret, UnpackedSubmission};
use chaic_core::Action;
use chaic_env::partner_suite::PartnerSuite;
use chaic_env::trace;
use chaic_env::{NoopAgent, Playback};
use chaic_episodes::Episode;
use chaic_eval::run::{RunFolder, read_results};
use chaic_learn::opponent::collect::read_from_user_path;
use chaic_learn::opponent::network::OpponentModel;
use chaic_learn::opponent::train::OpponentTrainer;
use chaic_learn::policy_kind::PolicyWeights;
use chaic_learn::train::{CloningConfig, PolicyTrainer, PpoTrainingConfig};
use chaic_learn::visual::train::VisualTrainer;
use chaic_llm::endpoint::Client;
use chaic_llm::exchange::Reply;
use chaic_llm::key::ApiKey;
use chaic_llm::record::DecisionLog;
use chaic_llm::templates::Templates;
use chaic_llm::{Settings, answer};
use chaic_nn::weights;
use chaic_study::{ParticipantData, RecordCheck};
use chaic_study_server::AdvanceRequest;
use chaic_subprocess::frame::{MAX_BODY, MessageFrame};
use chaic_subprocess::message::{PROTOCOL, ResponseMessage, SensorRequest};
use chaic_subprocess::serve::serve;
use chaic_training::checkpoint::{Checkpoint, Identity, MAGIC};
use chaic_training::{Trainer, parse_config};
use chaic_vision::behavior::network::TrainedBehavior;
use chaic_vision::behavior::train::BehaviorTrainer;
use chaic_vision::train::DetectorLearner;
use chaic_vision::trained::TrainedDetector;
use xxhash_rust::xxh3::xxh3_128;

use super::import;
use super::inputs::{self, Inputs, KIND};
use super::mutate::Format;

/// Maximum length of the simulation of a parsed trace, frames.
const MAX_FRAMES: usize = 60;
/// Start of the body of a checkpoint, bytes; its digest lies before.
const CHECKPOINT_HEAD: usize = MAGIC.len() + 4;
/// Size of a block of the tar format, bytes.
const TAR_BLOCK: usize = 512;
/// Octal digits of an entry's size in its header.
const TAR_SIZE: Range<usize> = 124..135;
/// Checksum of a header. Its own bytes count as spaces in the sum.
const TAR_CHECKSUM: Range<usize> = 148..156;

/// Parser with its inputs.
pub struct Target {
    /// Name for the command line.
    pub name: &'static str,
    /// Structure of the inputs.
    pub format: Format,
    /// Returns valid inputs.
    pub seeds: fn(&Inputs) -> Result<Vec<Vec<u8>>>,
    /// Parses an input; the error is the message for the user.
    pub parse: fn(&Inputs, &[u8]) -> Result<(), String>,
    /// Repairs lengths and digests of a changed input, so that the parser reads on.
    pub repair: fn(&mut [u8]),
}

/// All parsers.
pub const TARGETS: [Target; 23] = [
    target(
        "episode",
        Format::Json,
        |inputs| Ok(vec![inputs.episode.to_json_line().into()]),
        episode,
    ),
    target("trace", Format::JsonLines, |inputs| Ok(vec![inputs.trace()?]), trace),
    target("results", Format::JsonLines, |inputs| Ok(vec![inputs.file("results.jsonl")?]), results),
    target("run", Format::Json, |inputs| Ok(vec![inputs.file("run.json")?]), run),
    Target {
        repair: repair_weights,
        ..target("weights", Format::Binary, |_| Ok(vec![inputs::weights_file()]), weights)
    },
    Target {
        repair: repair_checkpoint,
        ..target("checkpoint", Format::Binary, |_| Ok(vec![inputs::checkpoint()]), checkpoint)
    },
    target("training-config", Format::Text, |_| Ok(training_configs()), training_config),
    target("llm-config", Format::Text, |_| Ok(llm_configs()), llm_config),
    target("llm-templates", Format::Text, |inputs| inputs.template(), llm_templates),
    target("llm-reply", Format::Json, |_| Ok(inputs::replies()), llm_reply),
    target("llm-answer", Format::Text, |_| Ok(inputs::answers()), llm_answer),
    target("llm-record", Format::JsonLines, |_| Ok(vec![inputs::record()]), llm_record),
    Target {
        repair: repair_frame,
        ..target(
            "exec-request",
            Format::Binary,
            |_| Ok(vec![inputs::request_frames()?]),
            exec_request,
        )
    },
    Target {
        repair: repair_frame,
        ..target("exec-response", Format::Binary, |_| Ok(responses()), exec_response)
    },
    Target {
        repair: repair_weights,
        ..target("windows", Format::Binary, |inputs| Ok(vec![inputs.windows()?]), windows)
    },
    target("commitment", Format::Json, |inputs| Ok(vec![inputs.commitment()?]), commitment),
    target("secret", Format::Binary, |_| Ok(vec![[b'a'; 64].to_vec()]), secret),
    target("manifest", Format::Text, |inputs| inputs.manifests(), manifest),
    Target {
        repair: repair_archive,
        ..target("submission", Format::Binary, |inputs| Ok(vec![inputs.archive()?]), submission)
    },
    target("partners", Format::Json, |_| Ok(inputs::partner_lists()), partners),
    target("study-data", Format::JsonLines, |inputs| Ok(vec![inputs.participant()]), study_data),
    target("study-turn", Format::Json, |_| Ok(inputs::turns()), study_turn),
    target("import", Format::JsonLines, |_| Ok(import::seeds()), import::parse),
];

const fn target(
    name: &'static str,
    format: Format,
    seeds: fn(&Inputs) -> Result<Vec<Vec<u8>>>,
    parse: fn(&Inputs, &[u8]) -> Result<(), String>,
) -> Target {
    Target { name, format, seeds, parse, repair: |_| {} }
}

fn message(error: impl Display) -> String {
    error.to_string()
}

/// Writes an input to a file of the scratch folder.
fn file(inputs: &Inputs, name: &str, bytes: &[u8]) -> PathBuf {
    let path = inputs.scratch.join(name);
    fs::write(&path, bytes).expect("the scratch folder is writable");
    path
}

fn episode(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    Episode::parse(bytes, "input").map(drop).map_err(message)
}

/// Parses a trace and simulates its start.
fn trace(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let (trace, _) = trace::parse(bytes, Path::new("input")).map_err(message)?;
    let mut playback = Playback::new(&trace, &inputs.episode).map_err(message)?;
    for _ in 0..MAX_FRAMES {
        if playback.step().map_err(message)?.is_none() {
            break;
        }
    }
    Ok(())
}

fn results(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    read_results(&file(inputs, "results.jsonl", bytes), &[]).map(drop).map_err(message)
}

fn run(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    file(inputs, "run.json", bytes);
    RunFolder::read(&inputs.scratch).map(drop).map_err(message)
}

fn weights(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let _ = PolicyWeights::from_bytes(bytes);
    let _ = OpponentModel::from_bytes(bytes);
    let _ = TrainedDetector::from_bytes(bytes);
    let _ = TrainedBehavior::from_bytes(bytes);
    weights::from_bytes(&inputs::network(), bytes, KIND).map(drop).map_err(message)
}

/// Writes the length of the header of a safetensors file, which is the text up to the last brace.
fn repair_weights(bytes: &mut [u8]) {
    let end = bytes.windows(2).rposition(|pair| pair == b"}}");
    if let Some(len) = end.and_then(|at| (at + 2).checked_sub(8)) {
        bytes[..8].copy_from_slice(&(len as u64).to_le_bytes());
    }
}

fn checkpoint(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let identity = Identity::new(KIND, &inputs::network());
    Checkpoint::from_bytes(bytes, &identity).map(drop).map_err(message)
}

fn repair_checkpoint(bytes: &mut [u8]) {
    if let Some((head, body)) = bytes.split_at_checked(CHECKPOINT_HEAD + 16) {
        let content = [&head[..CHECKPOINT_HEAD], body].concat();
        let digest = xxh3_128(&content).to_le_bytes();
        bytes[CHECKPOINT_HEAD..CHECKPOINT_HEAD + 16].copy_from_slice(&digest);
    }
}

fn training_config(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let config = &String::from_utf8_lossy(bytes);
    let parsed = [
        parse_config::<PolicyTrainer<PpoTrainingConfig>>(config).map(drop),
        parse_config::<PolicyTrainer<CloningConfig>>(config).map(drop),
        parse_config::<VisualTrainer>(config).map(drop),
        parse_config::<OpponentTrainer>(config).map(drop),
        parse_config::<DetectorLearner>(config).map(drop),
        parse_config::<BehaviorTrainer>(config).map(drop),
    ];
    let Some(errors) = parsed.into_iter().map(Result::err).collect::<Option<Vec<String>>>() else {
        return Ok(());
    };
    // Returns the message of the training that fits the input best. A message of several lines has
    // priority, because it is a fault.
    let score = |error: &String| (error.contains('\n'), !error.contains("unknown field"));
    Err(errors.into_iter().max_by_key(score).unwrap_or_default())
}

fn training_configs() -> Vec<Vec<u8>> {
    fn text<T: Trainer>() -> Vec<u8> {
        toml::to_string(&T::Config::default()).expect("a configuration serializes to TOML").into()
    }
    vec![
        text::<PolicyTrainer<PpoTrainingConfig>>(),
        text::<PolicyTrainer<CloningConfig>>(),
        text::<VisualTrainer>(),
        text::<OpponentTrainer>(),
        text::<DetectorLearner>(),
        text::<BehaviorTrainer>(),
    ]
}

fn llm_config(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let settings = Settings::read(&file(inputs, "llm.toml", bytes)).map_err(message)?;
    settings.check().map_err(message)
}

fn llm_configs() -> Vec<Vec<u8>> {
    let mut settings = Settings::default();
    settings.request.model = "m".to_owned();
    settings.endpoint.url = "http://localhost:8000/v1".to_owned();
    let text = toml::to_string(&settings).expect("settings serialize to TOML");
    let extra = "[request]\nmodel = \"m\"\n[request.extra]\ntop_k = 5\n[endpoint]\nurl = \"http://[::1]:1/v1\"\n";
    vec![text.into(), extra.as_bytes().to_vec()]
}

fn llm_templates(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let folder = inputs.scratch.join("templates");
    fs::create_dir_all(&folder).expect("the scratch folder is writable");
    file(inputs, "templates/ask_text.txt", bytes);
    Templates::load(Some(&folder)).map(drop).map_err(message)
}

/// Parses the body of a response, and the answer in it.
fn llm_reply(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let client = Client::with_key(&Settings::default(), ApiKey::new("secret"));
    let reply = client.parse_reply(&inputs::request(), bytes.to_vec(), Duration::ZERO);
    match reply.map_err(|failure| failure.fault.detail)? {
        Reply::Answer { text, .. } => choose(&text),
        Reply::Failed(fault) => Err(fault.detail),
    }
}

fn llm_answer(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    choose(&String::from_utf8_lossy(bytes))
}

fn choose(text: &str) -> Result<(), String> {
    let plans = ["bring the apple", "explore", "go to the box"].map(str::to_owned);
    for by_schema in [false, true] {
        let choice = answer::parse(text, &plans, by_schema)?;
        assert!(choice.index < plans.len(), "a listed plan");
    }
    Ok(())
}

fn llm_record(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let path = file(inputs, "record.jsonl", bytes);
    DecisionLog::read(&inputs.scratch, &path).map(drop).map_err(message)
}

fn exec_request(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let mut output = Vec::new();
    serve("fuzz", &mut NoopAgent, &mut &bytes[..], &mut output).map_err(message)
}

fn exec_response(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let mut input = bytes;
    while let Some(frame) = MessageFrame::read(&mut input, 0).map_err(message)? {
        serde_json::from_slice::<ResponseMessage>(&frame.head).map(drop).map_err(message)?;
    }
    Ok(())
}

fn responses() -> Vec<Vec<u8>> {
    let sensors =
        SensorRequest { image_size: 8, rgb: true, depth: true, ids: false, frame_history: None };
    let messages = [
        ResponseMessage::Hello { protocol: PROTOCOL, name: "fuzz".to_owned() },
        ResponseMessage::Ready { sensors },
        ResponseMessage::Act { action: Action::Wait { frames: 3 }, thought: None },
        ResponseMessage::Failed { problem: "none".to_owned() },
    ];
    messages.iter().map(|message| inputs::to_bytes(&[inputs::head(message)])).collect()
}

/// Writes the lengths of a single message.
fn repair_frame(bytes: &mut [u8]) {
    let Some(first) = bytes.get(..8) else { return };
    let length =
        |k: usize| u32::from_le_bytes([first[k], first[k + 1], first[k + 2], first[k + 3]]);
    let (head, body) = (length(0) as usize, length(4) as usize);
    let is_whole = head.saturating_add(body).saturating_add(8) <= bytes.len();
    if !is_whole && bytes.len() < MAX_BODY {
        let len = (bytes.len() - 8) as u32;
        bytes[..4].copy_from_slice(&len.to_le_bytes());
        bytes[4..8].copy_from_slice(&0u32.to_le_bytes());
    }
}

fn windows(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    read_from_user_path(&file(inputs, "windows", bytes), false).map(drop).map_err(message)
}

fn commitment(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    Commitment::parse(bytes).map(drop).map_err(message)
}

fn secret(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    Secret::read(&file(inputs, "secret", bytes)).map(drop).map_err(message)
}

fn manifest(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    Manifest::parse(bytes, Path::new("input")).map(drop).map_err(message)
}

/// Extracts an archive, and reads the submission in it.
fn submission(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let archive = file(inputs, "submission.tar", bytes);
    UnpackedSubmission::read(&archive).map(drop).map_err(message)
}

/// Writes the checksums of the headers of a tar archive.
fn repair_archive(bytes: &mut [u8]) {
    let mut at = 0;
    while let Some(header) = bytes.get_mut(at..at + TAR_BLOCK) {
        let digits = str::from_utf8(&header[TAR_SIZE]).unwrap_or_default();
        // The end marker and compressed archives have no size here.
        let Ok(size) = usize::from_str_radix(digits, 8) else { return };
        header[TAR_CHECKSUM].fill(b' ');
        let sum: u32 = header.iter().map(|byte| u32::from(*byte)).sum();
        header[TAR_CHECKSUM].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
        at += TAR_BLOCK + size.next_multiple_of(TAR_BLOCK);
    }
}

fn partners(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    PartnerSuite::parse(bytes, "input").map(drop).map_err(message)
}

/// Parses the file of a participant, and checks its records against the plan of the study.
fn study_data(inputs: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let data = ParticipantData::parse(bytes, Path::new("input")).map_err(message)?;
    // The digest depends on the version of chaic, so that of the input is not compared.
    let mut check = RecordCheck::new(&inputs.study, inputs.study.digest(), data.slot)?;
    data.records.iter().try_for_each(|(_, record)| check.add(&inputs.study, record))
}

fn study_turn(_: &Inputs, bytes: &[u8]) -> Result<(), String> {
    let text = str::from_utf8(bytes).map_err(message)?;
    AdvanceRequest::parse(text).map(drop).map_err(message)
}
