//! `chaic completions` and `chaic man`.

use anyhow::{Context as _, Result};
use chaic_files::{create_folders, write_atomically};
use clap::Command;
use clap_complete::generate;
use clap_mangen::Man;
use serde_json::json;

use super::require_text;
use crate::arguments::{CompletionsArguments, ManArguments, command};
use crate::exit::ExitStatus;
use crate::output::{OutputFormat, counted, json_path, print, print_result};

/// Prints a completion script.
pub fn completions(arguments: &CompletionsArguments, format: OutputFormat) -> Result<ExitStatus> {
    require_text(format, "chaic completions")?;
    let mut script = Vec::new();
    generate(arguments.shell, &mut command(), "chaic", &mut script);
    print(&String::from_utf8(script).context("the script is not UTF-8")?)?;
    Ok(ExitStatus::Success)
}

/// Writes a manual page for each command.
pub fn man(arguments: &ManArguments, format: OutputFormat) -> Result<ExitStatus> {
    let folder = &arguments.folder;
    create_folders(folder)?;
    let mut root = command().disable_help_subcommand(true);
    root.build();
    let mut pages = Vec::new();
    collect_pages(&root, &mut pages)?;
    for (name, page) in &pages {
        write_atomically(&folder.join(name), page)?;
    }
    let paths: Vec<String> = pages.iter().map(|(name, _)| json_path(&folder.join(name))).collect();
    let text = format!(
        "{}: {}; read them with: man -l {}\n",
        folder.display(),
        counted(pages.len(), "page"),
        folder.join("chaic.1").display()
    );
    print_result(format, &json!({ "pages": paths }), &text)?;
    Ok(ExitStatus::Success)
}

/// Adds the pages of a command and of its visible subcommands: file names and contents.
fn collect_pages(command: &Command, pages: &mut Vec<(String, Vec<u8>)>) -> Result<()> {
    let man = Man::new(command.clone());
    let mut page = Vec::new();
    man.render(&mut page).context("can't render a manual page")?;
    pages.push((man.get_filename(), page));
    for inner in command.get_subcommands().filter(|inner| !inner.is_hide_set()) {
        collect_pages(inner, pages)?;
    }
    Ok(())
}
