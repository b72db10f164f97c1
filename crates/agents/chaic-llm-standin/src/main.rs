//! Starts a scripted server in place of a language model endpoint, for tests of the pipeline. Its
//! scores are not those of a language model.

use std::process::ExitCode;
use std::time::Duration;

use chaic_llm_standin::faults::{FaultKind, check_rates};
use chaic_llm_standin::{Options, StandIn};
use clap::Parser;

/// Exit code of an invalid request, as of the parser of the command line.
const USAGE: u8 = 2;

/// A scripted server in place of a language model endpoint. Scores reached with it are NOT those of
/// a language model.
#[derive(Debug, Parser)]
#[command(name = "chaic-llm-standin", version)]
struct Arguments {
    /// Local port.
    #[arg(long, default_value_t = 8808)]
    port: u16,
    /// Time per response, milliseconds.
    #[arg(long, default_value_t = 0)]
    latency_ms: u64,
    /// Fault kind and its rate, for example 429=0.3; can be repeated. All rates together are at
    /// most 1. Kinds: refused, reset, timeout, slow-drip, 429-with-wait, 429, 500, 503, empty,
    /// truncated, wrong-schema, plan-not-listed, huge, invalid-utf8.
    #[arg(long, value_name = "KIND=RATE", value_parser = fault)]
    fault: Vec<(FaultKind, f64)>,
    /// Delay of timeout and slow-drip faults, milliseconds.
    #[arg(long, default_value_t = 200_000)]
    stall_ms: u64,
    /// Seed that selects the requests that fail.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Reject JSON schemas, as some servers do.
    #[arg(long)]
    refuse_schema: bool,
}

fn fault(text: &str) -> Result<(FaultKind, f64), String> {
    let (kind, rate) = text.split_once('=').ok_or("write KIND=RATE, for example 429=0.3")?;
    let rate: f64 = rate.parse().map_err(|_| format!("invalid rate `{rate}`; write 0 to 1"))?;
    if !(0.0..=1.0).contains(&rate) {
        return Err(format!("invalid rate `{rate}`; write 0 to 1"));
    }
    Ok((kind.parse()?, rate))
}

fn main() -> ExitCode {
    let Arguments { port, latency_ms, fault, stall_ms, seed, refuse_schema } = Arguments::parse();
    if let Err(problem) = check_rates(&fault) {
        eprintln!("error: {problem}");
        return ExitCode::from(USAGE);
    }
    let options = Options {
        port,
        faults: fault,
        seed,
        latency: Duration::from_millis(latency_ms),
        stall: Duration::from_millis(stall_ms),
        refuses_schema: refuse_schema,
        ..Options::default()
    };
    match StandIn::start(options) {
        Ok(standin) => {
            println!(
                "a stand-in (not a language model) listens at {url}\n\
                 try: chaic eval --task no_constraint --n-episodes 1 --helper none,llm \
                 --endpoint {url} --model standin",
                url = standin.url()
            );
            standin.serve();
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: can't listen on port {port}: {error}; choose another with --port");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_help_lists_all_kinds_of_faults() {
        let help = Arguments::command().render_long_help().to_string();
        let words: Vec<&str> =
            help.split(|c: char| c.is_whitespace() || ",.".contains(c)).collect();
        for kind in FaultKind::ALL {
            assert!(words.contains(&kind.name()), "{}: {help}", kind.name());
        }
    }
}
