//! Memory and tasks of a process and its descendants, from `/proc`.

use std::fs;

use rustix::process::Pid;

/// Sums over processes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Usage {
    /// Anonymous and shared memory in use, KiB. Shared pages count once for each process.
    pub memory_kib: u64,
    /// Number of processes and threads.
    pub tasks: u64,
}

/// Maximum number of listed processes; a larger fork bomb exceeds the task limit anyway.
const MAX_LISTED: usize = 100_000;

/// Returns the memory and tasks of a process and all of its descendants.
pub(super) fn usage(pid: Pid) -> Usage {
    let mut sum = Usage::default();
    for pid in descendants(pid).into_iter().chain([pid]) {
        // A process that has just ended uses nothing.
        let text = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
        let field = |name: &str| -> u64 {
            let line = text.lines().find_map(|line| line.strip_prefix(name));
            let number = line.and_then(|rest| rest.split_whitespace().next());
            number.and_then(|n| n.parse().ok()).unwrap_or(0)
        };
        sum.memory_kib += field("RssAnon:") + field("RssShmem:") + field("VmSwap:");
        sum.tasks += field("Threads:");
    }
    sum
}

/// Returns the descendants of a process, without the process itself.
pub(super) fn descendants(pid: Pid) -> Vec<Pid> {
    let mut found = Vec::new();
    let mut open = vec![pid];
    while let Some(pid) = open.pop() {
        let children = children(pid);
        open.extend(&children);
        found.extend(children);
        if found.len() > MAX_LISTED {
            break;
        }
    }
    found
}

fn children(pid: Pid) -> Vec<Pid> {
    let tasks = fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
    let texts = tasks.filter_map(|task| fs::read_to_string(task.path().join("children")).ok());
    let numbers = |text: String| -> Vec<Pid> {
        text.split_whitespace().filter_map(|n| Pid::from_raw(n.parse().ok()?)).collect()
    };
    texts.flat_map(numbers).collect()
}

/// Returns whether the kernel lists children in `/proc`.
pub(super) fn is_available() -> bool {
    let pid = std::process::id();
    fs::exists(format!("/proc/{pid}/task/{pid}/children")).unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn usage_includes_grandchildren() {
        let script = "sh -c 'sleep 100 & sleep 100; true' & wait";
        let mut child = Command::new("sh").args(["-c", script]).spawn().unwrap();
        let pid = Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap();
        let deadline = std::time::Instant::now() + std::time::Duration::from_secs(20);
        while descendants(pid).len() < 3 && std::time::Instant::now() < deadline {
            std::thread::yield_now();
        }
        let found = descendants(pid);
        let used = usage(pid);
        for pid in &found {
            rustix::process::kill_process(*pid, rustix::process::Signal::KILL).unwrap();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(found.len(), 3);
        assert_eq!(used.tasks, 4);
        assert!(used.memory_kib > 0);
    }
}
