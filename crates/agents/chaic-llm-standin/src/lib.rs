//! A stand-in for a language model's endpoint: a small server on this machine that answers the
//! protocol of chat completions by a script.
//!
//! **What it is**: something to try the pipeline on, and to test it against: it reads the text of
//! the prompt it is sent and picks a plan by a few rules, and it fails in all the ways in which
//! endpoints fail, as often as one likes. `cargo run -p chaic-llm-standin` starts it.
//!
//! **What it is not**: a language model. **Scores that are reached with it are not a language
//! model's, and say nothing of any.** It knows nothing of chaic but the text it is sent.
//!
//! **Invariants**
//! - It listens on this machine only.
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

/// For how long nobody listens after a fault of the kind `refused`.
const DEAF: Duration = Duration::from_millis(20);

/// How it answers a question that it isn't failing.
pub enum Manner {
    /// By its script.
    Script,
    /// As the caller says.
    Say(Box<dyn Fn(&Question) -> String + Send + Sync>),
}

/// What the server does.
pub struct Options {
    /// The port; 0 for any that is free.
    pub port: u16,
    /// How often it fails in which way.
    pub faults: Vec<(FaultKind, f64)>,
    /// Which requests fail.
    pub seed: u64,
    /// How long each answer takes.
    pub latency: Duration,
    /// How long it stalls where it fails by being slow.
    pub stall: Duration,
    /// The key that it asks for.
    pub key: Option<String>,
    /// Whether it refuses JSON schemas, as some servers do.
    pub refuses_schema: bool,
    /// The address that it sends everybody on to, with their request.
    pub redirects_to: Option<String>,
    /// How it answers.
    pub manner: Manner,
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
            redirects_to: None,
            manner: Manner::Script,
        }
    }
}

/// What the server has seen and done.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Requests for a completion.
    pub requests: usize,
    /// Requests that were answered as they should be.
    pub answered: usize,
    /// Faults by their names.
    pub faults: BTreeMap<&'static str, usize>,
    /// Pictures that came with questions.
    pub pictures: usize,
    /// Questions with a JSON schema.
    pub with_schema: usize,
    /// Most requests at a time.
    pub most_in_flight: usize,
    /// The last question's text.
    pub last_text: String,
}

/// A running server; it ends with this value.
pub struct StandIn {
    address: SocketAddr,
    shared: Arc<Shared>,
    listener: Option<JoinHandle<()>>,
}

struct Shared {
    options: Options,
    seen: Mutex<Seen>,
    in_flight: AtomicUsize,
    drawn: AtomicUsize,
    is_over: AtomicBool,
    is_deaf: AtomicBool,
}

impl StandIn {
    /// Starts a server.
    ///
    /// # Errors
    /// If the port can't be had.
    pub fn start(options: Options) -> io::Result<StandIn> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, options.port))?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared {
            options,
            seen: Mutex::default(),
            in_flight: AtomicUsize::new(0),
            drawn: AtomicUsize::new(0),
            is_over: AtomicBool::new(false),
            is_deaf: AtomicBool::new(false),
        });
        let for_thread = Arc::clone(&shared);
        let thread = std::thread::spawn(move || listen(listener, address, &for_thread));
        Ok(StandIn { address, shared, listener: Some(thread) })
    }

    /// The base of its address.
    pub fn url(&self) -> String {
        format!("http://{}/v1", self.address)
    }

    /// What it has seen and done so far.
    pub fn seen(&self) -> Seen {
        self.shared.seen().clone()
    }

    /// Waits until it ends, which it doesn't by itself.
    pub fn serve(mut self) {
        if let Some(thread) = self.listener.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::SeqCst);
        // Wakes the listener; it may be deaf just now, and wakes then by itself.
        let _ = TcpStream::connect(self.address);
        if let Some(thread) = self.listener.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(|e| e.into_inner())
    }
}

fn listen(listener: TcpListener, address: SocketAddr, shared: &Arc<Shared>) {
    let mut listener = Some(listener);
    while !shared.is_over.load(Ordering::SeqCst) {
        if shared.is_deaf.swap(false, Ordering::SeqCst) {
            // Nobody listens for a moment: connections are refused.
            drop(listener.take());
            std::thread::sleep(DEAF);
        }
        if listener.is_none() {
            match TcpListener::bind(address) {
                Ok(again) => listener = Some(again),
                Err(_) => std::thread::sleep(DEAF),
            }
        }
        let Some(open) = &listener else { continue };
        // Whoever ended it while nobody listened has knocked in vain and won't again.
        if shared.is_over.load(Ordering::SeqCst) {
            return;
        }
        let Ok((stream, _)) = open.accept() else { continue };
        let shared = Arc::clone(shared);
        std::thread::spawn(move || {
            // Whoever hangs up has nothing to be told.
            let _ = converse(stream, &shared);
        });
    }
}

fn converse(mut stream: TcpStream, shared: &Shared) -> io::Result<()> {
    stream.set_nodelay(true)?;
    // Nobody holds a connection open for ever.
    stream.set_read_timeout(Some(Duration::from_secs(60)))?;
    while !shared.is_over.load(Ordering::SeqCst) {
        // Luck is drawn when something comes, and is not read yet.
        if stream.peek(&mut [0])? == 0 {
            return Ok(());
        }
        let draw = shared.draw();
        if draw == Some(FaultKind::Reset) || draw == Some(FaultKind::Refused) {
            shared.break_off(&stream, draw);
            return Ok(());
        }
        let Some(request) = read_request(&mut stream)? else { return Ok(()) };
        let now = shared.in_flight.fetch_add(1, Ordering::SeqCst) + 1;
        shared.seen().most_in_flight.max_with(now);
        let result = shared.answer(&mut stream, &request, draw);
        shared.in_flight.fetch_sub(1, Ordering::SeqCst);
        if !result? {
            return Ok(());
        }
    }
    Ok(())
}

/// Raises a number to another.
trait MaxWith {
    fn max_with(&mut self, other: usize);
}

impl MaxWith for usize {
    fn max_with(&mut self, other: usize) {
        *self = (*self).max(other);
    }
}

impl Shared {
    /// How the next request fails, if it does.
    fn draw(&self) -> Option<FaultKind> {
        let number = self.drawn.fetch_add(1, Ordering::SeqCst) as u64;
        Draw { seed: self.options.seed, number }.fault(&self.options.faults)
    }

    fn count(&self, kind: FaultKind) {
        *self.seen().faults.entry(kind.name()).or_default() += 1;
    }

    /// What is left unread resets the connection when it is closed.
    fn break_off(&self, stream: &TcpStream, draw: Option<FaultKind>) {
        self.seen().requests += 1;
        draw.into_iter().for_each(|kind| self.count(kind));
        if draw == Some(FaultKind::Refused) {
            self.is_deaf.store(true, Ordering::SeqCst);
            // Wakes the listener, which is deaf from then on.
            let _ = stream.local_addr().and_then(TcpStream::connect);
        }
    }

    /// Answers a request; whether the connection stays open.
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
        self.seen().requests += 1;
        if let Some(address) = &self.options.redirects_to {
            // The status by which clients send the same again.
            return write_response(stream, 307, &[("location", address)], b"");
        }
        if let Some(key) = &self.options.key
            && request.key() != Some(key.as_str())
        {
            // As real ones do: it says which key it was given.
            let said = format!("Incorrect API key provided: {}", request.key().unwrap_or(""));
            return write_response(stream, 401, &[], error(&said).to_string().as_bytes());
        }
        let question = match Question::parse(&request.body) {
            Ok(question) => question,
            Err(problem) => {
                return write_response(stream, 400, &[], error(&problem).to_string().as_bytes());
            }
        };
        {
            let mut seen = self.seen();
            seen.pictures += question.pictures;
            seen.with_schema += usize::from(question.schema_of.is_some());
            seen.last_text.clone_from(&question.text);
        }
        if self.options.refuses_schema && question.schema_of.is_some() {
            let said = error("response_format of type json_schema is not supported");
            return write_response(stream, 400, &[], said.to_string().as_bytes());
        }
        if let Some(kind) = draw {
            self.count(kind);
            return kind.perform(stream, &question, self.options.stall);
        }
        std::thread::sleep(self.options.latency);
        let text = match &self.options.manner {
            Manner::Script => question.answer(),
            Manner::Say(say) => say(&question),
        };
        self.seen().answered += 1;
        write_response(stream, 200, &[], completion(&question, &text).to_string().as_bytes())
    }
}

/// A completion that says this.
fn completion(question: &Question, text: &str) -> Value {
    // A token is about four letters; nobody should take these numbers for more.
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
    fn it_ends_at_once_even_while_nobody_listens() {
        let standin = StandIn::start(Options::default()).expect("a port");
        standin.shared.is_deaf.store(true, Ordering::SeqCst);
        // The listener takes note with the next connection, and is deaf when it is told to end.
        drop(TcpStream::connect(standin.address));
        std::thread::sleep(DEAF / 2);
        let (done, ended) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            drop(standin);
            let _ = done.send(());
        });
        assert_eq!(ended.recv_timeout(Duration::from_secs(20)), Ok(()));
    }
}
