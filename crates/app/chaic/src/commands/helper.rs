//! `chaic helper`.

use std::io::{stdin, stdout};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result};
use chaic_agents::perception_factory::GroundTruthPerceptionFactory;
use chaic_env::helper_registry::{BuiltInHelpers, HelperRegistry as _, find};
use chaic_env::rules::RuleSet;
use chaic_eval::EvalError;
use chaic_learn::helpers::PolicyRegistry;
use chaic_sandbox::Launcher;
use chaic_subprocess::conformance::{Check, check};
use chaic_subprocess::serve::serve_with_grants;
use serde_json::json;

use super::require_text;
use crate::arguments::{HelperCheckArguments, HelperCommand, HelperServeArguments};
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{OutputFormat, counted, print, print_result};

/// Tests or runs helper processes.
pub fn run(
    command: &HelperCommand,
    format: OutputFormat,
    launcher: &Launcher,
) -> Result<ExitStatus> {
    match command {
        HelperCommand::Check(arguments) => check_helper(arguments, format, launcher),
        HelperCommand::Serve(arguments) => {
            require_text(format, "chaic helper serve")?;
            serve_helper(arguments)
        }
    }
}

fn check_helper(
    arguments: &HelperCheckArguments,
    format: OutputFormat,
    launcher: &Launcher,
) -> Result<ExitStatus> {
    let stop = interrupt::stop_flag()?;
    let mut command = arguments.exec.command("exec", &arguments.line);
    arguments.exec.confine(&mut command, launcher, &[])?;
    let command = Arc::new(command);
    let mut printed = Ok(());
    let mut print_check = |check: &Check| {
        if stop.load(Ordering::Relaxed) || format == OutputFormat::Json {
            return;
        }
        let line = match &check.result {
            Ok(()) => format!("ok      {}\n", check.requirement),
            Err(problem) => format!("FAILED  {}\n        {problem}\n", check.requirement),
        };
        if printed.is_ok() {
            printed = print(&line);
        }
    };
    let checks = check(&command, stop, &mut print_check);
    printed?;
    if stop.load(Ordering::Relaxed) {
        return Ok(ExitStatus::Interrupted);
    }
    let n_failed = checks.iter().filter(|check| check.result.is_err()).count();
    let record = |check: &Check| json!({ "check": check.requirement, "problem": check.result.clone().err() });
    let json = json!({
        "passed": n_failed == 0,
        "checks": checks.iter().map(record).collect::<Vec<_>>(),
    });
    let text = match n_failed {
        0 => "The helper follows the protocol.\n".to_owned(),
        n => format!("{} failed.\n", counted(n, "check")),
    };
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(n_failed > 0))
}

fn serve_helper(arguments: &HelperServeArguments) -> Result<ExitStatus> {
    let rules = RuleSet::named(arguments.rules).planner;
    let perception = Arc::new(GroundTruthPerceptionFactory);
    let helpers = PolicyRegistry::bundled(&BuiltInHelpers, perception);
    let helper = find(&helpers, &arguments.name, rules)?;
    let Some(mut helper) = helper else {
        let names = helpers.names().join(", ");
        let text = format!("none is no helper to serve; name one of {names}");
        return Err(EvalError::Options(text).into());
    };
    let name = format!("chaic {} {}", chaic_env::CHAIC_VERSION, arguments.name);
    let (mut input, mut output) = (stdin().lock(), stdout().lock());
    serve_with_grants(&name, helper.agent.as_mut(), helper.grants, &mut input, &mut output)
        .context("standard input and output")?;
    Ok(ExitStatus::Success)
}
