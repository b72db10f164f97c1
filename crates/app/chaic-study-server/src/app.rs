//! State that all routes share, and the answers that they have in common.

use std::num::NonZeroUsize;
use std::sync::Arc;
use std::thread::available_parallelism;

use axum::body::{Body, Bytes, HttpBody as _, to_bytes};
use axum::http::StatusCode;
use axum::http::header::{self, HeaderValue};
use axum::response::{IntoResponse as _, Response};
use chaic_env::helper_registry::HelperRegistry;
use serde_json::json;
use tokio::sync::Semaphore;

use crate::access::AllowedHosts;
use crate::limits::WAITING_THREADS;
use crate::refusal::Refusal;
use crate::sessions::Sessions;
use crate::store::Store;

/// Clock of the server, seconds since an arbitrary start. Stored data contain no times.
pub type Clock = Box<dyn Fn() -> u64 + Send + Sync>;
/// Receiver of problems that the researcher should see.
pub type Reporter = Box<dyn Fn(&str) + Send + Sync>;

/// State of the routes.
pub struct App {
    /// Participants.
    pub store: Store,
    /// Names of the server.
    pub hosts: AllowedHosts,
    /// The page (HTML).
    pub page: Bytes,
    /// Content security policy of the page.
    pub policy: HeaderValue,
    /// Episodes, if the simulator runs on the server.
    pub play: Option<Arc<EpisodeService>>,
    /// Clock.
    pub clock: Clock,
    /// Receiver of problems.
    pub report: Reporter,
}

/// Episodes that participants play.
pub struct EpisodeService {
    /// Open episodes.
    pub sessions: Sessions,
    /// Digest of the page. Answers contain it in place of the digest of the study.
    pub page_digest: String,
    /// Permits of the threads that simulate and draw.
    pub threads: Arc<Semaphore>,
}

/// Returns the number of threads that simulate and render. With helpers in other processes there are more
/// threads than cores, because some only wait.
pub fn n_play_threads(has_own_helpers: bool) -> usize {
    let n_cores = available_parallelism().map_or(1, NonZeroUsize::get);
    if has_own_helpers { n_cores + WAITING_THREADS } else { n_cores }
}

impl EpisodeService {
    /// Creates the state without open episodes.
    pub fn new(
        page_digest: String,
        helpers: &'static dyn HelperRegistry,
        n_threads: usize,
    ) -> EpisodeService {
        let threads = Arc::new(Semaphore::new(n_threads));
        EpisodeService { sessions: Sessions::new(helpers), page_digest, threads }
    }
}

/// Reads a body of limited size.
pub async fn read_text(body: Body, max_bytes: usize) -> Result<String, Response> {
    let refused = || {
        let text = format!("the request is incomplete or longer than {max_bytes} bytes");
        refuse(StatusCode::PAYLOAD_TOO_LARGE, &text)
    };
    // A length in the headers is checked before the body is read.
    if body.size_hint().lower() > max_bytes as u64 {
        return Err(refused());
    }
    let bytes = to_bytes(body, max_bytes).await.map_err(|_| refused())?;
    String::from_utf8(bytes.into())
        .map_err(|_| refuse(StatusCode::UNPROCESSABLE_ENTITY, "the body is not UTF-8"))
}

/// Answers after a panic.
pub fn server_failure(app: &App) -> Response {
    (app.report)("a request of a participant has failed; this is an error of chaic");
    refuse(StatusCode::INTERNAL_SERVER_ERROR, "the server has failed")
}

/// Closes the episode of a participant after a panic. A repetition would fail again, so the page continues with the
/// next episode after this answer.
pub fn episode_failure(app: &App, code: &str) -> Response {
    if let Some(play) = &app.play {
        play.sessions.close(code);
    }
    (app.report)("an episode of a participant has failed; this is an error of chaic");
    refuse(StatusCode::UNPROCESSABLE_ENTITY, "the episode cannot go on")
}

/// Answers with a refusal, and reports refusals that need an action of the researcher.
pub fn refusal_response(app: &App, refusal: &Refusal) -> Response {
    let status = match refusal {
        Refusal::Unknown => StatusCode::NOT_FOUND,
        Refusal::Token => StatusCode::UNAUTHORIZED,
        Refusal::Full | Refusal::Over => StatusCode::GONE,
        Refusal::Rate => StatusCode::TOO_MANY_REQUESTS,
        Refusal::Gap { .. } | Refusal::Turn { .. } | Refusal::Closed | Refusal::NotBegun(_) => {
            StatusCode::CONFLICT
        }
        Refusal::Record { .. } | Refusal::Input(_) | Refusal::Simulator(_) => {
            StatusCode::UNPROCESSABLE_ENTITY
        }
        Refusal::Unfinished => StatusCode::FORBIDDEN,
        Refusal::Busy | Refusal::InProgress | Refusal::Ending => StatusCode::SERVICE_UNAVAILABLE,
        Refusal::Size(_) => StatusCode::PAYLOAD_TOO_LARGE,
        Refusal::Changed | Refusal::File(_) => StatusCode::INTERNAL_SERVER_ERROR,
    };
    match refusal {
        Refusal::File(error) => (app.report)(&error.to_string()),
        Refusal::Simulator(problem) => (app.report)(&format!("{refusal}: {problem}")),
        Refusal::Changed | Refusal::Busy => (app.report)(&refusal.to_string()),
        _ => {}
    }
    let mut answer = json!({ "error": refusal.to_string() });
    match refusal {
        Refusal::Gap { stored } => answer["stored"] = json!(stored),
        Refusal::Turn { next } => answer["next"] = json!(next),
        _ => {}
    }
    json_response(status, answer.to_string())
}

/// Answers to a request for another path.
pub fn no_such_page() -> Response {
    refuse(StatusCode::NOT_FOUND, "there is no such page")
}

/// Answers with an error.
pub fn refuse(status: StatusCode, text: &str) -> Response {
    json_response(status, json!({ "error": text }).to_string())
}

/// Answers with JSON.
pub fn json_response(status: StatusCode, answer: String) -> Response {
    let media_type = HeaderValue::from_static("application/json");
    (status, [(header::CONTENT_TYPE, media_type)], answer).into_response()
}
