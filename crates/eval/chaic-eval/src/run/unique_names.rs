//! Rejects JSON objects with repeated field names: JSON parsers disagree about which value counts.

use std::collections::BTreeSet;
use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error as _, MapAccess, SeqAccess, Visitor};

/// Checks that no object in a JSON text has two fields of the same name. Accepts text that is not
/// JSON; the parser of the values reports it.
///
/// # Errors
/// A message with the name of the repeated field.
pub(super) fn check(json: &[u8]) -> Result<(), String> {
    let mut from = serde_json::Deserializer::from_slice(json);
    match Unique.deserialize(&mut from) {
        Err(e) if e.is_data() => Err(message(&e)),
        _ => Ok(()),
    }
}

fn message(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.split(" at line ").next().unwrap_or_default().to_owned()
}

/// Visitor of any JSON value.
struct Unique;

impl<'de> DeserializeSeed<'de> for Unique {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<(), D::Error> {
        from.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Unique {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let mut names = BTreeSet::new();
        while let Some(name) = map.next_key::<String>()? {
            map.next_value_seed(Unique)?;
            if let Some(name) = names.replace(name) {
                return Err(A::Error::custom(format!("the field `{name}` occurs twice")));
            }
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        while seq.next_element_seed(Unique)?.is_some() {}
        Ok(())
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_u64<E>(self, _: u64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_fields_are_found_at_any_depth() {
        for twice in
            [r#"{"a":1,"a":2}"#, r#"{"b":[{"a":1,"c":2,"a":null}]}"#, r#"{"a":1,"\u0061":2}"#]
        {
            assert_eq!(check(twice.as_bytes()), Err("the field `a` occurs twice".to_owned()));
        }
        for once in [r#"{"a":{"a":true},"b":[1,-1,1.5,"a"]}"#, "{", "no JSON", "", "\u{0}"] {
            assert_eq!(check(once.as_bytes()), Ok(()), "{once}");
        }
    }
}
