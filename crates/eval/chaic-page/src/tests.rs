//! Promises: contents cannot add markup, and a page loads nothing from elsewhere.

use chaic_core::TaskId;
use chaic_env::RunKey;

use super::*;

const EVIL: &str = "</script><b onload=\"x\">&";

fn replay(text: &str) -> PageReplay {
    let (task, text) = (TaskId::LowTarget, text.to_owned());
    let key = RunKey { task, helper: text.clone(), episode: text.clone(), seed: 0 };
    let language = serde_json::json!([text]);
    PageReplay { key, name: text.clone(), trace: text.clone(), episode: text, language }
}

fn summary(text: &str) -> RunSummary {
    RunSummary {
        lead: text.to_owned(),
        gains: Vec::new(),
        scores: vec![ScoreRow {
            task: "Low target",
            helper: text.to_owned(),
            rate: "0.50".to_owned(),
            interval: String::new(),
            span: StripPosition { rate: 50.0, interval: Some([25.0, 75.0]), paper: Some(64.0) },
            paper: "0.64".to_owned(),
            others: [const { String::new() }; 4],
            episodes: 2,
        }],
        has_paper: true,
        example_rule: text.to_owned(),
        examples: Vec::new(),
        overview_helper: text.to_owned(),
        overview: vec![OverviewRow {
            task: "Low target",
            dots: vec![EpisodePoint { x: 25.0, y: 90.0, text: text.to_owned(), is_example: true }],
            counts: [0, 0, 1],
        }],
        activities: Vec::new(),
        notes: vec![text.to_owned()],
        command: text.to_owned(),
        csv: data_link("text/csv", text),
        json: String::new(),
    }
}

#[test]
fn names_and_contents_cannot_add_markup() {
    let replays = [replay(EVIL), replay(EVIL)];
    let text = page(EVIL, Some(&summary(EVIL)), &replays);
    assert!(!text.contains("<b onload"), "the text is escaped or encoded");
    let n_scripts = text.matches("<script").count();
    assert_eq!((n_scripts, text.matches("</script>").count()), (5, 5));
    assert!(text.contains(">&lt;&#x2f;script&gt;"), "names are escaped");
}

#[test]
fn a_page_loads_nothing_from_elsewhere() {
    let text = page("title", Some(&summary("rhp")), &[]);
    for forbidden in ["src=", "<link", "@import", "fetch(\"http"] {
        assert!(!text.contains(forbidden), "{forbidden}");
    }
}

#[test]
fn a_row_has_the_positions_of_its_values() {
    let text = page("title", Some(&summary("rhp")), &[]);
    for part in ["cx=\"50.0\"", "M25.0 4H75.0", "M61.5 4l", "cx=\"25.0\" cy=\"90.0\""] {
        assert!(text.contains(part), "{part}");
    }
}
