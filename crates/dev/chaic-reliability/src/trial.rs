//! Interrupted commands: their recovery gives the result of an undisturbed command.

use std::path::Path;

use anyhow::{Context as _, Result};

use crate::commands::{FileOperation, operations, run, run_ok};
use crate::folder::{Contents, copy, differences};
use crate::scenario::{Recovery, Scenario, words};

/// A scenario with its inputs and the result of an undisturbed command.
pub struct Trial<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// Folder with the inputs.
    pub inputs: &'a Path,
    /// File operations of the command, sorted.
    pub operations: Vec<FileOperation>,
    /// Files of the result, as [`Scenario::result`] returns them.
    pub expected: Contents,
    /// Output of each reader of the complete result.
    read: Vec<String>,
}

impl<'a> Trial<'a> {
    /// Runs the command without faults twice below `folder`; both must have the same operations and
    /// files.
    ///
    /// # Errors
    /// If they differ, the command fails, or the scenario compares no file.
    pub fn new(scenario: &'a Scenario, inputs: &'a Path, folder: &Path) -> Result<Trial<'a>> {
        let log = folder.join("operations");
        let mut trials = Vec::new();
        for name in ["first", "second"] {
            let at = folder.join(name);
            copy(inputs, &at)?;
            let operations = operations(&at, &words(scenario.command), &log)?;
            let readers = scenario.readers.iter();
            let read: Result<Vec<String>> = readers
                .map(|reader| run_ok(&at, &words(reader.command)).map(|ended| ended.stdout))
                .collect();
            let expected = scenario.result(&at)?;
            anyhow::ensure!(!expected.is_empty(), "scenario {} compares no file", scenario.name);
            trials.push(Trial { scenario, inputs, operations, expected, read: read? });
        }
        let trial = trials.swap_remove(0);
        let changed = differences(&trial.expected, &trials[0].expected);
        anyhow::ensure!(
            trial.operations == trials[0].operations && changed.is_empty(),
            "scenario {} is not repeatable: {} and {} operations, different files: {changed:?}",
            scenario.name,
            trial.operations.len(),
            trials[0].operations.len(),
        );
        Ok(trial)
    }

    /// Checks that readers accept no half-written result in the folder `at`.
    ///
    /// # Errors
    /// If a reader panics, fails without one line of explanation, or accepts a wrong result.
    pub fn check_readers(&self, at: &Path) -> Result<()> {
        for (reader, expected) in self.scenario.readers.iter().zip(&self.read) {
            let read = run(at, &words(reader.command), None)?;
            if let Some(problem) = read.problem() {
                anyhow::bail!("`{}`: {problem}", reader.command);
            }
            let is_accepted = reader.is_exact && read.code == Some(0);
            anyhow::ensure!(
                !is_accepted || read.stdout == *expected,
                "`{}` accepts an interrupted result",
                reader.command
            );
        }
        Ok(())
    }

    /// Returns the command that completes an interrupted one in the folder `at`; removes its outputs
    /// if it starts over.
    ///
    /// # Errors
    /// If an output cannot be removed.
    pub fn recovery_command(&self, at: &Path) -> Result<&'static str> {
        match self.scenario.recovery {
            Recovery::Resume { marker, command } if at.join(marker).exists() => return Ok(command),
            Recovery::StartOver => {
                let outputs = self.scenario.outputs.iter().map(|name| at.join(name));
                outputs.filter(|path| path.exists()).try_for_each(std::fs::remove_dir_all)?;
            }
            Recovery::Resume { .. } | Recovery::Repeat => {}
        }
        Ok(self.scenario.command)
    }

    /// Completes an interrupted command in the folder `at`, and compares the result.
    ///
    /// # Errors
    /// If a command fails, or files or outputs differ from those of an undisturbed command.
    pub fn complete(&self, at: &Path) -> Result<()> {
        let command = self.recovery_command(at)?;
        run_ok(at, &words(command)).context("the recovery")?;
        let changed = differences(&self.scenario.result(at)?, &self.expected);
        anyhow::ensure!(changed.is_empty(), "different files after `{command}`: {changed:?}");
        for (reader, expected) in self.scenario.readers.iter().zip(&self.read) {
            let read = run_ok(at, &words(reader.command)).context("after the recovery")?;
            let is_equal = !reader.is_exact || read.stdout == *expected;
            anyhow::ensure!(is_equal, "`{}` differs after the recovery", reader.command);
        }
        Ok(())
    }
}
