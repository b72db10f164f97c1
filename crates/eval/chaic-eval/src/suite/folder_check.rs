//! Checks of a folder with several partners, beside the checks of its runs.

use chaic_core::observation::Grants;
use chaic_files::{entries, read_bounded};

use super::episodes::episode_problems;
use super::{PartnerRun, REPORT, Robustness, SuiteFolder};
use crate::error::Result;
use crate::run::{PARTNERS_FILE, RunFolder, RunGrants, RunOptions};
use crate::verify::Finding;

impl SuiteFolder {
    /// Returns the problems of the folder: runs whose options, recorded grants or episodes differ in
    /// more than the partner, other entries, and a report that differs from the results.
    ///
    /// # Errors
    /// If a file can't be read.
    pub fn findings(&self, runs: &[PartnerRun]) -> Result<Vec<Finding>> {
        let mut findings = Vec::new();
        let mut add = |name: &str, problem: String| {
            findings.push(Finding { path: self.path.join(name), problem });
        };
        let text = self.suite.to_json();
        if read_bounded(&self.path.join(PARTNERS_FILE), text.len() as u64 + 1)? != text.as_bytes() {
            add(PARTNERS_FILE, "its form differs from what chaic writes".to_owned());
        }
        let ordinary = runs.first().map(|run| &run.options);
        let ordinary_grants = runs.first().map(|run| helper_grants(&run.folder)).transpose()?;
        for run in runs {
            let expected = ordinary.map(|options| RunOptions {
                partner: run.partner.partner.clone(),
                person: run.partner.person,
                ..options.clone()
            });
            if expected.as_ref() != Some(&run.options) {
                let problem = "its options are not those of the other runs with this partner";
                add(&run.partner.name, problem.to_owned());
            }
            if ordinary_grants.as_ref() != Some(&helper_grants(&run.folder)?) {
                let problem = "grants, perception, isolation or weights of its helpers are not those of \
                               the other runs";
                add(&run.partner.name, problem.to_owned());
            }
        }
        for (name, problem) in episode_problems(runs) {
            add(name, problem);
        }
        for path in entries(&self.path)? {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let is_known = name == PARTNERS_FILE
                || REPORT.contains(&name)
                || runs.iter().any(|run| run.partner.name == name);
            if !is_known {
                add(name, "it is no file of a folder with several partners".to_owned());
            }
        }
        let (missing, altered) = self.differing_files(&Robustness::from_runs(runs))?;
        for name in missing {
            add(name, "it is missing; repeat the command that played the runs".to_owned());
        }
        for name in altered {
            add(name, "it differs from the results".to_owned());
        }
        findings.sort();
        Ok(findings)
    }
}

/// Returns the recorded grants of a run without those of its partner.
fn helper_grants(folder: &RunFolder) -> Result<Option<RunGrants>> {
    Ok(folder.granted()?.map(|granted| RunGrants { partner: Grants::NONE, ..granted }))
}
