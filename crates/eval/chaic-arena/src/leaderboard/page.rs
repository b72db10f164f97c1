//! Leaderboard as an HTML page.

use chaic_core::TaskId;
use chaic_env::helper_registry::NONE;
use chaic_eval::metrics::{Estimate, HelperRobustness};
use chaic_eval::report::{number, rounded};
use chaic_page::{STYLE, data_link};
use minijinja::value::Serde;
use minijinja::{Environment, context};
use serde::Serialize;

use super::{Leaderboard, LeaderboardRow, LeaderboardTable, RefusedEntry, RowDifference};

/// Name and text of the template. The ending of the name selects escaping for HTML.
const TEMPLATE: (&str, &str) = ("leaderboard.html", include_str!("leaderboard.html"));
/// Style of this page (CSS), after the style of all pages.
const TABLE_STYLE: &str = include_str!("leaderboard.css");
/// Digits of a code version in the page. The link to the JSON file has all.
const VERSION_DIGITS: usize = 12;
/// Level of significance.
const ALPHA: f64 = 0.05;

/// Table as texts.
#[derive(Debug, Serialize)]
struct TableView {
    heading: String,
    /// Names and values of the rules.
    terms: Vec<(&'static str, String)>,
    tasks: Vec<&'static str>,
    reference: String,
    /// Number of partners of the list in words; absent without a list.
    partners: Option<String>,
    rows: Vec<RowView>,
    /// Gains with the partners of the list; empty without a list.
    robustness: Vec<RobustnessView>,
}

/// Robustness of a helper as texts.
#[derive(Debug, Serialize)]
struct RobustnessView {
    title: String,
    is_submission: bool,
    ordinary: String,
    list_gain: String,
    share_kept: String,
    worst_partner: String,
    worst_tenth: String,
    worst_tenth_ordinary: String,
}

/// Row as texts; an absent text is undefined.
#[derive(Debug, Serialize)]
struct RowView {
    title: String,
    is_submission: bool,
    rate: String,
    interval: Option<String>,
    /// Position of the rate in the strip, percent.
    position: f64,
    /// Positions of the ends of the interval.
    interval_positions: Option<[f64; 2]>,
    ei: String,
    difference: Option<String>,
    p_value: Option<String>,
    is_significant: bool,
    /// Rate and interval by task.
    task_rates: Vec<(String, Option<String>)>,
    grants: String,
    perception: String,
    track: String,
    partner: String,
    failed: usize,
    version: String,
    license: String,
    core_hours: String,
    hardware: String,
    authors: String,
}

/// Returns the page.
pub(super) fn render(leaderboard: &Leaderboard, title: &str) -> String {
    let mut environment = Environment::new();
    let (name, source) = TEMPLATE;
    environment.add_template(name, source).expect("the template is valid");
    let tables: Vec<TableView> = leaderboard.tables.iter().map(TableView::new).collect();
    let has_partners = tables.iter().any(|table| table.partners.is_some());
    let refused: Vec<RefusedEntry> = leaderboard.refused.clone();
    let template = environment.get_template(name).expect("it was added above");
    let values = context! {
        title,
        tables => Serde(tables),
        has_partners,
        refused => Serde(refused),
        style => STYLE,
        table_style => TABLE_STYLE,
        json => data_link("application/json", &leaderboard.to_json()),
        csv => data_link("text/csv", &leaderboard.to_csv()),
    };
    template.render(values).expect("the template uses given values only")
}

impl TableView {
    fn new(table: &LeaderboardTable) -> TableView {
        let rules = &table.conditions;
        let is_reference =
            |row: &&LeaderboardRow| row.sha256.is_none() && row.name == table.reference;
        let reference = table.rows.iter().find(is_reference);
        let partners = rules.partners.as_ref().map(|partners| match partners.n {
            1 => "1 partner".to_owned(),
            n => format!("{n} partners"),
        });
        let heading_suffix =
            partners.as_ref().map_or(String::new(), |partners| format!(", {partners}"));
        let robustness = table.rows.iter();
        TableView {
            heading: format!("{}, {} track{heading_suffix}", rules.split, rules.track),
            terms: terms(table),
            tasks: rules.tasks.iter().map(|task| task.info().title).collect(),
            reference: match reference {
                Some(row) if row.name != NONE => title_of(row),
                _ => "no helper".to_owned(),
            },
            rows: table.rows.iter().map(|row| RowView::new(table, row)).collect(),
            robustness: robustness
                .filter_map(|row| Some(RobustnessView::new(row, row.robustness.as_ref()?)))
                .collect(),
            partners,
        }
    }
}

impl RobustnessView {
    fn new(row: &LeaderboardRow, robustness: &HelperRobustness) -> RobustnessView {
        let HelperRobustness { ordinary, suite, share_kept, .. } = robustness;
        let worst = robustness.worst_partner().map(|worst| (&worst.partner, worst.gain.mean));
        RobustnessView {
            title: title_of(row),
            is_submission: row.sha256.is_some(),
            ordinary: estimate(Some(&ordinary.gain)),
            list_gain: estimate(Some(suite)),
            share_kept: estimate(share_kept.as_ref()),
            worst_partner: worst
                .map_or_else(|| number(None), |(name, gain)| format!("{name} {}", rounded(gain))),
            worst_tenth: estimate(Some(&robustness.worst_decile)),
            worst_tenth_ordinary: estimate(Some(&robustness.worst_decile_ordinary)),
        }
    }
}

/// Returns names and values of the rules of a table.
fn terms(table: &LeaderboardTable) -> Vec<(&'static str, String)> {
    let rules = &table.conditions;
    let size = rules.size.map_or("as each helper requests".to_owned(), |px| format!("{px} pixels"));
    let rule_set = match rules.set[..] {
        [] => rules.rules.clone(),
        _ => format!("{} with {}", rules.rules, rules.set.join(", ")),
    };
    let mut terms = vec![
        ("Split", format!("{}, {} episodes", rules.split, rules.n_episodes)),
        ("Episodes, SHA-256", rules.episodes_sha256.clone()),
        ("Environments", table.environments.to_string()),
        ("Seeds per episode", rules.seeds.to_string()),
        ("Track", rules.track.clone()),
        ("Rules", rule_set),
        ("Partner", rules.ranked_partners()),
        ("Person", rules.person.clone().unwrap_or_else(|| "as in the episodes".to_owned())),
        ("Appearance", rules.appearance.clone()),
        ("Perception", rules.perception.clone()),
        ("Behavior recognition", rules.behavior.clone()),
        ("Images", size),
        ("chaic", rules.chaic.clone()),
    ];
    if let Some(partners) = &rules.partners {
        terms.push(("Partners, SHA-256", partners.sha256.clone()));
    }
    terms
}

/// Returns the title of a row.
fn title_of(row: &LeaderboardRow) -> String {
    let title = if row.name == NONE { "No helper" } else { &row.title };
    format!("{title} {}", row.release).trim_end().to_owned()
}

impl RowView {
    fn new(table: &LeaderboardTable, row: &LeaderboardRow) -> RowView {
        let task_rate = |task: &TaskId| {
            let rates = row.tasks.get(task);
            (number(rates.map(|rates| rates.tr)), rates.and_then(|r| r.tr_ci).map(interval))
        };
        let position = |rate: f64| (1000.0 * rate).round() / 10.0;
        let difference =
            |d: RowDifference| format!("{} ({})", rounded(d.mean), interval([d.low, d.high]));
        let grants = row.granted.as_ref().map(|g| g.grants.join(", ").replace('_', " "));
        let version = row.sha256.as_ref().map(|digest| digest[..VERSION_DIGITS].to_owned());
        RowView {
            title: title_of(row),
            is_submission: row.sha256.is_some(),
            rate: rounded(row.tr),
            interval: row.tr_ci.map(interval),
            position: position(row.tr),
            interval_positions: row.tr_ci.map(|ends| ends.map(position)),
            ei: number(row.ei),
            difference: row.difference.map(difference),
            p_value: row.difference.map(p_value),
            is_significant: row.difference.is_some_and(|d| d.p_holm < ALPHA),
            task_rates: table.conditions.tasks.iter().map(task_rate).collect(),
            grants: grants.filter(|names| !names.is_empty()).unwrap_or_else(|| "none".to_owned()),
            perception: perception(row),
            track: table.conditions.track.clone(),
            partner: table.conditions.ranked_partners(),
            failed: row.failed,
            version: version.unwrap_or_default(),
            license: row.license.clone(),
            core_hours: row.core_hours.map_or(String::new(), |hours| hours.to_string()),
            hardware: row.hardware.clone(),
            authors: row.authors.join(", "),
        }
    }
}

/// Returns the perception of a row without the digests of its weights, and an isolation other than the whole
/// sandbox.
fn perception(row: &LeaderboardRow) -> String {
    let Some(granted) = &row.granted else { return String::new() };
    let first_word = |text: &str| text.split(' ').next().unwrap_or_default().to_owned();
    let parts = granted.perception.split(", ").map(|part| match part.strip_prefix("behavior ") {
        Some(behavior) => format!("behavior {}", first_word(behavior)),
        None => first_word(part).replace('_', " "),
    });
    let isolation = granted.isolation.clone().filter(|isolation| isolation != "sandbox");
    parts.chain(isolation).collect::<Vec<_>>().join(", ")
}

/// Formats an estimate with its interval, or as undefined.
fn estimate(estimate: Option<&Estimate>) -> String {
    let mean = number(estimate.map(|estimate| estimate.mean));
    match estimate.and_then(|estimate| estimate.interval) {
        Some(ends) => format!("{mean} ({})", interval([ends.low, ends.high])),
        None => mean,
    }
}

fn interval([low, high]: [f64; 2]) -> String {
    format!("{} to {}", rounded(low), rounded(high))
}

fn p_value(difference: RowDifference) -> String {
    if difference.p_holm < 0.001 {
        return "< 0.001".to_owned();
    }
    format!("{:.3}", difference.p_holm)
}
