//! Measures a server with many players: latency of uploads and processor time.
//!
//! `cargo run -p chaic-study-server --example load -- PLAYERS SECONDS`, 100 players for 30 seconds by
//! default. Each player loads the page, enters and uploads one decision per second through one connection.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use chaic_study::data::CODE_ALPHABET;
use chaic_study::{Plan, Study};
use chaic_study_server::{ServerOptions, StudyServer};
use rustix::time::{ClockId, clock_gettime};

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

/// Figures of one player.
struct Player {
    /// Durations of the first request, of the entry and of the uploads.
    page: Duration,
    entry: Duration,
    uploads: Vec<Duration>,
    cpu: Duration,
}

fn main() {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse().expect("a number"));
    let n_players: usize = arguments.next().unwrap_or(100);
    let n_seconds = arguments.next().unwrap_or(30);
    let dir = tempfile::tempdir().expect("the disk has space");
    let path = dir.path().join("study.toml");
    fs::write(&path, DEFINITION).expect("the disk has space");
    fs::write(dir.path().join("text.txt"), "Words.\n").expect("the disk has space");
    let plan = Plan::new(Study::read(&path).expect("a study"), &path).expect("a plan");
    let options = ServerOptions {
        folder: dir.path().join("data"),
        listen: "127.0.0.1:0".parse().expect("an address"),
        hosts: Vec::new(),
    };
    let start = Instant::now();
    let clock = Box::new(move || start.elapsed().as_secs());
    let report = Box::new(|text: &str| eprintln!("{text}"));
    let server = StudyServer::open(plan, &options, clock, report).expect("a server");
    let address = server.address();
    let stop = AtomicBool::new(false);
    let cpu_before = cpu(ClockId::ProcessCPUTime);
    let start = Instant::now();
    let players: Vec<Player> = thread::scope(|scope| {
        let running = scope.spawn(|| server.run(&stop).expect("it runs"));
        let play = |n: usize| scope.spawn(move || play(address, n, n_players, n_seconds));
        let players: Vec<_> = (0..n_players).map(play).collect();
        let players = players.into_iter().map(|player| player.join().expect("no panic")).collect();
        stop.store(true, Ordering::SeqCst);
        running.join().expect("no panic");
        players
    });
    let elapsed_secs = start.elapsed().as_secs_f64();
    let clients: Duration = players.iter().map(|player| player.cpu).sum();
    let server_secs = (cpu(ClockId::ProcessCPUTime) - cpu_before - clients).as_secs_f64();
    print("page", players.iter().map(|player| player.page).collect());
    print("entry", players.iter().map(|player| player.entry).collect());
    print("upload", players.into_iter().flat_map(|player| player.uploads).collect());
    let percent = 100.0 * server_secs / elapsed_secs;
    println!(
        "server: {server_secs:.2} s of processor time in {elapsed_secs:.1} s, {percent:.1} % of a core"
    );
}

/// Plays for some seconds.
fn play(address: SocketAddr, n: usize, n_players: usize, n_seconds: usize) -> Player {
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
        let status = read_answer(&mut connection);
        assert!(status == 200 || status == 201, "{method} {path}: {status}");
        start.elapsed()
    };
    let page = request("GET", "/", "");
    let entry = request("PUT", &format!("/participants/{code}"), "");
    let trial = "{\"type\":\"trial\",\"trial\":0}\n";
    request("PUT", &format!("/participants/{code}/records/1"), trial);
    let text = "x".repeat(DECISION_BYTES);
    let line = format!("{{\"type\":\"trace\",\"trial\":0,\"text\":\"{text}\\n\"}}\n");
    let mut uploads = Vec::new();
    for k in 0..n_seconds {
        uploads.push(request("PUT", &format!("/participants/{code}/records/{}", k + 2), &line));
        thread::sleep(Duration::from_secs(1).saturating_sub(*uploads.last().expect("an upload")));
    }
    Player { page, entry, uploads, cpu: cpu(ClockId::ThreadCPUTime) }
}

/// Reads an answer and returns its status.
fn read_answer(connection: &mut BufReader<TcpStream>) -> u16 {
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
    status
}

fn cpu(clock: ClockId) -> Duration {
    Duration::try_from(clock_gettime(clock)).expect("a time after the start")
}

fn print(name: &str, mut durations: Vec<Duration>) {
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
