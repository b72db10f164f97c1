//! Tests that an agent in another process acts as one in this process. Any failure of a process
//! ends its own episode in time, with a message and without remaining processes.

use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::Command as Shell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use chaic_agents::PlannerRules;
use chaic_core::observation::Grants;
use chaic_core::{Action, Agent, AgentError, AgentId, Briefing, TaskId};
use chaic_env::helper_registry::{BuiltInHelpers, Helper, HelperRegistry as _};
use chaic_env::{AdvanceOutcome, Env, EpisodeConfig};
use chaic_episodes::find_episode;
use chaic_subprocess::conformance::check;
use chaic_subprocess::frame::MessageFrame;
use chaic_subprocess::serve::{serve, serve_with_grants};
use chaic_subprocess::{CommandRegistry, HelperProgram, Limits, Pool, SubprocessAgent};

fn never_stop() -> &'static AtomicBool {
    static NEVER: AtomicBool = AtomicBool::new(false);
    &NEVER
}

fn command(line: &str) -> HelperProgram {
    let limits = Limits {
        start: Duration::from_secs(20),
        decision: Duration::from_secs(20),
        ..Limits::default()
    };
    HelperProgram {
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

/// Returns the briefing of a training episode.
fn briefing(task: TaskId) -> Briefing {
    let episode = find_episode(&format!("{task}/train/01")).unwrap();
    let helper = BuiltInHelpers.make("rhp", PlannerRules::paper());
    let env = Env::new(config(&episode), helper).unwrap();
    env.briefing(AgentId::HELPER)
}

fn config(episode: &chaic_episodes::Episode) -> EpisodeConfig<'_> {
    EpisodeConfig { image_size: Some(64), ..EpisodeConfig::new(episode, "exec") }
}

/// Runs a command in an episode and returns the error of its agent.
fn failure(command: HelperProgram) -> String {
    let mut agent = SubprocessAgent::new(Arc::new(command), never_stop());
    agent.reset(&briefing(TaskId::NoConstraint));
    let episode = find_episode("no_constraint/train/01").unwrap();
    let helper = Some(Helper { agent: Box::new(agent), grants: Grants::PLANNER });
    // The environment briefs it again and asks it.
    let mut env = Env::new(config(&episode), helper).unwrap();
    match env.advance(Some(100)) {
        Err(AgentError::Broken(text)) => text,
        other => panic!("{other:?}"),
    }
}

/// Returns a command that gives the first two answers of the protocol and then runs other code.
fn ready_then(then: &str) -> String {
    let python = r#"
import sys, struct, json, time, os
def read():
    a, b = struct.unpack('<II', sys.stdin.buffer.read(8))
    sys.stdin.buffer.read(b + a)
def send(message):
    head = json.dumps(message).encode()
    sys.stdout.buffer.write(struct.pack('<II', len(head), 0) + head)
    sys.stdout.buffer.flush()
read(); send({'type': 'hello', 'protocol': 2, 'name': 'test'})
read(); send({'type': 'ready', 'sensors': {'image_size': 64, 'rgb': True, 'depth': True, 'ids': True}})
read()
"#;
    format!("python3 -c \"{python}{then}\"")
}

/// Returns such a command that requests a frame history of 256 images of this size.
fn ready_with_history(then: &str, history_size: u32) -> String {
    let history = format!(
        "'frame_history': {{'image_size': {history_size}, 'every_frames': 1, 'max_len': 256}}"
    );
    ready_then(then).replace("'ids': True", &format!("'ids': True, {history}"))
}

#[test]
fn sensors_whose_observation_exceeds_a_message_are_refused_when_requested() {
    let failure = |line: &str, image_size: Option<u32>| {
        let command = Arc::new(command(line));
        let agent = Box::new(SubprocessAgent::new(command, never_stop()));
        let helper = Some(Helper { agent, grants: Grants::PLANNER });
        let episode = find_episode("no_constraint/train/01").unwrap();
        let config = EpisodeConfig { image_size, ..config(&episode) };
        match Env::new(config, helper).unwrap().advance(Some(100)) {
            Err(AgentError::Broken(text)) => text,
            other => panic!("{other:?}"),
        }
    };
    let start = Instant::now();
    let text = failure(&ready_with_history("", 2048), None);
    for expected in
        ["the helper asks for up to 7169 MiB", "at most 64 MiB", "ask for fewer or smaller"]
    {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    assert!(start.elapsed() < Duration::from_secs(20), "no image is rendered");
    // Images and frame history fit alone but not together.
    let large = ready_with_history("raise ValueError('asked')", 128)
        .replace("'image_size': 64", "'image_size': 2048");
    let larger = large.replace("'image_size': 128", "'image_size': 130");
    assert!(failure(&larger, None).contains("up to 65 MiB"));
    assert!(failure(&larger, Some(64)).contains("ValueError: asked"));
    assert!(failure(&ready_with_history("", 130), Some(2048)).contains("up to 65 MiB"));
}

#[test]
fn a_served_agent_acts_as_one_in_this_process() {
    for task in [TaskId::HighGoal, TaskId::Shopping] {
        let episode = find_episode(&format!("{task}/train/02")).unwrap();
        let records_of = |agent: Box<dyn Agent>| {
            let helper = Some(Helper { agent, grants: Grants::PLANNER });
            let mut env = Env::new(config(&episode), helper).unwrap();
            let mut records = Vec::new();
            let mut sink = |record: &chaic_env::trace::Record| {
                records.push(record.to_line());
                Ok::<(), AgentError>(())
            };
            let flow = env.run(never_stop(), Some(600), &mut sink);
            assert_eq!(flow, Ok(AdvanceOutcome::Stopped));
            records
        };
        let rhp = || BuiltInHelpers.make("rhp", PlannerRules::paper()).unwrap().agent;
        assert_eq!(records_of(Box::new(Piped::new(rhp()))), records_of(rhp()), "{task}");
    }
}

#[test]
fn a_served_agent_refuses_a_briefing_without_its_grants() {
    use chaic_subprocess::message::{RequestMessage, ResponseMessage};
    let answer = |granted: Grants| {
        let mut helper = BuiltInHelpers.make("rhp", PlannerRules::paper()).unwrap();
        let briefing = Briefing { grants: granted, ..briefing(TaskId::HighGoal) };
        let reset = RequestMessage::Reset { briefing: Box::new(briefing) };
        let frame = MessageFrame { head: serde_json::to_vec(&reset).unwrap(), body: Vec::new() };
        let (mut input, mut output) = (Vec::new(), Vec::new());
        frame.write(&mut input).unwrap();
        let agent = helper.agent.as_mut();
        serve_with_grants("rhp", agent, helper.grants, &mut &input[..], &mut output).unwrap();
        let answer = MessageFrame::read(&mut &output[..], 0).unwrap().unwrap();
        serde_json::from_slice::<ResponseMessage>(&answer.head).unwrap()
    };
    let problem = "the briefing lacks the grants goal_place; give --exec-grants ids,goal_place";
    assert_eq!(answer(Grants::IDS), ResponseMessage::Failed { problem: problem.to_owned() });
    for enough in [Grants::PLANNER, Grants::ORACLE] {
        assert!(matches!(answer(enough), ResponseMessage::Ready { .. }), "{enough:?}");
    }
}

/// Agent behind the protocol, served by a thread of this process.
struct Piped {
    stream: UnixStream,
    sensors: chaic_core::observation::SensorConfig,
    thought: chaic_core::agent::Thought,
}

impl Piped {
    fn new(mut agent: Box<dyn Agent>) -> Piped {
        let (stream, other) = UnixStream::pair().unwrap();
        std::thread::spawn(move || {
            let mut input = other.try_clone().unwrap();
            let mut output = other;
            serve("rhp", agent.as_mut(), &mut input, &mut output).unwrap();
        });
        let sensors = chaic_core::observation::SensorConfig::NONE;
        Piped { stream, sensors, thought: chaic_core::agent::Thought::default() }
    }
}

impl Agent for Piped {
    fn sensors(&self) -> chaic_core::observation::SensorConfig {
        self.sensors
    }

    fn reset(&mut self, briefing: &Briefing) {
        use chaic_subprocess::message::{RequestMessage, ResponseMessage};
        let message = RequestMessage::Reset { briefing: Box::new(briefing.clone()) };
        let frame = MessageFrame { head: serde_json::to_vec(&message).unwrap(), body: Vec::new() };
        frame.write(&mut self.stream).unwrap();
        let answer = MessageFrame::read(&mut self.stream, 0).unwrap().unwrap();
        match serde_json::from_slice(&answer.head).unwrap() {
            ResponseMessage::Ready { sensors } => self.sensors = sensors.into(),
            other => panic!("{other:?}"),
        }
    }

    fn act(&mut self, observation: &chaic_core::Observation) -> Result<Action, AgentError> {
        use chaic_subprocess::message::{ResponseMessage, observation_frame};
        observation_frame(observation).write(&mut self.stream).unwrap();
        let answer = MessageFrame::read(&mut self.stream, 0).unwrap().unwrap();
        match serde_json::from_slice(&answer.head).unwrap() {
            ResponseMessage::Act { action, thought } => {
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
fn the_python_helper_meets_all_requirements() {
    let checks = check(&Arc::new(command(&python_helper())), never_stop(), &mut |_| {});
    let broken: Vec<_> = checks.iter().filter(|c| c.result.is_err()).collect();
    assert!(broken.is_empty() && checks.len() == 7, "{checks:?}");
}

#[test]
fn the_conformance_test_finds_violations() {
    let found = |line: &str| -> Vec<&'static str> {
        let limits = Limits { decision: Duration::from_secs(2), ..command("").limits };
        let command = HelperProgram { limits, ..command(line) };
        let checks = check(&Arc::new(command), never_stop(), &mut |_| {});
        checks.iter().filter(|c| c.result.is_err()).map(|c| c.requirement).collect()
    };
    let act = "send({'type': 'act', 'action': 'turn_left'})";
    assert_eq!(found("true"), ["it starts and says hello in this version of the protocol"]);
    let huge = ready_then("").replace("'image_size': 64", "'image_size': 64000");
    assert_eq!(found(&huge), ["it accepts a briefing and requests valid images"]);
    assert_eq!(
        found(&ready_with_history("", 2048)),
        ["it accepts a briefing and requests valid images"]
    );
    let once = ready_then(act);
    assert_eq!(found(&once), ["it decides in an episode of each task, in time"]);
    // Decides by the clock. Does not exit if it has decided nothing: waiting for all of the processes would
    // take half a minute.
    let unstable = ready_then(
        "\nwhile True:\n    send({'type': 'act', 'action': {'wait': {'frames': 1 + time.time_ns() // 1000 % 97}}})\n    n_actions += 1\n    read()\n",
    );
    let unstable = unstable.replace("import sys", "n_actions = 0\nimport sys").replace(
        "sys.stdin.buffer.read(8)",
        "(sys.stdin.buffer.read(8) or (time.sleep(60) if n_actions == 0 else sys.exit(0)))",
    );
    let violations = found(&unstable);
    assert_eq!(violations[0], "it decides the same for the same briefing and observations");
    assert!(violations.contains(&"it exits after `bye`"));
}

#[test]
fn every_failure_of_a_process_is_reported() {
    let short = |line: &str| {
        let second = Duration::from_secs(2);
        let limits = Limits { start: second, decision: second, ..Limits::default() };
        failure(HelperProgram { limits, ..command(line) })
    };
    for (line, expected) in [
        ("exit 3", "exited before its answer"),
        ("echo no weights >&2; exit 1", "standard error: no weights"),
        ("no-such-command-at-all", "not found"),
        ("sleep 60", "no answer within 2 s"),
        ("echo Loading weights, please wait", "standard output"),
        ("echo hello", "sent an incomplete message; does the helper print to the standard output?"),
        ("cat", "no message of the protocol"),
    ] {
        let text = short(line);
        assert!(text.contains(expected) && text.contains(line), "{line}: {text}");
    }
    for (then, expected) in [
        ("sys.exit(0)", "exited before its answer"),
        ("time.sleep(60)", "no answer within 2 s"),
        ("send({'type': 'failed', 'problem': 'I am lost'})", "failed: I am lost"),
        ("send({'type': 'act', 'action': 'fly'})", "fly"),
        ("send({'type': 'hello', 'protocol': 2, 'name': 'x'})", "answered `observe` with `hello`"),
        ("sys.stdout.buffer.write(b'\\xff' * 100); sys.stdout.buffer.flush()", "a frame of"),
        ("raise ValueError('no weights')", "ValueError: no weights"),
        (
            "a = {'type': 'act', 'action': 'turn_left'}; [send(a) for _ in range(1000)]",
            "without being asked",
        ),
        ("send({'type': 'failed', 'problem': 'x' * 100000})", "failed: xxxx"),
        ("sys.stdout.buffer.write(struct.pack('<II', 2, 5) + b'{}hello')", "a frame of"),
    ] {
        let text = short(&ready_then(then));
        assert!(text.contains(expected) && text.len() < 6000, "{then}: {text}");
    }
    let huge = ready_then("").replace("'image_size': 64", "'image_size': 64000");
    assert!(short(&huge).contains("asks for images of 64000 pixels"));
    let old = short(&ready_then("").replace("'protocol': 2", "'protocol': 1"));
    assert!(old.contains("speaks version 1 of the protocol, this chaic speaks version 2"), "{old}");
    // One line, apart from those of the command.
    assert_eq!(old.lines().count(), ready_then("").lines().count(), "{old}");
}

#[test]
fn memory_is_limited() {
    let excessive =
        ready_then("x = bytearray(1 << 30); send({'type': 'act', 'action': 'turn_left'})");
    let limits = Limits { memory_mib: 256, ..command("").limits };
    let text = failure(HelperProgram { limits, ..command(&excessive) });
    assert!(text.contains("MemoryError"), "{text}");
}

#[test]
fn the_time_of_an_episode_is_limited() {
    let slow = ready_then(
        "\nwhile True:\n    time.sleep(0.3)\n    send({'type': 'act', 'action': 'turn_left'})\n    read()\n",
    );
    let limits = Limits { episode: Duration::from_secs(2), ..command("").limits };
    let start = Instant::now();
    let text = failure(HelperProgram { limits, ..command(&slow) });
    assert!(text.contains("no answer within"), "{text}");
    assert!(start.elapsed() < Duration::from_secs(20));
}

/// Returns whether a process with this command line runs.
fn is_running(mark: &str) -> bool {
    let found = Shell::new("pgrep").args(["-f", mark]).output().expect("pgrep is installed");
    !found.stdout.is_empty()
}

#[test]
fn no_process_outlives_its_episode() {
    let mark = "chaic_test_mark_51973";
    // Its background child must end with the episode.
    let line = format!("python3 -c 'import time; time.sleep(97)' {mark} & {}", python_helper());
    let mut agent = SubprocessAgent::new(Arc::new(command(&line)), never_stop());
    agent.reset(&briefing(TaskId::NoConstraint));
    assert!(is_running(mark));
    drop(agent);
    let start = Instant::now();
    while is_running(mark) && start.elapsed() < Duration::from_secs(10) {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(!is_running(mark));
}

#[test]
fn a_stopped_run_does_not_wait() {
    static STOP: AtomicBool = AtomicBool::new(false);
    let line = ready_then("time.sleep(60)");
    let mut agent = SubprocessAgent::new(Arc::new(command(&line)), &STOP);
    agent.reset(&briefing(TaskId::NoConstraint));
    let episode = find_episode("no_constraint/train/01").unwrap();
    let helper = Some(Helper { agent: Box::new(agent), grants: Grants::PLANNER });
    let mut env = Env::new(config(&episode), helper).unwrap();
    let start = Instant::now();
    std::thread::spawn(|| {
        std::thread::sleep(Duration::from_millis(300));
        STOP.store(true, Ordering::Relaxed);
    });
    assert!(matches!(env.advance(None), Err(AgentError::Halted(_))));
    drop(env);
    assert!(start.elapsed() < Duration::from_secs(15), "the helper sleeps for a minute");
}

#[test]
fn a_run_resumes_with_its_own_commands_only() {
    let run = tempfile::tempdir().unwrap();
    let registry = |lines: &[(&str, &str)]| {
        let named = |(name, line): &(&str, &str)| HelperProgram {
            name: (*name).to_owned(),
            ..command(line)
        };
        CommandRegistry::new(&BuiltInHelpers, lines.iter().map(named).collect(), never_stop())
    };
    let first = registry(&[("mine", "python3 a.py")]).unwrap();
    assert!(
        first.names().contains(&"mine".to_owned()) && first.names().contains(&"rhp".to_owned())
    );
    first.attach_run(run.path()).unwrap();
    first.attach_run(run.path()).unwrap();
    for other in [&[][..], &[("mine", "rm -rf b")][..]] {
        let refused = registry(other).unwrap().attach_run(run.path()).unwrap_err().to_string();
        assert!(refused.contains("mine=exec:python3 a.py"), "{refused}");
    }
    for wrong in ["rhp", "none", "", "a/b", "..", "a b"] {
        assert!(registry(&[(wrong, "true")]).is_err(), "{wrong}");
    }
    assert!(registry(&[("a", "true"), ("a", "false")]).is_err());
}

#[test]
fn a_run_resumes_with_its_own_limits_only() {
    let run = tempfile::tempdir().unwrap();
    let path = run.path().join("commands.json");
    let attach = |change: fn(&mut Limits)| {
        let mut program = command("python3 a.py");
        change(&mut program.limits);
        let commands = CommandRegistry::new(&BuiltInHelpers, vec![program], never_stop()).unwrap();
        commands.attach_run(run.path()).map_err(|error| error.to_string())
    };
    attach(|limits| limits.decision = Duration::from_secs_f64(0.3)).unwrap();
    let whole = std::fs::read_to_string(&path).unwrap();
    attach(|limits| limits.decision = Duration::from_secs_f64(0.3)).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), whole);
    let refused = attach(|_| ()).unwrap_err();
    assert!(refused.contains("was started with --exec-decision-s 0.3, not 20; give"), "{refused}");
    let refused = attach(|limits| {
        limits.decision = Duration::from_secs_f64(0.3);
        limits.memory_mib = 7;
    });
    let refused = refused.unwrap_err();
    assert!(refused.contains("--exec-memory-mib 8192, not 7"), "{refused}");
    // A run of an older version has no limits, before and after it is resumed.
    let older = "[\n  {\n    \"name\": \"exec\",\n    \"command\": \"python3 a.py\"\n  }\n]";
    std::fs::write(&path, older).unwrap();
    attach(|limits| limits.memory_mib = 7).unwrap();
    attach(|_| ()).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), older);
}

#[test]
fn the_python_helper_delivers_objects() {
    let line = python_helper();
    let mut n_delivered = 0;
    for k in 3..6 {
        let episode = find_episode(&format!("low_target/train/0{k}")).unwrap();
        let agent = SubprocessAgent::new(Arc::new(command(&line)), never_stop());
        let helper = Some(Helper { agent: Box::new(agent), grants: Grants::PLANNER });
        let mut env = Env::new(config(&episode), helper).unwrap();
        assert_eq!(env.advance(None), Ok(AdvanceOutcome::Ended));
        let objects = env.world().state().objects.iter();
        n_delivered += objects.filter(|t| t.delivered_by == Some(AgentId::HELPER)).count();
    }
    assert!(n_delivered > 0, "no delivery in three episodes");
}

/// Returns the numbers of open descriptors and threads of this process.
#[cfg(target_os = "linux")]
fn open_resources() -> (usize, usize) {
    let count = |folder: &str| std::fs::read_dir(folder).expect("/proc is mounted").count();
    (count("/proc/self/fd"), count("/proc/self/task"))
}

#[test]
#[cfg(target_os = "linux")]
fn a_detached_grandchild_leaks_no_descriptors_or_threads() {
    let mark = "43210.75";
    let line = ready_then("send({'type': 'act', 'action': 'turn_left'})");
    // The grandchild keeps the pipes open after the episode.
    let line = format!("setsid sleep {mark} & {line}");
    let episodes = || {
        for _ in 0..4 {
            let mut agent = SubprocessAgent::new(Arc::new(command(&line)), never_stop());
            agent.reset(&briefing(TaskId::NoConstraint));
        }
        // The threads poll every 50 ms whether their pipe is abandoned.
        std::thread::sleep(Duration::from_millis(500));
    };
    episodes();
    let before = open_resources();
    (0..3).for_each(|_| episodes());
    let after = open_resources();
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
        let agent = SubprocessAgent::pooled(command, Arc::clone(&pool), never_stop());
        let helper = Some(Helper { agent: Box::new(agent), grants: Grants::PLANNER });
        let episode = find_episode("no_constraint/train/01").unwrap();
        let mut env = Env::new(config(&episode), helper).unwrap();
        let mut records = Vec::new();
        let mut sink = |record: &chaic_env::trace::Record| {
            records.push(record.to_line());
            Ok::<(), AgentError>(())
        };
        let flow = env.run(never_stop(), Some(200), &mut sink);
        (flow, records)
    };
    let first = play(&line);
    let second = play(&line);
    assert_eq!(first, second, "the second briefing starts a new episode");
    assert_eq!(starts(), 1);
    // A failed process does not return to the pool.
    let failing_pool = Arc::new(Pool::default());
    for _ in 0..2 {
        let failing = format!("echo start >> '{}'; {}", log.display(), ready_then("sys.exit(0)"));
        let command = Arc::new(command(&failing));
        let agent = SubprocessAgent::pooled(command, Arc::clone(&failing_pool), never_stop());
        let helper = Some(Helper { agent: Box::new(agent), grants: Grants::PLANNER });
        let episode = find_episode("no_constraint/train/01").unwrap();
        assert!(Env::new(config(&episode), helper).unwrap().advance(Some(100)).is_err());
    }
    assert!(starts() >= 3, "{}", starts());
}
