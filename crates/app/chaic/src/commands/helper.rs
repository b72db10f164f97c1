//! `chaic helper`.

use std::io::{stdin, stdout};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result};
use chaic_env::minds::{BuiltIn, Helpers as _, find};
use chaic_env::rules::RuleSet;
use chaic_sandbox::Launcher;
use chaic_subprocess::conformance::{Check, check};
use chaic_subprocess::serve::serve;

use crate::arguments::{HelperCheckArguments, HelperCommand, HelperServeArguments};
use crate::exit::Ended;
use crate::interrupt;
use crate::output::{counted, say};

/// Looks after helpers in other processes.
pub fn run(command: &HelperCommand, launcher: &Launcher) -> Result<Ended> {
    match command {
        HelperCommand::Check(arguments) => checked(arguments, launcher),
        HelperCommand::Serve(arguments) => served(arguments),
    }
}

fn checked(arguments: &HelperCheckArguments, launcher: &Launcher) -> Result<Ended> {
    let stop = interrupt::stop_flag().context("can't listen for Ctrl-C")?;
    let mut command = arguments.exec.command("exec", &arguments.line);
    arguments.exec.confine(&mut command, launcher, &[])?;
    let command = Arc::new(command);
    let mut printed = Ok(());
    let mut print = |check: &Check| {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        let line = match &check.kept {
            Ok(()) => format!("ok      {}\n", check.promise),
            Err(problem) => format!("FAILED  {}\n        {problem}\n", check.promise),
        };
        if printed.is_ok() {
            printed = say(&line);
        }
    };
    let checks = check(&command, stop, &mut print);
    printed?;
    if stop.load(Ordering::Relaxed) {
        return Ok(Ended::Interrupted);
    }
    let n_broken = checks.iter().filter(|c| c.kept.is_err()).count();
    if n_broken == 0 {
        say("It keeps to the protocol.\n")?;
        return Ok(Ended::Well);
    }
    say(&format!("{} not kept.\n", counted(n_broken, "promise")))?;
    Ok(Ended::WithFindings)
}

fn served(arguments: &HelperServeArguments) -> Result<Ended> {
    let rules = RuleSet::named(arguments.rules).planner;
    let helper = find(&BuiltIn, &arguments.name, rules)?;
    let mut helper = helper
        .with_context(|| format!("nobody serves; name one of {}", BuiltIn.names().join(", ")))?;
    let name = format!("chaic {} {}", chaic_env::CHAIC_VERSION, arguments.name);
    serve(&name, helper.mind.as_mut(), &mut stdin().lock(), &mut stdout().lock())
        .context("standard input and output")?;
    Ok(Ended::Well)
}
