//! A server in a thread, and a client of raw requests.

use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use chaic_agents::PlannerRules;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{Action, Agent, AgentError, Briefing, Observation};
use chaic_env::helper_registry::{BuiltInHelpers, Helper, HelperRegistry};
use chaic_study::data::CODE_ALPHABET;
use chaic_study::{Study, StudyPlan};
use chaic_study_server::{ParticipantCounts, ServerError, ServerOptions, StudyServer};
use serde_json::{Value, json};

pub const DEFINITION: &str = r#"title = "Shelves"
consent = "text.txt"
instructions = "text.txt"
debrief = "text.txt"
completion_code = "DONE"
participants = 3
timeout_minutes = 60
design = "latin_square"
episodes = ["high_target/test/00", "high_target/test/01"]

[factors]
helper = ["none", "rhp"]

[forms]
at_end = ["trust"]
"#;

/// A study in which the server simulates, and the person is the helper.
pub const SIMULATED: &str = r#"title = "Shelves"
consent = "text.txt"
instructions = "text.txt"
debrief = "text.txt"
completion_code = "DONE"
participants = 3
timeout_minutes = 60
design = "latin_square"
episodes = ["high_target/test/00"]

[play]
simulator = "server"
seat = "helper"
"#;

/// Built-in helpers, `mine`, `broken`, which fails, `panics`, `halted`, which the end of the server stops, and `slow`.
pub struct TestHelpers;

impl HelperRegistry for TestHelpers {
    fn names(&self) -> Vec<String> {
        let own = ["mine", "broken", "panics", "halted", "slow"].map(str::to_owned);
        BuiltInHelpers.names().into_iter().chain(own).collect()
    }

    fn make(&self, name: &str, rules: PlannerRules) -> Option<Helper> {
        let outcome = match name {
            "mine" => return BuiltInHelpers.make("rhp", rules),
            "panics" => {
                return Some(Helper { agent: Box::new(PanickingAgent), grants: Grants::NONE });
            }
            "broken" => Err(AgentError::Broken("no idea".to_owned())),
            "halted" => Err(AgentError::Halted("the server ends".to_owned())),
            "slow" => Ok(Action::TurnLeft),
            _ => return BuiltInHelpers.make(name, rules),
        };
        Some(Helper { agent: Box::new(TestAgent { outcome }), grants: Grants::NONE })
    }
}

/// Time that the helper `slow` needs for a decision.
pub const SLOW: Duration = Duration::from_millis(800);

/// Agent with one answer.
struct TestAgent {
    outcome: Result<Action, AgentError>,
}

impl Agent for TestAgent {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Result<Action, AgentError> {
        if self.outcome.is_ok() {
            thread::sleep(SLOW);
        }
        self.outcome.clone()
    }
}

/// Agent with a bug.
struct PanickingAgent;

impl Agent for PanickingAgent {
    fn sensors(&self) -> SensorConfig {
        SensorConfig::NONE
    }

    fn reset(&mut self, _: &Briefing) {}

    fn act(&mut self, _: &Observation) -> Result<Action, AgentError> {
        panic!("a bug of this test")
    }
}

/// A folder with a study, and the data in it.
pub struct Folder {
    dir: tempfile::TempDir,
}

impl Folder {
    pub fn new(definition: &str) -> Folder {
        let dir = tempfile::tempdir().expect("the disk has space");
        fs::write(dir.path().join("study.toml"), definition).expect("the disk has space");
        fs::write(dir.path().join("text.txt"), "Plain words.\n").expect("the disk has space");
        Folder { dir }
    }

    pub fn plan(&self) -> StudyPlan {
        let path = self.dir.path().join("study.toml");
        StudyPlan::new(Study::read(&path).expect("a study"), &path).expect("a plan")
    }

    pub fn path(&self) -> &Path {
        self.dir.path()
    }

    pub fn data(&self) -> PathBuf {
        self.dir.path().join("data")
    }

    /// Returns the names of the files with data and tokens.
    pub fn files(&self) -> Vec<String> {
        let files = fs::read_dir(self.data()).expect("a folder");
        let names = files.map(|f| f.expect("an entry").file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = names.filter(|name| name != ".lock").collect();
        names.sort();
        names
    }

    pub fn text(&self, code: &str) -> String {
        fs::read_to_string(self.data().join(format!("{code}.jsonl"))).expect("a file")
    }

    pub fn server(&self) -> Server {
        self.try_server().expect("a server")
    }

    pub fn try_server(&self) -> Result<Server, ServerError> {
        let options = ServerOptions {
            folder: self.data(),
            listen: "127.0.0.1:0".parse().expect("an address"),
            hosts: vec!["study.example.org".to_owned()],
        };
        let now_secs = Arc::new(AtomicU64::new(1000));
        let problems = Arc::new(Mutex::new(Vec::new()));
        let clock = Arc::clone(&now_secs);
        let report = Arc::clone(&problems);
        let server = StudyServer::open(
            self.plan(),
            &options,
            &TestHelpers,
            Box::new(move || clock.load(Ordering::SeqCst)),
            Box::new(move |text| report.lock().expect("no panic").push(text.to_owned())),
        )?;
        let address = server.address();
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let thread = thread::spawn(move || server.run(&flag).expect("it runs"));
        Ok(Server { address, stop, now_secs, problems, thread: Some(thread) })
    }
}

/// A running server.
pub struct Server {
    pub address: SocketAddr,
    stop: Arc<AtomicBool>,
    now_secs: Arc<AtomicU64>,
    problems: Arc<Mutex<Vec<String>>>,
    thread: Option<JoinHandle<ParticipantCounts>>,
}

impl Server {
    pub fn wait_secs(&self, secs: u64) {
        self.now_secs.fetch_add(secs, Ordering::SeqCst);
    }

    pub fn problems(&self) -> Vec<String> {
        self.problems.lock().expect("no panic").clone()
    }

    pub fn client(&self, n: usize) -> Client {
        Client { address: self.address, code: code(n), token: format!("{n:064x}") }
    }

    pub fn stop(mut self) -> ParticipantCounts {
        self.stop.store(true, Ordering::SeqCst);
        self.thread.take().expect("it runs").join().expect("no panic")
    }

    /// Sends bytes and returns the answer, if there is one.
    pub fn raw(&self, bytes: &[u8]) -> Option<Answer> {
        exchange(self.address, bytes)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Returns a participant code for each number below 32 * 32.
pub fn code(n: usize) -> String {
    let letter = |k: usize| char::from(CODE_ALPHABET[k % 32]);
    format!("TESTCQDE{}{}", letter(n / 32), letter(n))
}

/// Sends bytes, closes the sending side and reads the answer. An answer may come before all is sent.
pub fn exchange(address: SocketAddr, bytes: &[u8]) -> Option<Answer> {
    let mut stream = TcpStream::connect(address).expect("it listens");
    let _ = stream.write_all(bytes);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    Answer::parse(&answer)
}

/// An answer of the server.
#[derive(Clone, Debug)]
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: String,
    /// The body as sent.
    pub bytes: Vec<u8>,
}

impl Answer {
    fn parse(answer: &[u8]) -> Option<Answer> {
        let end = answer.windows(4).position(|bytes| bytes == b"\r\n\r\n")?;
        let head = String::from_utf8_lossy(&answer[..end]).to_lowercase();
        let status = head.split(' ').nth(1)?.parse().ok()?;
        let bytes = answer[end + 4..].to_vec();
        let body = String::from_utf8_lossy(&bytes).into_owned();
        Some(Answer { status, head, body, bytes })
    }

    /// Returns the state and the picture of a turn.
    pub fn turn(&self) -> (Value, &[u8]) {
        assert_eq!(self.status, 200, "{self:?}");
        let end = self.bytes.iter().position(|byte| *byte == b'\n').expect("a line");
        let state = serde_json::from_slice(&self.bytes[..end]).expect("JSON");
        (state, &self.bytes[end + 1..])
    }

    pub fn json(&self) -> Value {
        serde_json::from_str(&self.body).expect("JSON")
    }

    pub fn error(&self) -> String {
        self.json()["error"].as_str().expect("an error").to_owned()
    }

    pub fn stored(&self) -> u64 {
        assert!(self.status < 300, "{self:?}");
        self.json()["stored"].as_u64().expect("a number")
    }
}

/// A participant's page.
#[derive(Clone)]
pub struct Client {
    pub address: SocketAddr,
    pub code: String,
    pub token: String,
}

impl Client {
    /// Sends a request as the page does.
    pub fn request(&self, method: &str, path: &str, body: &str) -> Answer {
        let Client { address, code, token } = self;
        let n = body.len();
        let request = format!(
            "{method} /participants/{code}{path} HTTP/1.1\r\nHost: {address}\r\n\
             Origin: http://{address}\r\nAuthorization: Bearer {token}\r\n\
             Content-Length: {n}\r\nConnection: close\r\n\r\n{body}"
        );
        exchange(*address, request.as_bytes()).expect("an answer")
    }

    pub fn enter(&self) -> Answer {
        self.request("PUT", "", "")
    }

    pub fn withdraw(&self) -> Answer {
        self.request("DELETE", "", "")
    }

    pub fn append(&self, from: usize, lines: &[String]) -> Answer {
        self.request("PUT", &format!("/records/{from}"), &lines.concat())
    }

    /// Enters and begins the first trial.
    pub fn begin(&self) {
        self.slot();
        assert_eq!(self.append(1, &["{\"type\":\"trial\",\"trial\":0}\n".to_owned()]).stored(), 2);
    }

    /// Opens an episode.
    pub fn open(&self, trial: usize) -> Answer {
        self.request("PUT", &format!("/trials/{trial}"), "")
    }

    /// Sends a turn of an episode.
    pub fn turn(&self, trial: usize, number: u64, turn: &Value) -> Answer {
        self.request("PUT", &format!("/trials/{trial}/turns/{number}"), &turn.to_string())
    }

    /// Enters and returns the slot.
    pub fn slot(&self) -> u64 {
        let answer = self.enter();
        assert_eq!(answer.status, 201, "{answer:?}");
        answer.json()["start"]["slot"].as_u64().expect("a slot")
    }
}

/// Returns the lines of a participation after the first record.
pub fn lines() -> Vec<String> {
    let ratings = json!({ "confident": 6, "reliable": null, "trust": 7 });
    let records = [
        json!({ "type": "instructed" }),
        json!({ "type": "trial", "trial": 0 }),
        json!({ "type": "trial_end", "trial": 0, "outcome": "left" }),
        json!({ "type": "trial", "trial": 1 }),
        json!({ "type": "trial_end", "trial": 1, "outcome": "stopped" }),
        json!({ "type": "answers", "position": 0, "form": "trust", "ratings": ratings }),
        json!({ "type": "complete" }),
    ];
    records.iter().map(|record| format!("{record}\n")).collect()
}
