//! Runs of `chaic submit run`: with the ordinary partner, and with each partner of a list.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::Result;
use chaic_env::helper_registry::HelperRegistry;
use chaic_env::partner_suite::{PartnerSuite, SuitePartner};
use chaic_eval::EvalError;
use chaic_eval::report::{Format, write_files};
use chaic_eval::run::{FolderMode, Run, RunProgress, RunRequest};
use chaic_eval::suite::SuiteFolder;
use chaic_llm::language::is_language_partner;
use chaic_page::{no_language, write_report};
use serde_json::{Value, json};

use super::bars::RunBars;
use super::eval_partners::{partner_request, refuse_single_run, write_robustness};
use super::eval_session::warn_of_run;
use super::given_partners::require_no_files;
use super::summary::report_of;
use crate::exit::{ExitStatus, with_hint};
use crate::output::{
    OutputFormat, counted, json_path, print_error, print_progress, print_result, quoted_path,
};

/// Plays the runs of a submission. Each of them continues after an interruption.
pub(super) struct SubmissionPlayer<'a> {
    /// Folder of the evaluation.
    pub evaluation: &'a Path,
    /// Folder of the run, or of the runs with several partners.
    pub run: &'a Path,
    /// The run with the ordinary partner.
    pub request: &'a RunRequest,
    /// Helpers and partners.
    pub registry: &'a dyn HelperRegistry,
    /// Episodes in parallel.
    pub jobs: usize,
    pub stop: &'static AtomicBool,
    pub format: OutputFormat,
}

impl SubmissionPlayer<'_> {
    /// Plays with the ordinary partner, and with the partners of a list if one is given or the folder has
    /// one.
    ///
    /// # Errors
    /// If the folder was started with other partners; those of [`Run::open`] and [`Run::play`].
    pub fn play(&self, partners: Option<PartnerSuite>) -> Result<ExitStatus> {
        match self.start_partners(partners)? {
            Some(folder) => self.play_partners(&folder),
            None => self.play_ordinary(),
        }
    }

    /// Starts or continues the folder of the runs with several partners; `None` without a list. Nothing is
    /// written if one of the runs is not possible.
    fn start_partners(&self, given: Option<PartnerSuite>) -> Result<Option<SuiteFolder>> {
        let is_started = SuiteFolder::is_suite(self.run);
        let started = if is_started { Some(SuiteFolder::read(self.run)?) } else { None };
        let Some(suite) = given else {
            started.as_ref().map_or(Ok(()), require_no_files)?;
            return Ok(started);
        };
        refuse_single_run(self.run)?;
        if let Some(folder) = started {
            folder.check_partners(&suite)?;
            return Ok(Some(folder));
        }
        for entry in suite.with_ordinary() {
            let request = partner_request(self.request, &entry);
            Run::check(&self.run.join(&entry.name), &request, self.registry)?;
        }
        Ok(Some(SuiteFolder::start(self.run, suite)?))
    }

    fn play_ordinary(&self) -> Result<ExitStatus> {
        let Some(extent) = self.play_run(self.run, self.request, None)? else {
            return Ok(ExitStatus::Interrupted);
        };
        self.print_end(extent, "", String::new(), json!({}))
    }

    fn play_partners(&self, folder: &SuiteFolder) -> Result<ExitStatus> {
        let mut all = RunProgress { total: 0, finished: 0, errors: 0 };
        for entry in folder.partners() {
            let request = partner_request(self.request, &entry);
            let path = folder.run_path(&entry);
            let Some(extent) = self.play_run(&path, &request, Some(&entry.name))? else {
                return Ok(ExitStatus::Interrupted);
            };
            all.total += extent.total;
            all.finished += extent.finished;
            all.errors += extent.errors;
        }
        let robustness = write_robustness(folder)?;
        let n_partners = folder.suite().partners().len();
        let partners = format!(
            " with the ordinary partner and the list of {}",
            counted(n_partners, "partner")
        );
        let json = json!({
            "partners": n_partners,
            "report": json_path(&folder.report_path()),
            "robustness": serde_json::to_value(&robustness)?,
        });
        let tables = robustness.text(Format::Table) + "\n";
        self.print_end(all, &partners, tables, json)
    }

    /// Plays the run in a folder and writes its report. `part` names it among several runs. Returns `None`
    /// if the user stopped the run, after printing a message.
    fn play_run(
        &self,
        path: &Path,
        request: &RunRequest,
        part: Option<&str>,
    ) -> Result<Option<RunProgress>> {
        let (mut run, warnings) = Run::open(path, FolderMode::Resume, request, self.registry)?;
        warn_of_run(&run, &warnings);
        let extent = run.progress();
        print_progress(&format!(
            "{}: {}, helpers {}",
            path.display(),
            counted(extent.total, "episode run"),
            run.options().helpers.join(", ")
        ));
        let mut bars = match part {
            Some(part) => RunBars::for_part(&run, part),
            None => RunBars::new(&run),
        };
        let played = run.play(self.jobs, self.registry, self.stop, &mut |event| bars.show(event));
        bars.clear();
        let how_to_continue = "the same command continues";
        if !played.map_err(|error| with_hint(error.into(), how_to_continue))? {
            let extent = run.progress();
            let total = counted(extent.total, "episode run");
            let with_partner = part.map_or(String::new(), |part| format!(" with partner {part}"));
            print_error(&format!(
                "stopped after {} of {total}{with_partner}; {how_to_continue}",
                extent.finished
            ));
            return Ok(None);
        }
        let report = report_of(&run);
        write_files(run.folder(), &report)?;
        write_report(run.folder(), &report, &no_language)?;
        Ok(Some(run.progress()))
    }

    /// Prints the extent of the played runs after some tables. `more` contains additional fields of
    /// the JSON output.
    fn print_end(
        &self,
        extent: RunProgress,
        partners: &str,
        tables: String,
        more: Value,
    ) -> Result<ExitStatus> {
        let RunProgress { total, errors, .. } = extent;
        let mut json =
            json!({ "run": json_path(self.run), "episode_runs": total, "failed": errors });
        for (name, value) in more.as_object().into_iter().flatten() {
            json[name] = value.clone();
        }
        let failed =
            if errors > 0 { format!("; failed, zero each: {errors}") } else { String::new() };
        let text = format!(
            "{tables}{}: {}{partners}{failed}\nScore: chaic submit score {}\n",
            self.run.display(),
            counted(total, "episode run"),
            quoted_path(self.evaluation)
        );
        print_result(self.format, &json, &text)?;
        Ok(ExitStatus::from_findings(errors > 0))
    }
}

/// Refuses a list with a language model: a submission plays without an endpoint.
///
/// # Errors
/// [`EvalError::Options`] with the first such partner.
pub(super) fn refuse_language_partners(suite: &PartnerSuite) -> Result<()> {
    let asks_model =
        |entry: &&SuitePartner| entry.partner.as_deref().is_some_and(is_language_partner);
    let Some(entry) = suite.partners().iter().find(asks_model) else { return Ok(()) };
    let problem = format!(
        "the partner `{}` asks a language model, which a contest does not have; remove it from the \
         list",
        entry.name
    );
    Err(EvalError::Options(problem).into())
}
