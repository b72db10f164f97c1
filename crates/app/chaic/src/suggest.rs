//! Suggestions for misspelled names.

use chaic_env::EnvError;
use chaic_env::rules::rule_names;

use crate::exit::env_error;

/// Maximum edit distance (Damerau-Levenshtein) between a name and a suggestion: characters added, left
/// out, replaced, or swapped with a neighbor.
const MAX_ERRORS: usize = 2;

/// Returns the most similar known name. The edit distance is at most [`MAX_ERRORS`], and at most half the length
/// of the given name.
pub fn similar_name<S: AsRef<str>>(
    name: &str,
    known: impl IntoIterator<Item = S>,
) -> Option<String> {
    let max_errors = MAX_ERRORS.min(name.chars().count() / 2);
    known
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(name, candidate.as_ref()), candidate))
        .filter(|(n_errors, _)| *n_errors <= max_errors)
        .min_by_key(|(n_errors, _)| *n_errors)
        .map(|(_, candidate)| candidate.as_ref().to_owned())
}

/// Appends a suggestion to a message about an unknown name.
pub fn with_suggestion<S: AsRef<str>>(
    message: String,
    name: &str,
    known: impl IntoIterator<Item = S>,
) -> String {
    match similar_name(name, known) {
        Some(similar) => format!("{message}; did you mean `{similar}`?"),
        None => message,
    }
}

/// Returns the message of an error, with a suggestion for an unknown helper, partner or rule.
pub fn message(error: &anyhow::Error) -> String {
    let message = format!("{error:#}");
    match env_error(error) {
        Some(
            EnvError::UnknownHelper { name, known } | EnvError::UnknownPartner { name, known },
        ) => with_suggestion(message, name, known),
        Some(EnvError::UnknownRule { name, .. }) => unknown_rule(name),
        Some(EnvError::Rule { setting, .. }) => match setting.split_once('=') {
            Some((name, _)) if !rule_names().iter().any(|rule| rule == name) => {
                format!("--set {setting}: {}", unknown_rule(name))
            }
            _ => message,
        },
        _ => message,
    }
}

/// Returns the message for an unknown rule, without the list of more than a hundred rules.
fn unknown_rule(name: &str) -> String {
    let message = format!("no rule `{name}`; `chaic list rules` prints all rules");
    with_suggestion(message, name, rule_names())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn similar_names_are_suggested_and_others_are_not() {
        let known = ["none", "random", "rhp", "oracle", "follow"];
        assert_eq!(similar_name("randmo", known).as_deref(), Some("random"));
        assert_eq!(similar_name("orakel", known).as_deref(), Some("oracle"));
        assert_eq!(similar_name("rph", known).as_deref(), Some("rhp"));
        assert_eq!(similar_name("foo", known), None);
        assert_eq!(similar_name("nobody", known), None);
        assert_eq!(similar_name("", known), None);
    }
}
