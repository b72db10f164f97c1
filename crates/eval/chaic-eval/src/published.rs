//! Scores that the paper reports.
//!
//! Sources: TR, EI, IA and ER of the planning helpers are in the paper's table "Quantitative
//! results on CHAIC benchmark" (section 5, `tab:main_results`). CR and the standard error of TR are
//! in "Additional results on CHAIC benchmark" (appendix, `tab:appendix_results`). TR and EI of the
//! learning helpers are in "Quantitative results of learning-based agents" (appendix,
//! `tab:rl_results`). All are means over the original's test split, to two decimals.
//!
//! The table of the learning helpers repeats the row without helper. It has 0.38, 0.27 and 0.08 in
//! high container, high goal and obstacle; the main table has 0.37, 0.28 and 0.07. This file has
//! the values of the main table.

use chaic_core::TaskId;

/// Published scores of one helper in one task; `None` for scores that the paper does not report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedScores {
    /// Transport rate, 0 to 1.
    pub tr: f64,
    /// Efficiency improvement over no helper.
    pub ei: Option<f64>,
    /// Goal inference accuracy, 0 to 1.
    pub ia: Option<f64>,
    /// Emergency rate, 0 to 1; shopping only.
    pub er: Option<f64>,
    /// Completion ratio of the helper, 0 to 1.
    pub cr: Option<f64>,
    /// Standard error of the transport rate.
    pub tr_se: Option<f64>,
}

/// A row of the paper's tables. Arrays are in the order of [`TaskId::all`], which is the paper's
/// order.
#[derive(Clone, Copy, Debug)]
pub struct PublishedHelper {
    /// Name of the helper in commands, or of a helper of the same kind if chaic does not have it.
    pub helper: &'static str,
    /// Name in the paper.
    pub title: &'static str,
    tr: [f64; 8],
    ei: Option<[f64; 8]>,
    /// All tasks except the last one, moving house.
    ia: Option<[f64; 7]>,
    /// Shopping only.
    er: Option<f64>,
    cr: Option<[f64; 8]>,
    tr_se: Option<[f64; 8]>,
}

/// All rows in the paper's order; the learning helpers are last.
pub static PUBLISHED: [PublishedHelper; 8] = [
    PublishedHelper {
        helper: "none",
        title: "w/o",
        tr: [0.53, 0.30, 0.37, 0.28, 0.51, 0.07, 0.37, 0.17],
        ei: None,
        ia: None,
        er: None,
        cr: None,
        tr_se: Some([0.03, 0.02, 0.03, 0.05, 0.03, 0.04, 0.02, 0.04]),
    },
    PublishedHelper {
        helper: "random",
        title: "Random",
        tr: [0.52, 0.27, 0.36, 0.33, 0.50, 0.21, 0.39, 0.48],
        ei: Some([-0.02, -0.05, 0.00, 0.10, -0.01, 0.56, 0.05, 0.68]),
        ia: Some([0.24, 0.29, 0.25, 0.14, 0.31, 0.24, 0.34]),
        er: Some(0.32),
        cr: Some([0.09, 0.10, 0.12, 0.06, 0.09, 0.09, 0.07, 0.73]),
        tr_se: Some([0.04, 0.03, 0.03, 0.04, 0.04, 0.04, 0.02, 0.05]),
    },
    PublishedHelper {
        helper: "rhp",
        title: "RHP",
        tr: [0.64, 0.35, 0.45, 0.35, 0.66, 0.44, 0.49, 0.65],
        ei: Some([0.15, 0.11, 0.19, 0.18, 0.23, 0.77, 0.22, 0.72]),
        ia: Some([0.15, 0.29, 0.21, 0.21, 0.28, 0.17, 0.44]),
        er: Some(0.30),
        cr: Some([0.15, 0.43, 0.29, 0.39, 0.36, 0.19, 0.34, 0.74]),
        tr_se: Some([0.02, 0.04, 0.03, 0.05, 0.03, 0.04, 0.02, 0.04]),
    },
    PublishedHelper {
        helper: "vlm",
        title: "VLM (GPT-4o)",
        tr: [0.63, 0.33, 0.43, 0.26, 0.69, 0.40, 0.50, 0.70],
        ei: Some([0.14, 0.06, 0.12, -0.20, 0.26, 0.86, 0.25, 0.78]),
        ia: Some([0.24, 0.32, 0.40, 0.33, 0.46, 0.35, 0.72]),
        er: Some(0.39),
        cr: Some([0.13, 0.08, 0.34, 0.18, 0.39, 0.17, 0.34, 0.82]),
        tr_se: Some([0.03, 0.02, 0.04, 0.05, 0.02, 0.03, 0.03, 0.05]),
    },
    PublishedHelper {
        helper: "llm_bm",
        title: "LLM (GPT-4) + BM",
        tr: [0.65, 0.38, 0.49, 0.36, 0.70, 0.42, 0.58, 0.69],
        ei: Some([0.17, 0.19, 0.24, 0.23, 0.27, 0.89, 0.33, 0.77]),
        ia: Some([0.25, 0.29, 0.30, 0.35, 0.43, 0.47, 0.74]),
        er: Some(0.38),
        cr: Some([0.22, 0.30, 0.30, 0.35, 0.38, 0.45, 0.46, 0.78]),
        tr_se: Some([0.03, 0.03, 0.03, 0.04, 0.03, 0.05, 0.03, 0.05]),
    },
    PublishedHelper {
        helper: "oracle",
        title: "Oracle",
        tr: [0.77, 0.49, 0.69, 0.61, 0.82, 0.60, 0.61, 0.76],
        ei: Some([0.31, 0.37, 0.47, 0.56, 0.38, 0.87, 0.39, 0.80]),
        ia: Some([0.88, 0.91, 0.91, 0.90, 0.91, 0.82, 0.87]),
        er: Some(0.17),
        cr: Some([0.51, 0.64, 0.66, 0.73, 0.59, 0.38, 0.45, 0.77]),
        tr_se: Some([0.03, 0.04, 0.03, 0.04, 0.03, 0.03, 0.03, 0.04]),
    },
    PublishedHelper {
        helper: "rl_paper",
        title: "RL",
        tr: [0.45, 0.26, 0.28, 0.25, 0.43, 0.11, 0.32, 0.67],
        ei: Some([-0.19, -0.16, -0.25, -0.22, -0.16, 0.07, -0.13, 0.74]),
        ia: None,
        er: None,
        cr: None,
        tr_se: None,
    },
    PublishedHelper {
        helper: "smart_help",
        title: "Smart-Help",
        tr: [0.46, 0.24, 0.26, 0.31, 0.49, 0.13, 0.32, 0.57],
        ei: Some([-0.12, -0.17, -0.28, 0.01, -0.04, 0.11, -0.13, 0.70]),
        ia: None,
        er: None,
        cr: None,
        tr_se: None,
    },
];

impl PublishedHelper {
    /// Returns the published scores in a task; `None` for a task that is not in the paper.
    pub fn scores(&self, task: TaskId) -> Option<PublishedScores> {
        let k = TaskId::paper().position(|t| t == task)?;
        Some(PublishedScores {
            tr: self.tr[k],
            ei: self.ei.map(|row| row[k]),
            ia: self.ia.and_then(|row| row.get(k).copied()),
            er: self.er.filter(|_| task.info().has_child),
            cr: self.cr.map(|row| row[k]),
            tr_se: self.tr_se.map(|row| row[k]),
        })
    }
}

/// Returns the paper's row of a helper.
pub fn published(helper: &str) -> Option<&'static PublishedHelper> {
    PUBLISHED.iter().find(|row| row.helper == helper)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_are_those_of_the_paper() {
        let scores = |helper: &str, task| published(helper).unwrap().scores(task).unwrap();
        let oracle = scores("oracle", TaskId::Shopping);
        assert_eq!((oracle.tr, oracle.ei), (0.61, Some(0.39)));
        assert_eq!((oracle.ia, oracle.er), (Some(0.87), Some(0.17)));
        let vlm = scores("vlm", TaskId::HighGoal);
        assert_eq!((vlm.tr, vlm.ei, vlm.ia), (0.26, Some(-0.20), Some(0.33)));
        let random = scores("random", TaskId::Obstacle);
        assert_eq!((random.tr, random.ei, random.er), (0.21, Some(0.56), None));
        let moving = scores("rhp", TaskId::MovingHouse);
        assert_eq!((moving.tr, moving.ia, moving.cr), (0.65, None, Some(0.74)));
        assert_eq!(scores("none", TaskId::HighGoal).tr_se, Some(0.05));
        assert_eq!(scores("smart_help", TaskId::Obstacle).tr, 0.13);
        assert!(published("unknown").is_none());
    }

    /// EI is not a function of the mean TR values, but has the sign of their difference where that
    /// is large.
    #[test]
    fn transport_rates_and_improvements_agree() {
        let alone = published("none").unwrap();
        for row in &PUBLISHED {
            for task in TaskId::paper() {
                let (f, without) = (row.scores(task).unwrap(), alone.scores(task).unwrap().tr);
                let Some(ei) = f.ei else { continue };
                if (f.tr - without).abs() > 0.05 {
                    assert_eq!(ei > 0.0, f.tr > without, "{} in {task}", row.title);
                }
                assert!(f.tr <= 1.0 && f.ia.is_none_or(|ia| ia <= 1.0));
            }
        }
    }

    /// docs/results.md repeats the paper's rows.
    #[test]
    fn the_results_page_has_the_same_scores() {
        let page = include_str!("../../../../docs/results.md");
        for row in &PUBLISHED {
            let head = format!("| {}, paper |", row.title);
            let Some(line) = page.lines().find(|l| l.starts_with(&head)) else { continue };
            let cells: Vec<&str> = line.trim_matches('|').split('|').skip(1).collect();
            for (task, cell) in TaskId::paper().zip(cells) {
                let f = row.scores(task).unwrap();
                let ei = f.ei.map_or(String::new(), |ei| format!(" ({ei:.2})"));
                assert_eq!(cell.trim(), format!("{:.2}{ei}", f.tr), "{} in {task}", row.title);
            }
        }
        assert_eq!(page.matches(", paper |").count(), 6, "all rows were compared");
    }
}
