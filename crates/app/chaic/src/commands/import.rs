//! `chaic import`.

use anyhow::{Context as _, Result};
use chaic_files::write_whole;
use chaic_import::{Half, OnError, Sources, import};

use crate::arguments::{ImportCommand, ImportHalf, OriginalArguments};
use crate::exit::Ended;
use crate::output::{complain, counted, say};

/// Imports episodes from elsewhere.
pub fn run(command: &ImportCommand) -> Result<Ended> {
    match command {
        ImportCommand::Original(arguments) => original(arguments),
    }
}

/// Nothing is written before everything has been read.
fn original(arguments: &OriginalArguments) -> Result<Ended> {
    let OriginalArguments { dataset, tdw, out, split, keep_going } = arguments;
    let half = split.map(|half| match half {
        ImportHalf::Train => Half::Train,
        ImportHalf::Test => Half::Test,
    });
    let sources = Sources { dataset: dataset.clone(), tdw: tdw.clone(), half };
    let on_error = if *keep_going { OnError::KeepGoing } else { OnError::Stop };
    let imported = import(&sources, on_error)?;
    std::fs::create_dir_all(out)
        .with_context(|| format!("can't make the folder {}", out.display()))?;
    for episode in &imported.episodes {
        let path = out.join(format!("{}.json", episode.id().replace('/', "-")));
        write_whole(&path, episode.to_json().as_bytes())?;
    }
    for error in &imported.left_out {
        complain(&format!("left out: {error}"));
    }
    let n = counted(imported.episodes.len(), "episode");
    say(&format!("{}: {n}, {} left out\n", out.display(), imported.left_out.len()))?;
    Ok(if imported.left_out.is_empty() { Ended::Well } else { Ended::WithFindings })
}
