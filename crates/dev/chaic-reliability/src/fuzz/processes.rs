//! Fuzzing of several parsers in parallel, each in its own process, so that the measured memory is that of
//! one parser.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

use anyhow::{Context as _, Result};

use super::targets::Target;
use super::{FuzzOptions, HEAD};

/// Fuzzes the parsers and prints their rows in order; returns whether all promises hold.
///
/// # Errors
/// If a process cannot be started.
pub fn run(targets: &[&Target], options: &FuzzOptions) -> Result<bool> {
    let program = &std::env::current_exe().context("can't find this program")?;
    let next = &AtomicUsize::new(0);
    let (sender, receiver) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..options.jobs {
            let sender = sender.clone();
            scope.spawn(move || {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    let Some(target) = targets.get(k) else { break };
                    let output = command(program, target.name, options).output();
                    if sender.send((k, output)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let (mut finished, mut n_printed, mut is_ok) = (BTreeMap::new(), 0_usize, true);
        for (k, output) in receiver {
            finished.insert(k, output.context("can't start this program")?);
            while let Some(output) = finished.remove(&n_printed) {
                is_ok &= print(targets[n_printed].name, &output);
                n_printed += 1;
            }
        }
        Ok(is_ok)
    })
}

/// Returns the command that fuzzes one parser.
fn command(program: &Path, target: &str, options: &FuzzOptions) -> Command {
    let FuzzOptions { seconds, inputs, seed, corpus, keep, .. } = options;
    let mut command = Command::new(program);
    command.args(["fuzz", target, "--seconds", &seconds.to_string()]);
    command.args(["--inputs", &inputs.to_string(), "--seed", &seed.to_string()]);
    command.args(keep.then_some("--keep")).arg("--corpus").arg(corpus).stdin(Stdio::null());
    command
}

/// Prints the row and the messages of the process of a parser; returns whether it succeeded.
fn print(name: &str, output: &Output) -> bool {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    eprint!("{}", text(&output.stderr));
    let table = text(&output.stdout);
    let rows: Vec<&str> = table.lines().skip(HEAD.lines().count()).collect();
    for row in &rows {
        println!("{row}");
    }
    if rows.is_empty() {
        eprintln!("{name}: the process ended without a row: {}", output.status);
    }
    output.status.success() && !rows.is_empty()
}
