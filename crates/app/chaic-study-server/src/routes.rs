//! HTTP routes of the server. A guard checks every request first.
//!
//! | request | effect |
//! |---|---|
//! | `GET /` | the page |
//! | `PUT /participants/CODE` | gives a slot; answers with the first record and the number of stored ones |
//! | `GET /participants/CODE` | answers with the number of stored records |
//! | `DELETE /participants/CODE` | deletes the participant |
//! | `PUT /participants/CODE/records/N` | appends records, the first of which has the number N |
//!
//! Requests for participants have a token. Every request can be repeated. [`crate::play_routes`] has the routes of
//! episodes, if the simulator runs on the server.

use std::sync::Arc;

use axum::Router;
use axum::extract::{Path, Request, State};
use axum::http::header::{self, HeaderName, HeaderValue};
use axum::http::{HeaderMap, Method, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse as _, Response};
use axum::routing::{get, put};
use chaic_study::data::{DataRecord, is_code};
use serde_json::json;
use tokio::task::spawn_blocking;
use tokio::time::timeout;

use crate::access::TokenDigest;
use crate::app::{
    App, json_response, no_such_page, read_text, refusal_response, refuse, server_failure,
};
use crate::limits::{MAX_BODY_BYTES, REQUEST_TIMEOUT};
use crate::play_routes;
use crate::refusal::Refusal;
use crate::store::EntryAnswer;

/// Headers of all answers, beside the policy.
const HEADERS: [(HeaderName, &str); 5] = [
    (header::CACHE_CONTROL, "no-store"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// Creates the routes.
pub fn router(app: Arc<App>) -> Router {
    let play = if app.play.is_some() { play_routes::router() } else { Router::new() };
    Router::new()
        .route("/", get(page))
        .route("/participants/{code}", put(enter).get(stored).delete(withdraw))
        .route("/participants/{code}/records/{from}", put(append))
        .merge(play)
        .fallback(async || no_such_page())
        .method_not_allowed_fallback(async || {
            refuse(StatusCode::METHOD_NOT_ALLOWED, "the page has no such method")
        })
        .layer(from_fn_with_state(Arc::clone(&app), guard))
        .with_state(app)
}

/// Checks host and origin, limits the duration, and adds the headers.
async fn guard(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    let is_reading = matches!(*request.method(), Method::GET | Method::HEAD);
    let headers = request.headers();
    let mut response = if !app.hosts.has_host(headers) || request.uri().authority().is_some() {
        let text = "the server is not known under this name; its operator can add --host NAME";
        refuse(StatusCode::FORBIDDEN, text)
    } else if !is_reading && !app.hosts.has_origin(headers) {
        refuse(StatusCode::FORBIDDEN, "the request does not come from the page of this server")
    } else {
        timeout(REQUEST_TIMEOUT, next.run(request)).await.unwrap_or_else(|_| {
            refuse(StatusCode::REQUEST_TIMEOUT, "the request took too long; repeat it")
        })
    };
    let headers = response.headers_mut();
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.insert(header::CONTENT_SECURITY_POLICY, app.policy.clone());
    response
}

async fn page(State(app): State<Arc<App>>) -> Response {
    let html = HeaderValue::from_static("text/html; charset=utf-8");
    ([(header::CONTENT_TYPE, html)], app.page.clone()).into_response()
}

async fn enter(
    State(app): State<Arc<App>>,
    Path(code): Path<String>,
    headers: HeaderMap,
) -> Response {
    respond(app, code, &headers, StatusCode::CREATED, |app, code, token| {
        let EntryAnswer { start, slot, stored } = app.store.enter(code, token, (app.clock)())?;
        let start = match &app.play {
            Some(play) => DataRecord::start(&play.page_digest, code, slot).to_line(),
            None => start,
        };
        // The line is inserted as text, because parsing would lose the order of its keys.
        Ok(format!("{{\"start\":{},\"stored\":{stored}}}", start.trim_end()))
    })
    .await
}

async fn stored(
    State(app): State<Arc<App>>,
    Path(code): Path<String>,
    headers: HeaderMap,
) -> Response {
    respond(app, code, &headers, StatusCode::OK, |app, code, token| {
        Ok(stored_json(app.store.stored(code, token, (app.clock)())?))
    })
    .await
}

async fn withdraw(
    State(app): State<Arc<App>>,
    Path(code): Path<String>,
    headers: HeaderMap,
) -> Response {
    respond(app, code, &headers, StatusCode::OK, |app, code, token| {
        app.store.withdraw(code, token)?;
        if let Some(play) = &app.play {
            play.sessions.close(code);
        }
        Ok(stored_json(0))
    })
    .await
}

async fn append(
    State(app): State<Arc<App>>,
    Path((code, from)): Path<(String, String)>,
    request: Request,
) -> Response {
    let (parts, body) = request.into_parts();
    let is_number = !from.is_empty() && from.bytes().all(|byte| byte.is_ascii_digit());
    let Some(from) = from.parse::<usize>().ok().filter(|_| is_number) else {
        return no_such_page();
    };
    // The sender is checked before the body is read.
    let token = TokenDigest::of_request(&parts.headers);
    if let Err(refusal) =
        token.ok_or(Refusal::Token).and_then(|token| app.store.authorize(&code, &token))
    {
        return refusal_response(&app, &refusal);
    }
    let text = match read_text(body, MAX_BODY_BYTES).await {
        Ok(text) => text,
        Err(response) => return response,
    };
    respond(app, code, &parts.headers, StatusCode::OK, move |app, code, token| {
        let stored = app.store.append(code, token, from, &text, (app.clock)())?;
        if let Some(play) = &app.play {
            play.sessions.close_ended(&app.store, code);
        }
        Ok(stored_json(stored))
    })
    .await
}

/// Performs a request of a participant on a thread for files.
async fn respond(
    app: Arc<App>,
    code: String,
    headers: &HeaderMap,
    success: StatusCode,
    perform: impl FnOnce(&App, &str, &TokenDigest) -> Result<String, Refusal> + Send + 'static,
) -> Response {
    if !is_code(&code) {
        return no_such_page();
    }
    let Some(token) = TokenDigest::of_request(headers) else {
        return refusal_response(&app, &Refusal::Token);
    };
    let shared = Arc::clone(&app);
    match spawn_blocking(move || perform(&shared, &code, &token)).await {
        Ok(Ok(answer)) => json_response(success, answer),
        Ok(Err(refusal)) => refusal_response(&app, &refusal),
        Err(_) => server_failure(&app),
    }
}

fn stored_json(stored: usize) -> String {
    json!({ "stored": stored }).to_string()
}
