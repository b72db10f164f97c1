//! HTTP routes of episodes, if the simulator runs on the server.
//!
//! | request | effect |
//! |---|---|
//! | `PUT /participants/CODE/trials/N` | opens the running episode N; answers with its facts and the number of the next turn |
//! | `PUT /participants/CODE/trials/N/turns/K` | performs the turn K; answers with a line of JSON, then the picture (PNG) |
//! | `GET /participants/CODE/data` | answers with the file of a participant who has finished |
//!
//! Simulating and drawing run on as many threads as the machine has cores, apart from those that handle requests.

use std::sync::Arc;

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Path, Request, State};
use axum::http::header::{self, HeaderValue};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse as _, Response};
use axum::routing::{get, put};
use chaic_study::data::is_code;
use tokio::task::spawn_blocking;

use crate::access::TokenDigest;
use crate::app::{
    App, EpisodeService, episode_failure, json_response, no_such_page, read_text, refusal_response,
    server_failure,
};
use crate::limits::MAX_TURN_BYTES;
use crate::refusal::Refusal;
use crate::sessions::AdvanceRequest;

/// Creates the routes.
pub fn router() -> Router<Arc<App>> {
    Router::new()
        .route("/participants/{code}/trials/{trial}", put(open))
        .route("/participants/{code}/trials/{trial}/turns/{number}", put(turn))
        .route("/participants/{code}/data", get(data))
}

async fn open(
    State(app): State<Arc<App>>,
    Path((code, trial)): Path<(String, String)>,
    headers: HeaderMap,
) -> Response {
    let Some(trial) = number(&trial) else { return no_such_page() };
    let opened = simulate(app, code, &headers, move |app, play, code, token| {
        play.sessions.open(&app.store, code, token, trial, (app.clock)())
    });
    opened.await.map_or_else(|refused| refused, |answer| json_response(StatusCode::OK, answer))
}

async fn turn(
    State(app): State<Arc<App>>,
    Path((code, trial, turn)): Path<(String, String, String)>,
    request: Request,
) -> Response {
    let (Some(trial), Some(number)) = (number(&trial), number::<u64>(&turn)) else {
        return no_such_page();
    };
    let (parts, body) = request.into_parts();
    // The sender is checked before the body is read.
    if let Err(refusal) = allowed(&app, &code, &parts.headers, trial) {
        return refusal_response(&app, &refusal);
    }
    let turn = match read_text(body, MAX_TURN_BYTES).await {
        Ok(text) => AdvanceRequest::parse(&text),
        Err(response) => return response,
    };
    let turn = match turn {
        Ok(turn) => turn,
        Err(refusal) => return refusal_response(&app, &refusal),
    };
    let performed = simulate(app, code, &parts.headers, move |app, play, code, _| {
        play.sessions.turn(&app.store, code, trial, number, &turn)
    });
    performed.await.map_or_else(|refused| refused, binary_response)
}

async fn data(
    State(app): State<Arc<App>>,
    Path(code): Path<String>,
    headers: HeaderMap,
) -> Response {
    let read = simulate(app, code, &headers, |app, _, code, token| {
        app.store.complete_data(code, token, (app.clock)())
    });
    read.await.map_or_else(|refused| refused, |text| binary_response(Bytes::from(text)))
}

/// Checks the sender of a turn and its rate.
fn allowed(app: &App, code: &str, headers: &HeaderMap, trial: usize) -> Result<(), Refusal> {
    let token = TokenDigest::of_request(headers).ok_or(Refusal::Token)?;
    app.store.authorize(code, &token)?;
    let play = app.play.as_ref().ok_or(Refusal::Closed)?;
    play.sessions.take_token(code, trial, (app.clock)())
}

/// Performs a request of a participant on one of the threads of the simulator.
async fn simulate<T: Send + 'static>(
    app: Arc<App>,
    code: String,
    headers: &HeaderMap,
    perform: impl FnOnce(&App, &EpisodeService, &str, &TokenDigest) -> Result<T, Refusal>
    + Send
    + 'static,
) -> Result<T, Response> {
    let token = TokenDigest::of_request(headers).filter(|_| is_code(&code));
    let token = token.ok_or_else(|| refusal_response(&app, &Refusal::Token))?;
    app.store.authorize(&code, &token).map_err(|refusal| refusal_response(&app, &refusal))?;
    let Some(play) = app.play.clone() else { return Err(no_such_page()) };
    let permit = Arc::clone(&play.threads).acquire_owned().await.expect("it is never closed");
    let (shared, participant) = (Arc::clone(&app), code.clone());
    let work = move || {
        // The permit is held until the work ends, even if the client has disconnected.
        let _permit = permit;
        perform(&shared, &play, &code, &token)
    };
    match spawn_blocking(work).await {
        Ok(performed) => performed.map_err(|refusal| refusal_response(&app, &refusal)),
        Err(error) if error.is_panic() => Err(episode_failure(&app, &participant)),
        Err(_) => Err(server_failure(&app)),
    }
}

/// Parses a number of a path.
fn number<T: std::str::FromStr>(text: &str) -> Option<T> {
    let is_number = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse().ok().filter(|_| is_number)
}

fn binary_response(bytes: Bytes) -> Response {
    let media_type = HeaderValue::from_static("application/octet-stream");
    ([(header::CONTENT_TYPE, media_type)], bytes).into_response()
}
