//! Promises: a participation reaches the folder as it was sent, and `export` reads it; a repeated request changes
//! nothing; slots are free after their time-out; a withdrawal deletes all.

use std::fs;

use chaic_files::faults::{FaultKind, FaultPlan, install};
use chaic_study::export::export;

use crate::kit::{DEFINITION, Folder, SIMULATED, lines};

#[test]
fn a_participation_is_stored_as_sent_and_exported() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let client = server.client(1);
    let entered = client.enter();
    assert_eq!(entered.status, 201);
    let start = &entered.json()["start"];
    assert_eq!((start["slot"].as_u64(), start["code"].as_str()), (Some(1), Some(&*client.code)));
    let lines = lines();
    for (k, line) in lines.iter().enumerate() {
        let stored = client.append(k + 1, std::slice::from_ref(line)).stored();
        assert_eq!(stored, k as u64 + 2);
    }
    let first = folder.text(&client.code).lines().next().expect("a line").to_owned();
    assert_eq!(&serde_json::from_str::<serde_json::Value>(&first).expect("JSON"), start);
    assert!(entered.body.contains(&first), "the page gets the bytes of the file");
    assert_eq!(folder.text(&client.code), format!("{first}\n{}", lines.concat()));
    for file in folder.files() {
        let text = fs::read_to_string(folder.data().join(&file)).expect("a text");
        assert!(!text.contains(&client.token), "{file}");
    }
    let counts = server.stop();
    assert_eq!((counts.participants, counts.complete), (1, 1));
    let report = export(&folder.plan(), &[folder.data()], &folder.path().join("set"));
    let report = report.expect("valid data");
    assert_eq!((report.participants, report.completed), (1, 1));
    assert_eq!(report.open_slots, [2, 3]);
}

#[test]
fn repeated_requests_change_nothing() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let client = server.client(1);
    let lines = lines();
    let first = client.enter();
    assert_eq!(first.json(), client.enter().json());
    assert_eq!(client.append(1, &lines[..3]).stored(), 4);
    let text = folder.text(&client.code);
    // All records again, some records again, and records whose answer was lost together with new
    // ones.
    assert_eq!(client.append(1, &lines[..3]).stored(), 4);
    assert_eq!(client.append(2, &lines[1..2]).stored(), 4);
    assert_eq!(client.append(4, &[]).stored(), 4);
    assert_eq!(client.request("GET", "", "").stored(), 4);
    assert_eq!(folder.text(&client.code), text);
    assert_eq!(client.append(2, &lines[1..5]).stored(), 6);
    assert_eq!(folder.text(&client.code), text + &lines[3..5].concat());
    assert_eq!(client.enter().json()["stored"], 6);
    // Records that were skipped are asked for.
    let gap = client.append(7, &lines[6..]);
    assert_eq!((gap.status, gap.json()["stored"].as_u64()), (409, Some(6)));
    // Another page cannot change what is stored.
    let other = client.append(2, &lines[2..3]);
    assert_eq!(other.status, 422);
    assert_eq!(other.error(), "record 2: another record is stored");
    assert_eq!(client.append(6, &lines[5..]).stored(), 8);
}

/// In a study that the server simulates, the page has another digest in its first record than the file.
#[test]
fn the_first_record_can_be_sent_again() {
    for definition in [DEFINITION, SIMULATED] {
        let folder = Folder::new(definition);
        let server = folder.server();
        let client = server.client(1);
        let entered = client.enter().body;
        let start =
            entered.strip_prefix("{\"start\":").and_then(|rest| rest.split_once(",\"stored"));
        let start = format!("{}\n", start.expect("the record of the page").0);
        let begun = [start.clone(), "{\"type\":\"trial\",\"trial\":0}\n".to_owned()];
        let text = folder.text(&client.code);
        assert_eq!(client.append(0, &begun[..1]).stored(), 1);
        assert_eq!(client.append(0, &begun).stored(), 2);
        assert_eq!(client.append(0, &begun).stored(), 2);
        let other = start.replace("\"slot\":1", "\"slot\":2");
        let refused = client.append(0, &[other]);
        assert_eq!(refused.status, 422);
        assert_eq!(refused.error(), "record 0: another record is stored");
        assert_eq!(folder.text(&client.code), text + &begun[1]);
    }
}

#[test]
fn invalid_records_are_refused_with_all_of_their_request() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let client = server.client(1);
    client.slot();
    let good = lines()[0].clone();
    let text = folder.text(&client.code);
    for (line, words) in [
        ("{}\n", "record 2: no record"),
        ("\n", "record 2: no record"),
        ("{\"type\":\"instructed\",\"name\":\"a person\"}\n", "unknown field `name`"),
        ("{\"type\":\"trial\",\"trial\":2}\n", "slot 1 has no trial 2"),
        ("{\"type\":\"trace\",\"trial\":0,\"text\":\"\"}\n", "trial 0 is not running"),
        ("{\"type\":\"complete\"}", "the line has no end"),
        (text.as_str(), "a second `start`"),
    ] {
        let answer = client.append(1, &[good.clone(), line.to_owned()]);
        assert_eq!(answer.status, 422, "{line}");
        assert!(answer.error().contains(words), "{line}: {}", answer.error());
        assert_eq!(folder.text(&client.code), text);
    }
}

#[test]
fn slots_are_free_after_their_time_out_and_not_before() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    assert_eq!([1, 2, 3].map(|n| server.client(n).slot()), [1, 2, 3]);
    let refused = server.client(4).enter();
    assert_eq!(
        (refused.status, refused.error().as_str()),
        (410, "all places of the study are taken")
    );
    server.wait_secs(3599);
    assert_eq!(server.client(4).enter().status, 410);
    // The second participant finishes after the time-out, before the slot is given away.
    server.wait_secs(1);
    assert_eq!(server.client(2).append(1, &lines()).stored(), 8);
    assert_eq!(server.client(4).slot(), 1);
    assert_eq!(server.client(5).slot(), 3);
    assert_eq!(server.client(6).enter().status, 410);
    // A late participant can go on; the slot is done and not given away again.
    assert_eq!(server.client(1).append(1, &lines()).stored(), 8);
    server.wait_secs(3600);
    assert_eq!(server.client(6).slot(), 3);
    assert_eq!(server.client(7).enter().status, 410);
    let counts = server.stop();
    assert_eq!((counts.participants, counts.complete), (6, 2));
}

#[test]
fn a_withdrawal_deletes_all_and_frees_the_slot() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let [client, other] = [1, 2].map(|n| server.client(n));
    assert_eq!([client.slot(), other.slot()], [1, 2]);
    client.append(1, &lines());
    assert_eq!(client.withdraw().status, 200);
    assert_eq!(folder.files(), [format!("{}.jsonl", other.code), format!("{}.token", other.code)]);
    // A record that was on its way, and a repeated withdrawal.
    assert_eq!(client.append(8, &[]).status, 404);
    assert_eq!(client.withdraw().status, 404);
    assert_eq!(folder.files().len(), 2);
    assert_eq!(server.client(3).slot(), 1, "the slot is free, also after the end");
}

#[test]
fn a_file_that_another_program_removes_or_changes_is_not_written() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let [client, other] = [1, 2].map(|n| server.client(n));
    assert_eq!([client.slot(), other.slot()], [1, 2]);
    chaic_study::deletion::delete(&client.code, &folder.data()).expect("a code");
    assert_eq!(client.append(1, &lines()).status, 404);
    assert_eq!(folder.files().len(), 2);
    assert_eq!(server.client(3).slot(), 1);

    let path = folder.data().join(format!("{}.jsonl", other.code));
    let changed = folder.text(&other.code) + "a note\n";
    fs::write(&path, &changed).expect("the disk has space");
    let answer = other.append(1, &lines());
    assert_eq!(answer.status, 500);
    assert_eq!(server.problems(), [answer.error()]);
    assert_eq!(folder.text(&other.code), changed);
}

#[test]
fn records_that_the_disk_refuses_are_not_acknowledged_and_not_repeated() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let client = server.client(1);
    client.slot();
    let first = folder.text(&client.code);
    // Each append opens, writes and synchronizes the file: the second synchronization fails.
    let path = folder.data().join(format!("{}.jsonl", client.code));
    assert!(install(Some(FaultPlan { path, index: 5, kind: FaultKind::IoError })));
    let lines = lines();
    assert_eq!(client.append(1, &lines[..2]).stored(), 3);
    let refused = client.append(3, &lines[2..]);
    assert_eq!(
        (refused.status, refused.error().as_str()),
        (500, "the server cannot store data now")
    );
    assert_eq!(folder.text(&client.code), first.clone() + &lines[..2].concat());
    assert_eq!(server.problems().len(), 1);
    assert_eq!(client.append(3, &lines[2..]).stored(), 8);
    assert_eq!(folder.text(&client.code), first + &lines.concat());
}
