//! Memory, descriptors and threads of this process, from `/proc`. Zero on other systems than Linux.

use std::fs;

/// Returns a value of `/proc/self/status`.
fn status(name: &str) -> u64 {
    let text = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let value = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
    let number = value.and_then(|value| value.split_whitespace().next()?.parse().ok());
    number.unwrap_or_default()
}

/// Returns the memory in use, KiB.
pub fn memory_kib() -> u64 {
    status("VmRSS")
}

/// Returns the most memory in use since the last [`reset_peak_memory`], KiB.
pub fn peak_memory_kib() -> u64 {
    status("VmHWM")
}

/// Restarts the measurement of [`peak_memory_kib`].
pub fn reset_peak_memory() {
    // Without this file the peak is that of the whole process.
    let _ = fs::write("/proc/self/clear_refs", "5");
}

/// Returns the number of threads.
pub fn threads() -> u64 {
    status("Threads")
}

/// Returns the number of open descriptors.
pub fn descriptors() -> u64 {
    let entries = fs::read_dir("/proc/self/fd").into_iter().flatten();
    // One of them is the folder itself.
    (entries.count() as u64).saturating_sub(1)
}
