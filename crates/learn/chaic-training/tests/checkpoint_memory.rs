//! Reading a checkpoint allocates at most a small multiple of its size, whatever lengths it states.
//!
//! This test runs in its own process and measures the peak memory of that process.

#![cfg(target_os = "linux")]

use chaic_nn::Network;
use chaic_training::checkpoint::{Checkpoint, CheckpointError, Identity, MAGIC, VERSION};
use xxhash_rust::xxh3::xxh3_128;

/// Memory that a refused checkpoint of a megabyte may allocate, kB.
const ALLOWED_KB: u64 = 64 * 1024;

/// Returns the peak resident memory of the process, kB.
fn peak_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

/// Returns a checkpoint file with this body and a matching digest.
fn file(body: &[u8]) -> Vec<u8> {
    let head = [&MAGIC[..], &VERSION.to_le_bytes()].concat();
    let digest = xxh3_128(&[&head[..], body].concat());
    [&head[..], &digest.to_le_bytes(), body].concat()
}

#[test]
fn stated_lengths_take_no_memory() {
    let identity = Identity::new("test", &Network::default());
    let mut checkpoint = Checkpoint::default();
    checkpoint.insert_integers("steps", vec![1; 4]);
    let valid = checkpoint.to_bytes(&identity).unwrap();
    let body = &valid[36..];
    assert_eq!(file(body), valid, "the file is as the format says");
    let huge = postcard::to_stdvec(&(1u64 << 63)).unwrap();
    let before = peak_kb();
    // A length of 2^63 in place of every byte, followed by a megabyte of values.
    for at in 0..body.len() {
        let body = [&body[..at], &huge[..], &vec![0; 1 << 20][..]].concat();
        let read = Checkpoint::from_bytes(&file(&body), &identity);
        assert!(matches!(read, Err(CheckpointError::Damaged(_))), "{at}: {read:?}");
    }
    let taken = peak_kb() - before;
    assert!(taken < ALLOWED_KB, "{taken} kB");
}
