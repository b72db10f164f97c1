//! Promise: 100 participants at once have different slots, and each record is stored once and in order.

use std::collections::BTreeSet;
use std::thread;

use crate::kit::{Client, DEFINITION, Folder, lines};

/// Enters, sends each record in a request of its own and every third one twice. Returns the slot.
fn participate(client: &Client, lines: &[String]) -> u64 {
    let slot = client.slot();
    for (k, line) in lines.iter().enumerate() {
        for _ in 0..=usize::from(k % 3 == 0) {
            let stored = client.append(k + 1, std::slice::from_ref(line)).stored();
            assert_eq!(stored, k as u64 + 2);
        }
    }
    slot
}

#[test]
fn a_hundred_participants_at_once_lose_and_mix_nothing() {
    let folder = Folder::new(&DEFINITION.replace("participants = 3", "participants = 100"));
    let server = folder.server();
    let mut lines = lines();
    for k in 0..20 {
        lines.insert(2 + k, format!("{{\"type\":\"trace\",\"trial\":0,\"text\":\"[{k}]\\n\"}}\n"));
    }
    let slots: BTreeSet<u64> = thread::scope(|scope| {
        let run = |n: usize| {
            let (client, lines) = (server.client(n), &lines);
            scope.spawn(move || participate(&client, lines))
        };
        let running: Vec<_> = (0..100).map(run).collect();
        running.into_iter().map(|thread| thread.join().expect("no panic")).collect()
    });
    assert_eq!(slots, (1..=100).collect());
    for n in 0..100 {
        let text = folder.text(&server.client(n).code);
        let (_, rest) = text.split_once('\n').expect("a first line");
        assert_eq!(rest, lines.concat());
    }
    assert_eq!(server.problems(), [""; 0]);
    let counts = server.stop();
    assert_eq!((counts.participants, counts.complete), (100, 100));
}
