//! Sets of formulas for scores. The sets are data; no other code branches on them.

use std::fmt;
use std::str::FromStr;

use crate::metrics::Summary;

/// Name of a set of formulas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FormulaSet {
    /// The paper (section 4.1, "Evaluation Metrics", and appendix "Additional Metrics").
    Paper,
    /// The original's scripts (facts A7).
    Original,
}

/// Statistic that is reported as the spread of the transport rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpreadStatistic {
    /// Standard error of the mean over environments, by the cluster bootstrap of
    /// [`Clusters`](crate::metrics::Clusters).
    StandardError,
    /// Population standard deviation over all episodes and seeds.
    PopulationDeviation,
}

/// A set of formulas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Formulas {
    /// True if EI compares amounts (objects, kilograms) instead of rates.
    pub ei_on_amounts: bool,
    /// Lower bound of EI's denominator.
    pub ei_floor: f64,
    /// Statistic in `tr_se`.
    pub spread: SpreadStatistic,
    /// True if CR credits the helper with objects that it took once and the partner delivered.
    pub credits_handovers: bool,
    /// True if ER counts only frames in which the child ran away by its own decision.
    pub er_counts_escapes: bool,
}

impl Formulas {
    /// Formulas of the paper. The floor only keeps 0 / 0 from being undefined.
    pub const PAPER: Formulas = Formulas {
        ei_on_amounts: false,
        ei_floor: 1e-9,
        spread: SpreadStatistic::StandardError,
        credits_handovers: false,
        er_counts_escapes: false,
    };
    /// Formulas of the original's scripts.
    pub const ORIGINAL: Formulas = Formulas {
        ei_on_amounts: true,
        ei_floor: 1.0,
        spread: SpreadStatistic::PopulationDeviation,
        credits_handovers: true,
        er_counts_escapes: true,
    };
}

impl Formulas {
    /// Returns the frames of an episode run that ER counts; `None` without child.
    pub fn away_frames(&self, summary: &Summary) -> Option<u32> {
        if self.er_counts_escapes { summary.escape_frames } else { summary.away_frames }
    }
}

impl FormulaSet {
    /// Returns the formulas.
    pub fn formulas(self) -> Formulas {
        match self {
            FormulaSet::Paper => Formulas::PAPER,
            FormulaSet::Original => Formulas::ORIGINAL,
        }
    }

    /// Returns the name in commands.
    pub fn as_str(self) -> &'static str {
        match self {
            FormulaSet::Paper => "paper",
            FormulaSet::Original => "original",
        }
    }
}

impl fmt::Display for FormulaSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl FromStr for FormulaSet {
    type Err = String;

    fn from_str(text: &str) -> Result<FormulaSet, String> {
        match text {
            "paper" => Ok(FormulaSet::Paper),
            "original" => Ok(FormulaSet::Original),
            _ => Err(format!("unknown formulas `{text}`; they are paper and original")),
        }
    }
}
