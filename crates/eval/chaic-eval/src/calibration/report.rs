//! Belief scores as text.

use std::fmt::Write as _;

use serde::Serialize;

use super::episode::{PROBABILITY_FRAMES, SAMPLE_EVERY_FRAMES};
use super::scores::{BeliefScore, BeliefScores};
use crate::report::{Format, TextTable, number, rounded, title};

/// Name of the row over all tasks.
const ALL: &str = "all";

const LEGEND: &str = "Identified: the true set stays the most likely one with a probability of at \
                      least 0.7 until the end.\nECE: expected calibration error. Log score: mean \
                      ln of the probability of the truth; 0 is best.\n";

impl BeliefScores {
    /// Formats the scores; the text ends with a line break.
    pub fn text(&self, format: Format) -> String {
        match format {
            Format::Table => {
                let tables: String =
                    self.tables().iter().map(|table| table.to_terminal() + "\n").collect();
                tables + LEGEND
            }
            Format::Markdown => {
                let tables: String =
                    self.tables().iter().map(|table| table.to_markdown() + "\n").collect();
                tables + LEGEND
            }
            Format::Csv => self.csv(),
            Format::Json => self.json(),
        }
    }

    /// Returns the scores with their helper and the name of their task or [`ALL`].
    fn rows(&self) -> impl Iterator<Item = (&str, &str, &BeliefScore)> {
        self.helpers.iter().flat_map(|(helper, scores)| {
            let tasks = scores.tasks.iter().map(|(task, score)| (task.name(), score));
            let each = std::iter::once((ALL, &scores.all)).chain(tasks);
            each.map(move |(task, score)| (helper.as_str(), task, score))
        })
    }

    fn tables(&self) -> [TextTable; 2] {
        let table = |name: &str, columns: &[String], cells: fn(&BeliefScore) -> Vec<String>| {
            let first = ["Helper", "Task", "runs"].map(str::to_owned).into_iter();
            let row = |(helper, task, score): (&str, &str, &BeliefScore)| {
                let first = [title(helper), task.replace('_', " "), score.runs.to_string()];
                first.into_iter().chain(cells(score)).collect()
            };
            TextTable {
                title: name.to_owned(),
                header: first.chain(columns.iter().cloned()).collect(),
                rows: self.rows().map(row).collect(),
            }
        };
        let frames = PROBABILITY_FRAMES.map(|frame| format!("\n{frame}"));
        let last = ["identified\nshare", "\nmedian frame"].map(str::to_owned);
        let goal = table(
            "Mean probability of the true target set by frame, and its identification",
            &[&frames[..], &last[..]].concat(),
            goal_cells,
        );
        let calibration = table(
            "Accuracy of the last belief, and calibration over the episode",
            &["goal\naccuracy", "\nECE", "\nlog score", "person\naccuracy", "\nECE", "\nlog score"]
                .map(str::to_owned),
            calibration_cells,
        );
        [goal, calibration]
    }

    fn csv(&self) -> String {
        let frames = PROBABILITY_FRAMES.map(|frame| format!("true_set_{frame}")).join(",");
        let mut text = format!(
            "helper,task,runs,{frames},identified,identified_frame,goal_accuracy,goal_ece,\
             goal_log_score,person_accuracy,person_ece,person_log_score\n"
        );
        for (helper, task, score) in self.rows() {
            let cell = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.6}"));
            let BeliefScore { runs, goal, person, .. } = score;
            let probabilities = score.true_set_probability.iter().map(|p| Some(*p));
            let other = [Some(score.identified), score.identified_frame];
            let calibration =
                [goal, person].into_iter().flat_map(|s| [s.accuracy, s.ece, s.log_score]);
            let values: Vec<String> =
                probabilities.chain(other).chain(calibration).map(cell).collect();
            let _ = writeln!(text, "{helper},{task},{runs},{}", values.join(","));
        }
        text
    }

    fn json(&self) -> String {
        #[derive(Serialize)]
        struct File<'a> {
            frames: [u32; PROBABILITY_FRAMES.len()],
            sample_every_frames: u32,
            #[serde(flatten)]
            scores: &'a BeliefScores,
        }
        let file = File {
            frames: PROBABILITY_FRAMES,
            sample_every_frames: SAMPLE_EVERY_FRAMES,
            scores: self,
        };
        serde_json::to_string_pretty(&file).expect("scores have string keys") + "\n"
    }
}

fn goal_cells(score: &BeliefScore) -> Vec<String> {
    let frame = score.identified_frame.map_or("after the end".to_owned(), |f| format!("{f:.0}"));
    let probabilities = score.true_set_probability.iter().map(|p| rounded(*p));
    probabilities.chain([rounded(score.identified), frame]).collect()
}

fn calibration_cells(score: &BeliefScore) -> Vec<String> {
    let each = [score.goal, score.person].into_iter();
    each.flat_map(|s| [s.accuracy, s.ece, s.log_score].map(number)).collect()
}
