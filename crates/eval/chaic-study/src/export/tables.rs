//! Tables of a Psych-DS data set (CSV), and their description.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use chaic_files::{create_folders, write_atomically};

use super::{CheckedTrace, description};
use crate::data::TrialEnd;
use crate::error::Result;
use crate::forms::Questionnaire;
use crate::plan::{StudyPlan, Trial, short_digest};

/// Columns of the rows of all tables.
const COMMON: [(&str, &str); 4] = [
    ("participant", "random code of the participant"),
    ("slot", "number that determines the order of conditions, from 1"),
    ("position", "position of the condition, from 1; 0 for practice and for forms at the end"),
    ("condition", "combination of factor levels; empty for practice and for forms at the end"),
];
/// Columns of forms.
const FORM: (&str, &str) = ("form", "name of the questionnaire");
const ANSWER: [(&str, &str); 2] = [
    ("item", "name of the item"),
    ("rating", "rating on the scale of the form; empty for no answer"),
];
const SCORE: (&str, &str) =
    ("score", "score by the formula of the form; empty if an item has no answer");
/// Columns of trials.
const TRIAL: [(&str, &str); 10] = [
    ("trial", "number of the episode in the session, from 0"),
    ("episode", "id of the episode"),
    ("helper", "helper beside the participant, or human for a participant who helps"),
    ("outcome", "ended, stopped by the participant, or left"),
    ("frames", "simulated time in frames of 1/30 second; empty if not verified"),
    ("delivered", "delivered value of the goal; empty if not verified"),
    ("total", "value of the goal; empty if not verified"),
    ("decisions", "number of decisions of all agents; empty if not verified"),
    ("verified", "1 if the trace agrees with its re-simulation, else 0"),
    ("trace", "file of the trace; empty if the episode had not started"),
];
/// Description of the column of a factor.
const FACTOR: &str = "level of the factor";

/// A played episode.
pub(super) struct TrialRow {
    trial: Trial,
    number: usize,
    cells: [String; 3],
    /// Figures; `None` if the trace is not verified.
    pub(super) checked: Option<CheckedTrace>,
    /// File of the trace.
    pub(super) trace: String,
}

impl TrialRow {
    /// Creates the row of a trial without a trace.
    pub(super) fn new(
        plan: &StudyPlan,
        trial: Trial,
        number: usize,
        outcome: TrialEnd,
    ) -> TrialRow {
        let key = plan.key(trial);
        let cells = [key.episode, key.helper, outcome.name().to_owned()];
        TrialRow { trial, number, cells, checked: None, trace: String::new() }
    }
}

/// Rows of all tables.
pub(super) struct Tables {
    factors: Vec<&'static str>,
    /// Levels of each condition after its name.
    conditions: Vec<Vec<String>>,
    answers: String,
    scores: String,
    trials: String,
}

impl Tables {
    /// Creates empty tables.
    pub(super) fn new(plan: &StudyPlan) -> Tables {
        let levels = |c: &crate::plan::Condition| {
            let levels = c.levels.iter().map(|(_, level)| level.clone());
            std::iter::once(c.name.clone()).chain(levels).collect::<Vec<String>>()
        };
        let factors: Vec<&'static str> =
            plan.conditions()[0].levels.iter().map(|(factor, _)| *factor).collect();
        let conditions = plan.conditions().iter().map(levels).collect();
        let mut tables = Tables {
            factors,
            conditions,
            answers: String::new(),
            scores: String::new(),
            trials: String::new(),
        };
        let [answers, scores, trials] =
            tables.columns().map(|columns| columns.into_iter().map(|(name, _)| name).collect());
        tables.answers = line(answers);
        tables.scores = line(scores);
        tables.trials = line(trials);
        tables
    }

    /// Returns the columns of answers, scores and trials with their descriptions.
    fn columns(&self) -> [Vec<(String, &'static str)>; 3] {
        let owned = |(name, about): &(&'static str, &'static str)| ((*name).to_owned(), *about);
        let factors = self.factors.iter().map(|factor| (format!("factor_{factor}"), FACTOR));
        let common: Vec<_> = COMMON.iter().map(owned).chain(factors).collect();
        let with = |columns: &[(&'static str, &'static str)]| {
            common.iter().cloned().chain(columns.iter().map(owned)).collect::<Vec<_>>()
        };
        [with(&[FORM, ANSWER[0], ANSWER[1]]), with(&[FORM, SCORE]), with(&TRIAL)]
    }

    /// Returns the first cells of a row.
    fn common(&self, (code, slot): (&str, u32), trial: Option<Trial>) -> Vec<String> {
        let position = trial.map_or(0, |trial| trial.position);
        let condition = match trial {
            Some(trial) if position > 0 => self.conditions[trial.condition].clone(),
            _ => vec![String::new(); self.factors.len() + 1],
        };
        let cells = [code.to_owned(), slot.to_string(), position.to_string()];
        cells.into_iter().chain(condition).collect()
    }

    /// Adds a played episode.
    pub(super) fn add_trial(&mut self, code: &str, slot: u32, row: &TrialRow) {
        let mut cells = self.common((code, slot), Some(row.trial));
        cells.push(row.number.to_string());
        cells.extend(row.cells.iter().cloned());
        let figures = row.checked.map(|CheckedTrace { frames, decisions, progress }| {
            [
                frames.to_string(),
                progress.0.to_string(),
                progress.1.to_string(),
                decisions.to_string(),
            ]
        });
        cells.extend(figures.unwrap_or_default());
        cells.push(u8::from(row.checked.is_some()).to_string());
        cells.push(row.trace.clone());
        self.trials.push_str(&line(cells));
    }

    /// Adds the answers to a form, and its score.
    pub(super) fn add_answers(
        &mut self,
        plan: &StudyPlan,
        participant: (&str, u32),
        trial: Option<Trial>,
        name: &str,
        ratings: &BTreeMap<String, Option<i32>>,
    ) {
        let Some((_, form)) = plan.forms().into_iter().find(|(known, _)| *known == name) else {
            return;
        };
        let common = self.common(participant, trial);
        for item in &form.items {
            let rating = ratings.get(&item.id).copied().flatten();
            let rating = rating.map_or(String::new(), |rating| rating.to_string());
            let cells = [name.to_owned(), item.id.clone(), rating];
            self.answers.push_str(&line(common.iter().cloned().chain(cells).collect()));
        }
        let score =
            Questionnaire::score(&form, ratings).map_or(String::new(), |score| score.to_string());
        self.scores.push_str(&line(common.into_iter().chain([name.to_owned(), score]).collect()));
    }

    /// Writes the tables and then the description of the data set.
    pub(super) fn write(&self, plan: &StudyPlan, out: &Path) -> Result<()> {
        let folder = out.join("data");
        create_folders(&folder)?;
        let tables =
            [("answers", &self.answers), ("scores", &self.scores), ("trials", &self.trials)];
        for (name, table) in tables {
            let file = format!("study-{}_description-{name}_data.csv", short_digest(plan.digest()));
            write_atomically(&folder.join(file), table.as_bytes())?;
        }
        let mut variables: Vec<(String, &'static str)> = Vec::new();
        for column in self.columns().into_iter().flatten() {
            if !variables.contains(&column) {
                variables.push(column);
            }
        }
        let text = serde_json::to_string_pretty(&description(plan, &variables));
        let text = text.expect("a description has string keys") + "\n";
        Ok(write_atomically(&out.join("dataset_description.json"), text.as_bytes())?)
    }
}

/// Formats a row of a CSV file (RFC 4180).
fn line(cells: Vec<String>) -> String {
    let mut text = String::new();
    for (k, cell) in cells.iter().enumerate() {
        let separator = if k == 0 { "" } else { "," };
        let _ = if cell.contains(['"', ',', '\n', '\r']) {
            write!(text, "{separator}\"{}\"", cell.replace('"', "\"\""))
        } else {
            write!(text, "{separator}{cell}")
        };
    }
    text + "\n"
}
