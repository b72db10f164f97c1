//! `chaic list`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use chaic_agents::HelperInfo;
use chaic_agents::partners::{PartnerVariant, partner_habits};
use chaic_core::capability::{IMPAIRMENTS, Persona};
use chaic_core::observation::Grants;
use chaic_core::task::{TASKS, TaskOrigin};
use chaic_env::helper_registry::{NONE, RULES};
use chaic_env::partner_suite::{PartnerSuite, SuitePartner};
use chaic_env::rules::{RuleSet, differing_rules, rule_names, rule_values};
use chaic_eval::report::title;
use chaic_eval::run::{RunFolder, planned, read_results};
use chaic_eval::suite::SuiteFolder;
use chaic_files::entries;
use chaic_learn::bundled::{BundledHelper, BundledPartner};
use comfy_table::ContentArrangement;
use serde_json::{Value, json};

use super::{all_helper_names, all_partner_names, table};
use crate::arguments::ListCommand;
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, print_result};

/// Lists helpers, tasks, people, partners, rules or runs.
pub fn run(command: &ListCommand, format: OutputFormat) -> Result<ExitStatus> {
    match command {
        ListCommand::Helpers => helpers(format),
        ListCommand::Tasks => tasks(format),
        ListCommand::People => people(format),
        ListCommand::Partners => partners(format),
        ListCommand::Rules => rules(format),
        ListCommand::Runs { folder } => runs(folder, format),
    }?;
    Ok(ExitStatus::Success)
}

/// Maximum width of the table of helpers, columns; longer cells take several lines.
const MAX_WIDTH: u16 = 100;

/// Describes a built-in helper.
fn description(name: &str) -> &'static str {
    match name {
        NONE => "no helper; the partner works alone",
        "llm" => "language model on text",
        "llm_known_task" => "the same; task and constraint known",
        "vlm" => "language model on text and images",
        "vlm_known_task" => "the same; task and constraint known",
        name => match (HelperInfo::find_helper(name), BundledHelper::find(name)) {
            (Some(info), _) => info.about,
            (None, Some(bundled)) => bundled.about,
            (None, None) => "",
        },
    }
}

/// Returns the names of the grants of a helper under the paper's rules.
fn grants(name: &str) -> Vec<&'static str> {
    let grants = match HelperInfo::find_helper(name) {
        Some(info) => (info.grants)(RuleSet::PAPER.planner),
        None if name == NONE => Grants::NONE,
        None if name.ends_with("_known_task") => {
            Grants { behavior: true, task: true, ..Grants::PLANNER }
        }
        None => BundledHelper::find(name).map_or(Grants::PLANNER, BundledHelper::grants),
    };
    let given = grants.named().into_iter().filter(|(_, is_given)| *is_given);
    given.map(|(name, _)| name).collect()
}

fn helpers(format: OutputFormat) -> Result<()> {
    let names = [NONE.to_owned()].into_iter().chain(all_helper_names());
    let mut rows = Vec::new();
    let mut table = table(["Name", "Granted", "Description"]);
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(MAX_WIDTH);
    for name in names {
        let (title, grants, description) = (title(&name), grants(&name), description(&name));
        table.add_row([name.as_str(), &grants.join(", "), description]);
        rows.push(json!({
            "name": name, "title": title, "grants": grants, "description": description,
        }));
    }
    let more = "Also: [NAME=]exec:COMMAND (a helper process), [NAME=]policy:FILE (a trained policy); \
                docs/helpers.md\n";
    print_result(format, &rows, &format!("{}\n{more}", table.trim_fmt()))
}

fn tasks(format: OutputFormat) -> Result<()> {
    let mut rows = Vec::new();
    let mut table = table(["Name", "Scene", "Partner", "Frames", "Origin"]);
    for task in &TASKS {
        let origin = if task.origin == TaskOrigin::Chaic { "chaic" } else { "paper" };
        let scene = format!("{:?}", task.scene).to_lowercase();
        let partner = task.partner.to_string();
        table.add_row([task.name, &scene, &partner, &task.horizon.to_string(), origin]);
        rows.push(json!({
            "name": task.name, "title": task.title, "scene": scene, "partner": partner,
            "frames": task.horizon, "origin": origin,
        }));
    }
    let more = "`--task all` means those of the paper; docs/benchmark.md describes them.\n";
    print_result(format, &rows, &format!("{}\n{more}", table.trim_fmt()))
}

fn people(format: OutputFormat) -> Result<()> {
    let (mut people, mut impairments) = (Vec::new(), Vec::new());
    let mut kinds = table(["Person", "Reach, m", "Strength, kg", "Speed, m/frame", "Height, m"]);
    for persona in Persona::ALL {
        let body = persona.capability();
        let [low, high] = body.pick_range_m;
        kinds.add_row([
            persona.name().to_owned(),
            format!("{low} to {high}"),
            body.strength_kg.to_string(),
            body.speed_m_per_frame.to_string(),
            body.height_m.to_string(),
        ]);
        people.push(json!({ "name": persona.name(), "capability": body }));
    }
    let mut with = table(["Impairment", "The person ..."]);
    for impairment in &IMPAIRMENTS {
        with.add_row([impairment.name, impairment.about]);
        impairments.push(json!({ "name": impairment.name, "description": impairment.about }));
    }
    let more = "`--person PERSON+IMPAIRMENT` combines them; docs/people.md.\n";
    let text = format!("{}\n{}\n{more}", kinds.trim_fmt(), with.trim_fmt());
    print_result(format, &json!({ "people": people, "impairments": impairments }), &text)
}

fn partners(format: OutputFormat) -> Result<()> {
    let mut rows = Vec::new();
    let mut minds = table(["Name", "The partner ..."]);
    for name in [RULES.to_owned()].into_iter().chain(all_partner_names()) {
        let bundled = BundledPartner::find(&name).map_or("", |partner| partner.about);
        let description = match name.as_str() {
            RULES => "follows the rules of the paper",
            "llm" => "asks a language model, with text",
            "vlm" => "asks a language model, with text and images",
            name => PartnerVariant::find(name).map_or(bundled, |variant| variant.about),
        };
        minds.add_row([name.as_str(), description]);
        let habits = partner_habits(&name).ok().map(|habits| habits.to_string());
        rows.push(json!({ "name": name, "description": description, "habits": habits }));
    }
    let mut suite = table(["Partner of the suite", "--partner", "--person"]);
    for SuitePartner { name, partner, person } in PartnerSuite::bundled().partners() {
        let person = person.map(|change| change.to_string()).unwrap_or_default();
        suite.add_row([name.as_str(), partner.as_deref().unwrap_or(RULES), &person]);
    }
    let more = "`--partner NAME` selects one; also drawn:SEED, habits:..., recorded:PATH (a trace or a folder)\n\
                and policy:FILE (weights of `chaic train partner`). `--person` selects the body.\n\
                `--partners suite` plays all of the second table. docs/people.md.\n";
    let text = format!("{}\n{}\n{more}", minds.trim_fmt(), suite.trim_fmt());
    print_result(format, &rows, &text)
}

fn rules(format: OutputFormat) -> Result<()> {
    let differing = differing_rules();
    let mut rows = Vec::new();
    let mut table = table(["Rule", "paper", "compat"]);
    for name in rule_names() {
        let (paper, compat) = rule_values(&name)?;
        table.add_row([&name, &paper, &compat]);
        let differs = differing.contains(&name);
        rows.push(json!({ "name": name, "paper": paper, "compat": compat, "differs": differs }));
    }
    let more = "`--set RULE=VALUE` changes one rule; docs/rules.md describes them.\n";
    print_result(format, &rows, &format!("{}\n{more}", table.trim_fmt()))
}

fn runs(folder: &Path, format: OutputFormat) -> Result<()> {
    // The default folder is missing before the first run.
    let is_unused = folder == Path::new("runs") && !folder.exists();
    let found = if is_unused { Vec::new() } else { entries(folder)? };
    let mut paths: Vec<PathBuf> = Vec::new();
    for path in found {
        // A folder with several partners holds a run per partner.
        let inside = if SuiteFolder::is_suite(&path) { entries(&path)? } else { vec![path] };
        paths.extend(inside.into_iter().filter(|path| RunFolder::is_run(path)));
    }
    paths.sort();
    let mut rows: Vec<Value> = Vec::new();
    let mut table = table(["Run", "Finished", "Split", "Tasks", "Helpers"]);
    for path in paths {
        let shown = path.display().to_string();
        let row = run_row(&path);
        let (finished, split, tasks, helpers) = match &row {
            Ok(row) => (
                format!("{} of {}", row.finished, row.planned),
                row.split.clone(),
                row.tasks.len().to_string(),
                row.helpers.join(", "),
            ),
            Err(error) => (format!("{error:#}"), String::new(), String::new(), String::new()),
        };
        table.add_row([&shown, &finished, &split, &tasks, &helpers]);
        rows.push(match row {
            Ok(row) => json!({
                "run": shown, "finished": row.finished, "planned": row.planned,
                "split": row.split, "tasks": row.tasks, "helpers": row.helpers,
            }),
            Err(error) => json!({ "run": shown, "problem": format!("{error:#}") }),
        });
    }
    let text = if rows.is_empty() {
        format!("no runs in {}; `chaic eval` writes one\n", folder.display())
    } else {
        table.trim_fmt() + "\n"
    };
    print_result(format, &rows, &text)
}

/// Progress and options of a run.
struct RunRow {
    finished: usize,
    /// Number of planned episode runs; 0 if the episode files of the run no longer exist.
    planned: usize,
    split: String,
    tasks: Vec<&'static str>,
    helpers: Vec<String>,
}

fn run_row(path: &Path) -> Result<RunRow> {
    let (folder, options) = RunFolder::read(path)?;
    let planned = planned(&folder, &options).unwrap_or_default();
    let has_results = folder.results().exists();
    let finished = if has_results { read_results(&folder.results(), &planned)?.0.len() } else { 0 };
    Ok(RunRow {
        finished,
        planned: planned.len(),
        split: options.split,
        tasks: options.tasks.iter().map(|task| task.name()).collect(),
        helpers: options.helpers,
    })
}
