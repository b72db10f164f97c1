//! Local server in place of a language model endpoint. It implements the chat completions protocol
//! with scripted answers.
//!
//! **What it is**: a test endpoint for the pipeline. It selects a plan from the text of the prompt
//! by fixed rules, and injects all kinds of endpoint failures at configurable rates. `cargo run -p
//! chaic-llm-standin` starts it.
//!
//! **What it is not**: a language model. **Scores reached with it are not those of a language
//! model.** It knows nothing of chaic except the text of the prompt.
//!
//! **Invariants**
//! - It listens on the local machine only.
//! - The same requests in the same order get the same answers and faults.

pub mod faults;
pub mod script;

mod http;

use std::collections::BTreeMap;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

use serde_json::{Value, json};

use faults::{Draw, FaultKind};
use http::{Request, read_request, write_response};
use script::Question;

/// Time without a listener after a [`FaultKind::Refused`].
const REFUSAL_TIME: Duration = Duration::from_millis(20);

/// Source of answers to requests without a fault.
pub enum ResponseMode {
    /// The script.
    Script,
    /// A function of the caller.
    Function(Box<dyn Fn(&Question) -> String + Send + Sync>),
}

/// Options of a server.
pub struct Options {
    /// Port; 0 for any free port.
    pub port: u16,
    /// Fault kinds and their rates, 0 to 1.
    pub faults: Vec<(FaultKind, f64)>,
    /// Seed that selects the requests that fail.
    pub seed: u64,
    /// Time per response.
    pub latency: Duration,
    /// Delay of timeout and slow-drip faults.
    pub stall: Duration,
    /// Required API key, if any.
    pub key: Option<String>,
    /// True if it rejects JSON schemas, as some servers do.
    pub refuses_schema: bool,
    /// Reported reason for the end of each answer; `length` for one that was cut off.
    pub finish_reason: &'static str,
    /// Target of redirects; the server then redirects all completion requests.
    pub redirects_to: Option<String>,
    /// Source of answers.
    pub response_mode: ResponseMode,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            port: 0,
            faults: Vec::new(),
            seed: 0,
            latency: Duration::ZERO,
            stall: Duration::from_secs(2),
            key: None,
            refuses_schema: false,
            finish_reason: "stop",
            redirects_to: None,
            response_mode: ResponseMode::Script,
        }
    }
}

/// Counters of the server.
#[derive(Clone, Debug, Default)]
pub struct ServerStats {
    /// Number of completion requests.
    pub requests: usize,
    /// Number of requests that were answered without a fault.
    pub answered: usize,
    /// Numbers of faults by name.
    pub faults: BTreeMap<&'static str, usize>,
    /// Number of images in requests.
    pub images: usize,
    /// Number of requests with a JSON schema.
    pub with_schema: usize,
    /// Maximum number of concurrent requests.
    pub max_in_flight: usize,
    /// Text of the last request.
    pub last_text: String,
}

/// A running server; dropping it stops the server.
pub struct StandIn {
    address: SocketAddr,
    shared: Arc<Shared>,
    listener: Option<JoinHandle<()>>,
}

struct Shared {
    options: Options,
    stats: Mutex<ServerStats>,
    in_flight: AtomicUsize,
    n_drawn: AtomicUsize,
    is_stopped: AtomicBool,
    is_refusing: AtomicBool,
}

impl StandIn {
    /// Starts a server.
    ///
    /// # Errors
    /// If the port is not available.
    pub fn start(options: Options) -> io::Result<StandIn> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, options.port))?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared {
            options,
            stats: Mutex::default(),
            in_flight: AtomicUsize::new(0),
            n_drawn: AtomicUsize::new(0),
            is_stopped: AtomicBool::new(false),
            is_refusing: AtomicBool::new(false),
        });
        let for_thread = Arc::clone(&shared);
        let thread = std::thread::spawn(move || listen(listener, address, &for_thread));
        Ok(StandIn { address, shared, listener: Some(thread) })
    }

    /// Returns the base URL.
    pub fn url(&self) -> String {
        format!("http://{}/v1", self.address)
    }

    /// Returns the counters so far.
    pub fn stats(&self) -> ServerStats {
        self.shared.stats().clone()
    }

    /// Serves until the process ends.
    pub fn serve(mut self) {
        if let Some(thread) = self.listener.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::SeqCst);
        // Wakes the listener. While it is not listening, it wakes after a short delay.
        let _ = TcpStream::connect(self.address);
        if let Some(thread) = self.listener.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn stats(&self) -> MutexGuard<'_, ServerStats> {
        self.stats.lock().unwrap_or_else(|e| e.into_inner())
    }
}

fn listen(listener: TcpListener, address: SocketAddr, shared: &Arc<Shared>) {
    let mut listener = Some(listener);
    while !shared.is_stopped.load(Ordering::SeqCst) {
        if shared.is_refusing.swap(false, Ordering::SeqCst) {
            // Connections are refused until the port is bound again.
            drop(listener.take());
            std::thread::sleep(REFUSAL_TIME);
        }
        if listener.is_none() {
            match TcpListener::bind(address) {
                Ok(bound) => listener = Some(bound),
                Err(_) => std::thread::sleep(REFUSAL_TIME),
            }
        }
        let Some(open) = &listener else { continue };
        // A stop request while the port was closed did not reach the listener.
        if shared.is_stopped.load(Ordering::SeqCst) {
            return;
        }
        let Ok((stream, _)) = open.accept() else { continue };
        let shared = Arc::clone(shared);
        std::thread::spawn(move || {
            // Errors of a connection concern the client only.
            let _ = serve_connection(stream, &shared);
        });
    }
}

fn serve_connection(mut stream: TcpStream, shared: &Shared) -> io::Result<()> {
    stream.set_nodelay(true)?;
    // Closes idle connections.
    stream.set_read_timeout(Some(Duration::from_secs(60)))?;
    while !shared.is_stopped.load(Ordering::SeqCst) {
        // The fault is drawn when data arrives, before it is read.
        if stream.peek(&mut [0])? == 0 {
            return Ok(());
        }
        let draw = shared.draw();
        if draw == Some(FaultKind::Reset) || draw == Some(FaultKind::Refused) {
            shared.reset(&stream, draw);
            return Ok(());
        }
        let Some(request) = read_request(&mut stream)? else { return Ok(()) };
        let now = shared.in_flight.fetch_add(1, Ordering::SeqCst) + 1;
        shared.record_in_flight(now);
        let result = shared.answer(&mut stream, &request, draw);
        shared.in_flight.fetch_sub(1, Ordering::SeqCst);
        if !result? {
            return Ok(());
        }
    }
    Ok(())
}

impl Shared {
    /// Returns the fault of the next request, if any.
    fn draw(&self) -> Option<FaultKind> {
        let index = self.n_drawn.fetch_add(1, Ordering::SeqCst) as u64;
        Draw { seed: self.options.seed, index }.fault(&self.options.faults)
    }

    fn record_in_flight(&self, n: usize) {
        let mut stats = self.stats();
        stats.max_in_flight = stats.max_in_flight.max(n);
    }

    fn count(&self, kind: FaultKind) {
        *self.stats().faults.entry(kind.name()).or_default() += 1;
    }

    /// Drops the connection. Closing a socket with unread data resets the connection.
    fn reset(&self, stream: &TcpStream, draw: Option<FaultKind>) {
        self.stats().requests += 1;
        draw.into_iter().for_each(|kind| self.count(kind));
        if draw == Some(FaultKind::Refused) {
            self.is_refusing.store(true, Ordering::SeqCst);
            // Wakes the listener, which closes the port.
            let _ = stream.local_addr().and_then(TcpStream::connect);
        }
    }

    /// Answers a request; returns whether the connection stays open.
    fn answer(
        &self,
        stream: &mut TcpStream,
        request: &Request,
        draw: Option<FaultKind>,
    ) -> io::Result<bool> {
        if !request.path.contains("/chat/completions") {
            let models =
                json!({ "object": "list", "data": [{ "id": "standin", "object": "model" }] });
            let is_models = request.path.ends_with("/models");
            let (status, body) =
                if is_models { (200, models) } else { (404, error("no such path")) };
            return write_response(stream, status, &[], body.to_string().as_bytes());
        }
        self.stats().requests += 1;
        if let Some(address) = &self.options.redirects_to {
            // Status 307 makes clients repeat the request with its body.
            return write_response(stream, 307, &[("location", address)], b"");
        }
        if let Some(key) = &self.options.key
            && request.key() != Some(key.as_str())
        {
            // Like real endpoints, the error message contains the rejected key.
            let message = format!("Incorrect API key provided: {}", request.key().unwrap_or(""));
            return write_response(stream, 401, &[], error(&message).to_string().as_bytes());
        }
        let question = match Question::parse(&request.body) {
            Ok(question) => question,
            Err(problem) => {
                return write_response(stream, 400, &[], error(&problem).to_string().as_bytes());
            }
        };
        {
            let mut stats = self.stats();
            stats.images += question.images;
            stats.with_schema += usize::from(question.n_schema_plans.is_some());
            stats.last_text.clone_from(&question.text);
        }
        if self.options.refuses_schema && question.n_schema_plans.is_some() {
            let body = error("response_format of type json_schema is not supported");
            return write_response(stream, 400, &[], body.to_string().as_bytes());
        }
        if let Some(kind) = draw {
            self.count(kind);
            return kind.send(stream, &question, self.options.stall);
        }
        std::thread::sleep(self.options.latency);
        let text = match &self.options.response_mode {
            ResponseMode::Script => question.answer(),
            ResponseMode::Function(answer) => answer(&question),
        };
        self.stats().answered += 1;
        let mut body = completion(&question, &text);
        body["choices"][0]["finish_reason"] = json!(self.options.finish_reason);
        write_response(stream, 200, &[], body.to_string().as_bytes())
    }
}

/// Returns a completion with this text.
fn completion(question: &Question, text: &str) -> Value {
    // Estimate of four characters per token.
    let (prompt, answer) = (question.text.len() / 4, text.len() / 4);
    json!({
        "id": "standin",
        "object": "chat.completion",
        "model": "standin",
        "choices": [{
            "index": 0,
            "message": { "role": "assistant", "content": text },
            "finish_reason": "stop",
        }],
        "usage": {
            "prompt_tokens": prompt,
            "completion_tokens": answer,
            "total_tokens": prompt + answer,
        },
    })
}

fn error(message: &str) -> Value {
    json!({ "error": { "message": message, "type": "invalid_request_error" } })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_stops_at_once_while_it_refuses_connections() {
        let standin = StandIn::start(Options::default()).expect("a port");
        standin.shared.is_refusing.store(true, Ordering::SeqCst);
        // The listener closes the port with the next connection, so it is closed when the server is
        // dropped.
        drop(TcpStream::connect(standin.address));
        std::thread::sleep(REFUSAL_TIME / 2);
        let (done, ended) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            drop(standin);
            let _ = done.send(());
        });
        assert_eq!(ended.recv_timeout(Duration::from_secs(20)), Ok(()));
    }
}
