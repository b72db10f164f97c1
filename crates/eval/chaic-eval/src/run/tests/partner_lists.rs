//! Promise: verification finds runs of a list of partners that differ in more than the partner.

use chaic_env::partner_suite::{PartnerSuite, SuitePartner};

use super::*;
use crate::suite::{Robustness, SuiteFolder};

/// Returns a folder with the same episodes, but with more frames.
fn with_more_frames(source: &Path) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for path in chaic_files::entries(source).unwrap() {
        let text = fs::read_to_string(&path).unwrap();
        let (from, to) =
            (format!("\"horizon\": {HORIZON}"), format!("\"horizon\": {}", HORIZON + 30));
        assert!(text.contains(&from), "{text}");
        fs::write(dir.path().join(path.file_name().unwrap()), text.replace(&from, &to)).unwrap();
    }
    dir
}

#[test]
fn episodes_are_the_same_with_all_partners_of_a_list() {
    let (dir, helpers) = (tempfile::tempdir().unwrap(), TestHelpers::new());
    let source = episode_files(&[TaskId::LowTarget], 2);
    let fewer = episode_files(&[TaskId::LowTarget], 1);
    let easier = with_more_frames(source.path());
    let person = Some("+speed150".parse().unwrap());
    let fast = SuitePartner { name: "fast".to_owned(), partner: None, person };
    let agent = Some("slow".to_owned());
    let slow = SuitePartner { name: "slow".to_owned(), partner: agent, person: None };
    let suite = PartnerSuite::new(vec![fast, slow]).unwrap();
    // Plays the partner of this name with other episodes, and returns the findings.
    let findings = |case: &str, other: &str, files: &tempfile::TempDir| {
        let folder = SuiteFolder::start(&dir.path().join(case), suite.clone()).unwrap();
        for entry in folder.partners() {
            let request = RunRequest {
                seeds: None,
                partner: entry.partner.clone(),
                person: entry.person,
                ..request(if entry.name == other { files } else { &source }, &["turner"])
            };
            let path = folder.run_path(&entry);
            let (mut run, _) = Run::open(&path, FolderMode::New, &request, &helpers).unwrap();
            assert!(play(&mut run, 1, &helpers));
            // Each run agrees with itself.
            let report =
                crate::verify::verify_run(run.folder(), run.options(), &helpers, 1, &|_| ());
            let report = report.unwrap();
            assert_eq!((report.mismatches, report.findings), (vec![], vec![]));
        }
        let (runs, _) = folder.runs().unwrap();
        folder.write_report(&Robustness::from_runs(&runs)).unwrap();
        let findings = folder.findings(&runs).unwrap();
        findings.iter().map(ToString::to_string).collect::<Vec<String>>()
    };
    assert_eq!(findings("good", "", &source), [""; 0]);
    let differs = "is not that of the run with the ordinary partner";
    for (case, other, files, expected) in [
        ("a", "fast", &easier, format!("a/fast: low_target/short/0/+speed150 {differs}")),
        ("b", "slow", &easier, format!("b/slow: low_target/short/0 {differs}")),
        ("c", "rules", &easier, format!("c/slow: low_target/short/0 {differs}")),
        (
            "d",
            "slow",
            &fewer,
            "d/slow: it has 1 of the 2 episodes of the run with the ordinary partner".to_owned(),
        ),
    ] {
        let found = findings(case, other, files);
        // With other ordinary episodes, those of both partners differ.
        assert_eq!(found.len(), if other == "rules" { 2 } else { 1 }, "{found:?}");
        assert!(found.last().unwrap().ends_with(&expected), "{found:?}");
    }

    // Without the episodes, nothing is compared.
    let folder = SuiteFolder::read(&dir.path().join("good")).unwrap();
    fs::remove_dir_all(folder.path().join("slow/episodes")).unwrap();
    let (runs, _) = folder.runs().unwrap();
    let found: Vec<String> =
        folder.findings(&runs).unwrap().iter().map(ToString::to_string).collect();
    let unread = |text: &String| text.ends_with("good/slow: its episodes can't be read");
    assert!(found.iter().any(unread), "{found:?}");
}
