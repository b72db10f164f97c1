//! What a figure was measured on.

use serde::Serialize;

/// The machine and the build.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// The processor's name; empty where the system doesn't tell.
    pub cpu: String,
    /// How many threads it runs at a time.
    pub cores: usize,
    /// Operating system and architecture.
    pub platform: String,
    /// Which of the instructions beyond the architecture's least the program was built for.
    pub target_features: Vec<&'static str>,
    /// Which of these the processor has.
    pub cpu_features: Vec<&'static str>,
    /// Version of the program.
    pub chaic: &'static str,
    /// Whether it is an optimized build.
    pub optimized: bool,
}

impl Machine {
    /// This one.
    pub fn this() -> Machine {
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

/// Linux tells it in a file; elsewhere it stays unknown.
fn cpu_name() -> String {
    let Ok(text) = std::fs::read_to_string("/proc/cpuinfo") else { return String::new() };
    let line = text.lines().find(|l| l.starts_with("model name"));
    line.and_then(|l| l.split_once(':')).map_or(String::new(), |(_, name)| name.trim().to_owned())
}

macro_rules! built_for {
    ($($feature:literal),*) => {{
        let all = [$(($feature, cfg!(target_feature = $feature))),*];
        all.into_iter().filter(|(_, has)| *has).map(|(name, _)| name).collect()
    }};
}

fn target_features() -> Vec<&'static str> {
    built_for!("sse4.2", "avx", "avx2", "fma", "avx512f", "neon", "sve")
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
