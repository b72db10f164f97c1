//! Promises: an episode on the server has the states, pictures and trace of a session in a page; it goes on after a
//! reload, a pause and a restart; a repeated turn changes nothing; wrong turns get a clear refusal.

use chaic_core::AgentId;
use chaic_study::StudyPlan;
use chaic_study::data::DataRecord;
use chaic_study::export::export;
use chaic_study_server::{
    MAX_TURN_BYTES, MAX_TURN_FRAMES, PARTICIPANT_RATE, SESSION_IDLE_SECS, TURN_RATE,
};
use chaic_web::{InputLevel, LiveConfig, LiveInput, LiveSession, LiveStatus};
use serde_json::{Value, json};

use crate::kit::{Answer, Client, DEFINITION, Folder, SIMULATED, SLOW, TestHelpers, code};

/// Side of the pictures of tests, pixels.
const SIDE_PX: u32 = 64;

/// Starts the session that a page would have for the first trial of the first slot.
fn local(plan: &StudyPlan, level: InputLevel) -> LiveSession {
    let trial = plan.trials(1)[0];
    let is_live = plan.study().play.world == chaic_study::WorldPace::RealTime;
    let is_helper = plan.study().play.seat == chaic_study::Seat::Helper;
    let seat = if is_helper { AgentId::HELPER } else { AgentId::PARTNER };
    let helper = if is_helper { "none" } else { plan.helper(trial) };
    let config = LiveConfig { seed: 0, seat, level, helper: helper.to_owned(), is_live };
    let episode = plan.episodes()[trial.episode].to_json_line();
    LiveSession::start(episode.as_bytes(), &config, &TestHelpers).expect("an episode")
}

/// Returns a decision for a state: the first plan, or an action that depends on the turn.
fn decision(state: &Value, number: u64) -> Option<Value> {
    if state["status"] != "waiting" {
        return None;
    }
    if let Some(plan) = state["plans"].get(0) {
        return Some(json!({ "plan": plan }));
    }
    let pixel = json!({ "column": 256, "row": 300 });
    let actions = [
        json!("turn_left"),
        json!("move_forward"),
        json!({ "pick_up": { "object": { "pixel": pixel }, "hand": "left" } }),
        json!({ "wait": { "frames": 3 } }),
    ];
    Some(json!({ "action": actions[number as usize % actions.len()] }))
}

/// Plays turns from a number on, until the episode ends or `n_turns` are done. Returns the answers.
fn play(client: &Client, from: u64, n_turns: u64, frames: u32) -> Vec<Answer> {
    let mut answers: Vec<Answer> = Vec::new();
    for number in from..from + n_turns {
        let last = answers.last().map(|answer| answer.turn().0);
        let input = last.as_ref().and_then(|state| decision(state, number));
        let mut turn = json!({ "frames": frames, "view_px": SIDE_PX });
        if let Some(input) = input {
            turn["input"] = input;
        }
        let answer = client.turn(0, number, &turn);
        let has_ended = answer.turn().0["status"] == "ended";
        answers.push(answer);
        if has_ended {
            break;
        }
    }
    answers
}

/// Returns the stored trace of the first trial.
fn stored_trace(folder: &Folder, n: usize) -> String {
    let records = folder.text(&code(n));
    let records = records.lines().map(|line| DataRecord::parse(line).expect("a record"));
    let texts = records.filter_map(|record| match record {
        DataRecord::Trace { text, .. } => Some(text),
        _ => None,
    });
    texts.collect()
}

/// Exports the data and returns the numbers of traces and of verified ones.
fn exported(folder: &Folder) -> (usize, usize) {
    let out = folder.path().join("set");
    let report = export(&folder.plan(), &[folder.data()], &out).expect("valid data");
    assert_eq!(report.problems, [""; 0]);
    (report.traces, report.verified.len())
}

#[test]
fn an_episode_equals_the_one_in_a_page() {
    let live = SIMULATED.replace("seat = \"helper\"", "world = \"goes_on\"\nhelper = \"rhp\"");
    let steps = SIMULATED.replace("seat = \"helper\"", "input = \"steps\"\nhelper = \"none\"");
    let own = SIMULATED.replace("seat = \"helper\"", "helper = \"mine\"");
    for (definition, level, frames) in [
        (SIMULATED, InputLevel::Plans, MAX_TURN_FRAMES),
        (&own, InputLevel::Plans, 40),
        (&live, InputLevel::Plans, 12),
        (&steps, InputLevel::Steps, 7),
    ] {
        let folder = Folder::new(definition);
        let server = folder.server();
        let client = server.client(1);
        client.begin();
        let opened = client.open(0).json();
        assert_eq!(opened["next"], 0);
        let answers = play(&client, 0, 55, frames);
        let mut session = local(&folder.plan(), level);
        let mut info = serde_json::to_value(session.info()).expect("JSON");
        info["episode"] = json!("");
        assert_eq!(opened["info"], info);
        let mut last: Option<Value> = None;
        for (number, answer) in (0..).zip(&answers) {
            if let Some(input) = last.as_ref().and_then(|state| decision(state, number)) {
                let input: LiveInput = serde_json::from_value(input).expect("an input");
                session.decide(&input);
            }
            session.advance(frames).expect("it advances");
            let state = serde_json::to_value(session.state()).expect("JSON");
            let (sent, png) = answer.turn();
            assert_eq!(sent, state, "turn {number}");
            let picture = image::load_from_memory(png).expect("a PNG").into_rgb8();
            assert_eq!(picture.as_raw(), &session.draw_view_rgb(SIDE_PX), "turn {number}");
            last = Some(sent);
        }
        let stopped = json!({ "type": "trial_end", "trial": 0, "outcome": "stopped" });
        let has_ended = session.status() == LiveStatus::Ended;
        if !has_ended {
            assert_eq!(client.append(2, &[format!("{stopped}\n")]).stored(), 3);
        }
        let (trace, whole) = (stored_trace(&folder, 1), session.trace());
        // An episode that goes on stores its trace every half second.
        assert!(whole.starts_with(&trace) && trace.lines().count() > 10, "{}", trace.len());
        assert!(whole == trace || (frames < 15 && !has_ended));
        server.stop();
        assert_eq!(exported(&folder), (1, 1));
    }
}

#[test]
fn an_episode_is_played_to_its_end() {
    let folder = Folder::new(SIMULATED);
    let server = folder.server();
    let client = server.client(1);
    client.begin();
    client.open(0);
    // The participant cannot end the study during an episode, and then read its goal.
    let complete = ["{\"type\":\"complete\"}\n".to_owned()];
    assert_eq!(client.append(2, &complete).status, 422);
    let mut answers = play(&client, 0, 50, MAX_TURN_FRAMES);
    while answers.last().expect("a turn").turn().0["status"] != "ended" {
        server.wait_secs(3);
        let next = client.open(0).json()["next"].as_u64().expect("a number");
        answers.extend(play(&client, next, 50, MAX_TURN_FRAMES));
    }
    let next = answers.len() as u64;
    assert!(
        answers.last().expect("a turn").turn().0["progress"].is_array(),
        "the end tells the result"
    );
    let text = folder.text(&client.code);
    assert!(text.ends_with("{\"type\":\"trial_end\",\"trial\":0,\"outcome\":\"ended\"}\n"));
    // If the page has lost the answer, it gets the end again, and its copy of the record equals the stored
    // record.
    let turn = json!({ "frames": 1, "view_px": SIDE_PX });
    assert_eq!(client.turn(0, next - 1, &turn).bytes, answers.last().expect("a turn").bytes);
    let after = client.turn(0, next, &turn);
    assert_eq!((after.status, after.error().as_str()), (410, "the episode is over"));
    assert_eq!(client.open(0).status, 410);
    let end = "{\"type\":\"trial_end\",\"trial\":0,\"outcome\":\"ended\"}\n".to_owned();
    assert_eq!(client.request("GET", "", "").stored(), 3);
    assert_eq!(client.append(2, &[end]).stored(), 3);
    // The data of a participant contain goals, so they are readable at the end of the study.
    assert_eq!(client.request("GET", "/data", "").status, 403);
    assert_eq!(client.append(3, &["{\"type\":\"complete\"}\n".to_owned()]).stored(), 4);
    assert_eq!(client.request("GET", "/data", "").body, folder.text(&client.code));
    server.stop();
    assert_eq!(exported(&folder), (1, 1));
}

#[test]
fn an_episode_goes_on_after_a_reload_a_pause_and_a_restart() {
    let folder =
        Folder::new(&DEFINITION.replace("[factors]", "[play]\nsimulator = \"server\"\n[factors]"));
    let server = folder.server();
    let client = server.client(1);
    client.begin();
    client.open(0);
    let frame = |answers: &[Answer]| answers.last().expect("a turn").turn().0["frame"].clone();
    let first = play(&client, 0, 12, 40);
    // A reload.
    assert_eq!(client.open(0).json()["next"], 12);
    let second = play(&client, 12, 6, 40);
    assert!(frame(&second).as_u64() > frame(&first).as_u64());
    // Another participant gets the memory after a pause.
    server.wait_secs(SESSION_IDLE_SECS);
    let other = server.client(2);
    other.begin();
    other.open(0);
    let closed = client.turn(0, 18, &json!({ "frames": 40, "view_px": SIDE_PX }));
    assert_eq!(
        (closed.status, closed.error().as_str()),
        (409, "the episode is not open; open it again")
    );
    let before = stored_trace(&folder, 1);
    assert_eq!(client.open(0).json()["next"], 0);
    let third = play(&client, 0, 6, 40);
    server.stop();
    let kept = stored_trace(&folder, 1);
    assert!(kept.starts_with(&before) && kept.len() > before.len());
    let server = folder.server();
    let client = Client { address: server.address, ..client };
    assert_eq!(client.turn(0, 6, &json!({ "frames": 40, "view_px": SIDE_PX })).status, 409);
    assert_eq!(client.open(0).json()["next"], 0);
    let fourth = play(&client, 0, 6, 40);
    assert!(frame(&fourth).as_u64() > frame(&third).as_u64());
    let stopped = "{\"type\":\"trial_end\",\"trial\":0,\"outcome\":\"stopped\"}\n".to_owned();
    assert_eq!(client.append(2, &[stopped]).stored(), 3);
    assert_eq!(client.turn(0, 6, &json!({ "frames": 40, "view_px": SIDE_PX })).status, 409);
    assert_eq!(client.open(0).status, 410);
    assert!(stored_trace(&folder, 1).starts_with(&kept));
    assert_eq!(server.problems(), [""; 0]);
    server.stop();
    assert_eq!(exported(&folder), (1, 1));
}

#[test]
fn a_stored_trace_of_another_simulator_is_refused_and_reported() {
    let folder = Folder::new(SIMULATED);
    let server = folder.server();
    let client = server.client(1);
    client.begin();
    client.open(0);
    play(&client, 0, 6, 40);
    server.stop();
    let path = folder.data().join(format!("{}.jsonl", client.code));
    let text = folder.text(&client.code).replacen("\\\"seed\\\":0", "\\\"seed\\\":1", 1);
    assert_ne!(text, folder.text(&client.code));
    std::fs::write(&path, text).expect("the disk has space");
    let server = folder.server();
    let client = Client { address: server.address, ..client };
    let refused = client.open(0);
    assert_eq!(refused.status, 422, "{refused:?}");
    assert_eq!(refused.error(), "the episode cannot go on");
    let problems = server.problems();
    assert!(
        problems[0].contains("do not act as in the trace") && problems.len() == 1,
        "{problems:?}"
    );
    // The page goes on with the next episode.
    let left = "{\"type\":\"trial_end\",\"trial\":0,\"outcome\":\"left\"}\n".to_owned();
    assert_eq!(client.append(2, &[left]).stored(), 3);
}

#[test]
fn wrong_turns_are_refused_and_repeated_ones_change_nothing() {
    let folder = Folder::new(&SIMULATED.replace("seat = \"helper\"", "input = \"steps\""));
    let server = folder.server();
    let client = server.client(1);
    let good = json!({ "frames": 5, "view_px": SIDE_PX });
    assert_eq!(client.open(0).status, 404, "no participant");
    client.slot();
    let early = client.open(0);
    assert_eq!((early.status, early.error().as_str()), (409, "episode 0 has not begun"));
    assert_eq!(client.append(1, &["{\"type\":\"trial\",\"trial\":0}\n".to_owned()]).stored(), 2);
    assert_eq!(client.turn(0, 0, &good).status, 409, "it is not open");
    client.open(0);
    let answers = play(&client, 0, 3, 5);
    let text = folder.text(&client.code);
    let again = client.turn(0, 2, &json!({ "frames": 200, "view_px": 128 }));
    assert_eq!(again.bytes, answers[2].bytes, "the answer to the last turn");
    for (number, status) in [(0, 409), (1, 409), (4, 409), (u64::MAX, 409)] {
        let refused = client.turn(0, number, &good);
        assert_eq!(
            (refused.status, refused.json()["next"].as_u64()),
            (status, Some(3)),
            "{number}"
        );
    }
    assert_eq!(client.turn(1, 3, &good).status, 409);
    let entity = json!({ "pick_up": { "object": { "entity": 3 }, "hand": "left" } });
    for (turn, words) in [
        (
            json!({ "frames": MAX_TURN_FRAMES + 1, "view_px": 64 }),
            "`frames` must be at most 240, not 241",
        ),
        (json!({ "frames": u32::MAX, "view_px": 64 }), "`frames` must be at most 240"),
        (json!({ "frames": -1, "view_px": 64 }), "invalid value"),
        (
            json!({ "frames": 1, "view_px": 65 }),
            "`view_px` must be a multiple of 64 up to 512, not 65",
        ),
        (json!({ "frames": 1, "view_px": 0 }), "`view_px` must be"),
        (json!({ "frames": 1, "view_px": 1024 }), "`view_px` must be"),
        (json!({ "frames": 1 }), "missing field `view_px`"),
        (json!({ "frames": 1, "view_px": 64, "goal": true }), "unknown field `goal`"),
        (json!({ "frames": 1, "view_px": 64, "input": { "cheat": 1 } }), "unknown variant `cheat`"),
        (json!({ "frames": 1, "view_px": 64, "input": { "action": entity } }), "names a pixel"),
        (json!([]), "the turn is invalid"),
    ] {
        let refused = client.turn(0, 3, &turn);
        assert_eq!(refused.status, 422, "{turn}: {refused:?}");
        assert!(refused.error().contains(words), "{turn}: {}", refused.error());
    }
    for (path, body, status) in [
        ("/trials/0/turns/3", "{", 422),
        ("/trials/0/turns/3", &*"x".repeat(MAX_TURN_BYTES + 1), 413),
        ("/trials/0/turns/+3", "", 404),
        ("/trials/-1", "", 404),
        ("/trials/0/turns/99999999999999999999999", "", 404),
        ("/trials/99999999999999999999999", "", 404),
        ("/trials/7", "", 409),
    ] {
        assert_eq!(client.request("PUT", path, body).status, status, "{path}");
    }
    let stranger = Client { token: "f".repeat(64), ..client.clone() };
    let foreign = server.client(2);
    foreign.slot();
    for answer in [
        stranger.open(0),
        stranger.turn(0, 3, &good),
        stranger.request("GET", "/data", ""),
        Client { code: client.code.clone(), ..foreign }.turn(0, 3, &good),
    ] {
        assert_eq!(answer.status, 401, "{answer:?}");
    }
    // The page cannot write what the server writes.
    for line in [
        "{\"type\":\"trace\",\"trial\":0,\"text\":\"\"}\n",
        "{\"type\":\"trial_end\",\"trial\":0,\"outcome\":\"ended\"}\n",
    ] {
        let refused = client.append(2, &[line.to_owned()]);
        assert_eq!(refused.status, 422);
        assert!(refused.error().contains("the server of this study writes"), "{}", refused.error());
    }
    assert_eq!(folder.text(&client.code), text);
    client.turn(0, 3, &good).turn();
    server.wait_secs(60);
    let flood = (0..TURN_RATE.burst + 10).filter(|_| client.turn(0, 3, &good).status == 429);
    assert_eq!(flood.count(), 10);
    let flood = (0..PARTICIPANT_RATE.burst + 10).filter(|_| client.open(0).status == 429);
    assert_eq!(flood.count(), 10);
    client.withdraw();
    assert_eq!(client.turn(0, 4, &good).status, 404);
    assert_eq!(server.problems(), [""; 0]);
}

#[test]
fn a_page_with_the_simulator_has_no_episodes_on_the_server() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let client = server.client(1);
    client.begin();
    for answer in
        [client.open(0), client.turn(0, 0, &json!({})), client.request("GET", "/data", "")]
    {
        assert_eq!((answer.status, answer.error().as_str()), (404, "there is no such page"));
    }
}

#[test]
fn a_helper_that_fails_ends_the_episode_and_the_researcher_learns_why() {
    let broken = SIMULATED.replace("seat = \"helper\"", "helper = \"broken\"");
    let folder = Folder::new(&broken);
    let server = folder.server();
    let client = server.client(1);
    client.begin();
    client.open(0);
    let answer = client.turn(0, 0, &json!({ "frames": 9, "view_px": SIDE_PX }));
    assert_eq!(answer.status, 422);
    assert_eq!(answer.json()["error"], "the episode cannot go on");
    let problems = server.problems();
    assert!(problems.iter().any(|problem| problem.contains("no idea")), "{problems:?}");
}

/// The page repeats a request with a status from 500 on, and the same turn would fail again.
#[test]
fn a_simulator_that_panics_ends_the_episode_and_not_the_study() {
    let panics = SIMULATED.replace("seat = \"helper\"", "helper = \"panics\"");
    let folder = Folder::new(&panics);
    let server = folder.server();
    let client = server.client(1);
    client.begin();
    client.open(0);
    let turn = json!({ "frames": 9, "view_px": SIDE_PX });
    let answer = client.turn(0, 0, &turn);
    assert_eq!((answer.status, answer.error().as_str()), (422, "the episode cannot go on"));
    let problems = server.problems();
    assert!(problems.len() == 1 && problems[0].contains("error of chaic"), "{problems:?}");
    assert_eq!(client.turn(0, 0, &turn).status, 409, "it is closed");
    let left = "{\"type\":\"trial_end\",\"trial\":0,\"outcome\":\"left\"}\n".to_owned();
    assert_eq!(client.append(2, &[left]).stored(), 3);
}

#[test]
fn a_server_without_a_helper_of_the_study_does_not_start() {
    let unknown = SIMULATED.replace("seat = \"helper\"", "helper = \"theirs\"");
    let error = Folder::new(&unknown).try_server().err().expect("an error").to_string();
    assert!(error.contains("unknown helper `theirs`"), "{error}");
}

#[test]
fn a_helper_that_decides_blocks_only_its_own_participant() {
    let slow = SIMULATED.replace("seat = \"helper\"", "helper = \"slow\"");
    let folder = Folder::new(&slow);
    let server = folder.server();
    let [client, other] = [server.client(1), server.client(2)];
    for client in [&client, &other] {
        client.begin();
        client.open(0);
    }
    let turn = json!({ "frames": 1, "view_px": SIDE_PX });
    std::thread::scope(|scope| {
        let first = scope.spawn(|| client.turn(0, 0, &turn));
        std::thread::sleep(SLOW / 4);
        let repeated = client.turn(0, 0, &turn);
        assert_eq!(repeated.status, 503, "{repeated:?}");
        assert!(repeated.error().contains("not answered yet"), "{}", repeated.error());
        assert_eq!(other.turn(0, 0, &turn).status, 200);
        let first = first.join().expect("no panic");
        assert_eq!(first.turn(), client.turn(0, 0, &turn).turn());
    });
}

#[test]
fn an_episode_whose_helper_is_stopped_with_the_server_can_go_on() {
    let halted = SIMULATED.replace("seat = \"helper\"", "helper = \"halted\"");
    let folder = Folder::new(&halted);
    let server = folder.server();
    let client = server.client(1);
    client.begin();
    client.open(0);
    // The page repeats a request with this status.
    assert_eq!(client.turn(0, 0, &json!({ "frames": 9, "view_px": SIDE_PX })).status, 503);
    assert_eq!(client.open(0).status, 200, "the episode is still running");
}
