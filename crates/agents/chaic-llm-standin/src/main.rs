//! Starts a stand-in for a language model's endpoint on this machine, to try the pipeline with. Its
//! scores are not a language model's.

use std::process::ExitCode;
use std::time::Duration;

use chaic_llm_standin::faults::FaultKind;
use chaic_llm_standin::{Options, StandIn};
use clap::Parser;

/// A scripted stand-in for a language model's endpoint. Scores reached with it are NOT a language
/// model's, and say nothing of any.
#[derive(Debug, Parser)]
#[command(name = "chaic-llm-standin", version)]
struct Arguments {
    /// The port on this machine.
    #[arg(long, default_value_t = 8808)]
    port: u16,
    /// How long each answer takes, milliseconds.
    #[arg(long, default_value_t = 0)]
    latency_ms: u64,
    /// A way to fail, and how often, for example 429=0.3; may be given often.
    #[arg(long, value_name = "KIND=RATE", value_parser = fault)]
    fault: Vec<(FaultKind, f64)>,
    /// How long it stalls where it fails by being slow, milliseconds.
    #[arg(long, default_value_t = 200_000)]
    stall_ms: u64,
    /// Which requests fail.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Refuse JSON schemas, as some servers do.
    #[arg(long)]
    refuse_schema: bool,
}

fn fault(text: &str) -> Result<(FaultKind, f64), String> {
    let (kind, rate) = text.split_once('=').ok_or("write KIND=RATE, for example 429=0.3")?;
    let rate: f64 = rate.parse().map_err(|_| format!("no rate `{rate}`; write 0 to 1"))?;
    if !(0.0..=1.0).contains(&rate) {
        return Err(format!("no rate `{rate}`; write 0 to 1"));
    }
    Ok((kind.parse()?, rate))
}

fn main() -> ExitCode {
    let Arguments { port, latency_ms, fault, stall_ms, seed, refuse_schema } = Arguments::parse();
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
                "a stand-in, not a language model, answers at {url}\n\
                 try: chaic eval --task no_constraint --first 1 --helper none,llm \
                 --endpoint {url} --model standin",
                url = standin.url()
            );
            standin.serve();
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: can't listen on port {port}: {error}; choose another by --port");
            ExitCode::FAILURE
        }
    }
}
