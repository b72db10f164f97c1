//! Promise: a mind in another process does as one within, and whatever else a process does ends its
//! own episode with a reason, in time, and leaves nothing running.

use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::Command as Shell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use chaic_agents::PlannerRules;
use chaic_core::observation::Grants;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, TaskId};
use chaic_env::minds::{BuiltIn, Helper, Helpers as _};
use chaic_env::rules::RuleSet;
use chaic_env::{Appearance, Env, EpisodeConfig, Flow};
use chaic_episodes::find_episode;
use chaic_subprocess::conformance::check;
use chaic_subprocess::frame::Frame;
use chaic_subprocess::serve::serve;
use chaic_subprocess::{Command, Commands, Limits, Pool, SubprocessAgent};

fn never() -> &'static AtomicBool {
    static NEVER: AtomicBool = AtomicBool::new(false);
    &NEVER
}

fn command(line: &str) -> Command {
    let limits = Limits {
        start: Duration::from_secs(20),
        decision: Duration::from_secs(20),
        ..Limits::default()
    };
    Command {
        name: "exec".to_owned(),
        line: line.to_owned(),
        grants: Grants::PLANNER,
        limits,
        environment: Vec::new(),
        confinement: None,
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(3).expect("the workspace")
}

fn python_helper() -> String {
    format!("python3 '{}'", root().join("examples/python_helper/helper.py").display())
}

/// A briefing of a real episode.
fn briefing(task: TaskId) -> Briefing {
    let episode = find_episode(&format!("{task}/train/01")).unwrap();
    let helper = BuiltIn.make("rhp", PlannerRules::paper());
    let env = Env::new(config(&episode), helper).unwrap();
    env.briefing(AgentId::HELPER)
}

fn config(episode: &chaic_episodes::Episode) -> EpisodeConfig<'_> {
    EpisodeConfig {
        episode,
        seed: 0,
        rules: RuleSet::PAPER,
        helper: "exec",
        partner: None,
        image_size: Some(64),
        appearance: Appearance::Canonical,
    }
}

/// What a mind does that is briefed and asked once; how it fails.
fn failure(command: Command) -> String {
    let mut mind = SubprocessAgent::new(Arc::new(command), never());
    mind.reset(&briefing(TaskId::NoConstraint));
    let episode = find_episode("no_constraint/train/01").unwrap();
    let helper = Some(Helper { mind: Box::new(mind), grants: Grants::PLANNER });
    // Briefed once more by the environment, and asked there.
    let mut env = Env::new(config(&episode), helper).unwrap();
    match env.advance(Some(100)) {
        Err(AgentError::Broken(text)) => text,
        other => panic!("{other:?}"),
    }
}

/// A shell that speaks the first two answers of the protocol and then does something else.
fn speaks_then(then: &str) -> String {
    let python = r#"
import sys, struct, json, time, os
def read():
    a, b = struct.unpack('<II', sys.stdin.buffer.read(8))
    sys.stdin.buffer.read(b + a)
def say(message):
    head = json.dumps(message).encode()
    sys.stdout.buffer.write(struct.pack('<II', len(head), 0) + head)
    sys.stdout.buffer.flush()
read(); say({'type': 'hello', 'protocol': 1, 'name': 'test'})
read(); say({'type': 'ready', 'senses': {'image_size': 64, 'rgb': True, 'depth': True, 'ids': True}})
read()
"#;
    format!("python3 -c \"{python}{then}\"")
}

/// The same, with a film of 256 images of this side.
fn filming(then: &str, film_size: u32) -> String {
    let film = format!("'film': {{'image_size': {film_size}, 'every_frames': 1, 'most': 256}}");
    speaks_then(then).replace("'ids': True", &format!("'ids': True, {film}"))
}

#[test]
fn an_observation_that_fits_no_message_is_refused_when_it_is_asked_for() {
    let failure = |line: &str, image_size: Option<u32>| {
        let command = Arc::new(command(line));
        let mind = Box::new(SubprocessAgent::new(command, never()));
        let helper = Some(Helper { mind, grants: Grants::PLANNER });
        let episode = find_episode("no_constraint/train/01").unwrap();
        let config = EpisodeConfig { image_size, ..config(&episode) };
        match Env::new(config, helper).unwrap().advance(Some(100)) {
            Err(AgentError::Broken(text)) => text,
            other => panic!("{other:?}"),
        }
    };
    let began = Instant::now();
    let text = failure(&filming("", 2048), None);
    for said in ["the helper asks for up to 7169 MiB", "at most 64 MiB", "smaller film images"] {
        assert!(text.contains(said), "{said}: {text}");
    }
    assert!(began.elapsed() < Duration::from_secs(20), "no film is taken");
    // Images of this size and the film fit alone, but not together.
    let large =
        filming("raise ValueError('asked')", 128).replace("'image_size': 64", "'image_size': 2048");
    let larger = large.replace("'image_size': 128", "'image_size': 130");
    assert!(failure(&larger, None).contains("up to 65 MiB"));
    assert!(failure(&larger, Some(64)).contains("ValueError: asked"));
    assert!(failure(&filming("", 130), Some(2048)).contains("up to 65 MiB"));
}

#[test]
fn a_served_mind_does_as_one_within() {
    for task in [TaskId::HighGoal, TaskId::Shopping] {
        let episode = find_episode(&format!("{task}/train/02")).unwrap();
        let played = |mind: Box<dyn Agent>| {
            let helper = Some(Helper { mind, grants: Grants::PLANNER });
            let mut env = Env::new(config(&episode), helper).unwrap();
            let mut records = Vec::new();
            let mut sink = |record: &chaic_env::trace::Record| {
                records.push(record.to_line());
                Ok::<(), AgentError>(())
            };
            let flow = env.run(never(), Some(600), &mut sink);
            assert_eq!(flow, Ok(Flow::Stopped));
            records
        };
        let rhp = || BuiltIn.make("rhp", PlannerRules::paper()).unwrap().mind;
        assert_eq!(played(Box::new(Piped::new(rhp()))), played(rhp()), "{task}");
    }
}

/// A mind behind the protocol, served by a thread of this process.
struct Piped {
    stream: UnixStream,
    senses: chaic_core::observation::Senses,
    thought: chaic_core::agent::Thought,
}

impl Piped {
    fn new(mut mind: Box<dyn Agent>) -> Piped {
        let (stream, other) = UnixStream::pair().unwrap();
        std::thread::spawn(move || {
            let mut input = other.try_clone().unwrap();
            let mut output = other;
            serve("rhp", mind.as_mut(), &mut input, &mut output).unwrap();
        });
        let senses = chaic_core::observation::Senses::NONE;
        Piped { stream, senses, thought: chaic_core::agent::Thought::default() }
    }
}

impl Agent for Piped {
    fn senses(&self) -> chaic_core::observation::Senses {
        self.senses
    }

    fn reset(&mut self, briefing: &Briefing) {
        use chaic_subprocess::message::{ToEnv, ToMind};
        let message = ToMind::Reset { briefing: Box::new(briefing.clone()) };
        let frame = Frame { head: serde_json::to_vec(&message).unwrap(), body: Vec::new() };
        frame.write(&mut self.stream).unwrap();
        let answer = Frame::read(&mut self.stream, 0).unwrap().unwrap();
        match serde_json::from_slice(&answer.head).unwrap() {
            ToEnv::Ready { senses } => self.senses = senses,
            other => panic!("{other:?}"),
        }
    }

    fn act(&mut self, observation: &chaic_core::Observation) -> Result<Action, AgentError> {
        use chaic_subprocess::message::{ToEnv, observation_frame};
        observation_frame(observation).write(&mut self.stream).unwrap();
        let answer = Frame::read(&mut self.stream, 0).unwrap().unwrap();
        match serde_json::from_slice(&answer.head).unwrap() {
            ToEnv::Act { action, thought } => {
                self.thought = thought.unwrap_or_default();
                Ok(action)
            }
            other => panic!("{other:?}"),
        }
    }

    fn thought(&self) -> chaic_core::agent::Thought {
        self.thought.clone()
    }
}

#[test]
fn the_helper_in_python_keeps_to_the_protocol() {
    let checks = check(&Arc::new(command(&python_helper())), never(), &mut |_| {});
    let broken: Vec<_> = checks.iter().filter(|c| c.kept.is_err()).collect();
    assert!(broken.is_empty() && checks.len() == 7, "{checks:?}");
}

#[test]
fn the_conformance_suite_finds_what_does_not_keep_to_it() {
    let found = |line: &str| -> Vec<&'static str> {
        let limits = Limits { decision: Duration::from_secs(2), ..command("").limits };
        let command = Command { limits, ..command(line) };
        let checks = check(&Arc::new(command), never(), &mut |_| {});
        checks.iter().filter(|c| c.kept.is_err()).map(|c| c.promise).collect()
    };
    let act = "say({'type': 'act', 'action': 'turn_left'})";
    assert_eq!(found("true"), ["it starts and says hello in this version of the protocol"]);
    let huge = speaks_then("").replace("'image_size': 64", "'image_size': 64000");
    assert_eq!(found(&huge), ["it is briefed, and wants images that there are"]);
    assert_eq!(found(&filming("", 2048)), ["it is briefed, and wants images that there are"]);
    let once = speaks_then(act);
    assert_eq!(found(&once), ["it decides in an episode of each task, in time"]);
    // Decides by the clock, and stays when it is told to go.
    let moody = speaks_then(
        "\nwhile True:\n    say({'type': 'act', 'action': {'wait': {'frames': 1 + time.time_ns() // 1000 % 97}}})\n    read()\n",
    );
    let moody =
        moody.replace("sys.stdin.buffer.read(8)", "(sys.stdin.buffer.read(8) or time.sleep(60))");
    assert_eq!(found(&moody)[0], "the same briefing and observations make it decide the same");
    assert!(found(&moody).contains(&"it ends when it is told to"));
}

#[test]
fn whatever_a_process_does_wrong_is_said() {
    let short = |line: &str| {
        let second = Duration::from_secs(2);
        let limits = Limits { start: second, decision: second, ..Limits::default() };
        failure(Command { limits, ..command(line) })
    };
    for (line, said) in [
        ("exit 3", "is gone"),
        ("echo oh dear >&2; exit 1", "it complained: oh dear"),
        ("no-such-command-at-all", "not found"),
        ("sleep 60", "no answer within 2 s"),
        ("echo Loading weights, please wait", "standard output"),
        ("cat", "no message of the protocol"),
    ] {
        let text = short(line);
        assert!(text.contains(said) && text.contains(line), "{line}: {text}");
    }
    for (then, said) in [
        ("sys.exit(0)", "is gone"),
        ("time.sleep(60)", "no answer within 2 s"),
        ("say({'type': 'failed', 'problem': 'I am lost'})", "said: I am lost"),
        ("say({'type': 'act', 'action': 'fly'})", "fly"),
        ("say({'type': 'hello', 'protocol': 1, 'name': 'x'})", "answered `observe` with `hello`"),
        ("sys.stdout.buffer.write(b'\\xff' * 100); sys.stdout.buffer.flush()", "a frame of"),
        ("raise ValueError('no weights')", "ValueError: no weights"),
        (
            "a = {'type': 'act', 'action': 'turn_left'}; [say(a) for _ in range(1000)]",
            "without being asked",
        ),
        ("say({'type': 'failed', 'problem': 'x' * 100000})", "said: xxxx"),
        ("sys.stdout.buffer.write(struct.pack('<II', 2, 5) + b'{}hello')", "a frame of"),
    ] {
        let text = short(&speaks_then(then));
        assert!(text.contains(said) && text.len() < 6000, "{then}: {text}");
    }
    let huge = speaks_then("").replace("'image_size': 64", "'image_size': 64000");
    assert!(short(&huge).contains("asks for images of 64000 pixels"));
    let old = speaks_then("").replace("'protocol': 1", "'protocol': 7");
    assert!(short(&old).contains("speaks version 7"));
}

#[test]
fn memory_is_bounded() {
    let greedy = speaks_then("x = bytearray(1 << 30); say({'type': 'act', 'action': 'turn_left'})");
    let limits = Limits { memory_mib: 256, ..command("").limits };
    let text = failure(Command { limits, ..command(&greedy) });
    assert!(text.contains("MemoryError"), "{text}");
}

#[test]
fn the_time_of_an_episode_is_bounded() {
    let slow = speaks_then(
        "\nwhile True:\n    time.sleep(0.3)\n    say({'type': 'act', 'action': 'turn_left'})\n    read()\n",
    );
    let limits = Limits { episode: Duration::from_secs(2), ..command("").limits };
    let began = Instant::now();
    let text = failure(Command { limits, ..command(&slow) });
    assert!(text.contains("no answer within"), "{text}");
    assert!(began.elapsed() < Duration::from_secs(20));
}

/// Whether a process of this command line runs.
fn runs(mark: &str) -> bool {
    let found = Shell::new("pgrep").args(["-f", mark]).output().expect("pgrep is there");
    !found.stdout.is_empty()
}

#[test]
fn no_process_outlives_its_episode() {
    let mark = "chaic_test_mark_51973";
    // It leaves a child behind, which outlives it unless somebody looks after it.
    let line = format!("python3 -c 'import time; time.sleep(97)' {mark} & {}", python_helper());
    let mut mind = SubprocessAgent::new(Arc::new(command(&line)), never());
    mind.reset(&briefing(TaskId::NoConstraint));
    assert!(runs(mark));
    drop(mind);
    let began = Instant::now();
    while runs(mark) && began.elapsed() < Duration::from_secs(10) {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(!runs(mark));
}

#[test]
fn a_run_that_stops_waits_for_nobody() {
    static STOP: AtomicBool = AtomicBool::new(false);
    let line = speaks_then("time.sleep(60)");
    let mut mind = SubprocessAgent::new(Arc::new(command(&line)), &STOP);
    mind.reset(&briefing(TaskId::NoConstraint));
    let episode = find_episode("no_constraint/train/01").unwrap();
    let helper = Some(Helper { mind: Box::new(mind), grants: Grants::PLANNER });
    let mut env = Env::new(config(&episode), helper).unwrap();
    let began = Instant::now();
    std::thread::spawn(|| {
        std::thread::sleep(Duration::from_millis(300));
        STOP.store(true, Ordering::Relaxed);
    });
    assert!(matches!(env.advance(None), Err(AgentError::Halted(_))));
    drop(env);
    assert!(began.elapsed() < Duration::from_secs(15), "it was to sleep for a minute");
}

#[test]
fn a_run_goes_on_with_the_commands_it_began_with() {
    let run = tempfile::tempdir().unwrap();
    let of = |lines: &[(&str, &str)]| {
        let named =
            |(name, line): &(&str, &str)| Command { name: (*name).to_owned(), ..command(line) };
        Commands::beside(&BuiltIn, lines.iter().map(named).collect(), never())
    };
    let begun = of(&[("mine", "python3 a.py")]).unwrap();
    assert!(
        begun.names().contains(&"mine".to_owned()) && begun.names().contains(&"rhp".to_owned())
    );
    begun.attach(run.path()).unwrap();
    begun.attach(run.path()).unwrap();
    for other in [&[][..], &[("mine", "rm -rf b")][..]] {
        let refused = of(other).unwrap().attach(run.path()).unwrap_err().to_string();
        assert!(refused.contains("mine=exec:python3 a.py"), "{refused}");
    }
    for wrong in ["rhp", "none", "", "a/b", "..", "a b"] {
        assert!(of(&[(wrong, "true")]).is_err(), "{wrong}");
    }
    assert!(of(&[("a", "true"), ("a", "false")]).is_err());
}

#[test]
fn the_python_helper_delivers_something() {
    let line = python_helper();
    let mut n_delivered = 0;
    for k in 3..6 {
        let episode = find_episode(&format!("low_target/train/0{k}")).unwrap();
        let mind = SubprocessAgent::new(Arc::new(command(&line)), never());
        let helper = Some(Helper { mind: Box::new(mind), grants: Grants::PLANNER });
        let mut env = Env::new(config(&episode), helper).unwrap();
        assert_eq!(env.advance(None), Ok(Flow::Ended));
        let things = env.world().state().things.iter();
        n_delivered += things.filter(|t| t.delivered_by == Some(AgentId::HELPER)).count();
    }
    assert!(n_delivered > 0, "nothing in three episodes");
}

/// Open descriptors and threads of this process.
#[cfg(target_os = "linux")]
fn held() -> (usize, usize) {
    let count = |folder: &str| std::fs::read_dir(folder).expect("it is there").count();
    (count("/proc/self/fd"), count("/proc/self/task"))
}

#[test]
#[cfg(target_os = "linux")]
fn a_detached_grandchild_holds_nothing_of_ours() {
    let mark = "43210.75";
    let line = speaks_then("say({'type': 'act', 'action': 'turn_left'})");
    // It keeps the pipes open after its episode.
    let line = format!("setsid sleep {mark} & {line}");
    let episodes = || {
        for _ in 0..4 {
            let mut mind = SubprocessAgent::new(Arc::new(command(&line)), never());
            mind.reset(&briefing(TaskId::NoConstraint));
        }
        // The threads look every 50 ms whether their pipe is given up.
        std::thread::sleep(Duration::from_millis(500));
    };
    episodes();
    let before = held();
    (0..3).for_each(|_| episodes());
    let after = held();
    let _ = Shell::new("pkill").args(["-f", &format!("sleep {mark}")]).status();
    // Other tests of this process start and end meanwhile; twelve leaks would be 24 of each.
    assert!(after.0 < before.0 + 20 && after.1 < before.1 + 20, "{before:?}, then {after:?}");
}

#[test]
fn a_pooled_process_serves_several_episodes_and_a_failed_one_is_replaced() {
    let pool = Arc::new(Pool::default());
    let dir = tempfile::tempdir().unwrap();
    let log = dir.path().join("starts");
    let line = format!("echo start >> '{}'; {}", log.display(), python_helper());
    let starts = || std::fs::read_to_string(&log).unwrap().lines().count();
    let play = |line: &str| {
        let command = Arc::new(command(line));
        let mind = SubprocessAgent::pooled(command, Arc::clone(&pool), never());
        let helper = Some(Helper { mind: Box::new(mind), grants: Grants::PLANNER });
        let episode = find_episode("no_constraint/train/01").unwrap();
        let mut env = Env::new(config(&episode), helper).unwrap();
        let mut records = Vec::new();
        let mut sink = |record: &chaic_env::trace::Record| {
            records.push(record.to_line());
            Ok::<(), AgentError>(())
        };
        let flow = env.run(never(), Some(200), &mut sink);
        (flow, records)
    };
    let first = play(&line);
    let second = play(&line);
    assert_eq!(first, second, "it begins anew");
    assert_eq!(starts(), 1);
    // A process that breaks down does not come back.
    let pool_of_broken = Arc::new(Pool::default());
    for _ in 0..2 {
        let broken = format!("echo start >> '{}'; {}", log.display(), speaks_then("sys.exit(0)"));
        let command = Arc::new(command(&broken));
        let mind = SubprocessAgent::pooled(command, Arc::clone(&pool_of_broken), never());
        let helper = Some(Helper { mind: Box::new(mind), grants: Grants::PLANNER });
        let episode = find_episode("no_constraint/train/01").unwrap();
        assert!(Env::new(config(&episode), helper).unwrap().advance(Some(100)).is_err());
    }
    assert!(starts() >= 3, "{}", starts());
}
