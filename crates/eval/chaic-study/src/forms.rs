//! Questionnaires: standard forms, which the crate contains as data, and their scores.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Names of the standard forms with their content (TOML).
const STANDARD: [(&str, &str); 4] = [
    ("nasa_tlx", include_str!("../forms/nasa_tlx.toml")),
    ("sus", include_str!("../forms/sus.toml")),
    ("trust", include_str!("../forms/trust.toml")),
    ("fluency", include_str!("../forms/fluency.toml")),
];

/// Lowest and highest label of a scale of agreement.
const AGREEMENT: [&str; 2] = ["strongly disagree", "strongly agree"];

/// A questionnaire. Each item is rated on the scale `first`, `first + step`, ..., `last`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Questionnaire {
    /// Heading.
    pub title: String,
    /// Sentence before the items. `{other}` stands for the other agent of the team.
    pub instruction: String,
    /// Publication of the form, and changes of its words.
    pub source: String,
    /// Lowest rating.
    pub first: i32,
    /// Highest rating.
    pub last: i32,
    /// Distance between ratings.
    pub step: i32,
    /// Formula of the score.
    pub scoring: Scoring,
    /// Items in the order of the page.
    pub items: Vec<QuestionnaireItem>,
}

/// An item of a questionnaire.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QuestionnaireItem {
    /// Name in the data.
    pub id: String,
    /// Text. `{other}` stands for the other agent of the team.
    pub text: String,
    /// Label of the lowest rating.
    #[serde(default = "lowest")]
    pub low: String,
    /// Label of the highest rating.
    #[serde(default = "highest")]
    pub high: String,
    /// True if a high rating counts as low.
    #[serde(default)]
    pub is_reversed: bool,
}

fn lowest() -> String {
    AGREEMENT[0].to_owned()
}

fn highest() -> String {
    AGREEMENT[1].to_owned()
}

/// Formula of a form's score.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scoring {
    /// Mean of the ratings; those of reversed items are inverted.
    Mean,
    /// Sum of the distances from the worst rating, times 2.5: 0 to 100.
    Sus,
}

impl Questionnaire {
    /// Returns the standard form with a name.
    pub fn standard(name: &str) -> Option<Questionnaire> {
        let (_, text) = STANDARD.iter().find(|(known, _)| *known == name)?;
        Some(toml::from_str(text).expect("a test parses all standard forms"))
    }

    /// Returns the names of the standard forms.
    pub fn standard_names() -> [&'static str; 4] {
        STANDARD.map(|(name, _)| name)
    }

    /// Returns whether the scale has this rating.
    pub fn has_rating(&self, rating: i32) -> bool {
        (self.first..=self.last).contains(&rating) && (rating - self.first) % self.step == 0
    }

    /// Returns the score; `None` if an item has no rating.
    pub fn score(&self, ratings: &BTreeMap<String, Option<i32>>) -> Option<f64> {
        let oriented = self.items.iter().map(|item| {
            let rating = ratings.get(&item.id).copied().flatten()?;
            Some(if item.is_reversed { self.first + self.last - rating } else { rating })
        });
        let oriented: Vec<i32> = oriented.collect::<Option<_>>()?;
        let sum = f64::from(oriented.iter().sum::<i32>());
        let n = oriented.len() as f64;
        Some(match self.scoring {
            Scoring::Mean => sum / n,
            Scoring::Sus => (sum - n * f64::from(self.first)) * 2.5,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rates all items of a form by a function of item number and reversal.
    fn ratings(
        form: &Questionnaire,
        rate: impl Fn(usize, bool) -> i32,
    ) -> BTreeMap<String, Option<i32>> {
        let items = form.items.iter().enumerate();
        items.map(|(k, item)| (item.id.clone(), Some(rate(k, item.is_reversed)))).collect()
    }

    #[test]
    fn standard_forms_are_complete() {
        for (name, n_items, n_ratings) in
            [("nasa_tlx", 6, 21), ("sus", 10, 5), ("trust", 3, 7), ("fluency", 3, 7)]
        {
            let form = Questionnaire::standard(name).expect("a standard form");
            let ids: std::collections::BTreeSet<&String> =
                form.items.iter().map(|item| &item.id).collect();
            assert_eq!((form.items.len(), ids.len()), (n_items, n_items), "{name}");
            let found = (-10..200).filter(|rating| form.has_rating(*rating)).count();
            assert_eq!(found, n_ratings, "{name}");
        }
        assert_eq!(Questionnaire::standard("tlx"), None);
    }

    /// Brooke's formula: odd items count rating - 1, even items 5 - rating; the sum times 2.5.
    #[test]
    fn scores_follow_the_published_formulas() {
        let sus = Questionnaire::standard("sus").expect("a standard form");
        let brooke = |ratings: [i32; 10]| {
            let points = ratings.iter().enumerate();
            let points = points.map(|(k, r)| if k % 2 == 0 { r - 1 } else { 5 - r });
            f64::from(points.sum::<i32>()) * 2.5
        };
        for given in [[3; 10], [5, 1, 4, 2, 5, 1, 5, 1, 4, 3], [1, 5, 2, 4, 1, 5, 1, 5, 1, 5]] {
            assert_eq!(sus.score(&ratings(&sus, |k, _| given[k])), Some(brooke(given)));
        }
        let tlx = Questionnaire::standard("nasa_tlx").expect("a standard form");
        assert_eq!(tlx.score(&ratings(&tlx, |k, _| 10 * k as i32)), Some(25.0));
        let mut partial = ratings(&tlx, |_, _| 5);
        partial.insert("effort".to_owned(), None);
        assert_eq!(tlx.score(&partial), None);
        partial.remove("effort");
        assert_eq!(tlx.score(&partial), None);
    }
}
