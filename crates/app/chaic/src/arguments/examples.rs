//! Examples in the long help of each command, in a file for each group of commands. A test parses all of them.

mod check;
mod contest;
mod learn;
mod look;
mod play;
mod study;

/// A purpose, and the command line.
type Example = (&'static str, &'static str);
/// A command with its examples.
pub(super) type CommandExamples = (&'static str, [Example; 3]);

/// Examples of `chaic` itself.
const ROOT: &[CommandExamples] = &[(
    "chaic",
    [
        ("Play a small benchmark, about a minute", "chaic eval"),
        ("Print its scores", "chaic report runs/quick"),
        ("Check this machine", "chaic doctor"),
    ],
)];

/// Returns all commands with their examples.
pub(super) fn examples() -> impl Iterator<Item = &'static CommandExamples> {
    [
        ROOT,
        play::EXAMPLES,
        study::EXAMPLES,
        look::EXAMPLES,
        learn::EXAMPLES,
        check::EXAMPLES,
        contest::EXAMPLES,
    ]
    .into_iter()
    .flatten()
}
