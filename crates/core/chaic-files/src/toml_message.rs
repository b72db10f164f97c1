//! Messages about TOML files, from the errors of a parser.

use std::ops::Range;

/// Integer types that a parser names in its messages, with their ranges in TOML.
const INTEGERS: [(&str, i64, i64); 5] = [
    ("u8", 0, u8::MAX as i64),
    ("u16", 0, u16::MAX as i64),
    ("u32", 0, u32::MAX as i64),
    ("u64", 0, i64::MAX),
    ("usize", 0, i64::MAX),
];

/// Formats an error of a TOML parser on one line: the number of its line in the file, then the message of
/// [`toml_problem`].
pub fn toml_message(text: &str, span: Option<Range<usize>>, message: &str) -> String {
    let problem = toml_problem(text, span.clone(), message).replace('\n', " ");
    match span.and_then(|span| text.get(..span.start)) {
        Some(before) => format!("line {}: {problem}", before.matches('\n').count() + 1),
        None => problem,
    }
}

/// Returns the message of a TOML parser, with ranges in place of the names of integer types. `span` is the
/// byte range of the error in `text`.
pub fn toml_problem(text: &str, span: Option<Range<usize>>, message: &str) -> String {
    let literal = span.and_then(|span| text.get(span));
    literal.and_then(large_integer).unwrap_or_else(|| with_range(message))
}

/// Returns a message about an integer that exceeds 64 bits; `None` for other text.
pub fn large_integer(literal: &str) -> Option<String> {
    let without_separators = literal.replace('_', "");
    let (prefix, rest) = without_separators.split_at_checked(2).unwrap_or_default();
    let (digits, radix) = match prefix {
        "0x" => (rest, 16),
        "0o" => (rest, 8),
        "0b" => (rest, 2),
        _ => (without_separators.as_str(), 10),
    };
    let unsigned = digits.strip_prefix(['+', '-']).unwrap_or(digits);
    let is_integer = !unsigned.is_empty() && unsigned.chars().all(|c| c.is_digit(radix));
    (is_integer && i64::from_str_radix(digits, radix).is_err()).then(|| {
        format!("{literal} exceeds 64 bits; integers are from {} to {}", i64::MIN, i64::MAX)
    })
}

/// Replaces the name of the expected integer type at the end of a message.
fn with_range(message: &str) -> String {
    let range = |(name, lower, upper): &(&str, i64, i64)| {
        let before = message.strip_suffix(*name)?.strip_suffix("expected ")?;
        Some(format!("{before}expected an integer from {lower} to {upper}"))
    };
    INTEGERS.iter().find_map(range).unwrap_or_else(|| message.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_line_and_range() {
        let text = "a = 1\nb = 4294967296\n";
        let span = Some(10..20);
        let message = "invalid value: integer `4294967296`, expected u32";
        let expected = "line 2: invalid value: integer `4294967296`, expected an integer from 0 to \
                        4294967295";
        assert_eq!(toml_message(text, span.clone(), message), expected);
        assert_eq!(toml_message(text, span, "two\nlines"), "line 2: two lines");
        assert_eq!(toml_message(text, None, "expected a menu32"), "expected a menu32");
        let large = "b = 9223372036854775808";
        let message = toml_message(large, Some(4..large.len()), "integer overflow");
        assert!(message.starts_with("line 1: 9223372036854775808 exceeds 64 bits"), "{message}");
    }

    #[test]
    fn only_integers_beyond_64_bits_are_large() {
        let huge = "9".repeat(50);
        for literal in
            ["9223372036854775808", "-9223372036854775809", &huge, "0x1_0000000000000000"]
        {
            let expected = format!("{literal} exceeds 64 bits; integers are from -9223");
            assert!(large_integer(literal).is_some_and(|text| text.starts_with(&expected)));
        }
        for other in ["", "-", "9223372036854775807", "0xff", "1e30", "99999999999999999999.txt"] {
            assert_eq!(large_integer(other), None, "{other}");
        }
    }
}
