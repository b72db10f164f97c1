//! Promise: a hostile archive or manifest gives one clear error, and writes nothing.

use std::fs;
use std::path::Path;

use chaic_arena::Evaluation;
use chaic_arena::archive::{MAX_ENTRIES, extract};

use crate::raw_tar::{
    BLOCK, Header, MANIFEST, archive, entry, file, folder, gzip, special, with, with_manifest,
};

/// Name, archive, and words of the error.
type Case = (&'static str, Vec<u8>, &'static str);

/// Returns the archive of a submission with a file of this path.
fn at_path(path: &[u8]) -> Vec<u8> {
    with(entry(&Header { path, ..Header::default() }, b"evil"))
}

/// Returns the archive of a submission with a file below a prefix of the ustar header.
fn at_prefix(prefix: &[u8], path: &[u8]) -> Vec<u8> {
    with(entry(&Header { prefix, path, ..Header::default() }, b"evil"))
}

/// Returns the archive of a submission with this field of the size.
fn with_size(size: &[u8]) -> Vec<u8> {
    with(entry(&Header { size, ..Header::default() }, b""))
}

fn paths() -> Vec<Case> {
    let long = vec![b'a'; 100];
    let deep = "a/".repeat(8) + "evil";
    vec![
        ("parent", at_path(b"../evil"), "leads out of the archive"),
        ("parent inside", at_path(b"helper/../../evil"), "leads out of the archive"),
        ("parent after ./", at_path(b"./../evil"), "leads out of the archive"),
        ("parent as a folder", with(folder("..")), "leads out of the archive"),
        ("parent as an inner folder", with(folder("helper/../")), "leads out of the archive"),
        ("absolute", at_path(b"/etc/evil"), "is an absolute path"),
        ("two slashes", at_path(b"//evil"), "is an absolute path"),
        ("absolute after ./", at_path(b".//evil"), "is an absolute path"),
        ("empty name", at_path(b"helper//evil"), "has an empty name"),
        ("dot", at_path(b"helper/./evil"), "has an empty name or `.`"),
        ("no path", at_path(b""), "has no path"),
        ("file with a slash", at_path(b"helper/evil/"), "has an empty name"),
        ("backslash", at_path(b"helper\\..\\evil"), "other characters"),
        ("drive", at_path(b"C:/evil"), "other characters"),
        ("line break", at_path(b"helper/evil\n"), "other characters"),
        ("escape", at_path(b"helper/\x1b[2Jevil"), "other characters"),
        ("UTF-8", at_path("helper/\u{e9}vil".as_bytes()), "other characters"),
        ("invalid UTF-8", at_path(b"helper/\xff\xfe"), "other characters"),
        ("right to left", at_path("helper/\u{202e}live".as_bytes()), "other characters"),
        ("dot at the end", at_path(b"helper/evil."), "ends with a space or dot"),
        ("space at the end", at_path(b"helper/evil "), "ends with a space or dot"),
        ("space at the start", at_path(b"helper/ evil"), "begins with a space"),
        ("long", at_prefix(&[long.clone(), vec![b'b'; 10]].concat(), &long), "longer than 200"),
        ("deep", at_path(deep.as_bytes()), "has more than 8 names"),
        ("lock file", at_path(b"helper/.lock"), "is named `.lock`"),
        ("bytecode", at_path(b"helper/__pycache__/evil.pyc"), "belongs to `__pycache__`"),
        ("folder of bytecode", with(folder("helper/__pycache__/")), "belongs to `__pycache__`"),
        ("parent in the prefix", at_prefix(b"..", b"evil"), "leads out of the archive"),
        ("absolute prefix", at_prefix(b"/etc", b"evil"), "is an absolute path"),
    ]
}

fn kinds() -> Vec<Case> {
    let pax =
        |kind| entry(&Header { kind, path: b"pax", ..Header::default() }, b"16 path=../evil\n");
    let below = |kind| [special(kind, "/tmp"), file("helper/evil/x", "evil")].concat();
    vec![
        ("symbolic link", with(special(b'2', "/etc/passwd")), "is a symbolic link"),
        ("link to the parent", with(special(b'2', "../..")), "is a symbolic link"),
        ("file below a link", with(below(b'2')), "is a symbolic link"),
        ("hard link", with(special(b'1', "/etc/passwd")), "is a hard link"),
        ("hard link inside", with(special(b'1', "helper/helper.sh")), "is a hard link"),
        ("character device", with(special(b'3', "")), "is a character device"),
        ("block device", with(special(b'4', "")), "is a block device"),
        ("pipe", with(special(b'6', "")), "is a named pipe"),
        ("contiguous", with(special(b'7', "")), "is an entry of another kind"),
        ("sparse", with(special(b'S', "")), "is a sparse file"),
        ("volume", with(special(b'V', "")), "is an entry of another kind"),
        ("continuation", with(special(b'M', "")), "is an entry of another kind"),
        ("unknown kind", with(special(b'Z', "")), "is an entry of another kind"),
        ("long name", with(special(b'L', "")), "is a long name of GNU tar"),
        ("long link", with(special(b'K', "")), "is a long name of GNU tar"),
        ("pax path", with(pax(b'x')), "is a pax header"),
        ("global pax path", with(pax(b'g')), "is a pax header"),
    ]
}

fn conflicts() -> Vec<Case> {
    let two = |a: Vec<u8>, b: Vec<u8>| with([a, b].concat());
    let evil = || file("helper/evil", "evil");
    vec![
        ("twice", two(evil(), evil()), "`helper/evil`, occurs twice"),
        ("manifest twice", with(file("submission.toml", MANIFEST)), "occurs twice"),
        ("case", two(evil(), file("helper/EVIL", "")), "differs from `helper/evil` in case only"),
        ("case of a folder", with(file("Helper/x", "")), "differs from `helper` in case only"),
        ("below a file", two(evil(), file("helper/evil/x", "")), "which is a file"),
        ("folder over a file", two(evil(), folder("helper/evil/")), "occurs twice"),
        ("file over a folder", with(file("helper", "")), "occurs twice"),
        ("folder twice", two(folder("helper/a/"), folder("helper/a/")), "occurs twice"),
    ]
}

fn sizes() -> Vec<Case> {
    let many = (0..=MAX_ENTRIES).flat_map(|k| folder(&format!("helper/{k}/"))).collect();
    let filled = entry(&Header { kind: b'5', ..Header::default() }, b"content");
    vec![
        ("8 GiB", with_size(b"77777777777\0"), "has 8589934591 bytes, more than"),
        ("2^62 bytes", with_size(b"\x80\0\0\0\x40\0\0\0\0\0\0\0"), "more than 1073741824"),
        ("letters as size", with_size(b"00000000zzz\0"), "has a damaged size"),
        ("folder with content", with(filled), "is a folder with content"),
        ("many entries", archive(&[many]), "more than 20000 entries"),
        ("content is missing", with_size(b"00000100000\0"), "it is cut off within entry 3"),
    ]
}

fn damages() -> Vec<Case> {
    let good = with(file("helper/more", "more"));
    let end = good.len() - 2 * BLOCK;
    let mut checksum = good.clone();
    checksum[0] ^= 1;
    let v7 = Header { magic: b"\0\0\0\0\0\0\0\0", ..Header::default() };
    let padded = |n: usize| [&good[..], &vec![0; n]].concat();
    vec![
        ("empty file", Vec::new(), "it is no tar archive, or it is cut off"),
        ("text", b"Dear organizer,\n".repeat(100), "of no tar format"),
        ("zip", [&b"PK\x03\x04"[..], &[0; 2 * BLOCK]].concat(), "of no tar format"),
        ("only an end marker", archive(&[]), "it is empty"),
        ("cut header", good[..end - BLOCK - 100].to_vec(), "cut off"),
        ("cut content", good[..end - 100].to_vec(), "it is cut off within entry 3"),
        ("no end marker", good[..end].to_vec(), "it is cut off: a header or the end marker"),
        ("half an end marker", good[..end + BLOCK].to_vec(), "cut off within its end marker"),
        ("checksum", checksum, "the header of entry 1 is damaged"),
        ("old header", with(entry(&v7, b"")), "the header of entry 3 is damaged"),
        ("hidden data", [&good[..], b"evil"].concat(), "data follows its end marker"),
        ("second archive", [&good[..], &good].concat(), "data follows its end marker"),
        ("long padding", padded(1 << 20), "more data follows its end marker"),
        ("gzip bomb", gzip(&padded(64 << 20)), "more data follows its end marker"),
        ("large file in gzip", gzip(&with_size(b"77777777777\0")), "has 8589934591 bytes"),
        ("cut gzip", gzip(&good)[..60].to_vec(), "it cannot be read to its end"),
        ("gzip checksum", altered_end(gzip(&good)), "it cannot be read to its end"),
        ("text after gzip", [gzip(&good), b"evil".repeat(9)].concat(), "be read to its end"),
        ("gzip in gzip", gzip(&gzip(&good)), "it is no tar archive"),
        ("parent in gzip", gzip(&at_path(b"../evil")), "leads out of the archive"),
    ]
}

/// Changes the checksum at the end of a gzip file.
fn altered_end(mut bytes: Vec<u8>) -> Vec<u8> {
    let at = bytes.len() - 8;
    bytes[at] ^= 1;
    bytes
}

fn layouts() -> Vec<Case> {
    let helper = || file("helper/helper.sh", "exit 1\n");
    let wrapped = [file("mine/submission.toml", MANIFEST), file("mine/helper/helper.sh", "")];
    vec![
        ("no manifest", archive(&[helper()]), "submission.toml is missing at its top"),
        ("one folder too many", archive(&wrapped), "submission.toml is missing at its top"),
        (
            "manifest as a folder",
            archive(&[folder("submission.toml/"), helper()]),
            "submission.toml is missing at its top, or is no regular file",
        ),
        ("other entry", with(file("run.sh", "")), "it holds `run.sh`; its entries are"),
        ("hidden entry", with(file(".profile", "")), "it holds `.profile`"),
        (
            "no helper",
            archive(&[file("submission.toml", MANIFEST)]),
            "the folder `helper` is missing",
        ),
        (
            "helper as a file",
            archive(&[file("submission.toml", MANIFEST), file("helper", "")]),
            "the folder `helper` is missing",
        ),
    ]
}

fn manifests() -> Vec<Case> {
    let changed = |from: &str, to: &str| {
        assert!(MANIFEST.contains(from), "{from}");
        with_manifest(&MANIFEST.replacen(from, to, 1))
    };
    let command = r#"command = ["sh", "helper.sh"]"#;
    let policy = |path: &str| changed(command, &format!("policy = \"{path}\""));
    let built_in = MANIFEST.replacen(command, "built_in = \"rhp\"", 1);
    let not_utf8 =
        entry(&Header { path: b"submission.toml", ..Header::default() }, b"a = \"\xff\"");
    vec![
        ("no TOML", with_manifest("{}"), "submission.toml: line 1"),
        ("empty manifest", with_manifest(""), "missing field"),
        ("not UTF-8", archive(&[not_utf8]), "it is not UTF-8"),
        ("long manifest", with_manifest(&"#".repeat(65 << 10)), "it is longer than"),
        ("unknown field", changed("[training]", "[training]\nsudo = true"), "unknown field `sudo`"),
        ("wrong type", changed("core_hours = 0", "core_hours = \"0\""), "`training.core_hours`: "),
        ("license", changed("\"MIT\"", "\"Mine\""), "`license` is no SPDX expression"),
        ("name", changed("\"mine\"", "\"../mine\""), "`name`: `../mine` is not a valid name"),
        ("escape in a text", changed("Waits.", "\\u001b[2J"), "`description` has a line break"),
        ("formula", changed("\"1.0\"", "\"=1+1\""), "`release` has other characters"),
        ("version of chaic", changed("0.1.0", "9.9.9"), "`chaic` is 9.9.9, but this is chaic"),
        ("policy outside", policy("../../weights"), "`helper.policy`: "),
        ("absolute policy", policy("/etc/passwd"), "`helper.policy`: "),
        ("missing policy", policy("weights"), "`helper/weights`, the policy of the manifest, is"),
        ("two helpers", changed(command, "policy = \"a\"\nbuilt_in = \"b\""), "give exactly one"),
        ("foreign built-in", with_manifest(&built_in), "a built-in helper keeps its name"),
        (
            "built-in with a folder",
            with_manifest(&built_in.replacen("\"mine\"", "\"rhp\"", 1)),
            "a built-in helper needs no folder",
        ),
        (
            "weights from elsewhere",
            changed("[training]", "[play]\nperception = \"learned:/etc/passwd\"\n[training]"),
            "`play.perception` is `learned:/etc/passwd`",
        ),
        (
            "grant of another track",
            changed("[training]", "[play]\ntrack = \"hidden\"\ngrants = [\"goal\"]\n[training]"),
            "`play`: helper `mine` is granted goal",
        ),
    ]
}

/// Returns all files below a folder with their content, and all folders.
fn snapshot(folder: &Path) -> Vec<(String, Option<Vec<u8>>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder") {
        let path = entry.expect("an entry").path();
        let name = path.display().to_string();
        match path.is_dir() {
            true => {
                found.push((name, None));
                found.extend(snapshot(&path));
            }
            false => found.push((name, Some(fs::read(&path).expect("the file")))),
        }
    }
    found.sort();
    found
}

#[test]
fn hostile_submissions_are_refused_and_write_nothing() {
    let archives = [paths(), kinds(), conflicts(), sizes(), damages()].concat();
    let submissions = [layouts(), manifests()].concat();
    let n_archives = archives.len();
    let n_cases = n_archives + submissions.len();
    assert!(n_cases >= 100, "{n_cases} cases");
    let dir = tempfile::tempdir().expect("the disk has space");
    let at = dir.path().join("parent");
    fs::create_dir_all(at.join("helper")).expect("the disk has space");
    for name in ["evil", "helper/evil", "submission.toml"] {
        fs::write(at.join(name), "mine").expect("the disk has space");
    }
    for (k, (name, bytes, words)) in archives.into_iter().chain(submissions).enumerate() {
        let archive = at.join("hostile.tar");
        fs::write(&archive, bytes).expect("the disk has space");
        let before = snapshot(dir.path());
        let target = at.join("target");
        let added = Evaluation::at(&target).add_submission(&archive);
        let mut errors = vec![added.map(drop).expect_err(name).to_string()];
        if k < n_archives {
            errors.push(extract(&archive, &target).expect_err(name).to_string());
        }
        for error in errors {
            assert!(error.contains(words), "{name}: {error}");
            let is_clear = error.contains("hostile.tar")
                && error.lines().count() == 1
                && error.len() < 700
                && !error.contains(char::is_control);
            assert!(is_clear, "{name}: {error}");
        }
        assert!(!target.exists(), "{name}");
        assert!(snapshot(dir.path()) == before, "{name}: a file changed");
    }
}

#[test]
fn special_files_are_no_archives() {
    let dir = tempfile::tempdir().expect("the disk has space");
    let target = dir.path().join("target");
    for (path, words) in [("/dev/zero", "no regular file"), ("nowhere", "can't open nowhere")] {
        let error = extract(Path::new(path), &target).expect_err(path).to_string();
        assert!(error.contains(words), "{path}: {error}");
    }
    assert!(!target.exists());
}
