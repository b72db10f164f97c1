//! Promise: if the server simulates, nothing that it sends before the end of an episode has the episode, its goal or
//! its trace. A page that simulates is the positive control.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use chaic_study_server::MAX_TURN_FRAMES;
use miniz_oxide::inflate::decompress_to_vec;
use serde_json::{Value, json};

use crate::kit::{Folder, SIMULATED, Server};

/// Parts of a state that the person's agent observes: names of objects may be in them.
const OBSERVED: [&str; 5] = ["plans", "hands", "failure", "caption", "events"];
/// All parts of a state.
const PARTS: [&str; 10] = [
    "frame",
    "horizon",
    "status",
    "plans",
    "hands",
    "failure",
    "is_refused",
    "caption",
    "progress",
    "events",
];

/// Returns the page without its program, with its compressed parts decompressed.
fn page(server: &Server) -> Vec<u8> {
    let host = server.address;
    let request = format!("GET / HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    let page = server.raw(request.as_bytes()).expect("an answer");
    let (page, _) = page.body.split_once("<script>").expect("a program at the end");
    let mut all = page.as_bytes().to_vec();
    for part in page.split("<script type=\"text/plain\" id=\"").skip(1) {
        let (_, content) = part.split_once('>').expect("a tag");
        let (content, _) = content.split_once('<').expect("an end");
        if let Ok(bytes) = STANDARD.decode(content) {
            all.extend(decompress_to_vec(&bytes).expect("raw deflate"));
        }
    }
    all
}

fn contains(bytes: &[u8], text: &str) -> bool {
    bytes.windows(text.len()).any(|window| window == text.as_bytes())
}

#[test]
fn nothing_before_the_end_reveals_the_goal() {
    let folder = Folder::new(SIMULATED);
    let plan = folder.plan();
    let episode = &plan.episodes()[0];
    let classes: Vec<&str> =
        episode.setup().goal.targets.iter().map(|(c, _)| c.info().label).collect();
    assert!(!classes.is_empty());
    let server = folder.server();
    let client = server.client(1);
    let mut sent = page(&server);
    sent.extend(client.enter().bytes);
    sent.extend(client.append(1, &["{\"type\":\"trial\",\"trial\":0}\n".to_owned()]).bytes);
    sent.extend(client.request("GET", "", "").bytes);
    let opened = client.open(0);
    assert_eq!(opened.json()["info"]["goal"], json!([]));
    assert_eq!(opened.json()["info"]["person"], "helper", "not that of the partner");
    sent.extend(opened.bytes);
    let mut unobserved = Vec::new();
    let mut last = Value::Null;
    let mut number = 0;
    loop {
        let mut turn = json!({ "frames": MAX_TURN_FRAMES, "view_px": 64 });
        if let Some(plan) = last["plans"].get(0) {
            turn["input"] = json!({ "plan": plan });
        }
        let answer = client.turn(0, number, &turn);
        let (mut state, picture) = answer.turn();
        if state["status"] == "ended" {
            break;
        }
        last = state.clone();
        let parts = state.as_object_mut().expect("an object");
        let mut names: Vec<&str> = parts.keys().map(String::as_str).collect();
        let mut expected = PARTS;
        names.sort_unstable();
        expected.sort_unstable();
        assert_eq!(
            names, expected,
            "a new part of a state needs a decision whether people may see it"
        );
        assert_eq!(parts["progress"], Value::Null, "the total value of the goal");
        OBSERVED.iter().for_each(|name| drop(parts.remove(*name)));
        unobserved.extend(state.to_string().into_bytes());
        assert!(picture.starts_with(b"\x89PNG"));
        sent.extend(&answer.bytes);
        number += 1;
        server.wait_secs(1);
    }
    assert!(number > 10, "{number}");
    let stored = folder.text(&client.code);
    let header = stored.lines().find_map(|line| {
        let record: Value = serde_json::from_str(line).expect("JSON");
        record["text"].as_str().and_then(|text| text.lines().next()).map(str::to_owned)
    });
    let header = header.expect("a trace");
    assert!(header.contains(episode.id()), "{header}");
    let hidden = [
        episode.id(),
        plan.digest(),
        &plan.digest()[..8],
        &header,
        &episode.to_json_line(),
        "\"setup\"",
        "\"targets\"",
        "\"trace\"",
        "\"end\"",
    ];
    for text in hidden {
        assert!(!contains(&sent, text), "{text}");
    }
    for class in classes {
        assert!(!contains(&unobserved, class), "{class}");
    }

    // The positive control.
    let folder = Folder::new(&SIMULATED.replace("simulator = \"server\"\n", ""));
    let page = page(&folder.server());
    let plan = folder.plan();
    for text in [plan.digest(), &plan.episodes()[0].to_json_line().replace('"', "\\\""), "targets"]
    {
        assert!(contains(&page, text), "{text}");
    }
}
