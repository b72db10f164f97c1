//! Runs a shell command in the sandbox: `cargo run -p chaic-sandbox --example sandbox -- 'id; ls
//! /'`. `--probe` prints the enforced parts; `--bench N` measures N starts, in milliseconds.

use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

use chaic_sandbox::{Launcher, Policy, run_stage};

fn main() -> ExitCode {
    if let Some(status) = run_stage(std::env::args_os()) {
        return status.into();
    }
    let mut policy = Policy {
        start_folder: std::env::current_dir().expect("there is a current folder"),
        readable: Vec::new(),
        masked: Vec::new(),
        memory_mib: 1024,
        scratch_mib: 128,
        max_tasks: 256,
    };
    let launcher = Launcher::this_program();
    let isolation = launcher.probe(&policy).expect("the program starts");
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [flag] if flag == "--probe" => {
            println!("{isolation}: {isolation:?}");
            ExitCode::SUCCESS
        }
        [flag, n] if flag == "--bench" => {
            let n: u32 = n.parse().expect("a number");
            let time = |new_command: &dyn Fn() -> Command| {
                let start = Instant::now();
                for _ in 0..n {
                    new_command().stdin(Stdio::null()).status().expect("the command starts");
                }
                start.elapsed().as_secs_f64() * 1000.0 / f64::from(n)
            };
            let plain = || {
                let mut shell = Command::new("sh");
                shell.args(["-c", "true"]);
                shell
            };
            println!("plain shell: {:.2} ms", time(&plain));
            println!("sandbox: {:.2} ms", time(&|| launcher.command(&policy, &isolation, "true")));
            ExitCode::SUCCESS
        }
        [line] => {
            policy.add_from_command_line(line);
            let status = launcher.command(&policy, &isolation, line).status();
            let code = status.expect("the program starts").code();
            u8::try_from(code.unwrap_or(1)).unwrap_or(1).into()
        }
        _ => {
            eprintln!("name one shell command, --probe or --bench N");
            ExitCode::from(2)
        }
    }
}
