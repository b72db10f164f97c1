//! Section of the document about one rule set.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use chaic_core::TaskId;
use chaic_env::helper_registry::NONE;
use chaic_env::rules::RuleSetName;

use crate::compare::{
    PUBLISHED_EPISODES, PairwiseOrder, PublishedDifference, RankInversion, TaskRate,
    pairwise_order, published_difference, task_rate,
};
use chaic_eval::metrics::{Formulas, Metric, PlayedEpisodes, Scores, SpreadStatistic, differences};
use chaic_eval::published::published;
use chaic_eval::report::{Labels, TextTable, capitalized, interval, number, rounded, title};

/// Results of one rule set.
pub(super) struct RuleSection<'a> {
    pub rules: RuleSetName,
    pub played: PlayedEpisodes<'a>,
    pub labels: Labels<'a>,
    pub tasks: &'a [TaskId],
    pub helpers: &'a [String],
}

/// Returns the formulas of a rule set's scores: the paper's, or those of the original's scripts.
/// Standard errors are always over environments.
pub(super) fn formulas(rules: RuleSetName) -> Formulas {
    match rules {
        RuleSetName::Paper => Formulas::PAPER,
        RuleSetName::Compat => {
            Formulas { spread: SpreadStatistic::StandardError, ..Formulas::ORIGINAL }
        }
    }
}

impl RuleSection<'_> {
    /// Returns the section as Markdown; `figure` is the path of its figure.
    pub fn markdown(&self, figure: &str) -> String {
        let name = match self.rules {
            RuleSetName::Paper => "Rules of the paper (`paper`)",
            RuleSetName::Compat => "Rules of the original's code (`compat`)",
        };
        let scored = match self.rules {
            RuleSetName::Paper => "Scored by the paper's formulas.",
            RuleSetName::Compat => {
                "Scored by the formulas of the original's scripts where they differ from the \
                 paper's (EI, CR, ER; see [metrics.md](../metrics.md)). Standard errors are over \
                 environments throughout."
            }
        };
        let mut text = format!(
            "## {name}\n\n{scored}\n\n![Transport rates, measured and published]({figure})\n\n"
        );
        text += &self.rates();
        text += &self.distances();
        text += &self.orders();
        text += &self.gains();
        text += &self.other_metrics();
        text
    }

    /// Returns the rates of a helper in all tasks with results.
    fn task_rates(&self, helper: &str) -> Vec<TaskRate> {
        self.tasks.iter().filter_map(|t| task_rate(self.played, *t, helper)).collect()
    }

    fn header(&self, first: &str) -> Vec<String> {
        let titles = self.tasks.iter().map(|t| t.info().title.to_owned());
        std::iter::once(first.to_owned()).chain(titles).collect()
    }

    fn rates(&self) -> String {
        let mut rows = Vec::new();
        for helper in self.helpers {
            let rates: Vec<Option<TaskRate>> =
                self.tasks.iter().map(|t| task_rate(self.played, *t, helper)).collect();
            let row = |name: String, cell: &dyn Fn(&TaskRate) -> String| {
                let cells = rates.iter().map(|r| r.as_ref().map_or("/".to_owned(), cell));
                std::iter::once(name).chain(cells).collect::<Vec<String>>()
            };
            let name = title(helper);
            rows.push(row(format!("**{}**, chaic", self.labels.title(helper)), &|r| rounded(r.tr)));
            if published(helper).is_some() {
                rows.push(row(format!("{name}, paper"), &|r| number(r.published)));
                rows.push(row("difference".to_owned(), &difference));
            }
        }
        let title = "Transport rate, measured and published".to_owned();
        let text_table = TextTable { title, header: self.header("TR"), rows };
        format!(
            "{}\n± is half the 95 % interval of chaic's mean over environments ({}; cluster bootstrap \
             with Student's t, see [metrics.md](../metrics.md)). **Bold**: the difference exceeds the \
             95 % limit of chance for a comparison of these episodes with {PUBLISHED_EPISODES} \
             others of the same variance and as many per environment, played once. The paper's \
             helpers perceive by a trained Mask R-CNN; the information granted to chaic's helpers \
             follows their names.\n\n",
            text_table.to_markdown(),
            self.environments(),
        )
    }

    /// Lists the number of environments of each task's episodes.
    fn environments(&self) -> String {
        let count = |t: &TaskId| {
            let results = self.played.results.iter().filter(|r| r.key.task == *t);
            let environments: BTreeSet<&str> =
                results.map(|r| self.played.environments.get(*t, &r.key.episode)).collect();
            format!("{}: {}", t.info().title.to_lowercase(), environments.len())
        };
        self.tasks.iter().map(count).collect::<Vec<_>>().join(", ")
    }

    fn distances(&self) -> String {
        let cells = |d: Option<PublishedDifference>| match d {
            None => vec!["/".to_owned(); 5],
            Some(d) => vec![
                rounded(d.mad),
                rounded(d.by_chance),
                rounded(d.chance_sd),
                rounded(d.bias),
                format!("{} of {}", d.significant, d.tasks),
            ],
        };
        let known = self.helpers.iter().filter(|h| published(h).is_some());
        let row = |h: &String| {
            let d = published_difference(&self.task_rates(h));
            std::iter::once(title(h)).chain(cells(d)).collect::<Vec<String>>()
        };
        let header =
            ["Helper", "MAD", "MAD by chance", "its deviation", "mean difference", "beyond chance"];
        let text_table = TextTable {
            title: "Mean absolute difference (MAD) of TR over the tasks".to_owned(),
            header: header.map(str::to_owned).to_vec(),
            rows: known.map(row).collect(),
        };
        format!(
            "{}\nMAD by chance: expected MAD, and its standard deviation, if chaic's figures and the \
             published ones were means over episodes of the same kind. These are chaic's own and \
             {PUBLISHED_EPISODES} others played once, with the variance over environments and seeds \
             of chaic's results. The mean absolute value of a normal distribution is 0.80 of its \
             standard deviation. A larger MAD is not explained by sampling. Tasks in one house are \
             treated as independent, so the deviation is a lower bound. Beyond chance: tasks in bold \
             above; chance alone gives 0.4 of eight.\n\n",
            text_table.to_markdown()
        )
    }

    fn orders(&self) -> String {
        let orders: Vec<(TaskId, PairwiseOrder)> = self
            .tasks
            .iter()
            .map(|t| (*t, pairwise_order(self.played, *t, self.helpers)))
            .collect();
        let row = |(task, o): &(TaskId, PairwiseOrder)| {
            let inverted: Vec<String> = o.inverted.iter().map(inversion).collect();
            vec![
                task.info().title.to_owned(),
                self.ranking(*task, true),
                self.ranking(*task, false),
                format!("{} of {}", o.pairs - o.inverted.len(), o.pairs),
                if inverted.is_empty() { "none".to_owned() } else { inverted.join("; ") },
            ]
        };
        let header =
            ["Task", "published", "chaic", "pairs kept", "inverted, with chaic's difference"];
        let text_table = TextTable {
            title: "Order of the helpers by TR".to_owned(),
            header: header.map(str::to_owned).to_vec(),
            rows: orders.iter().map(row).collect(),
        };
        let compared = orders.iter().filter(|(_, o)| o.pairs > 0);
        let (n, kept) =
            (compared.clone().count(), compared.clone().filter(|(_, o)| o.is_preserved()));
        let by_chance =
            compared.clone().filter(|(_, o)| !o.is_preserved() && o.is_within_intervals());
        let (pairs, n_inverted) =
            compared.clone().fold((0, 0), |(p, i), (_, o)| (p + o.pairs, i + o.inverted.len()));
        let mut text = text_table.to_markdown();
        let _ = writeln!(
            text,
            "\nThe published order of the helpers is kept in {} of {n} tasks; in {} more all inverted \
             pairs are within their intervals. Of {pairs} pairs {} are kept. Pairs with equal \
             published rates are not counted; pairs with equal measured rates count as inverted.\n",
            kept.count(),
            by_chance.count(),
            pairs - n_inverted
        );
        text
    }

    /// Lists the helpers in descending order of their rates.
    fn ranking(&self, task: TaskId, as_published: bool) -> String {
        let rate = |h: &String| {
            let rate = task_rate(self.played, task, h)?;
            let published = rate.published?;
            Some((title(h), if as_published { published } else { rate.tr }))
        };
        let mut rates: Vec<(String, f64)> = self.helpers.iter().filter_map(rate).collect();
        rates.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut text = String::new();
        for (k, (name, tr)) in rates.iter().enumerate() {
            if k > 0 {
                text += if rates[k - 1].1 == *tr { " = " } else { " > " };
            }
            text += name;
        }
        text
    }

    fn gains(&self) -> String {
        let helpers: Vec<&String> = self.helpers.iter().filter(|h| *h != NONE).collect();
        let mut rows = Vec::new();
        for helper in &helpers {
            let pair = [NONE.to_owned(), (*helper).clone()];
            let Some(found) = differences(self.played, &pair).pop() else { continue };
            let cells = self.tasks.iter().map(|t| interval(found.tasks.get(t)));
            let name = format!("**{} - w/o**, chaic", title(helper));
            let all = interval(found.all.as_ref());
            rows.push([name, all].into_iter().chain(cells).collect::<Vec<String>>());
            let gain = |t: TaskId| {
                let tr = |h: &str| published(h).and_then(|row| Some(row.scores(t)?.tr));
                Some(tr(helper)? - tr(NONE)?)
            };
            let gains: Vec<Option<f64>> = self.tasks.iter().map(|t| gain(*t)).collect();
            if let Some(known) = gains.iter().copied().collect::<Option<Vec<f64>>>() {
                let mean = known.iter().sum::<f64>() / known.len() as f64;
                let name = format!("{} - w/o, paper", title(helper));
                let cells = known.iter().map(|g| rounded(*g));
                rows.push([name, rounded(mean)].into_iter().chain(cells).collect());
            }
        }
        let mut header = self.header("TR difference");
        header.insert(1, "all".to_owned());
        let title =
            "Gain over no helper on the same episodes, with 95 % intervals over environments";
        TextTable { title: title.to_owned(), header, rows }.to_markdown() + "\n"
    }

    /// Returns EI, IA, CR, ER and the standard error of TR beside the paper's.
    fn other_metrics(&self) -> String {
        let metrics = ["ei", "ia", "cr", "er", "tr_se"].map(Metric::from_key);
        let scores = Scores::new(self.played, &formulas(self.rules));
        let mut rows = Vec::new();
        for metric in metrics {
            for helper in self.helpers {
                let cell = |task: &TaskId| {
                    let measured = scores.get(*task, helper).and_then(|score| metric.value(score));
                    let published = published(helper).and_then(|row| row.scores(*task));
                    let published = published.as_ref().and_then(|scores| metric.published(scores));
                    match (measured, published) {
                        (None, None) => "/".to_owned(),
                        _ => format!("{} ({})", number(measured), number(published)),
                    }
                };
                let cells: Vec<String> = self.tasks.iter().map(cell).collect();
                // Without helper only the standard error is defined, and the emergency rate exists
                // for shopping only.
                if cells.iter().any(|c| c != "/") {
                    let name = format!("{}, {}", metric.name, title(helper));
                    rows.push(std::iter::once(name).chain(cells).collect());
                }
            }
        }
        let titles = metrics.map(|m| format!("{} ({})", m.title, m.name)).join(", ");
        let title = capitalized(&titles) + ": chaic (paper in brackets)";
        TextTable { title, header: self.header("Metric"), rows }.to_markdown() + "\n"
    }
}

fn difference(rate: &TaskRate) -> String {
    let Some(difference) = rate.difference() else { return "/".to_owned() };
    let half = rate.interval.map_or(String::new(), |i| format!(" ±{:.2}", (i.high - i.low) / 2.0));
    let mark = if rate.is_beyond_chance() { "**" } else { "" };
    format!("{mark}{}{mark}{half}", signed(difference))
}

/// Formats with two decimals and a sign; values that round to zero have none.
fn signed(value: f64) -> String {
    let text = format!("{value:+.2}");
    if text.ends_with("0.00") { "0.00".to_owned() } else { text }
}

fn inversion(inversion: &RankInversion) -> String {
    let RankInversion { higher, lower, interval: i } = inversion;
    let pair = format!("{} - {}", title(higher), title(lower));
    match i {
        None => format!("{pair} (of one episode, without interval)"),
        Some(_) if inversion.is_within_interval() => {
            format!("{pair} {} (within its interval)", interval(i.as_ref()))
        }
        Some(_) => format!("{pair} {} (**beyond it**)", interval(i.as_ref())),
    }
}
