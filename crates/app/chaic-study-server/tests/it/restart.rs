//! Promises: a server that starts again knows participants, tokens and slots from the files; it removes an incomplete
//! line and what an interruption left; it refuses a folder that is in use or has other data.

use std::fs;

use chaic_study_server::ServerError;

use crate::kit::{DEFINITION, Folder, code, lines};

#[test]
fn participants_go_on_after_a_restart() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    assert_eq!([1, 2].map(|n| server.client(n).slot()), [1, 2]);
    assert_eq!(server.client(1).append(1, &lines()).stored(), 8);
    assert_eq!(server.client(2).append(1, &lines()[..2]).stored(), 3);
    server.stop();
    // A power failure in the middle of a write.
    let path = folder.data().join(format!("{}.jsonl", code(2)));
    let text = folder.text(&code(2));
    fs::write(&path, format!("{text}{}", &lines()[2][..20])).expect("the disk has space");
    fs::write(folder.data().join(format!("{}.token", code(9))), "").expect("the disk has space");
    fs::write(folder.data().join(format!("{}.jsonl.tmp", code(9))), "")
        .expect("the disk has space");
    fs::write(folder.data().join("notes.txt"), "kept").expect("the disk has space");

    let server = folder.server();
    assert_eq!(folder.text(&code(2)), text);
    assert_eq!(folder.files().len(), 5, "{:?}", folder.files());
    let client = server.client(2);
    assert_eq!(client.enter().json()["start"]["slot"], 2);
    assert_eq!(client.append(1, &lines()).stored(), 8);
    let stranger = crate::kit::Client { token: "0".repeat(64), ..client };
    assert_eq!(stranger.append(8, &[]).status, 401);
    assert_eq!(server.client(3).slot(), 3);
    assert_eq!(server.client(4).enter().status, 410);
    // The first two are done. The third has the time-out from its entry.
    server.wait_secs(3600);
    assert_eq!(server.client(4).slot(), 3);
}

#[test]
fn the_time_out_begins_again_with_the_server() {
    let folder = Folder::new(&DEFINITION.replace("participants = 3", "participants = 1"));
    let server = folder.server();
    assert_eq!(server.client(1).slot(), 1);
    server.wait_secs(3000);
    server.stop();
    let server = folder.server();
    server.wait_secs(3000);
    assert_eq!(server.client(2).enter().status, 410);
    server.wait_secs(600);
    assert_eq!(server.client(2).slot(), 1);
}

#[test]
fn folders_in_use_and_other_data_are_refused() {
    let folder = Folder::new(DEFINITION);
    let server = folder.server();
    let error = folder.try_server().err().expect("the folder is in use");
    assert!(matches!(error, ServerError::Lock(_)), "{error}");
    assert_eq!(server.client(1).slot(), 1);
    server.stop();
    let text = folder.text(&code(1));
    let digest = folder.plan().digest().to_owned();
    for (changed, words) in [
        (text.replace(&digest, &"0".repeat(64)), "line 1: the data are of another study"),
        (text.replace(&code(1), &code(2)), "rename the file"),
        (text.replace("\"slot\":1", "\"slot\":4"), "line 1: no slot 4"),
        (text.clone() + "{}\n", "line 2: no record"),
        (text.clone() + &text, "line 2: a second `start`"),
        (String::new(), "the first record must be `start`"),
    ] {
        let path = folder.data().join(format!("{}.jsonl", code(1)));
        fs::write(&path, &changed).expect("the disk has space");
        let message = folder.try_server().err().expect(words).to_string();
        assert!(message.contains(words), "{message}");
        assert!(!message.contains('\n'), "{message}");
        assert_eq!(folder.text(&code(1)), changed, "nothing is changed");
    }
    let token = folder.data().join(format!("{}.token", code(1)));
    fs::write(folder.data().join(format!("{}.jsonl", code(1))), &text).expect("the disk has space");
    fs::write(&token, "x").expect("the disk has space");
    let message = folder.try_server().err().expect("a damaged token").to_string();
    assert!(message.contains("holds no digest"), "{message}");
}
