//! Copies of records whose rest was replaced, because a resumed episode asked other questions.
//!
//! Only the sum of the spending reads them; other readers of a run's records ignore their names.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use chaic_files::{EntryKind, kind_below, read_below, walk, with_suffix, write_atomically};

use super::{EXTENSION, MAX_RECORD_BYTES, folder};
use crate::error::Result;

/// Separates the name of a record from the number of its copy.
const COPY: &str = ".old-";

/// Copies a record to the next free number in its folder; returns the path of the copy.
pub(super) fn keep(run: &Path, record: &Path) -> Result<PathBuf> {
    let bytes = read_below(run, record, MAX_RECORD_BYTES + 1)?;
    let mut number = 1_u32;
    let copy = loop {
        let copy = with_suffix(record, &format!("{COPY}{number}"));
        if kind_below(run, &copy)? == EntryKind::Missing {
            break copy;
        }
        number += 1;
    };
    write_atomically(&copy, &bytes)?;
    Ok(copy)
}

/// Returns the files of each record of a run: the record, unless it was removed, and its copies.
pub(crate) fn with_copies(run: &Path) -> Result<Vec<Vec<PathBuf>>> {
    let mut files: BTreeMap<PathBuf, Vec<PathBuf>> = BTreeMap::new();
    for entry in walk(&folder(run), 2)?.into_iter().filter(|entry| entry.kind == EntryKind::File) {
        let record = copied(&entry.path).unwrap_or_else(|| entry.path.clone());
        if is_record(&record) {
            files.entry(record).or_default().push(entry.path);
        }
    }
    Ok(files.into_values().collect())
}

/// Returns the path of the record of a copy; `None` for a path of another form.
fn copied(path: &Path) -> Option<PathBuf> {
    let (record, number) = path.file_name()?.to_str()?.rsplit_once(COPY)?;
    number.parse::<u32>().ok()?;
    Some(path.with_file_name(record)).filter(|record| is_record(record))
}

/// Returns whether a path has the extension of records.
pub(super) fn is_record(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == EXTENSION)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::record::tests::{decided, exchange, header, write};
    use crate::record::{DecisionLog, DecisionLogWriter, all};

    #[test]
    fn a_record_with_other_exchanges_is_kept_under_a_number() {
        let dir = tempfile::tempdir().unwrap();
        let run = dir.path();
        fs::create_dir_all(run.join("llm/obstacle/llm")).unwrap();
        let path = run.join("llm/obstacle/llm/x.old-1-s0.1.jsonl");
        let whole = [exchange("one"), decided(1), exchange("two"), decided(2)];
        let open = || DecisionLogWriter::open(run, &path, &header()).unwrap();
        write(&path, &whole);
        let mut kept = Vec::new();
        for (number, other) in ["three", "four"].into_iter().enumerate() {
            let before = fs::read(&path).unwrap();
            let mut writer = open();
            writer.push(exchange("one")).unwrap();
            assert_eq!(writer.take_copy_path(), None);
            writer.push(exchange(other)).unwrap();
            let copy = writer.take_copy_path().unwrap();
            assert!(copy.ends_with(format!("x.old-1-s0.1.jsonl.old-{}", number + 1)), "{copy:?}");
            assert_eq!(fs::read(&copy).unwrap(), before);
            // The second difference has nothing left to keep.
            writer.push(decided(3)).unwrap();
            assert_eq!(writer.take_copy_path(), None);
            kept.push(copy);
        }
        // Decisions alone cost nothing.
        write(&path, &[exchange("one"), exchange("four"), decided(4)]);
        fs::write(path.with_file_name("x.old-1-s0.1.jsonl.old-3.tmp"), "torn").unwrap();
        assert_eq!(
            all(run).unwrap(),
            std::slice::from_ref(&path),
            "other readers ignore the copies"
        );
        let files = [vec![path.clone()], kept].concat();
        assert_eq!(with_copies(run).unwrap(), [files]);
        let entries = DecisionLog::read(run, &path).unwrap().entries;
        assert_eq!(entries, [exchange("one"), exchange("four"), decided(4)]);
    }
}
