//! Measures a server with many players: latencies, processor time and memory.
//!
//! `cargo run -p chaic-study-server --example load -- PLAYERS SECONDS`, 100 players for 30 seconds by
//! default. Each player loads the page, enters and uploads one decision per second through one connection.
//!
//! `... --example load -- PLAYERS SECONDS PICTURES`: the server simulates a world that goes on, beside the helper
//! `rhp`. Each player asks for PICTURES pictures of 512 x 512 pixels a second and chooses a plan when it can.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use chaic_env::helper_registry::BuiltInHelpers;
use chaic_study::data::CODE_ALPHABET;
use chaic_study::{Study, StudyPlan};
use chaic_study_server::{ServerOptions, StudyServer};
use rustix::time::{ClockId, clock_gettime};
use serde_json::{Value, json};

/// Size of the trace of a decision, bytes: the mean of a game by plans, rounded up.
const DECISION_BYTES: usize = 2000;

const DEFINITION: &str = r#"title = "Load"
consent = "text.txt"
instructions = "text.txt"
debrief = "text.txt"
completion_code = "DONE"
participants = 1000
timeout_minutes = 60
design = "latin_square"
episodes = ["high_target/test/00"]
"#;

/// Added to the definition if the server simulates.
const SIMULATED: &str = r#"
[play]
simulator = "server"
world = "goes_on"
helper = "rhp"
"#;
/// Side of the pictures, pixels.
const VIEW_PX: u32 = 512;
/// Frames of simulated time per second.
const FRAMES_PER_SECOND: f64 = 30.0;
/// Largest number of frames of a turn: the page lets the world stand while a picture takes longer than a second.
const MAX_FRAMES: f64 = FRAMES_PER_SECOND;

/// Figures of one player.
struct Player {
    /// Durations of the first request, of the entry and of the uploads.
    page: Duration,
    entry: Duration,
    uploads: Vec<Duration>,
    /// Durations and sizes of pictures, and frames of simulated time, if the server simulates.
    turns: Vec<Duration>,
    n_bytes: usize,
    n_frames: f64,
    cpu: Duration,
}

fn main() {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse().expect("a number"));
    let n_players: usize = arguments.next().unwrap_or(100);
    let n_seconds = arguments.next().unwrap_or(30);
    let rate = arguments.next();
    let definition = DEFINITION.to_owned() + rate.map_or("", |_| SIMULATED);
    let dir = tempfile::tempdir().expect("the disk has space");
    let path = dir.path().join("study.toml");
    fs::write(&path, definition).expect("the disk has space");
    fs::write(dir.path().join("text.txt"), "Words.\n").expect("the disk has space");
    let plan = StudyPlan::new(Study::read(&path).expect("a study"), &path).expect("a plan");
    let options = ServerOptions {
        folder: dir.path().join("data"),
        listen: "127.0.0.1:0".parse().expect("an address"),
        hosts: Vec::new(),
    };
    let start = Instant::now();
    let clock = Box::new(move || start.elapsed().as_secs());
    let report = Box::new(|text: &str| eprintln!("{text}"));
    let server =
        StudyServer::open(plan, &options, &BuiltInHelpers, clock, report).expect("a server");
    let address = server.address();
    let stop = AtomicBool::new(false);
    let memory_before = memory_mib();
    let cpu_before = cpu(ClockId::ProcessCPUTime);
    let start = Instant::now();
    let players: Vec<Player> = thread::scope(|scope| {
        let running = scope.spawn(|| server.run(&stop).expect("it runs"));
        let play = |n: usize| scope.spawn(move || play(address, n, n_players, n_seconds, rate));
        let players: Vec<_> = (0..n_players).map(play).collect();
        let players = players.into_iter().map(|player| player.join().expect("no panic")).collect();
        if rate.is_some() {
            let grown = memory_mib() - memory_before;
            println!("memory: {grown:.0} MiB more, {:.1} MiB a player", grown / n_players as f64);
        }
        stop.store(true, Ordering::SeqCst);
        running.join().expect("no panic");
        players
    });
    let elapsed_secs = start.elapsed().as_secs_f64();
    let clients: Duration = players.iter().map(|player| player.cpu).sum();
    let server_secs = (cpu(ClockId::ProcessCPUTime) - cpu_before - clients).as_secs_f64();
    print("page", players.iter().map(|player| player.page).collect());
    print("entry", players.iter().map(|player| player.entry).collect());
    let turns: Vec<Duration> = players.iter().flat_map(|player| player.turns.clone()).collect();
    if !turns.is_empty() {
        let n_turns = turns.len() as f64;
        let n_bytes: usize = players.iter().map(|player| player.n_bytes).sum();
        let n_frames: f64 = players.iter().map(|player| player.n_frames).sum();
        let played_secs = (n_players * n_seconds) as f64;
        println!(
            "pictures: {:.1} a second and player, {:.0} bytes each; {:.2} simulated seconds a second",
            n_turns / played_secs,
            n_bytes as f64 / n_turns,
            n_frames / FRAMES_PER_SECOND / played_secs
        );
        print("picture", turns);
    }
    print("upload", players.into_iter().flat_map(|player| player.uploads).collect());
    let percent = 100.0 * server_secs / elapsed_secs;
    println!(
        "server: {server_secs:.2} s of processor time in {elapsed_secs:.1} s, {percent:.1} % of a core"
    );
}

/// Plays for some seconds.
fn play(
    address: SocketAddr,
    n: usize,
    n_players: usize,
    n_seconds: usize,
    rate: Option<usize>,
) -> Player {
    // Players do not act at the same moment.
    thread::sleep(Duration::from_secs(1).mul_f64(n as f64 / n_players as f64));
    let letter = |k: usize| char::from(CODE_ALPHABET[k % CODE_ALPHABET.len()]);
    let code = format!("LQADTEST{}{}", letter(n / CODE_ALPHABET.len()), letter(n));
    let mut connection = BufReader::new(TcpStream::connect(address).expect("it listens"));
    connection.get_ref().set_nodelay(true).expect("a socket");
    let mut request = |method: &str, path: &str, body: &str| {
        let start = Instant::now();
        let request = format!(
            "{method} {path} HTTP/1.1\r\nHost: {address}\r\nOrigin: http://{address}\r\n\
             Authorization: Bearer {n:064x}\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        connection.get_mut().write_all(request.as_bytes()).expect("it reads");
        let (status, body) = read_answer(&mut connection);
        assert!(status == 200 || status == 201, "{method} {path}: {status}");
        (start.elapsed(), body)
    };
    let (page, _) = request("GET", "/", "");
    let (entry, _) = request("PUT", &format!("/participants/{code}"), "");
    let trial = "{\"type\":\"trial\",\"trial\":0}\n";
    request("PUT", &format!("/participants/{code}/records/1"), trial);
    let mut player = Player {
        page,
        entry,
        uploads: Vec::new(),
        turns: Vec::new(),
        n_bytes: 0,
        n_frames: 0.0,
        cpu: Duration::ZERO,
    };
    if let Some(rate) = rate {
        let request =
            |path: &str, body: &str| request("PUT", &format!("/participants/{code}{path}"), body);
        play_on_server(&mut player, Duration::from_secs(n_seconds as u64), rate, request);
        player.cpu = cpu(ClockId::ThreadCPUTime);
        return player;
    }
    let text = "x".repeat(DECISION_BYTES);
    let line = format!("{{\"type\":\"trace\",\"trial\":0,\"text\":\"{text}\\n\"}}\n");
    for k in 0..n_seconds {
        let path = format!("/participants/{code}/records/{}", k + 2);
        let (upload, _) = request("PUT", &path, &line);
        player.uploads.push(upload);
        thread::sleep(Duration::from_secs(1).saturating_sub(upload));
    }
    player.cpu = cpu(ClockId::ThreadCPUTime);
    player
}

/// Plays an episode that the server simulates, as the page does: each turn has the frames of the time since the last.
fn play_on_server(
    player: &mut Player,
    duration: Duration,
    rate: usize,
    mut request: impl FnMut(&str, &str) -> (Duration, Vec<u8>),
) {
    request("/trials/0", "");
    let interval = Duration::from_secs(1) / rate as u32;
    let (start, mut last) = (Instant::now(), Instant::now());
    let mut input = Value::Null;
    for number in 0.. {
        if start.elapsed() >= duration {
            break;
        }
        let elapsed = last.elapsed();
        last = Instant::now();
        let frames = (elapsed.as_secs_f64() * FRAMES_PER_SECOND).round().min(MAX_FRAMES);
        let turn = json!({ "frames": frames as u32, "view_px": VIEW_PX, "input": input });
        let (taken, body) = request(&format!("/trials/0/turns/{number}"), &turn.to_string());
        player.turns.push(taken);
        player.n_bytes += body.len();
        player.n_frames += frames;
        let line = body.split(|byte| *byte == b'\n').next().expect("a line");
        let state: Value = serde_json::from_slice(line).expect("JSON");
        if state["status"] == "ended" {
            break;
        }
        let plan = &state["plans"][number % 7];
        input = if plan.is_null() { Value::Null } else { json!({ "plan": plan }) };
        thread::sleep(interval.saturating_sub(last.elapsed()));
    }
}

/// Returns the memory of this process, MiB.
fn memory_mib() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kib.unwrap_or_default() / 1024.0
}

/// Reads an answer and returns its status and body.
fn read_answer(connection: &mut BufReader<TcpStream>) -> (u16, Vec<u8>) {
    let (mut status, mut length) = (0, 0);
    loop {
        let mut line = String::new();
        connection.read_line(&mut line).expect("a line");
        let line = line.trim_end().to_lowercase();
        if let Some(rest) = line.strip_prefix("http/1.1 ") {
            status = rest[..3].parse().expect("a status");
        } else if let Some(rest) = line.strip_prefix("content-length: ") {
            length = rest.parse().expect("a length");
        } else if line.is_empty() {
            break;
        }
    }
    let mut body = vec![0; length];
    connection.read_exact(&mut body).expect("a body");
    (status, body)
}

fn cpu(clock: ClockId) -> Duration {
    Duration::try_from(clock_gettime(clock)).expect("a time after the start")
}

fn print(name: &str, mut durations: Vec<Duration>) {
    if durations.is_empty() {
        return;
    }
    durations.sort_unstable();
    let at = |share: f64| {
        let k = ((durations.len() - 1) as f64 * share) as usize;
        durations[k].as_secs_f64() * 1e3
    };
    let (median, p95, p99, max) = (at(0.5), at(0.95), at(0.99), at(1.0));
    println!(
        "{name}: {} requests, median {median:.1} ms, 95 % {p95:.1} ms, 99 % {p99:.1} ms, maximum {max:.1} ms",
        durations.len()
    );
}
