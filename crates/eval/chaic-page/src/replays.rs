//! Replays of a page, read from the folder of a run.

use std::path::PathBuf;

use chaic_env::RunKey;
use chaic_eval::Result;
use chaic_eval::run::{RunFolder, RunOptions, misplaced_trace};
use serde_json::Value;

/// Replay in a page.
#[derive(Clone, Debug)]
pub struct PageReplay {
    /// Episode run.
    pub key: RunKey,
    /// Name in the list of replays.
    pub name: String,
    /// Trace file (JSON lines).
    pub trace: String,
    /// Episode file (JSON).
    pub episode: String,
    /// Prompts and answers of agents with a language model: a list of `LanguageAgent` (`web/src/messages.ts`).
    pub language: Value,
}

/// Reads the [language](PageReplay::language) of an episode run.
pub type ReadLanguage<'a> = &'a dyn Fn(&RunKey) -> Value;

/// Returns an empty [language](PageReplay::language), for programs without language models.
pub fn no_language(_: &RunKey) -> Value {
    Value::Array(Vec::new())
}

/// Reads the replays of these traces. A damaged trace is read up to its last complete record, and one with the
/// name of another episode run is left out; warnings describe both.
///
/// # Errors
/// If a trace or its episode cannot be read.
pub fn read_replays(
    folder: &RunFolder,
    options: &RunOptions,
    traces: &[PathBuf],
    language: ReadLanguage<'_>,
) -> Result<(Vec<PageReplay>, Vec<String>)> {
    let mut all_warnings = Vec::new();
    let mut read = |path: &PathBuf| -> Result<Option<PageReplay>> {
        let (trace, warnings) = folder.read_trace(path)?;
        all_warnings.extend(warnings.iter().map(ToString::to_string));
        let key = trace.header.key();
        if let Some(warning) = misplaced_trace(folder, path, &key) {
            all_warnings.push(warning);
            return Ok(None);
        }
        let name = format!("{}, {}, seed {}", key.episode, key.helper, key.seed);
        let lines: Vec<String> = trace.lines().collect();
        let episode = folder.episode(options, &key)?.to_json_line();
        let language = language(&key);
        let trace = lines.join("\n") + "\n";
        Ok(Some(PageReplay { key, name, trace, episode, language }))
    };
    let replays: Result<Vec<PageReplay>> =
        traces.iter().filter_map(|path| read(path).transpose()).collect();
    Ok((replays?, all_warnings))
}
