//! Promise: an injected fault occurs at the planned operation only, and an atomic write then leaves the
//! old file. A plan is one per process, so one test of this file installs it.

use std::fs;

use chaic_files::faults::{FaultKind, FaultPlan, Operation, install, operations};
use chaic_files::{entries, write_atomically};

#[test]
fn a_write_that_fails_leaves_the_old_file_and_the_next_one_succeeds() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.txt");
    write_atomically(&path, b"old").expect("no fault is planned");
    assert!(operations().is_empty(), "nothing is recorded without a plan");

    // Operations of a write: open, write, flush, rename.
    let temporary = folder.path().join("a.txt.tmp");
    assert!(install(Some(FaultPlan { path: temporary, index: 2, kind: FaultKind::IoError })));
    let error = write_atomically(&path, b"new").expect_err("the flush fails");
    assert!(error.to_string().starts_with("can't write"), "{error}");
    assert_eq!(fs::read(&path).expect("the old file"), b"old");
    assert_eq!(entries(folder.path()).expect("a folder"), std::slice::from_ref(&path));

    write_atomically(&path, b"new").expect("one operation fails");
    assert_eq!(fs::read(&path).expect("the new file"), b"new");
    let found: Vec<Operation> = operations().iter().map(|record| record.operation).collect();
    let write = [Operation::Open, Operation::Write, Operation::Sync, Operation::Rename];
    let failed = [Operation::Open, Operation::Write, Operation::Sync, Operation::Remove];
    assert_eq!(found, [failed, write].concat());
    assert!(!install(None), "the first plan stays");
}

#[test]
fn every_kind_of_fault_has_a_name() {
    for kind in FaultKind::ALL {
        assert_eq!(kind.name().parse(), Ok(kind));
        assert!(Operation::ALL.into_iter().any(|operation| kind.applies_to(operation)));
    }
    assert!("disk-full".parse::<FaultKind>().expect_err("no such fault").contains("no-space"));
}
