//! Export of collected data: traces that `chaic verify` reads, and a Psych-DS data set.

mod tables;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use chaic_core::AgentId;
use chaic_env::trace::{Trace, TraceWarning, parse};
use chaic_env::{EpisodeConfig, Playback};
use chaic_eval::verify::verify;
use chaic_files::{EntryKind, create_folders, entries, kind, write_atomically};
use serde_json::json;

use crate::data::{DataRecord, ParticipantData, TrialEnd};
use crate::error::{Result, StudyError};
use crate::plan::{StudyPlan, Trial};
use crate::record_check::RecordCheck;
use crate::study::{PERSON, Seat};
use tables::{Tables, TrialRow};

/// Ending of the files of participants.
const ENDING: &str = "jsonl";
/// Folder of the traces.
const TRACES: &str = "traces";

/// Result of an export.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportReport {
    /// Number of participants.
    pub participants: usize,
    /// Number of participants who have seen the debriefing.
    pub completed: usize,
    /// Number of trials with a trace.
    pub traces: usize,
    /// Traces that agree with their re-simulation.
    pub verified: Vec<VerifiedTrial>,
    /// Traces that differ, incomplete last lines, and other findings.
    pub problems: Vec<String>,
    /// Slots without a complete participation: further participants can take them.
    pub open_slots: Vec<u32>,
}

/// A trial whose trace agrees with its re-simulation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VerifiedTrial {
    /// File of the trace.
    pub path: PathBuf,
    /// The trial.
    pub trial: Trial,
}

/// Exports files of participants, or folders with such files, to a new folder.
///
/// A trace that differs from its re-simulation is exported and marked as not verified. An incomplete last line of a
/// file is left out and reported.
///
/// # Errors
/// If a file is not that of a participant of this study, two files have the same code, or the folder is not
/// empty.
pub fn export(plan: &StudyPlan, paths: &[PathBuf], out: &Path) -> Result<ExportReport> {
    let mut participations = Vec::new();
    for path in files(paths)? {
        let data = ParticipantData::read(&path)?;
        participations.push(Participation::new(plan, data, &path)?);
    }
    participations.sort_by(|a, b| (a.slot, &a.code).cmp(&(b.slot, &b.code)));
    let mut codes = BTreeSet::new();
    if let Some(twice) = participations.iter().find(|p| !codes.insert(&p.code)) {
        return Err(data_error(
            &twice.path,
            1,
            format!("a second file of participant {}", twice.code),
        ));
    }
    create_folders(out)?;
    if !entries(out)?.is_empty() {
        return Err(StudyError::NotEmpty { path: out.to_owned() });
    }
    let mut report = ExportReport { participants: participations.len(), ..ExportReport::default() };
    report.problems.extend(participations.iter().filter_map(Participation::torn_line_note));
    let mut tables = Tables::new(plan);
    for participation in &participations {
        participation.export(plan, out, &mut tables, &mut report)?;
    }
    report.open_slots = open_slots(plan, &participations, &mut report.problems);
    tables.write(plan, out)?;
    Ok(report)
}

/// Returns the files of participants: those that are named, and those in the named folders.
fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            let is_data = |path: &PathBuf| path.extension().is_some_and(|e| e == ENDING);
            let found = entries(path)?.into_iter().filter(is_data);
            files.extend(found.filter(|p| kind(p).is_ok_and(|kind| kind == EntryKind::File)));
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
}

/// Returns the slots without a complete participation, and reports those with several.
fn open_slots(plan: &StudyPlan, all: &[Participation], problems: &mut Vec<String>) -> Vec<u32> {
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    for participation in all.iter().filter(|p| p.is_complete) {
        *counts.entry(participation.slot).or_default() += 1;
    }
    for (slot, n) in counts.iter().filter(|(_, n)| **n > 1) {
        problems.push(format!("slot {slot} has {n} complete participations"));
    }
    (1..=plan.study().participants).filter(|slot| !counts.contains_key(slot)).collect()
}

fn data_error(path: &Path, line: usize, problem: String) -> StudyError {
    StudyError::Data { path: path.to_owned(), line, problem }
}

/// Records of one participant, checked against the plan.
struct Participation {
    path: PathBuf,
    code: String,
    slot: u32,
    is_complete: bool,
    trials: Vec<Trial>,
    /// By number of the trial.
    played: BTreeMap<usize, PlayedTrial>,
    answers: Vec<AnsweredForm>,
    /// Number of an incomplete last line.
    torn_line: Option<usize>,
}

/// A trial that has begun.
#[derive(Default)]
struct PlayedTrial {
    trace: String,
    end: Option<TrialEnd>,
}

/// Answers to one form.
struct AnsweredForm {
    position: u32,
    form: String,
    ratings: BTreeMap<String, Option<i32>>,
}

impl Participation {
    /// Checks the records of a participant against the plan.
    fn new(plan: &StudyPlan, data: ParticipantData, path: &Path) -> Result<Participation> {
        let wrong = |line: usize, problem: String| data_error(path, line, problem);
        let check = RecordCheck::new(plan, &data.study, data.slot);
        let mut check = check.map_err(|problem| wrong(1, problem))?;
        let mut participation = Participation {
            path: path.to_owned(),
            slot: data.slot,
            is_complete: false,
            trials: check.trials().to_vec(),
            code: data.code,
            played: BTreeMap::new(),
            answers: Vec::new(),
            torn_line: data.torn_line,
        };
        for (line, record) in data.records {
            check.add(plan, &record).map_err(|problem| wrong(line, problem))?;
            participation.add(record);
        }
        participation.is_complete = check.is_complete();
        Ok(participation)
    }

    /// Returns a note about an incomplete last line; `None` without one.
    fn torn_line_note(&self) -> Option<String> {
        let (path, line) = (self.path.display(), self.torn_line?);
        Some(format!("{path}, line {line}: the line is incomplete and left out"))
    }

    /// Adds a checked record.
    fn add(&mut self, record: DataRecord) {
        match record {
            DataRecord::Start { .. } | DataRecord::Instructed {} | DataRecord::Complete {} => {}
            DataRecord::Trial { trial } => {
                self.played.insert(trial, PlayedTrial::default());
            }
            DataRecord::Trace { trial, text } => {
                self.played.entry(trial).or_default().trace.push_str(&text);
            }
            DataRecord::TrialEnd { trial, outcome } => {
                self.played.entry(trial).or_default().end = Some(outcome);
            }
            DataRecord::Answers { position, form, ratings } => {
                self.answers.push(AnsweredForm { position, form, ratings });
            }
        }
    }

    /// Writes the traces and adds the rows of the tables.
    fn export(
        &self,
        plan: &StudyPlan,
        out: &Path,
        tables: &mut Tables,
        report: &mut ExportReport,
    ) -> Result<()> {
        report.completed += usize::from(self.is_complete);
        for (number, played) in &self.played {
            let trial = self.trials[*number];
            let outcome = played.end.unwrap_or(TrialEnd::Left);
            let mut row = TrialRow::new(plan, trial, *number, outcome);
            if !played.trace.is_empty() {
                let name = format!("{TRACES}/{}/trial-{number:02}.jsonl", self.code);
                let path = out.join(&name);
                let folder = out.join(TRACES).join(&self.code);
                create_folders(&folder)?;
                write_atomically(&path, played.trace.as_bytes())?;
                let result = check_trace(plan, trial, played, &path);
                report.traces += 1;
                row.trace = name.clone();
                match result {
                    Ok(checked) => {
                        report.verified.push(VerifiedTrial { path, trial });
                        row.checked = Some(checked);
                    }
                    Err(problem) => report.problems.push(format!("{name}: {problem}")),
                }
            }
            tables.add_trial(&self.code, self.slot, &row);
        }
        for AnsweredForm { position, form, ratings } in &self.answers {
            let trial =
                self.trials.iter().find(|trial| trial.position == *position && *position > 0);
            tables.add_answers(plan, (&self.code, self.slot), trial.copied(), form, ratings);
        }
        Ok(())
    }
}

/// Figures of a verified trace.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CheckedTrace {
    frames: u32,
    decisions: usize,
    /// Delivered and total value of the goal.
    progress: (f64, f64),
}

/// Compares a trace with the plan and with its re-simulation; returns the first difference.
fn check_trace(
    plan: &StudyPlan,
    trial: Trial,
    played: &PlayedTrial,
    path: &Path,
) -> std::result::Result<CheckedTrace, String> {
    let text = |error: &dyn std::fmt::Display| error.to_string();
    let (trace, warnings) = parse(played.trace.as_bytes(), path).map_err(|e| text(&e))?;
    // An episode that was stopped has no end.
    if let Some(warning) = warnings.iter().find(|w| matches!(w, TraceWarning::Torn { .. })) {
        return Err(warning.to_string());
    }
    if let Some(problem) = header_problem(plan, trial, &trace) {
        return Err(problem);
    }
    if played.end == Some(TrialEnd::Ended) && trace.end().is_none() {
        return Err("the episode has ended, but its trace has no end".to_owned());
    }
    let episode = &plan.episodes()[trial.episode];
    if let Some(mismatch) = verify(&trace, episode, path).map_err(|e| text(&e))? {
        return Err(format!("frame {}: {}", mismatch.frame, mismatch.problem));
    }
    let mut playback = Playback::new(&trace, episode).map_err(|e| text(&e))?;
    while playback.step().map_err(|e| text(&e))?.is_some() {}
    let world = playback.world();
    Ok(CheckedTrace {
        frames: world.state().frame,
        decisions: trace.decisions().count(),
        progress: world.progress(),
    })
}

/// Returns a problem if the header of a trace is not the one of the trial.
fn header_problem(plan: &StudyPlan, trial: Trial, trace: &Trace) -> Option<String> {
    let header = &trace.header;
    let episode = &plan.episodes()[trial.episode];
    let condition = &plan.conditions()[trial.condition];
    let (seat, partner) = match condition.seat {
        Seat::Partner => (AgentId::PARTNER, Some(PERSON)),
        Seat::Helper => (AgentId::HELPER, None),
    };
    let expected = EpisodeConfig::new(episode, plan.helper(trial));
    let inputs =
        header.people.iter().filter_map(|person| Some((person.agent, person.input.as_deref()?)));
    let has_person = inputs.collect::<Vec<_>>() == [(seat, condition.input.name())];
    let is_same = header.key() == plan.key(trial)
        && header.partner.as_deref() == partner
        && header.rules == expected.rules
        && header.appearance == expected.appearance
        && header.branch_of.is_none()
        && has_person;
    (!is_same).then(|| "the trace is of another episode, seat, helper or set of rules".to_owned())
}

/// Returns the description of the data set for `dataset_description.json`.
fn description(plan: &StudyPlan, variables: &[(String, &'static str)]) -> serde_json::Value {
    let variables: Vec<serde_json::Value> = variables
        .iter()
        .map(
            |(name, about)| json!({ "@type": "PropertyValue", "name": name, "description": about }),
        )
        .collect();
    json!({
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": plan.study().title,
        "description": format!(
            "Answers and episodes of a study with people, exported by chaic {}; study digest {}",
            chaic_env::CHAIC_VERSION,
            plan.digest()
        ),
        "variableMeasured": variables,
    })
}
