//! Self-contained pages: replays with the module and the scripts that show them in one HTML file.
//!
//! **What it is**: [`replay_page`] embeds traces, episodes and the built bundle of `web/`. The page
//! works from a file, offline, and verifies what it shows.
//!
//! **What it is not**: it reads no run folders, draws nothing and knows no rules.

use std::fmt::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use miniz_oxide::deflate::compress_to_vec;
use serde_json::json;

/// Compression level: the best one.
const LEVEL: u8 = 9;

const MODULE: &[u8] = include_bytes!("../bundle/chaic_web.wasm");
const WORKER: &str = include_str!("../bundle/worker.js");
const PAGE: &str = include_str!("../bundle/page.js");
const STYLE: &str = include_str!("page.css");

/// Replay in a page.
#[derive(Clone, Copy, Debug)]
pub struct PageReplay<'a> {
    /// Name in the list of replays.
    pub name: &'a str,
    /// Trace file (JSON lines).
    pub trace: &'a str,
    /// Episode file (JSON).
    pub episode: &'a str,
}

/// Returns an HTML page that shows the first of these replays and offers the others.
pub fn replay_page(title: &str, replays: &[PageReplay<'_>]) -> String {
    let title = escape(title);
    let mut options = String::new();
    let mut scripts = String::new();
    for (k, replay) in replays.iter().enumerate() {
        let _ = writeln!(options, "<option value=\"{k}\">{}</option>", escape(replay.name));
        let content = json!({ "trace": replay.trace, "episode": replay.episode }).to_string();
        let content = encoded(content.as_bytes());
        let _ = writeln!(
            scripts,
            "<script type=\"text/plain\" class=\"chaic-replay\">{content}</script>"
        );
    }
    let module = encoded(MODULE);
    // A closing tag in a script would end it.
    let [worker, page] = [WORKER, PAGE].map(|script| script.replace("</script", "<\\/script"));
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n\
         <p><label>Replay <select>\n{options}</select></label></p>\n\
         <p data-status role=\"status\"></p>\n<chaic-replay></chaic-replay>\n\
         <noscript><p>This page needs JavaScript and WebAssembly.</p></noscript>\n</main>\n\
         <script type=\"text/plain\" id=\"chaic-module\">{module}</script>\n\
         <script type=\"text/plain\" id=\"chaic-worker\">{worker}</script>\n{scripts}\
         <script>{page}</script>\n</body>\n</html>\n"
    )
}

/// Compresses bytes (raw deflate) and encodes them as base64.
fn encoded(bytes: &[u8]) -> String {
    STANDARD.encode(compress_to_vec(bytes, LEVEL))
}

/// Escapes text for HTML.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_contents_cannot_add_markup() {
        let evil = "</script><b onload=\"x\">&";
        let replay = PageReplay { name: evil, trace: evil, episode: evil };
        let page = replay_page(evil, &[replay, replay]);
        assert!(!page.contains("<b onload"), "the text is escaped or encoded");
        let n_scripts = page.matches("<script").count();
        assert_eq!((n_scripts, page.matches("</script>").count()), (5, 5));
        assert!(page.contains("<option value=\"1\">&lt;/script&gt;"));
    }

    #[test]
    fn a_page_loads_nothing_from_elsewhere() {
        let page = replay_page("title", &[]);
        for forbidden in ["src=", "<link", "@import", "fetch(\"http"] {
            assert!(!page.contains(forbidden), "{forbidden}");
        }
    }
}
