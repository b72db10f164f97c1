//! Promises: the same content gives the same archive, and an extracted archive gives the same content.

use std::fs;
use std::path::Path;

use chaic_arena::archive::{content_sha256, extract, pack};
use chaic_arena::{ArenaError, Evaluation, Submission};
use chaic_eval::EvalError;
use chaic_files::FolderLock;

use crate::raw_tar::{MANIFEST, archive, file, folder, gzip, with_manifest};

/// Writes a submission with a program.
fn write_submission(at: &Path) {
    fs::create_dir_all(at.join("helper/lib")).expect("the disk has space");
    fs::create_dir_all(at.join("empty")).expect("the disk has space");
    fs::write(at.join("submission.toml"), MANIFEST).expect("the disk has space");
    fs::write(at.join("helper/helper.sh"), "exit 1\n").expect("the disk has space");
    fs::write(at.join("helper/lib/data.bin"), vec![7; 1500]).expect("the disk has space");
    fs::write(at.join("helper/.lock"), "").expect("the disk has space");
}

/// Writes bytecode as Python does beside a module that it imports; the bytes differ each time.
fn write_bytecode(helper: &Path, content: &str) {
    let folder = helper.join("__pycache__");
    fs::create_dir(&folder).expect("the disk has space");
    fs::write(folder.join("helper.cpython-311.pyc"), content).expect("the disk has space");
}

#[test]
fn equal_content_gives_equal_archives_and_comes_back() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    for name in ["a", "b"] {
        write_submission(&at.join(name));
        write_bytecode(&at.join(name).join("helper"), name);
    }
    let packed = pack(&at.join("a"), &at.join("a.tar")).expect("a plain folder");
    let again = pack(&at.join("b"), &at.join("b.tar")).expect("a plain folder");
    assert_eq!(packed, again);
    let bytes = fs::read(at.join("a.tar")).expect("an archive");
    assert_eq!(bytes, fs::read(at.join("b.tar")).expect("an archive"));
    // Three files of 1, 1 and 3 blocks, each with a header, and the end marker.
    assert_eq!((packed.n_files, packed.bytes), (3, 512 * 10));
    assert_eq!(content_sha256(&at.join("a")).expect("the folder"), packed.sha256);

    // A killed process leaves a part.
    fs::create_dir_all(at.join("new/c.tmp/helper")).expect("the disk has space");
    fs::write(at.join("new/c.tmp/helper/half"), "half").expect("the disk has space");
    extract(&at.join("a.tar"), &at.join("new/c")).expect("it was packed here");
    assert_eq!(content_sha256(&at.join("new/c")).expect("the folder"), packed.sha256);
    let data = fs::read(at.join("new/c/helper/lib/data.bin")).expect("the file");
    assert_eq!(data, vec![7; 1500]);
    assert!(!at.join("new/c/empty").exists() && !at.join("new/c/helper/.lock").exists());
    assert_eq!(fs::read_dir(at.join("new")).expect("the folder").count(), 1, "nothing is left");
    assert!(extract(&at.join("a.tar"), &at.join("new/c")).is_err(), "the folder exists");

    fs::write(at.join("a.tar.gz"), gzip(&bytes)).expect("the disk has space");
    extract(&at.join("a.tar.gz"), &at.join("d")).expect("gzip is allowed");
    assert_eq!(content_sha256(&at.join("d")).expect("the folder"), packed.sha256);
}

#[test]
fn an_archive_names_no_path_of_its_author() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_submission(&at.join("a"));
    let plain = pack(&at.join("a"), &at.join("plain.tar")).expect("a plain folder");
    let package = at.join("a/helper/mine-1.0.dist-info");
    fs::create_dir(&package).expect("the disk has space");
    let url = r#"{"url": "file:///home/author/mine-1.0-py3-none-any.whl"}"#;
    fs::write(package.join("direct_url.json"), url).expect("the disk has space");
    assert_eq!(pack(&at.join("a"), &at.join("a.tar")).expect("a plain folder"), plain);
    // Another folder may hold a file of this name.
    fs::write(at.join("a/helper/direct_url.json"), "{}").expect("the disk has space");
    let packed = pack(&at.join("a"), &at.join("a.tar")).expect("a plain folder");
    assert_eq!(packed.n_files, plain.n_files + 1);
    // Archives of other programs may hold such files, so they count in the version of the code.
    extract(&at.join("a.tar"), &at.join("b")).expect("it was packed here");
    assert_eq!(content_sha256(&at.join("b")).expect("the folder"), packed.sha256);
    assert_ne!(content_sha256(&at.join("a")).expect("the folder"), packed.sha256);
}

#[cfg(unix)]
#[test]
fn only_the_permission_to_execute_is_kept() {
    use std::os::unix::fs::PermissionsExt as _;
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_submission(&at.join("a"));
    let set = |name: &str, mode: u32| {
        let permissions = fs::Permissions::from_mode(mode);
        fs::set_permissions(at.join("a/helper").join(name), permissions).expect("an own file");
    };
    set("helper.sh", 0o4777);
    set("lib/data.bin", 0o600);
    pack(&at.join("a"), &at.join("a.tar")).expect("a plain folder");
    extract(&at.join("a.tar"), &at.join("b")).expect("it was packed here");
    let mode = |path: &str| fs::metadata(at.join(path)).expect("it exists").permissions().mode();
    let modes = ["b/helper/helper.sh", "b/helper/lib/data.bin"].map(|path| mode(path) & 0o7711);
    assert_eq!(modes, [0o711, 0o600]);
    assert_eq!(mode("b"), mode("a"), "as any new folder");
}

#[cfg(unix)]
#[test]
fn folders_with_links_are_not_packed() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    write_submission(&at.join("a"));
    std::os::unix::fs::symlink("/etc/hostname", at.join("a/helper/link")).expect("a link");
    let error = pack(&at.join("a"), &at.join("a.tar")).expect_err("a link").to_string();
    assert!(error.contains("link` is a link or no regular file"), "{error}");
    assert_eq!(fs::read_dir(at).expect("the folder").count(), 1, "no archive is left");
}

#[test]
fn an_archive_inside_its_own_folder_is_refused() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path().join("a");
    write_submission(&at);
    let before = content_sha256(&at).expect("a plain folder");
    for archive in ["a.tar", "helper/a.tar"] {
        let error = pack(&at, &at.join(archive)).expect_err("it lies inside").to_string();
        assert!(error.contains("would lie inside"), "{error}");
    }
    assert_eq!(content_sha256(&at).expect("a plain folder"), before, "no file is left");
}

#[test]
fn archives_of_other_programs_are_read() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    // As `tar -cf mine.tar -C mine .` writes them.
    let entries = [
        folder("./"),
        file("./submission.toml", MANIFEST),
        folder("./helper/"),
        file("./helper/helper.sh", "exit 1\n"),
    ];
    let mut bytes = archive(&entries);
    bytes.resize(bytes.len().next_multiple_of(10 << 10), 0);
    fs::write(at.join("mine.tar"), bytes).expect("the disk has space");
    extract(&at.join("mine.tar"), &at.join("mine")).expect("a plain archive");
    let submission = Submission::read(&at.join("mine")).expect("a submission");
    assert_eq!(submission.manifest().name, "mine");
}

#[test]
fn an_evaluation_keeps_its_submission() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path();
    let other = MANIFEST.replace("\"1.0\"", "\"1.1\"");
    for (name, manifest) in [("one.tar", MANIFEST), ("two.tar", other.as_str())] {
        fs::write(at.join(name), with_manifest(manifest)).expect("the disk has space");
    }
    let evaluation = Evaluation::at(&at.join("result"));
    fs::create_dir(at.join("result")).expect("the disk has space");
    let lock = FolderLock::acquire(&at.join("result")).expect("no process holds it");
    let error = evaluation.add_submission(&at.join("one.tar")).expect_err("it is locked");
    assert!(error.to_string().contains("result is in use by another process"), "{error}");
    drop(lock);
    let first = evaluation.add_submission(&at.join("one.tar")).expect("a submission");
    let again = evaluation.add_submission(&at.join("one.tar")).expect("the same submission");
    assert_eq!(first.sha256(), again.sha256());
    // A program that ran without a sandbox has written beside its modules.
    write_bytecode(&at.join("result/submission/helper"), "bytecode");
    let later = evaluation.add_submission(&at.join("one.tar")).expect("the same submission");
    assert_eq!(first.sha256(), later.sha256());
    let error = evaluation.add_submission(&at.join("two.tar")).expect_err("another one");
    assert!(error.to_string().contains("two.tar; choose another --out"), "{error}");
    assert!(matches!(error, ArenaError::Eval(EvalError::Options(_))), "an invalid request");
    // A folder with the same content is the same submission.
    extract(&at.join("one.tar"), &at.join("folder")).expect("a plain archive");
    let folder = evaluation.add_submission(&at.join("folder")).expect("the same submission");
    assert_eq!(folder.sha256(), first.sha256());
    assert_eq!(Evaluation::at(&at.join("result/score.json")).folder(), at.join("result"));
}
