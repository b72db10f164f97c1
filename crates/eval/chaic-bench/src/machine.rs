//! Machine and build of a measurement.

use serde::Serialize;

/// Machine and build.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Name of the CPU; empty if unknown.
    pub cpu: String,
    /// Number of threads that run at a time.
    pub cores: usize,
    /// Operating system and architecture.
    pub platform: String,
    /// Instruction set extensions that the program was compiled for.
    pub target_features: Vec<&'static str>,
    /// Instruction set extensions of the CPU.
    pub cpu_features: Vec<&'static str>,
    /// Version of the program.
    pub chaic: &'static str,
    /// True for an optimized build.
    pub optimized: bool,
}

impl Machine {
    /// Returns the current machine and build.
    pub fn current() -> Machine {
        Machine {
            cpu: cpu_name(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            platform: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            target_features: target_features(),
            cpu_features: cpu_features(),
            chaic: chaic_env::CHAIC_VERSION,
            optimized: !cfg!(debug_assertions),
        }
    }
}

/// Reads the CPU name on Linux; other systems return an empty name.
fn cpu_name() -> String {
    let Ok(text) = std::fs::read_to_string("/proc/cpuinfo") else { return String::new() };
    let line = text.lines().find(|l| l.starts_with("model name"));
    line.and_then(|l| l.split_once(':')).map_or(String::new(), |(_, name)| name.trim().to_owned())
}

macro_rules! enabled_features {
    ($($feature:literal),*) => {{
        let all = [$(($feature, cfg!(target_feature = $feature))),*];
        all.into_iter().filter(|(_, has)| *has).map(|(name, _)| name).collect()
    }};
}

fn target_features() -> Vec<&'static str> {
    enabled_features!("sse4.2", "avx", "avx2", "fma", "avx512f", "neon", "sve")
}

#[cfg(target_arch = "x86_64")]
fn cpu_features() -> Vec<&'static str> {
    let all = [
        ("sse4.2", is_x86_feature_detected!("sse4.2")),
        ("avx", is_x86_feature_detected!("avx")),
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
    ];
    all.into_iter().filter(|(_, has)| *has).map(|(name, _)| name).collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn cpu_features() -> Vec<&'static str> {
    target_features()
}
