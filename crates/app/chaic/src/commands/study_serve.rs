//! `chaic study serve`. Needs the feature `study-server`.

use anyhow::Result;

use crate::arguments::StudyServeArguments;
use crate::exit::ExitStatus;
use crate::output::OutputFormat;

/// Serves a study until Ctrl-C.
#[cfg(feature = "study-server")]
pub fn run(arguments: &StudyServeArguments, format: OutputFormat) -> Result<ExitStatus> {
    use std::time::Instant;

    use chaic_study::{Plan, Simulator, Study};
    use chaic_study_server::{ServerOptions, StudyServer};
    use serde_json::json;

    use crate::interrupt;
    use crate::output::{counted, print_progress, print_result, print_warning, quoted_path};

    let StudyServeArguments { study, data, listen, hosts } = arguments;
    let plan = Plan::new(Study::read(study)?, study)?;
    let (digest, slots) = (plan.digest().to_owned(), plan.study().participants);
    let goals = match plan.study().play.simulator {
        Simulator::Page => {
            "the page contains the goals of its episodes, so a participant can find them"
        }
        Simulator::Server => "the server simulates the episodes; the page has no goals",
    };
    let options = ServerOptions { folder: data.clone(), listen: *listen, hosts: hosts.clone() };
    let start = Instant::now();
    let clock = Box::new(move || start.elapsed().as_secs());
    let server = StudyServer::open(plan, &options, clock, Box::new(print_warning))?;
    let stop = interrupt::stop_flag()?;
    let url = format!("http://{}/", server.address());
    let counts = server.counts();
    let text = format!(
        "{url}: {}, digest {}; {} with {}, {} complete\n\
         {goals}\n\
         Ctrl-C ends the server; the same command goes on\n",
        counted(slots as usize, "slot"),
        &digest[..8],
        quoted_path(data),
        counted(counts.participants, "participant"),
        counts.complete,
    );
    let json = json!({
        "url": url, "digest": digest, "slots": slots, "data": data,
        "participants": counts.participants, "completed": counts.complete,
    });
    print_result(format, &json, &text)?;
    if !server.address().ip().is_loopback() {
        print_warning(
            "connections are not encrypted; outside a laboratory, put a proxy with TLS before the server",
        );
    }
    let counts = server.run(stop)?;
    print_progress(&format!(
        "{}: {}, {} complete",
        quoted_path(data),
        counted(counts.participants, "participant"),
        counts.complete
    ));
    Ok(ExitStatus::Success)
}

/// Refuses, since this build has no server.
#[cfg(not(feature = "study-server"))]
pub fn run(_: &StudyServeArguments, _: OutputFormat) -> Result<ExitStatus> {
    anyhow::bail!(
        "this build has no study server; install one that has it: `cargo install --path crates/app/chaic \
         --features study-server`"
    )
}
