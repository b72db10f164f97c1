//! The server: listens, bounds its connections, and ends when a flag is set.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::http::HeaderValue;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry, NONE, find};
use chaic_env::rules::RuleSet;
use chaic_page::{study_page, study_page_without_simulator, study_script};
use chaic_study::{Simulator, StudyPlan, page_content};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use serde_json::json;
use sha2::{Digest as _, Sha256};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};

use crate::access::{AllowedHosts, is_host_name};
use crate::app::{App, Clock, EpisodeService, Reporter, n_play_threads};
use crate::error::{Result, ServerError};
use crate::limits::{
    HEADER_TIMEOUT, IDLE_INTERVAL, MAX_CONNECTIONS, MAX_HEADER_BYTES, STOP_TIMEOUT, WRITE_TIMEOUT,
    WRITER_THREADS,
};
use crate::routes::router;
use crate::store::{ParticipantCounts, Store};
use crate::write_timeout::WriteTimeout;

/// Threads that handle requests.
const THREADS: usize = 2;
/// Interval at which the stop flag is read.
const STOP_INTERVAL: Duration = Duration::from_millis(50);
/// Pause after a connection that the system refused, for example without free descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Options of a server.
#[derive(Clone, Debug)]
pub struct ServerOptions {
    /// Folder of the participants' files.
    pub folder: PathBuf,
    /// Address on which to listen. Port 0 selects a free one.
    pub listen: SocketAddr,
    /// Further names under which browsers reach the server.
    pub hosts: Vec<String>,
}

/// Server of a study.
pub struct StudyServer {
    runtime: Runtime,
    listener: TcpListener,
    address: SocketAddr,
    app: Arc<App>,
}

impl StudyServer {
    /// Opens the folder of the data, builds the page and listens. Requests are answered by [`StudyServer::run`].
    ///
    /// `helpers` creates the helpers of the conditions, if the simulator runs on the server.
    ///
    /// # Errors
    /// [`ServerError`].
    pub fn open(
        plan: StudyPlan,
        options: &ServerOptions,
        helpers: &'static dyn HelperRegistry,
        clock: Clock,
        report: Reporter,
    ) -> Result<StudyServer> {
        let ServerOptions { folder, listen, hosts } = options;
        if let Some(name) = hosts.iter().find(|name| !is_host_name(name)) {
            return Err(ServerError::HostName(name.clone()));
        }
        if listen.ip().is_unspecified() && hosts.is_empty() {
            return Err(ServerError::NoHostName(*listen));
        }
        let refused = |error| ServerError::Listen { address: *listen, error };
        let is_simulated_here = plan.study().play.simulator == Simulator::Server;
        let has_own_helpers = plan.helpers().iter().any(|name| !is_built_in(name));
        let n_threads = if is_simulated_here { n_play_threads(has_own_helpers) } else { 0 };
        let runtime = Builder::new_multi_thread()
            .worker_threads(THREADS)
            .max_blocking_threads(WRITER_THREADS + n_threads)
            .enable_all()
            .build()
            .map_err(refused)?;
        let listener = listen_on(*listen).map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;
        let mut content = page_content(&plan);
        content["server"] = json!(true);
        let title = &plan.study().title;
        let page_digest = content["digest"].as_str().unwrap_or_default().to_owned();
        let (page, play) = if is_simulated_here {
            for name in plan.helpers() {
                find(helpers, name, RuleSet::PAPER.planner)?;
            }
            let play = Arc::new(EpisodeService::new(page_digest, helpers, n_threads));
            (study_page_without_simulator(title, &content), Some(play))
        } else {
            (study_page(title, &content), None)
        };
        let policy = policy(is_simulated_here);
        let store = Store::open(plan, folder, clock())?;
        let hosts = AllowedHosts::new(address, hosts);
        let app = Arc::new(App { store, hosts, page: page.into(), policy, play, clock, report });
        Ok(StudyServer { runtime, listener, address, app })
    }

    /// Returns the address on which the server listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the number of participants with files.
    pub fn counts(&self) -> ParticipantCounts {
        self.app.store.counts()
    }

    /// Answers requests until the flag is set. Requests in progress are finished first.
    ///
    /// # Errors
    /// [`ServerError::Listen`].
    pub fn run(self, stop: &AtomicBool) -> Result<ParticipantCounts> {
        let StudyServer { runtime, listener, address, app } = self;
        let listener = {
            let _runtime = runtime.enter();
            tokio::net::TcpListener::from_std(listener)
        };
        let listener = listener.map_err(|error| ServerError::Listen { address, error })?;
        if let Some(play) = app.play.clone() {
            runtime.spawn(close_idle(Arc::clone(&app), play));
        }
        runtime.block_on(serve(listener, router(Arc::clone(&app)), stop));
        // Waits for writes in progress.
        drop(runtime);
        Ok(app.store.counts())
    }
}

/// Returns whether a helper is built in, so that it decides in this process. Other helpers may wait
/// for another process.
fn is_built_in(name: &str) -> bool {
    name == NONE || BuiltInHelpers.names().iter().any(|known| known == name)
}

/// Closes episodes without turns, with the processes of their helpers.
async fn close_idle(app: Arc<App>, play: Arc<EpisodeService>) {
    loop {
        sleep(IDLE_INTERVAL).await;
        play.sessions.close_idle((app.clock)());
    }
}

fn listen_on(address: SocketAddr) -> io::Result<TcpListener> {
    let listener = TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Accepts connections until the flag is set, and then waits for those with requests in progress.
async fn serve(listener: tokio::net::TcpListener, router: Router, stop: &AtomicBool) {
    let free = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    let connections = GracefulShutdown::new();
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new())
        .header_read_timeout(HEADER_TIMEOUT)
        .max_buf_size(MAX_HEADER_BYTES);
    let stopped = async {
        while !stop.load(Ordering::SeqCst) {
            sleep(STOP_INTERVAL).await;
        }
    };
    tokio::pin!(stopped);
    loop {
        let accepted = async {
            let permit = Arc::clone(&free).acquire_owned().await.expect("it is never closed");
            (permit, listener.accept().await)
        };
        let (permit, accepted) = tokio::select! {
            () = &mut stopped => break,
            accepted = accepted => accepted,
        };
        let Ok((stream, _)) = accepted else {
            sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let service = TowerToHyperService::new(router.clone());
        let stream = TokioIo::new(WriteTimeout::new(stream, WRITE_TIMEOUT));
        let connection = connections.watch(http.serve_connection(stream, service));
        tokio::spawn(async move {
            // A broken connection affects only its client, which repeats the request.
            let _ = connection.await;
            drop(permit);
        });
    }
    drop(listener);
    let _ = timeout(STOP_TIMEOUT, connections.shutdown()).await;
}

/// Returns the content security policy of the page. It allows the page's script and requests to this server.
/// Unless the simulator runs on the server, it also allows module and worker.
fn policy(is_simulated_here: bool) -> HeaderValue {
    let hash = STANDARD.encode(Sha256::digest(study_script()));
    let simulator =
        if is_simulated_here { "" } else { " 'wasm-unsafe-eval' blob:; worker-src blob:" };
    let text = format!(
        "default-src 'none'; script-src 'sha256-{hash}'{simulator}; \
         style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self'; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'"
    );
    HeaderValue::from_str(&text).expect("base64 is ASCII")
}
