//! What the document says of one rule set.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use chaic_core::TaskId;
use chaic_env::minds::NONE;
use chaic_env::rules::RuleSetName;

use crate::compare::{
    Distance, Inversion, Order, PUBLISHED_EPISODES, TaskRate, distance, order, task_rate,
};
use chaic_eval::metrics::{Formulas, Metric, Played, Scores, Spread, differences};
use chaic_eval::published::published;
use chaic_eval::report::{Labels, TextTable, capitalized, interval, number, rounded, title};

/// The results of one rule set.
pub(super) struct RuleSection<'a> {
    pub rules: RuleSetName,
    pub played: Played<'a>,
    pub labels: Labels<'a>,
    pub tasks: &'a [TaskId],
    pub helpers: &'a [String],
}

/// The formulas that a rule set is scored by: the paper's by the paper's, the original's by those
/// of its scripts; standard errors are always over environments.
pub(super) fn formulas(rules: RuleSetName) -> Formulas {
    match rules {
        RuleSetName::Paper => Formulas::PAPER,
        RuleSetName::Compat => Formulas { spread: Spread::StandardError, ..Formulas::ORIGINAL },
    }
}

impl RuleSection<'_> {
    /// The whole section; `figure` is where its figure lies.
    pub fn markdown(&self, figure: &str) -> String {
        let name = match self.rules {
            RuleSetName::Paper => "By the paper's rules (`paper`)",
            RuleSetName::Compat => "By the rules of the original's code (`compat`)",
        };
        let scored = match self.rules {
            RuleSetName::Paper => "Scored by the paper's formulas.",
            RuleSetName::Compat => {
                "Scored by the formulas of the original's scripts, where these differ from the \
                 paper's (EI, CR, ER; see [metrics.md](metrics.md)); standard errors are over \
                 environments, as everywhere here."
            }
        };
        let mut text = format!(
            "## {name}\n\n{scored}\n\n![Transport rates, measured and published]({figure})\n\n"
        );
        text += &self.rates();
        text += &self.distances();
        text += &self.orders();
        text += &self.gains();
        text += &self.others();
        text
    }

    /// The rates of a helper in all tasks that have any.
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
        let grid = TextTable { title, header: self.header("TR"), rows };
        format!(
            "{}\nBehind ± stands half the 95 % interval of chaic's mean over environments ({}; cluster \
             bootstrap with Student's t, see [metrics.md](metrics.md)). **Bold**: the difference is \
             more than chance explains in 95 of 100 cases between these episodes and \
             {PUBLISHED_EPISODES} others with the same spread and as many in one environment, played \
             once. The paper's helpers perceive by a trained Mask R-CNN; what chaic's are granted \
             stands behind their names.\n\n",
            grid.to_markdown(),
            self.environments(),
        )
    }

    /// How many environments the episodes of each task take place in.
    fn environments(&self) -> String {
        let of = |t: &TaskId| {
            let results = self.played.results.iter().filter(|r| r.key.task == *t);
            let places: BTreeSet<&str> =
                results.map(|r| self.played.environments.of(&r.key.episode)).collect();
            format!("{}: {}", t.info().title.to_lowercase(), places.len())
        };
        self.tasks.iter().map(of).collect::<Vec<_>>().join(", ")
    }

    fn distances(&self) -> String {
        let cells = |d: Option<Distance>| match d {
            None => vec!["/".to_owned(); 5],
            Some(d) => vec![
                rounded(d.mad),
                rounded(d.by_chance),
                rounded(d.chance_sd),
                rounded(d.bias),
                format!("{} of {}", d.beyond, d.tasks),
            ],
        };
        let known = self.helpers.iter().filter(|h| published(h).is_some());
        let row = |h: &String| {
            let d = distance(&self.task_rates(h));
            std::iter::once(title(h)).chain(cells(d)).collect::<Vec<String>>()
        };
        let header =
            ["Helper", "MAD", "MAD by chance", "its deviation", "mean difference", "beyond chance"];
        let grid = TextTable {
            title: "Mean absolute difference (MAD) of TR over the tasks".to_owned(),
            header: header.map(str::to_owned).to_vec(),
            rows: known.map(row).collect(),
        };
        format!(
            "{}\nBy chance: what the MAD would be on average, and its standard deviation, if chaic's \
             figures and the published ones were means over episodes of the same kind, chaic's own and \
             {PUBLISHED_EPISODES} others played once, with the spread over environments and seeds \
             that chaic's show (the mean absolute value of a normal is 0.80 of its standard deviation). \
             What the MAD exceeds that by is not sampling. Tasks in one house are taken as independent, so \
             the deviation is at least that. Beyond chance: tasks in bold above; of \
             eight, chance gives 0.4.\n\n",
            grid.to_markdown()
        )
    }

    fn orders(&self) -> String {
        let orders: Vec<(TaskId, Order)> =
            self.tasks.iter().map(|t| (*t, order(self.played, *t, self.helpers))).collect();
        let row = |(task, o): &(TaskId, Order)| {
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
        let grid = TextTable {
            title: "Order of the helpers by TR".to_owned(),
            header: header.map(str::to_owned).to_vec(),
            rows: orders.iter().map(row).collect(),
        };
        let compared = orders.iter().filter(|(_, o)| o.pairs > 0);
        let (n, kept) =
            (compared.clone().count(), compared.clone().filter(|(_, o)| o.is_preserved()));
        let by_chance =
            compared.clone().filter(|(_, o)| !o.is_preserved() && o.is_within_intervals());
        let (pairs, turned) =
            compared.clone().fold((0, 0), |(p, i), (_, o)| (p + o.pairs, i + o.inverted.len()));
        let mut text = grid.to_markdown();
        let _ = writeln!(
            text,
            "\nThe published order of the helpers is kept in {} of {n} tasks; in {} more all inverted \
             pairs are within their intervals. Of {pairs} pairs {} are kept. Helpers whose published \
             rates are equal may stand either way and make no pair; two that are equal here count as \
             inverted.\n",
            kept.count(),
            by_chance.count(),
            pairs - turned
        );
        text
    }

    /// The helpers from the highest rate to the lowest.
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
                let tr = |h: &str| published(h).and_then(|row| Some(row.figures(t)?.tr));
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
        let title = "What a helper adds to no helper on the same episodes, with 95 % intervals over environments";
        TextTable { title: title.to_owned(), header, rows }.to_markdown() + "\n"
    }

    /// EI, IA, CR, ER and the standard error of TR beside the paper's.
    fn others(&self) -> String {
        let metrics = ["ei", "ia", "cr", "er", "tr_se"].map(Metric::of);
        let scores = Scores::of(self.played, &formulas(self.rules));
        let mut rows = Vec::new();
        for metric in metrics {
            for helper in self.helpers {
                let cell = |task: &TaskId| {
                    let ours = scores.get(*task, helper).and_then(metric.value);
                    let figures = published(helper).and_then(|row| row.figures(*task));
                    let papers = figures.as_ref().and_then(metric.published);
                    match (ours, papers) {
                        (None, None) => "/".to_owned(),
                        _ => format!("{} ({})", number(ours), number(papers)),
                    }
                };
                let cells: Vec<String> = self.tasks.iter().map(cell).collect();
                // Without helper only the standard error is defined; the emergency rate is
                // shopping's alone.
                if cells.iter().any(|c| c != "/") {
                    let name = format!("{}, {}", metric.name, title(helper));
                    rows.push(std::iter::once(name).chain(cells).collect());
                }
            }
        }
        let titles = metrics.map(|m| format!("{} ({})", m.title, m.name)).join(", ");
        let title = capitalized(&titles) + ": chaic's, the paper's in brackets";
        TextTable { title, header: self.header("Metric"), rows }.to_markdown() + "\n"
    }
}

fn difference(rate: &TaskRate) -> String {
    let Some(difference) = rate.difference() else { return "/".to_owned() };
    let half = rate.interval.map_or(String::new(), |i| format!(" ±{:.2}", (i.high - i.low) / 2.0));
    let mark = if rate.is_beyond_chance() { "**" } else { "" };
    format!("{mark}{}{mark}{half}", signed(difference))
}

/// Two decimals with their sign; what rounds to zero has none.
fn signed(value: f64) -> String {
    let text = format!("{value:+.2}");
    if text.ends_with("0.00") { "0.00".to_owned() } else { text }
}

fn inversion(inversion: &Inversion) -> String {
    let Inversion { higher, lower, interval: i } = inversion;
    let pair = format!("{} - {}", title(higher), title(lower));
    match i {
        None => format!("{pair} (of one episode, without interval)"),
        Some(_) if inversion.is_within_interval() => {
            format!("{pair} {} (within its interval)", interval(i.as_ref()))
        }
        Some(_) => format!("{pair} {} (**beyond it**)", interval(i.as_ref())),
    }
}
