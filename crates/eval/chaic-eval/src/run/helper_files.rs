//! Files that the commands of helper processes name. A run is resumed only with the same ones.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use chaic_env::Digest;
use chaic_files::open_user_file;

/// Digests of the files that the commands of helper processes name, by helper and by path as in the command.
pub type HelperFiles = BTreeMap<String, BTreeMap<String, Digest>>;

/// Size of the parts of a file, bytes, each of which is in memory at one time.
const PART_BYTES: u64 = 1 << 20;
/// Largest file of which all parts are compared, bytes. Of a larger one, such as a language model, only
/// size, first and last part are compared, so that a run starts at once.
const MAX_COMPARED_BYTES: u64 = 256 << 20;

/// Returns the digests of the readable files among these.
pub fn file_digests(paths: impl IntoIterator<Item = String>) -> BTreeMap<String, Digest> {
    let digest = |path: String| Some((path.clone(), digest_of(Path::new(&path))?));
    paths.into_iter().filter_map(digest).collect()
}

/// Returns the digest of the size and of the digests of the parts of a file; `None` if it can't be read.
fn digest_of(path: &Path) -> Option<Digest> {
    let mut file = open_user_file(path).ok()?;
    let n_bytes = file.metadata().ok()?.len();
    let mut digests = n_bytes.to_le_bytes().to_vec();
    let mut add = |file: &mut File| -> Option<bool> {
        let mut part = Vec::new();
        file.take(PART_BYTES).read_to_end(&mut part).ok()?;
        digests.extend(Digest::of_bytes(&part).0.to_le_bytes());
        Some(part.is_empty())
    };
    if n_bytes > MAX_COMPARED_BYTES {
        add(&mut file)?;
        file.seek(SeekFrom::Start(n_bytes - PART_BYTES)).ok()?;
        add(&mut file)?;
    } else {
        while !add(&mut file)? {}
    }
    Some(Digest::of_bytes(&digests))
}

/// Returns the first recorded file, after its helper, that differs from the given one or is missing there.
/// Helpers without given files are not compared.
pub(super) fn changed_file<'r>(
    recorded: &'r HelperFiles,
    given: &HelperFiles,
) -> Option<(&'r str, &'r str)> {
    recorded.iter().find_map(|(helper, files)| {
        let given = given.get(helper)?;
        let changed = files.iter().find(|(path, digest)| given.get(*path) != Some(*digest));
        changed.map(|(path, _)| (helper.as_str(), path.as_str()))
    })
}

/// Returns the files that both sides have, which shards of a run have in common; `None` if one differs.
pub(super) fn common_files(mut files: HelperFiles, others: &HelperFiles) -> Option<HelperFiles> {
    for (helper, files) in &mut files {
        let others = others.get(helper);
        files.retain(|path, _| others.is_some_and(|others| others.contains_key(path)));
    }
    files.retain(|_, files| !files.is_empty());
    changed_file(&files, others).is_none().then_some(files)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn digests_tell_the_content_of_files_from_another() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("helper");
        let digest = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            digest_of(&path).unwrap()
        };
        let long = vec![1; PART_BYTES as usize + 1];
        let mut edited = long.clone();
        edited[PART_BYTES as usize] = 2;
        let texts: [&[u8]; 5] = [b"", b"a", b"b", &long, &edited];
        for a in texts {
            for b in texts {
                assert_eq!(digest(a) == digest(b), a == b);
            }
        }
        let missing = dir.path().join("missing").display().to_string();
        assert!(file_digests([missing, dir.path().display().to_string()]).is_empty());
    }

    /// The files have holes, so they take no space.
    #[test]
    fn large_files_are_compared_by_their_size_and_their_ends() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("model");
        let digest = |n_bytes: u64, at: u64| {
            let mut file = File::create(&path).unwrap();
            file.set_len(n_bytes).unwrap();
            file.seek(SeekFrom::Start(at)).unwrap();
            std::io::Write::write_all(&mut file, b"x").unwrap();
            digest_of(&path).unwrap()
        };
        let n_bytes = MAX_COMPARED_BYTES + PART_BYTES;
        let first = digest(n_bytes, 0);
        assert_eq!(digest(n_bytes, 0), first);
        for (n_bytes, at) in [(n_bytes + 1, 0), (n_bytes, 1), (n_bytes, n_bytes - 1)] {
            assert!(digest(n_bytes, at) != first, "{n_bytes} {at}");
        }
    }

    #[test]
    fn only_recorded_files_of_given_helpers_are_compared() {
        let files = |pairs: &[(&str, &str, u64)]| {
            let mut files = HelperFiles::new();
            for (helper, path, digest) in pairs {
                let of_helper = files.entry((*helper).to_owned()).or_default();
                of_helper.insert((*path).to_owned(), Digest(*digest));
            }
            files
        };
        let recorded = files(&[("a", "a.py", 1), ("b", "b.py", 2)]);
        for (given, changed) in [
            (files(&[("a", "a.py", 1), ("a", "new.log", 5), ("b", "b.py", 2)]), None),
            (files(&[("b", "b.py", 2)]), None),
            (files(&[("a", "a.py", 1), ("b", "b.py", 3)]), Some(("b", "b.py"))),
            (files(&[("a", "other.py", 1)]), Some(("a", "a.py"))),
        ] {
            assert_eq!(changed_file(&recorded, &given), changed);
        }
        assert_eq!(changed_file(&HelperFiles::new(), &recorded), None);
        let log = files(&[("a", "a.py", 1), ("a", "new.log", 5), ("c", "c.py", 6)]);
        assert_eq!(common_files(log, &recorded), Some(files(&[("a", "a.py", 1)])));
        assert_eq!(common_files(recorded.clone(), &HelperFiles::new()), Some(HelperFiles::new()));
        assert_eq!(common_files(recorded, &files(&[("a", "a.py", 4)])), None);
    }
}
