//! Compares the world with the reference over many random joint actions, and prints counts.

use std::process::ExitCode;

use clap::Parser;

#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    /// Number of joint actions, 1 to 1000000000.
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    joint_actions: u64,
    /// Index of the first episode, 0 to 1000000000.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=1_000_000_000))]
    first: u64,
}

fn main() -> ExitCode {
    let Arguments { joint_actions, first } = Arguments::parse();
    match chaic_reference::play_many(first, joint_actions) {
        Ok(coverage) => {
            println!("{coverage}");
            ExitCode::SUCCESS
        }
        Err(difference) => {
            eprintln!("error: the reference and the world differ in {difference}");
            ExitCode::FAILURE
        }
    }
}
