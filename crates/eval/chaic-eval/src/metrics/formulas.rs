//! Which formulas scores are computed by. The two sets are data; nothing else branches on them.

use std::fmt;
use std::str::FromStr;

use crate::metrics::Summary;

/// Names a set of formulas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FormulaSet {
    /// What the paper says (section 4.1, "Evaluation Metrics", and appendix "Additional Metrics").
    Paper,
    /// What the original's scripts compute (facts A7).
    Original,
}

/// How the spread of the transport rate is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spread {
    /// The standard error of the mean over episodes: sample deviation over the root of their
    /// number, seeds of an episode averaged first.
    StandardError,
    /// The population's standard deviation over all episodes and seeds.
    PopulationDeviation,
}

/// A set of formulas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Formulas {
    /// Whether EI compares amounts (objects, kilograms) rather than rates.
    pub ei_on_amounts: bool,
    /// EI's denominator is at least this.
    pub ei_floor: f64,
    /// How `tr_se` is computed.
    pub spread: Spread,
    /// Whether CR credits the helper with what it once took and the partner delivered.
    pub credits_handing_over: bool,
    /// Whether ER counts frames only while the child ran away, by its own decisions.
    pub er_by_mood: bool,
}

impl Formulas {
    /// The paper's. The floor only keeps 0 / 0 from being undefined.
    pub const PAPER: Formulas = Formulas {
        ei_on_amounts: false,
        ei_floor: 1e-9,
        spread: Spread::StandardError,
        credits_handing_over: false,
        er_by_mood: false,
    };
    /// The original scripts'.
    pub const ORIGINAL: Formulas = Formulas {
        ei_on_amounts: true,
        ei_floor: 1.0,
        spread: Spread::PopulationDeviation,
        credits_handing_over: true,
        er_by_mood: true,
    };
}

impl Formulas {
    /// The frames of an episode run that ER counts; `None` without child.
    pub fn away_frames(&self, summary: &Summary) -> Option<u32> {
        if self.er_by_mood { summary.escape_frames } else { summary.away_frames }
    }
}

impl FormulaSet {
    /// The formulas.
    pub fn formulas(self) -> Formulas {
        match self {
            FormulaSet::Paper => Formulas::PAPER,
            FormulaSet::Original => Formulas::ORIGINAL,
        }
    }

    /// The name in commands.
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
