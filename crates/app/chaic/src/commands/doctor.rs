//! `chaic doctor`: checks of the machine and of the program.

use std::path::Path;

use anyhow::Result;
use chaic_bench::Machine;
use chaic_sandbox::Launcher;
use chaic_subprocess::{Confinement, ConfinementOptions, Limits};
use chaic_vision::behavior::network::TrainedBehavior;
use chaic_vision::trained::TrainedDetector;
use serde_json::json;

use crate::exit::ExitStatus;
use crate::output::{OutputFormat, print_result};

/// Result of one check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Status {
    /// The check passed.
    Ok,
    /// Some command works with restrictions.
    Warning,
    /// Some command cannot work.
    Failed,
}

impl Status {
    fn name(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::Warning => "warning",
            Status::Failed => "FAILED",
        }
    }
}

/// One checked property.
struct Check {
    name: &'static str,
    status: Status,
    detail: String,
}

/// Prints the checks. The exit code is 1 if one failed; warnings do not count.
pub fn run(format: OutputFormat, launcher: &Launcher) -> Result<ExitStatus> {
    let machine = Machine::current();
    let mut checks = vec![program(&machine), processor(&machine), vector_instructions(&machine)];
    checks.extend([started_by(), gpu(), sandbox(launcher)]);
    checks.extend([detector(), behavior_network()]);
    checks.extend([
        writable("current folder", Path::new(".")),
        writable("temporary folder", &std::env::temp_dir()),
    ]);
    if Path::new("runs").exists() {
        checks.push(writable("runs folder", Path::new("runs")));
    }
    let is_failed = checks.iter().any(|check| check.status == Status::Failed);
    let record = |check: &Check| {
        let status = check.status.name().to_lowercase();
        json!({ "name": check.name, "status": status, "detail": check.detail })
    };
    let json = json!({
        "passed": !is_failed,
        "checks": checks.iter().map(record).collect::<Vec<_>>(),
        "machine": machine,
    });
    let line = |check: &Check| {
        let Check { name, status, detail } = check;
        format!("{:8} {name:20} {detail}\n", status.name())
    };
    let text: String = checks.iter().map(line).collect();
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(is_failed))
}

fn check(name: &'static str, status: Status, detail: impl Into<String>) -> Check {
    Check { name, status, detail: detail.into() }
}

fn program(machine: &Machine) -> Check {
    let version = format!("chaic {}, {}", machine.chaic, machine.platform);
    if machine.optimized {
        return check("program", Status::Ok, version + ", release build");
    }
    check("program", Status::Warning, version + ", debug build: several times slower")
}

fn processor(machine: &Machine) -> Check {
    let cpu = if machine.cpu.is_empty() { "unknown model" } else { &machine.cpu };
    check("processor", Status::Ok, format!("{cpu}, cores: {}", machine.cores))
}

fn vector_instructions(machine: &Machine) -> Check {
    let features = &machine.cpu_features;
    let is_slow = cfg!(target_arch = "x86_64") && !features.contains(&"avx2");
    let status = if is_slow { Status::Warning } else { Status::Ok };
    let detail = if features.is_empty() { "none".to_owned() } else { features.join(", ") };
    check("vector instructions", status, detail)
}

/// Checks whether the program or the Python package runs this command.
fn started_by() -> Check {
    let program = std::env::current_exe().ok();
    let name = program.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy());
    let is_python = name.is_some_and(|name| name.starts_with("python"));
    let detail =
        if is_python { "yes, this is the Python package" } else { "no, this is the program" };
    check("Python module", Status::Ok, detail)
}

fn gpu() -> Check {
    let detail = if cfg!(feature = "gpu") {
        "compiled in, for `chaic bench render --gpu`"
    } else {
        "not compiled in; images are rendered on the processor"
    };
    check("GPU renderer", Status::Ok, detail)
}

fn sandbox(launcher: &Launcher) -> Check {
    let options = ConfinementOptions::default();
    match Confinement::new(launcher, "true", &Limits::default(), &options) {
        Ok(confinement) => match confinement.warning() {
            None => check("sandbox", Status::Ok, confinement.isolation().to_string()),
            Some(missing) => {
                check("sandbox", Status::Warning, format!("helper processes run in {missing}"))
            }
        },
        Err(refusal) => check("sandbox", Status::Failed, refusal.to_string()),
    }
}

fn detector() -> Check {
    let digest = TrainedDetector::built_in().digest();
    check("detector weights", Status::Ok, format!("built in, digest {digest}"))
}

fn behavior_network() -> Check {
    let digest = TrainedBehavior::built_in().digest();
    check("behavior weights", Status::Ok, format!("built in, digest {digest}"))
}

/// Checks that a folder is writable by creating and removing a file.
fn writable(name: &'static str, folder: &Path) -> Check {
    let path = folder.join(format!(".chaic-doctor-{}", std::process::id()));
    let created = chaic_files::create_or_replace(&path).map(drop);
    let result = created.and_then(|()| chaic_files::remove_file(&path).map_err(|e| e.error));
    let shown = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    match result {
        Ok(()) => check(name, Status::Ok, format!("{} is writable", shown.display())),
        Err(e) => check(name, Status::Failed, format!("can't write to {}: {e}", shown.display())),
    }
}
