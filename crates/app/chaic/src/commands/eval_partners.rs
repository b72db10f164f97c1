//! `chaic eval --partners`: a run per partner in one folder, and the robustness report.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context as _, Result};
use chaic_env::helper_registry::NONE;
use chaic_env::partner_suite::{MAX_FILE_BYTES, PartnerSuite, SUITE, SuitePartner};
use chaic_eval::EvalError;
use chaic_eval::run::{FolderMode, Run, RunFolder, RunRequest};
use chaic_eval::suite::{Robustness, SuiteFolder};
use chaic_files::read_user_file;
use chaic_llm::language::{is_language_helper, is_language_partner};
use chaic_llm::record;
use chaic_sandbox::Launcher;
use serde_json::json;

use super::eval_session::{
    EvalSession, PlayOutcome, how_to_complete, in_free_folder, request, write_reports,
};
use super::given_partners::{GivenPartners, require_no_files};
use super::llm::check_partner;
use crate::arguments::{EvalArguments, LanguageArguments};
use crate::exit::ExitStatus;
use crate::output::{
    OutputFormat, counted, json_path, print_error, print_result, print_warning, quoted, quoted_path,
};

/// Plays a benchmark with several partners.
///
/// # Errors
/// If the options or the partners are invalid, or a file can't be read or written.
pub(super) fn run(
    arguments: &EvalArguments,
    format: OutputFormat,
    launcher: &Launcher,
) -> Result<ExitStatus> {
    let mut files = GivenPartners::default();
    let list = arguments.partners.as_deref();
    let given = list.map(|list| read_partners(list, &mut files)).transpose()?;
    let options = list.map_or(String::new(), |list| format!(" --partners {}", quoted(list)));
    let session = EvalSession::new(arguments, launcher, files, options)?;
    let start = Instant::now();
    let folder = match given {
        Some(suite) if !arguments.resume => {
            let start = |path: &Path| start_runs(&session, arguments, path, suite.clone());
            match &arguments.out {
                Some(path) => start(path)?,
                None => in_free_folder("partners", start)?,
            }
        }
        given => {
            let path = arguments.out.as_deref().context("--resume needs --out")?;
            resumed(arguments, path, given.as_ref())?
        }
    };
    let request = if arguments.resume { request(arguments).0 } else { RunRequest::default() };
    let mut is_whole = true;
    let mut n_errors = 0;
    let partners = folder.partners();
    for entry in &partners {
        let part = partner_arguments(arguments, &folder.run_path(entry), entry, &partners)?;
        let request = partner_request(&request, entry);
        match session.play(&part, &folder.run_path(entry), &request, Some(&entry.name))? {
            PlayOutcome::Stopped => return Ok(ExitStatus::Interrupted),
            PlayOutcome::Shard(run) => {
                n_errors += run.progress().errors;
                is_whole = false;
            }
            PlayOutcome::Complete(run) => {
                n_errors += run.progress().errors;
                write_reports(&run)?;
            }
        }
    }
    if is_whole {
        print_robustness(&folder, format, Some(start))?;
    } else {
        let has_language_records =
            partners.iter().any(|entry| record::folder(&folder.run_path(entry)).exists());
        print_error(&format!(
            "shard {} is played with every partner; {}",
            session.shard,
            how_to_complete(folder.path(), has_language_records),
        ));
    }
    Ok(ExitStatus::from_findings(n_errors > 0))
}

/// Returns the bundled suite, or the list in a file.
///
/// # Errors
/// If the list or a file that it names can't be read.
pub(super) fn read_partners(list: &str, files: &mut GivenPartners) -> Result<PartnerSuite> {
    if list == SUITE {
        return Ok(PartnerSuite::bundled());
    }
    let path = Path::new(list);
    if !path.exists() {
        let text = format!("--partners {list}: no such file; give `{SUITE}` or a list of partners");
        return Err(EvalError::Options(text).into());
    }
    let suite = PartnerSuite::parse(&read_user_file(path, MAX_FILE_BYTES)?, list)?;
    let mut partners = suite.partners().to_vec();
    for entry in &mut partners {
        let Some(name) = &entry.partner else { continue };
        let known = files.resolve(name).and_then(|name| {
            check_partner(&name)?;
            Ok(name)
        });
        entry.partner = Some(known.with_context(|| format!("{list}: `{}`", entry.name))?);
    }
    PartnerSuite::new(partners).map_err(|problem| EvalError::Options(problem).into())
}

/// Starts a run per partner. Nothing is written if one of them is not possible.
fn start_runs(
    session: &EvalSession<'_>,
    arguments: &EvalArguments,
    path: &Path,
    suite: PartnerSuite,
) -> Result<SuiteFolder> {
    let (request, _) = request(arguments);
    if request.helpers.as_ref().is_some_and(|names| !names.iter().any(|name| name == NONE)) {
        let text =
            "--partners measures gains over no helper; add none, for example --helper none,rhp";
        return Err(EvalError::Options(text.to_owned()).into());
    }
    let partners = suite.with_ordinary();
    for entry in &partners {
        let run = path.join(&entry.name);
        let part = partner_arguments(arguments, &run, entry, &partners)?;
        session.with_helpers(&part, &run, |helpers, _| {
            Ok(Run::check(&run, &partner_request(&request, entry), helpers)?)
        })?;
    }
    // Another command may have taken the folder during these checks.
    if arguments.out.is_none() && path.exists() {
        return Err(EvalError::NotEmpty { path: path.to_owned() }.into());
    }
    let folder = SuiteFolder::start(path, suite)?;
    for entry in &partners {
        let run = folder.run_path(entry);
        let part = partner_arguments(arguments, &run, entry, &partners)?;
        session.with_helpers(&part, &run, |helpers, _| {
            Run::open(&run, FolderMode::Resume, &partner_request(&request, entry), helpers)?;
            Ok(())
        })?;
    }
    Ok(folder)
}

/// Checks that a folder is not a run with a single partner.
///
/// # Errors
/// [`EvalError::Options`] if it is one.
pub(super) fn refuse_single_run(path: &Path) -> Result<()> {
    if RunFolder::is_run(path) {
        let text =
            "is a run with one partner; omit --partners to resume it, or choose another --out";
        return Err(EvalError::Options(format!("{} {text}", path.display())).into());
    }
    Ok(())
}

/// Returns the folder of runs that are resumed.
fn resumed(
    arguments: &EvalArguments,
    path: &Path,
    given: Option<&PartnerSuite>,
) -> Result<SuiteFolder> {
    refuse_single_run(path)?;
    if !SuiteFolder::is_suite(path) {
        RunFolder::check_started(path)?;
    }
    let folder = SuiteFolder::read(path)?;
    if arguments.partner.is_some() || arguments.person.is_some() {
        let text = "has runs with several partners; omit --partner and --person to resume them, or name one \
                    of the runs by --out";
        return Err(EvalError::Options(format!("{} {text}", path.display())).into());
    }
    if let Some(suite) = given {
        folder.check_partners(suite)?;
    }
    folder.check_started()?;
    if given.is_none() {
        require_no_files(&folder)?;
    }
    Ok(folder)
}

/// Returns the options of the command for the run with one of the partners, which is resumed if it exists.
fn partner_arguments(
    arguments: &EvalArguments,
    run: &Path,
    entry: &SuitePartner,
    partners: &[SuitePartner],
) -> Result<EvalArguments> {
    let is_started = RunFolder::is_run(run);
    let recorded = if is_started { Some(RunFolder::read(run)?.1) } else { None };
    let helpers = arguments.helper_names().or(recorded.map(|options| options.helpers));
    let is_model = |entry: &SuitePartner| entry.partner.as_deref().is_some_and(is_language_partner);
    let asks_model =
        helpers.iter().flatten().any(|name| is_language_helper(name)) || is_model(entry);
    // Options for other partners do not apply to this run. If no partner needs them, the run refuses
    // them.
    let are_for_others = !asks_model && partners.iter().any(is_model);
    let language =
        if are_for_others { LanguageArguments::default() } else { arguments.language.clone() };
    Ok(EvalArguments {
        partner: entry.partner.clone(),
        person: entry.person,
        partners: None,
        out: Some(run.to_owned()),
        resume: is_started,
        language,
        ..arguments.clone()
    })
}

/// Returns the request of the run with one of the partners.
pub(super) fn partner_request(request: &RunRequest, entry: &SuitePartner) -> RunRequest {
    RunRequest { partner: entry.partner.clone(), person: entry.person, ..request.clone() }
}

/// Writes the robustness report of complete runs.
///
/// # Errors
/// If a file can't be read or written.
pub(super) fn write_robustness(folder: &SuiteFolder) -> Result<Robustness> {
    let (runs, warnings) = folder.runs()?;
    warnings.iter().for_each(|warning| print_warning(&warning.to_string()));
    let robustness = Robustness::from_runs(&runs);
    folder.write_report(&robustness)?;
    Ok(robustness)
}

/// Writes and prints the robustness report of complete runs.
///
/// # Errors
/// If a file can't be read or written.
pub(super) fn print_robustness(
    folder: &SuiteFolder,
    format: OutputFormat,
    start: Option<Instant>,
) -> Result<()> {
    let robustness = write_robustness(folder)?;
    let json = json!({
        "run": json_path(folder.path()),
        "report": json_path(&folder.report_path()),
        "robustness": serde_json::to_value(&robustness)?,
    });
    let mut text = robustness.text(chaic_eval::report::Format::Table);
    text += &format!("\nReport:  {}\n", quoted_path(&folder.report_path()));
    let runs = counted(folder.partners().len(), "run");
    text += &format!("Runs:    {} ({runs}, one per partner)\n", quoted_path(folder.path()));
    if let Some(start) = start {
        let secs = start.elapsed().as_secs();
        text += &format!("Time:    {} min {:02} s\n", secs / 60, secs % 60);
    }
    print_result(format, &json, &text)
}
