//! Runs attacks against a caller with secrets, with and without the sandbox.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, UdpSocket};
use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::net::{SocketAddr, UnixListener};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use chaic_sandbox::{Isolation, Launcher, Policy};
use rustix::process::{Pid, Signal, kill_process};

use super::list::{ATTACKS, Attack, PRELUDE, Proof};

/// Attacks that also fail without a sandbox: the outer stage monitors trusted commands and passes
/// neither descriptors nor unknown variables on, or the attack depends on the machine.
const ALSO_FAIL_WITHOUT_SANDBOX: &[&str] = &[
    "inherit-descriptors",
    "own-environment",
    "outlive",
    "outlive-kill",
    "endless-loop",
    "fork-bomb",
    "thread-bomb",
    "memory-map",
    "reserve-100-gib",
    "memory-of-children",
    "memory-shared",
];
/// Attacks whose success without a sandbox depends on the machine: kernel options, disks and
/// settings.
const MACHINE_DEPENDENT: &[&str] = &[
    "read-disk",
    "read-kernel-log",
    "make-control-group",
    "use-io-uring",
    "new-user-namespace",
    "clone-namespace",
    "enter-namespace",
    "load-bpf",
    "use-keyring",
    "handle-of-file",
    "change-kernel-settings",
    "read-passwords",
    "run-first-program",
    "read-through-proc-root",
    "raw-socket",
];
/// Environment variable with a key.
const KEY: &str = "CHAIC_TEST_API_KEY";
/// Maximum duration of an attack.
const TIME_LIMIT: Duration = Duration::from_secs(60);
/// Maximum duration of the end of a command after SIGTERM.
const END_LIMIT: Duration = Duration::from_secs(5);

/// Runs all attacks whose names contain one of the arguments.
pub fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first().map(String::as_str) {
        Some("--print-goal") => {
            println!("GOAL");
            ExitCode::SUCCESS
        }
        Some("--attacked") => run_attacks(&arguments[1..]),
        _ => {
            // Starts the program again with a secret in the environment.
            let names = arguments.iter().filter(|a| !a.starts_with('-'));
            let secret = format!("secret-{}", std::process::id());
            let mut command = Command::new("/proc/self/exe");
            command.arg("--attacked").args(names).env(KEY, secret);
            let status = command.status().expect("this program starts");
            ExitCode::from(status.code().and_then(|c| u8::try_from(c).ok()).unwrap_or(1))
        }
    }
}

fn run_attacks(names: &[String]) -> ExitCode {
    let target = Target::new();
    let isolation = target.launcher.probe(&target.policy).expect("the stages start");
    println!("isolation: {isolation:?}");
    let is_root = rustix::process::getuid().is_root();
    let mut wrong = Vec::new();
    for attack in ATTACKS {
        if !names.is_empty() && !names.iter().any(|name| attack.name.contains(name.as_str())) {
            continue;
        }
        let confined = target.try_attack(attack, &isolation);
        let trusted = target.try_attack(attack, &Isolation::Trusted);
        let word = |succeeds| if succeeds { "succeeds" } else { "fails" };
        let (name, aim) = (attack.name, attack.aim);
        println!("{name:24} sandbox {:9} trusted {:9} {aim}", word(confined), word(trusted));
        if confined {
            wrong.push(format!("{name} succeeds in the sandbox"));
        }
        let is_machine_dependent =
            MACHINE_DEPENDENT.contains(&name) || (attack.needs_root && !is_root);
        if !is_machine_dependent && trusted == ALSO_FAIL_WITHOUT_SANDBOX.contains(&name) {
            wrong.push(format!("{name} {} with trust", word(trusted)));
        }
    }
    wrong.extend(undocumented());
    if let Isolation::Sandboxed(missing) = &isolation
        && !missing.is_empty()
    {
        // The suite tests a complete sandbox. If a part is missing, there is no verdict.
        println!("NOT JUDGED: this system has a {isolation}");
        return ExitCode::SUCCESS;
    }
    wrong.iter().for_each(|problem| println!("FAILED: {problem}"));
    if wrong.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Returns attacks without a row in docs/threat-model.md, and rows without an attack.
fn undocumented() -> Vec<String> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../docs/threat-model.md");
    let page = fs::read_to_string(page).expect("the page exists");
    let row = |attack: &Attack| format!("| `{}` | {} |", attack.name, attack.aim);
    let missing = ATTACKS.iter().filter(|attack| !page.contains(&row(attack)));
    let mut wrong: Vec<String> = missing.map(|a| format!("no row for {}", a.name)).collect();
    let is_row = |line: &&str| line.ends_with("| succeeds |") || line.ends_with("| fails |");
    if page.lines().filter(is_row).count() != ATTACKS.len() {
        wrong.push("docs/threat-model.md has rows without an attack".to_owned());
    }
    wrong
}

/// A caller with secrets and other targets of attacks.
struct Target {
    launcher: Launcher,
    policy: Policy,
    top: tempfile::TempDir,
    secret: String,
    port: u16,
    _held: (TcpListener, UdpSocket, UnixListener, UnixListener, fs::File, std::os::fd::OwnedFd),
}

impl Target {
    fn new() -> Target {
        let secret = std::env::var(KEY).expect("the first process sets it");
        let top = tempfile::tempdir_in(std::env::temp_dir()).expect("there is room");
        let at = |name: &str| top.path().join(name);
        for folder in ["run", "start", "readable", "home"] {
            fs::create_dir(at(folder)).expect("there is room");
        }
        for file in ["run/secret", "home/notes", "readable/answers"] {
            fs::write(at(file), &secret).expect("there is room");
        }
        fs::write(at("readable/program.py"), "print(1)").expect("there is room");
        fs::write(at("run/results"), "{}").expect("there is room");
        let tcp = TcpListener::bind("127.0.0.1:0").expect("there is a port");
        let port = tcp.local_addr().expect("it is bound").port();
        let udp = UdpSocket::bind(("127.0.0.1", port)).expect("the port is free");
        let local = UnixListener::bind(at("run/socket")).expect("there is room");
        let name = SocketAddr::from_abstract_name(&secret).expect("it is short");
        let hidden = UnixListener::bind_addr(&name).expect("the name is free");
        let open = fs::File::open(at("run/secret")).expect("the entry exists");
        // A descriptor without the close-on-exec flag.
        let inherited = rustix::io::dup(&open).expect("there are descriptors");
        let mut policy = Policy {
            start_folder: at("start"),
            readable: vec![at("readable")],
            masked: vec![at("run"), at("readable/answers")],
            memory_mib: 192,
            scratch_mib: 48,
            max_tasks: 64,
        };
        policy.add_from_command_line("python3");
        let launcher = Launcher::this_program();
        let held = (tcp, udp, local, hidden, open, inherited);
        Target { launcher, policy, top, secret, port, _held: held }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.top.path().join(name)
    }

    /// Runs an attack; returns whether it succeeds.
    fn try_attack(&self, attack: &Attack, isolation: &Isolation) -> bool {
        let before = self.files();
        let survivor =
            format!("9753{}.25", ATTACKS.iter().position(|a| a.name == attack.name).unwrap_or(0));
        let mut other = self.start(isolation, "open('/tmp/of-another', 'w').write(SECRET)\nprint('READY', flush=True)\ntime.sleep(60)", "");
        wait_for_line(&mut other, "READY");
        let mut child = self.start(isolation, attack.script, &survivor);
        if attack.proof == Proof::Unstoppable {
            wait_for_line(&mut child, "READY");
            terminate(&child);
            let is_stuck = !ends_within(&mut child, END_LIMIT);
            terminate_or_kill(child);
            terminate_or_kill(other);
            return is_stuck;
        }
        let is_late = !ends_within(&mut child, TIME_LIMIT);
        let mut output = String::new();
        if is_late {
            terminate(&child);
        }
        let mut out = child.stdout.take().expect("the stream is piped");
        out.read_to_string(&mut output).expect("the output is text");
        terminate_or_kill(child);
        terminate_or_kill(other);
        let _ = fs::remove_file("/tmp/of-another");
        match attack.proof {
            Proof::Word => output.contains("SUCCESS"),
            Proof::Files => {
                let is_changed = self.files() != before;
                let _ = fs::remove_file(self.at("start/left"));
                fs::write(self.at("readable/program.py"), "print(1)").expect("there is room");
                fs::write(self.at("run/results"), "{}").expect("there is room");
                is_changed
            }
            Proof::Survivor => survives(&survivor),
            Proof::Unstoppable => is_late,
        }
    }

    fn start(&self, isolation: &Isolation, script: &str, survivor: &str) -> Child {
        let values = [
            ("RUN", self.at("run").display().to_string()),
            ("READABLE", self.at("readable").display().to_string()),
            ("HOME_FILE", self.at("home/notes").display().to_string()),
            ("SECRET", self.secret.clone()),
            ("ABSTRACT", self.secret.clone()),
            ("NAME", "--attacked".to_owned()),
            ("SURVIVOR", survivor.to_owned()),
        ];
        let mut text = PRELUDE.to_owned();
        for (name, value) in values {
            text += &format!("{name} = {value:?}\n");
        }
        text +=
            &format!("PORT = {}\nCALLER = {}\nOWN = os.getcwd()\n", self.port, std::process::id());
        text += script;
        let mut command = self.launcher.command(&self.policy, isolation, "exec python3 -");
        command.current_dir(self.at("start")).env_clear();
        command.envs(std::env::vars_os().filter(|(name, _)| name == "PATH"));
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().expect("the stage starts");
        let mut stdin = child.stdin.take().expect("the stream is piped");
        // A command that has already ended does not read it.
        let _ = stdin.write_all(text.as_bytes());
        child
    }

    /// Returns the caller's files with their contents, in order.
    fn files(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let mut files = Vec::new();
        for folder in ["run", "start", "readable", "home"] {
            for entry in fs::read_dir(self.at(folder)).expect("the entry exists") {
                let path = entry.expect("the entry exists").path();
                if path.is_file() && !path.is_symlink() && !path.ends_with("hard") {
                    files.push((path.clone(), fs::read(&path).expect("the entry exists")));
                }
            }
        }
        files.sort();
        let leftovers = [self.at("start/link"), self.at("start/hard"), self.at("start/mem")];
        leftovers.iter().for_each(|path| drop(fs::remove_file(path)));
        files
    }
}

fn wait_for_line(child: &mut Child, word: &str) {
    let mut line = String::new();
    let out = child.stdout.as_mut().expect("the stream is piped");
    BufReader::new(out).read_line(&mut line).expect("the output is text");
    assert_eq!(line.trim(), word);
}

fn terminate(child: &Child) {
    let pid =
        i32::try_from(child.id()).ok().and_then(Pid::from_raw).expect("the process id is valid");
    let _ = kill_process(pid, Signal::TERM);
}

/// Waits for a process; returns whether it has ended in time.
fn ends_within(child: &mut Child, limit: Duration) -> bool {
    let start = Instant::now();
    while start.elapsed() < limit {
        if child.try_wait().expect("it is a child").is_some() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    false
}

/// Terminates a process, and kills it after the time limit.
fn terminate_or_kill(mut child: Child) {
    terminate(&child);
    if !ends_within(&mut child, END_LIMIT) {
        let _ = child.kill();
    }
    let _ = child.wait();
}

/// Returns whether a process with this argument remains for a second, and kills it.
fn survives(argument: &str) -> bool {
    let found = || -> Option<Pid> {
        let entries = fs::read_dir("/proc").expect("the entry exists").flatten();
        let mut pids = entries.filter_map(|e| e.file_name().to_str()?.parse::<i32>().ok());
        pids.find(|pid| {
            let line = fs::read(Path::new("/proc").join(pid.to_string()).join("cmdline"));
            let words = line.unwrap_or_default();
            words.split(|b| *b == 0).any(|word| word == argument.as_bytes())
                && words.starts_with(b"sleep")
        })
        .and_then(Pid::from_raw)
    };
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(1) {
        if found().is_none() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let _ = found().map(|pid| kill_process(pid, Signal::KILL));
    true
}
