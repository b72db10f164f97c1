//! Self-contained pages: the report of a run and its replays in one HTML file.
//!
//! **What it is**: [`page`] puts a [`RunSummary`], traces, episodes and the built bundle of `web/` into
//! one file, which works offline and verifies what it shows. [`write_report`] writes the page of a run,
//! [`play_page`] returns one in which a person plays, [`study_page`] that of a study.
//!
//! **What it is not**: it plays nothing, draws nothing and knows no rules.

mod overview;
mod replays;
mod summary;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use chaic_env::RunKey;
use chaic_episodes::Episode;
use chaic_eval::report::Report;
use chaic_eval::run::RunFolder;
use minijinja::value::{Serde, Value};
use minijinja::{Environment, context};
use miniz_oxide::deflate::compress_to_vec;
use serde_json::json;

pub use overview::{EpisodePoint, OverviewRow};
pub use replays::{PageReplay, ReadLanguage, no_language, read_replays};
pub use summary::{ActivityRow, ExampleRow, HelperGain, RunSummary, ScoreRow, StripPosition};

/// Name of the page that a run writes into its folder.
pub const REPORT_FILE: &str = "report.html";

/// Compression level: the best one.
const LEVEL: u8 = 9;

/// Raw deflate, as the build of `web/` writes it.
const MODULE: &[u8] = include_bytes!("../bundle/chaic_web.wasm.deflate");
const WORKER: &str = include_str!("../bundle/worker.js");
const SCRIPT: &str = include_str!("../bundle/page.js");
const STUDY_SCRIPT: &str = include_str!("../bundle/study.js");
/// Style of all pages (CSS), for light and dark displays.
pub const STYLE: &str = include_str!("page.css");
/// Name and text of the template. The ending of the name selects escaping for HTML.
const TEMPLATE: (&str, &str) = ("page.html", include_str!("page.html"));

/// Writes the report of a run as a page into its folder: its scores, and replays of the examples. A
/// damaged trace is shown up to its last complete record.
///
/// # Errors
/// If a trace or an episode cannot be read, or the file cannot be written.
pub fn write_report(
    folder: &RunFolder,
    report: &Report<'_>,
    language: ReadLanguage<'_>,
) -> chaic_eval::Result<()> {
    let mut summary = RunSummary::new(folder, report)?;
    let traces = summary.example_traces(folder);
    let (replays, _) = read_replays(folder, report.options, &traces, language)?;
    summary.link(&replays);
    let title = format!("chaic: report of {}", folder.path().display());
    folder.write(REPORT_FILE, page(&title, Some(&summary), &replays).as_bytes())
}

/// Returns an HTML page with the report, if any, and the replays. The first replay is shown when the
/// page opens.
pub fn page(title: &str, report: Option<&RunSummary>, replays: &[PageReplay]) -> String {
    let option =
        |replay: &PageReplay| context! { name => replay.name.clone(), place => replay.place() };
    let options: Vec<Value> = replays.iter().map(option).collect();
    let contents: Vec<String> = replays.iter().map(PageReplay::content).collect();
    let report = report.cloned().map(Serde);
    render(context! { title, report, replays => options, contents })
}

/// Returns an HTML page in which a person plays one of these episodes, beside one of these helpers as the
/// partner.
pub fn play_page(title: &str, episodes: &[Episode], helpers: &[&str]) -> String {
    let games: Vec<String> = episodes.iter().map(game_title).collect();
    let contents: Vec<String> =
        episodes.iter().map(|episode| encoded(episode.to_json_line().as_bytes())).collect();
    let helpers: Vec<String> = helpers.iter().map(|name| (*name).to_owned()).collect();
    render(context! { title, games, helpers, game_contents => contents })
}

/// Returns the HTML page of a study with this content (`chaic_study::page_content`).
pub fn study_page(title: &str, content: &serde_json::Value) -> String {
    let study = encoded(content.to_string().as_bytes());
    render_with(STUDY_SCRIPT, context! { title, study })
}

/// Returns the HTML page of a study with this content that runs no simulator: it gets all pictures from a server.
pub fn study_page_without_simulator(title: &str, content: &serde_json::Value) -> String {
    let study = encoded(content.to_string().as_bytes());
    let script = inline(STUDY_SCRIPT);
    render_values(context! { title, study, script, style => STYLE })
}

/// Returns the text of the script in the page of a study, for its content security policy.
pub fn study_script() -> String {
    inline(STUDY_SCRIPT)
}

/// Returns the name of an episode in the list of a page.
fn game_title(episode: &Episode) -> String {
    format!("{}: {}", episode.setup().task.info().title, episode.id())
}

/// Renders the template with these values, the script of replays and games, and the module.
fn render(values: Value) -> String {
    render_with(SCRIPT, values)
}

/// Renders the template with these values, a script and the module.
fn render_with(script: &str, values: Value) -> String {
    let [worker, script] = [WORKER, script].map(inline);
    let fixed = context! { worker, script, style => STYLE, module => STANDARD.encode(MODULE) };
    render_values(context! { ..values, ..fixed })
}

/// Renders the template with these values.
fn render_values(values: Value) -> String {
    let mut environment = Environment::new();
    let (name, source) = TEMPLATE;
    environment.add_template(name, source).expect("the template is valid");
    let template = environment.get_template(name).expect("it was added above");
    template.render(values).expect("the template uses given values only")
}

/// Returns a script without a closing tag, which would end its element.
fn inline(script: &str) -> String {
    script.replace("</script", "<\\/script")
}

/// Compresses bytes (raw deflate) and encodes them as base64.
fn encoded(bytes: &[u8]) -> String {
    STANDARD.encode(compress_to_vec(bytes, LEVEL))
}

impl PageReplay {
    /// Returns a text that replays of one episode and seed share.
    fn place(&self) -> String {
        let RunKey { task, episode, seed, .. } = &self.key;
        format!("{task} {episode} {seed}")
    }

    /// Returns trace, episode, prompts and answers as one encoded text.
    fn content(&self) -> String {
        let PageReplay { trace, episode, language, .. } = self;
        let content = json!({ "trace": trace, "episode": episode, "language": language });
        encoded(content.to_string().as_bytes())
    }
}

/// Returns a link (data URL) to a text file that is part of a page.
pub fn data_link(media_type: &str, text: &str) -> String {
    format!("data:{media_type};base64,{}", STANDARD.encode(text))
}

#[cfg(test)]
mod tests;
