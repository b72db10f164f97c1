//! Token estimate of a text, without a model's vocabulary.

/// Estimates the tokens of a text, slightly above the counts of common vocabularies (tests compare
/// two tokenizers). Words count one token per six letters, digits one per three, all other
/// characters one each.
pub fn estimate(text: &str) -> usize {
    const LETTERS: usize = 6;
    const DIGITS: usize = 3;
    #[derive(Clone, Copy, PartialEq)]
    enum Kind {
        Letters,
        Digits,
        Space,
        Other,
    }
    let (mut tokens, mut run, mut last) = (0, 0, Kind::Space);
    let close = |kind: Kind, run: usize| match kind {
        Kind::Letters => run.div_ceil(LETTERS),
        Kind::Digits => run.div_ceil(DIGITS),
        // A space belongs to the following word.
        Kind::Space => run / 2,
        Kind::Other => run,
    };
    for c in text.chars() {
        let kind = match c {
            'a'..='z' | 'A'..='Z' => Kind::Letters,
            '0'..='9' => Kind::Digits,
            ' ' => Kind::Space,
            _ => Kind::Other,
        };
        if kind != last {
            tokens += close(last, run);
            (run, last) = (0, kind);
        }
        // A non-ASCII letter may take several tokens.
        run += if c.is_ascii() { 1 } else { 2 };
    }
    tokens + close(last, run)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_digits_spaces_and_other_characters_are_counted() {
        for (text, tokens) in
            [("", 0), ("explore", 2), ("go to apple", 3), ("#31", 2), ("(3.25, -1)", 8), ("é", 2)]
        {
            assert_eq!(estimate(text), tokens, "{text}");
        }
    }
}
