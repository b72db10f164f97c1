//! `chaic episodes seal` and `chaic episodes open`.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result};
use chaic_arena::{Commitment, SealedSplit, Secret};
use chaic_core::TaskId;
use chaic_eval::EvalError;
use chaic_files::{read_user_file, write_atomically};
use serde_json::json;

use super::bars;
use crate::exit::ExitStatus;
use crate::interrupt;
use crate::output::{OutputFormat, counted, json_path, print_error, print_result};

/// File of the commitment in the folder of a sealed split.
const COMMITMENT: &str = "commitment.json";
/// Folder of the episodes in the folder of a sealed split.
const EPISODES: &str = "episodes";
/// Maximum size of a commitment, bytes: one takes about 500.
const MAX_COMMITMENT_BYTES: u64 = 64 << 10;

/// File of the partners in the folder of a sealed split.
const PARTNERS: &str = "partners.json";

/// Size of a sealed split.
pub(super) struct SplitSize {
    /// Episodes of each task.
    pub n_episodes: usize,
    /// Drawn partners.
    pub n_partners: usize,
}

/// Creates a sealed split. An existing secret is reused, so that an interrupted command can be
/// repeated.
pub(super) fn seal(
    secret_path: &Path,
    tasks: &[TaskId],
    size: SplitSize,
    out: &Path,
    format: OutputFormat,
) -> Result<ExitStatus> {
    let partners_path = out.join(PARTNERS);
    if size.n_partners == 0 && partners_path.exists() {
        let text = format!(
            "{} belongs to another split; remove it, or choose another --out",
            partners_path.display()
        );
        return Err(EvalError::Options(text).into());
    }
    let secret = if secret_path.exists() {
        Secret::read(secret_path)?
    } else {
        Secret::create(secret_path)?
    };
    let split = SealedSplit::new(secret, tasks, size.n_episodes).with_partners(size.n_partners);
    let episodes = out.join(EPISODES);
    let Some(commitment) = generate(&split, Some(&episodes), interrupt::stop_flag()?)? else {
        return Ok(ExitStatus::Interrupted);
    };
    let partners = split.partners().map(|suite| (partners_path, suite));
    if let Some((path, suite)) = &partners {
        write_atomically(path, suite.to_json().as_bytes())?;
    }
    let path = out.join(COMMITMENT);
    write_atomically(&path, commitment.to_json().as_bytes())?;
    let json = json!({
        "split": split.name(), "episodes": split.n_total(), "secret": json_path(secret_path),
        "commitment": json_path(&path), "folder": json_path(&episodes),
        "partners": partners.as_ref().map(|(path, _)| json_path(path)),
    });
    let partners = partners.map_or_else(String::new, |(path, suite)| {
        format!("{}: {}\n", path.display(), counted(suite.partners().len(), "partner"))
    });
    let text = format!(
        "{}: {} of {}\n{partners}{}: publish this file\n{}: keep this file to yourself until you open the \
         split\n",
        episodes.display(),
        counted(split.n_total(), "episode"),
        split.name(),
        path.display(),
        secret_path.display()
    );
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}

/// Opens a sealed split.
pub(super) fn open(
    secret_path: &Path,
    commitment_path: &Path,
    out: &Path,
    partners: Option<&Path>,
    format: OutputFormat,
) -> Result<ExitStatus> {
    let name = commitment_path.display().to_string();
    let commitment = read_commitment(commitment_path)?;
    let split = commitment.split(Secret::read(secret_path)?).with_context(|| name.clone())?;
    let suite = split.partners();
    if partners.is_some() && suite.is_none() {
        let text = format!("{name}: the split has no partners; omit --partners");
        return Err(EvalError::Options(text).into());
    }
    if out.is_dir() {
        split.check_folder(out)?;
    }
    // The check comes before writing, so that only the committed episodes remain on the disk.
    let stop = interrupt::stop_flag()?;
    let Some(opened) = generate(&split, None, stop)? else {
        return Ok(ExitStatus::Interrupted);
    };
    commitment.check_content(&opened).context(name)?;
    if generate(&split, Some(out), stop)?.is_none() {
        return Ok(ExitStatus::Interrupted);
    }
    if let Some((path, suite)) = partners.zip(suite) {
        write_atomically(path, suite.to_json().as_bytes())?;
    }
    let json = json!({
        "split": split.name(), "episodes": split.n_total(), "folder": json_path(out),
    });
    let text = format!(
        "{}: {} of {}, the committed ones\n",
        out.display(),
        counted(split.n_total(), "episode"),
        split.name()
    );
    print_result(format, &json, &text)?;
    Ok(ExitStatus::Success)
}

/// Reads a published commitment.
///
/// # Errors
/// If the file cannot be read, or holds no commitment.
pub(super) fn read_commitment(path: &Path) -> Result<Commitment> {
    let bytes = read_user_file(path, MAX_COMMITMENT_BYTES)?;
    Commitment::parse(&bytes).with_context(|| path.display().to_string())
}

/// Generates the episodes of a split, and writes them to a folder if one is given. Returns `None` if the
/// user stopped it.
fn generate(
    split: &SealedSplit,
    folder: Option<&Path>,
    stop: &AtomicBool,
) -> Result<Option<Commitment>> {
    let bar = bars::count_bar(split.n_total() as u64, "episodes");
    let mut progress = || bar.inc(1);
    let commitment = match folder {
        Some(folder) => split.write(folder, stop, &mut progress)?,
        None => split.commitment(stop, &mut progress)?,
    };
    bar.finish_and_clear();
    if commitment.is_none() {
        print_error("stopped; the same command starts again");
    }
    Ok(commitment)
}
