//! `chaic import`.

use anyhow::Result;
use chaic_files::{create_folders, write_atomically};
use chaic_import::{OnError, SourceSplit, Sources, import};
use serde_json::json;

use crate::arguments::{ImportCommand, ImportSplit, OriginalArguments};
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, json_path, print_error, print_result};

/// Imports episodes of other projects.
pub fn run(command: &ImportCommand, format: OutputFormat) -> Result<ExitStatus> {
    match command {
        ImportCommand::Original(arguments) => original(arguments, format),
    }
}

/// Reads all episodes before it writes the first.
fn original(arguments: &OriginalArguments, format: OutputFormat) -> Result<ExitStatus> {
    let OriginalArguments { dataset, tdw, out, split, keep_going } = arguments;
    let half = split.map(|half| match half {
        ImportSplit::Train => SourceSplit::Train,
        ImportSplit::Test => SourceSplit::Test,
    });
    let sources = Sources { dataset: dataset.clone(), tdw: tdw.clone(), half };
    let on_error = if *keep_going { OnError::Skip } else { OnError::Stop };
    let imported = import(&sources, on_error)?;
    create_folders(out)?;
    for episode in &imported.episodes {
        let path = out.join(format!("{}.json", episode.id().replace('/', "-")));
        write_atomically(&path, episode.to_json().as_bytes())?;
    }
    let skipped: Vec<String> = imported.skipped.iter().map(ToString::to_string).collect();
    for error in &skipped {
        print_error(&format!("left out: {error}"));
    }
    let n = imported.episodes.len();
    let text =
        format!("{}: {}, {} left out\n", out.display(), counted(n, "episode"), skipped.len());
    let json = json!({ "out": json_path(out), "episodes": n, "left_out": skipped });
    print_result(format, &json, &text)?;
    Ok(ExitStatus::from_findings(!skipped.is_empty()))
}
