//! Runs attacks against a caller with secrets, in and out of the sandbox.

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

/// Attacks that fail without a sandbox too, since the outer stage watches trusted commands and passes
/// neither descriptors nor unknown variables on; or since they need something of the machine.
const FAIL_ANYWAY: &[&str] = &[
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
/// Attacks whose success without a sandbox depends on the machine: its kernel's options, disks and settings.
const DEPEND_ON_MACHINE: &[&str] = &[
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
/// The environment variable that holds a key.
const KEY: &str = "CHAIC_TEST_API_KEY";
/// An attack may take this long.
const TIME_LIMIT: Duration = Duration::from_secs(60);
/// What a command that is asked to end may take.
const END_LIMIT: Duration = Duration::from_secs(5);

/// Runs all attacks whose names contain one of the arguments.
pub fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first().map(String::as_str) {
        Some("--tell") => {
            println!("told");
            ExitCode::SUCCESS
        }
        Some("--attacked") => attacked(&arguments[1..]),
        _ => {
            // Once more, with a secret in the environment.
            let names = arguments.iter().filter(|a| !a.starts_with('-'));
            let secret = format!("secret-{}", std::process::id());
            let mut again = Command::new("/proc/self/exe");
            again.arg("--attacked").args(names).env(KEY, secret);
            let status = again.status().expect("this program starts");
            ExitCode::from(status.code().and_then(|c| u8::try_from(c).ok()).unwrap_or(1))
        }
    }
}

fn attacked(names: &[String]) -> ExitCode {
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
        let depends = DEPEND_ON_MACHINE.contains(&name) || (attack.needs_root && !is_root);
        if !depends && trusted == FAIL_ANYWAY.contains(&name) {
            wrong.push(format!("{name} {} with trust", word(trusted)));
        }
    }
    wrong.extend(undocumented());
    if let Isolation::Sandboxed(missing) = &isolation
        && !missing.is_empty()
    {
        // The suite speaks for a whole sandbox. Where a part is missing, no promise is kept or broken.
        println!("NOT JUDGED: this system has a {isolation}");
        return ExitCode::SUCCESS;
    }
    wrong.iter().for_each(|problem| println!("FAILED: {problem}"));
    if wrong.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Returns attacks without a row in docs/threat-model.md, and rows without an attack.
fn undocumented() -> Vec<String> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../docs/threat-model.md");
    let page = fs::read_to_string(page).expect("the page is there");
    let row = |attack: &Attack| format!("| `{}` | {} |", attack.name, attack.aim);
    let missing = ATTACKS.iter().filter(|attack| !page.contains(&row(attack)));
    let mut wrong: Vec<String> = missing.map(|a| format!("no row for {}", a.name)).collect();
    let is_row = |line: &&str| line.ends_with("| succeeds |") || line.ends_with("| fails |");
    if page.lines().filter(is_row).count() != ATTACKS.len() {
        wrong.push("docs/threat-model.md has rows without an attack".to_owned());
    }
    wrong
}

/// A caller with secrets, and everything that an attack may aim at.
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
        for file in ["run/secret", "home/notes"] {
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
        let open = fs::File::open(at("run/secret")).expect("it is there");
        // Without the flag that closes it on exec.
        let inherited = rustix::io::dup(&open).expect("there are descriptors");
        let mut policy = Policy {
            start_folder: at("start"),
            readable: vec![at("readable")],
            masked: vec![at("run")],
            memory_mib: 192,
            scratch_mib: 48,
            max_tasks: 64,
        };
        policy.add_named_by("python3");
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
        await_word(&mut other, "READY");
        let mut child = self.start(isolation, attack.script, &survivor);
        if attack.proof == Proof::Unstoppable {
            await_word(&mut child, "READY");
            terminate(&child);
            let is_stuck = !ends(&mut child, END_LIMIT);
            end(child);
            end(other);
            return is_stuck;
        }
        let is_late = !ends(&mut child, TIME_LIMIT);
        let mut said = String::new();
        if is_late {
            terminate(&child);
        }
        let mut out = child.stdout.take().expect("it is piped");
        out.read_to_string(&mut said).expect("it says text");
        end(child);
        end(other);
        let _ = fs::remove_file("/tmp/of-another");
        match attack.proof {
            Proof::Word => said.contains("SUCCESS"),
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
        let mut stdin = child.stdin.take().expect("it is piped");
        // A command that has ended already reads nothing.
        let _ = stdin.write_all(text.as_bytes());
        child
    }

    /// The caller's files with their contents, in order.
    fn files(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let mut files = Vec::new();
        for folder in ["run", "start", "readable", "home"] {
            for entry in fs::read_dir(self.at(folder)).expect("it is there") {
                let path = entry.expect("it is there").path();
                if path.is_file() && !path.is_symlink() && !path.ends_with("hard") {
                    files.push((path.clone(), fs::read(&path).expect("it is there")));
                }
            }
        }
        files.sort();
        let left = [self.at("start/link"), self.at("start/hard"), self.at("start/mem")];
        left.iter().for_each(|path| drop(fs::remove_file(path)));
        files
    }
}

fn await_word(child: &mut Child, word: &str) {
    let mut line = String::new();
    let out = child.stdout.as_mut().expect("it is piped");
    BufReader::new(out).read_line(&mut line).expect("it says text");
    assert_eq!(line.trim(), word);
}

fn terminate(child: &Child) {
    let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw).expect("it has a number");
    let _ = kill_process(pid, Signal::TERM);
}

/// Waits for a process; returns whether it has ended in time.
fn ends(child: &mut Child, within: Duration) -> bool {
    let began = Instant::now();
    while began.elapsed() < within {
        if child.try_wait().expect("it is a child").is_some() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    false
}

/// Ends a process, by force if it must be.
fn end(mut child: Child) {
    terminate(&child);
    if !ends(&mut child, END_LIMIT) {
        let _ = child.kill();
    }
    let _ = child.wait();
}

/// Returns whether a process with this argument is left for a second, and ends it.
fn survives(argument: &str) -> bool {
    let found = || -> Option<Pid> {
        let entries = fs::read_dir("/proc").expect("it is there").flatten();
        let mut pids = entries.filter_map(|e| e.file_name().to_str()?.parse::<i32>().ok());
        pids.find(|pid| {
            let line = fs::read(Path::new("/proc").join(pid.to_string()).join("cmdline"));
            let words = line.unwrap_or_default();
            words.split(|b| *b == 0).any(|word| word == argument.as_bytes())
                && words.starts_with(b"sleep")
        })
        .and_then(Pid::from_raw)
    };
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(1) {
        if found().is_none() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let _ = found().map(|pid| kill_process(pid, Signal::KILL));
    true
}
