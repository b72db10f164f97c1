//! `chaic study serve`. Needs the feature `study-server`.

use anyhow::Result;
use chaic_sandbox::Launcher;

use crate::arguments::StudyServeArguments;
use crate::exit::ExitStatus;
use crate::output::OutputFormat;

/// Serves a study until Ctrl-C.
#[cfg(feature = "study-server")]
pub fn run(
    arguments: &StudyServeArguments,
    format: OutputFormat,
    launcher: &Launcher,
) -> Result<ExitStatus> {
    use std::time::Instant;

    use chaic_study::{Simulator, Study, StudyPlan};
    use chaic_study_server::{ServerOptions, StudyServer};
    use serde_json::json;

    use crate::interrupt;
    use crate::output::{
        counted, json_path, print_progress, print_result, print_warning, quoted_path,
    };

    let StudyServeArguments { study, data, listen, hosts, .. } = arguments;
    let plan = StudyPlan::new(Study::read(study)?, study)?;
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
    let stop = interrupt::stop_flag()?;
    let helpers = own_helpers::registry(arguments, &plan, launcher, stop)?;
    let server = StudyServer::open(plan, &options, helpers, clock, Box::new(print_warning))
        .map_err(own_helpers::with_hint)?;
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
        "url": url, "digest": digest, "slots": slots, "data": json_path(data),
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

/// Helpers that are not built in.
#[cfg(feature = "study-server")]
mod own_helpers {
    use std::slice;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use anyhow::Result;
    use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
    use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry};
    use chaic_eval::EvalError;
    use chaic_learn::helpers::{NamedPolicy, PolicyRegistry};
    use chaic_sandbox::Launcher;
    use chaic_study::{Simulator, StudyPlan};
    use chaic_study_server::ServerError;
    use chaic_subprocess::CommandRegistry;

    use crate::arguments::{HelperArgument, StudyServeArguments};

    /// Returns all helpers of the server. They live as long as the process.
    pub(super) fn registry(
        arguments: &StudyServeArguments,
        plan: &StudyPlan,
        launcher: &Launcher,
        stop: &'static AtomicBool,
    ) -> Result<&'static dyn HelperRegistry> {
        let given: Vec<&HelperArgument> =
            arguments.helper.iter().flat_map(|list| &list.0).collect();
        if !given.is_empty() && plan.study().play.simulator == Simulator::Page {
            return Err(invalid(
                "--helper needs `play.simulator = \"server\"` in study.toml: a page has no own helpers",
            ));
        }
        let (mut programs, mut policies) = (Vec::new(), Vec::new());
        for helper in &given {
            match helper {
                HelperArgument::Names(names) => {
                    return Err(invalid(&format!(
                        "--helper {} has no command; write NAME=exec:COMMAND or NAME=policy:FILE, and name \
                         built-in helpers in study.toml alone",
                        names.join(",")
                    )));
                }
                HelperArgument::Exec { name, line } => {
                    programs.push(arguments.exec.command(name, line));
                }
                HelperArgument::Policy { name, file } => {
                    policies.push(NamedPolicy::read(name, file)?);
                }
            }
        }
        arguments.exec.check_used(programs.len())?;
        for name in given.iter().flat_map(|helper| helper.names()) {
            if !plan.helpers().contains(name.as_str()) {
                let problem = "no condition of the study has the helper";
                return Err(invalid(&format!("{problem} `{name}`; name it in study.toml")));
            }
        }
        for program in &mut programs {
            arguments.exec.confine(program, launcher, slice::from_ref(&arguments.data))?;
        }
        let perception = Arc::new(GroundTruthPerceptionFactory);
        let policies =
            PolicyRegistry::bundled(&BuiltInHelpers, perception).with_policies(policies)?;
        let policies = Box::leak(Box::new(policies));
        Ok(Box::leak(Box::new(CommandRegistry::new(policies, programs, stop)?)))
    }

    /// Adds a hint to the error about a missing helper: how to specify it. Also marks errors about wrong host
    /// names as invalid requests.
    pub(super) fn with_hint(error: ServerError) -> anyhow::Error {
        match error {
            ServerError::HostName(_) | ServerError::NoHostName(_) => invalid(&error.to_string()),
            ServerError::Helper(problem) => {
                invalid(&format!("{problem}; give your own with --helper NAME=exec:COMMAND"))
            }
            error => error.into(),
        }
    }

    fn invalid(problem: &str) -> anyhow::Error {
        EvalError::Options(problem.to_owned()).into()
    }
}

/// Returns an error, because this build has no server.
#[cfg(not(feature = "study-server"))]
pub fn run(_: &StudyServeArguments, _: OutputFormat, _: &Launcher) -> Result<ExitStatus> {
    anyhow::bail!(
        "this build has no study server; install one that has it: `cargo install --path crates/app/chaic \
         --features study-server`"
    )
}
