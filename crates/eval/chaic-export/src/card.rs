//! Descriptions of data sets: facts as plain data, and the card (`README.md`) made from them.
//! [`crate::croissant`] makes the metadata for programs from the same facts.

use std::fmt::Write as _;
use std::str::FromStr;

/// License of data in which programs decide, as an SPDX identifier.
pub const LICENSE: &str = "MIT";

/// Maximum number of characters of the name of a creator.
const MAX_NAME: usize = 200;

/// Creator of a data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Creator {
    /// A person of this name.
    Person(String),
    /// An organization, or a group of people, of this name.
    Organization(String),
}

impl Creator {
    /// Returns the authors of chaic, who created what its generators give.
    pub fn chaic() -> Creator {
        Creator::Organization("The chaic authors".to_owned())
    }

    /// Returns the name.
    pub fn name(&self) -> &str {
        match self {
            Creator::Person(name) | Creator::Organization(name) => name,
        }
    }
}

impl FromStr for Creator {
    type Err = String;

    /// Parses `person:NAME` or `organization:NAME`.
    fn from_str(text: &str) -> Result<Creator, String> {
        let (kind, name) = text.split_once(':').unwrap_or((text, ""));
        let creator: fn(String) -> Creator = match kind {
            "person" => Creator::Person,
            "organization" => Creator::Organization,
            _ => {
                return Err(format!("no creator `{text}`; write person:NAME or organization:NAME"));
            }
        };
        let name = name.trim();
        if !(1..=MAX_NAME).contains(&name.chars().count()) || name.chars().any(char::is_control) {
            return Err(format!("the name of a creator is one line of 1 to {MAX_NAME} characters"));
        }
        Ok(creator(name.to_owned()))
    }
}

/// Facts about a data set for its card and its metadata.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DatasetDescription {
    /// Title of the data set, for example `chaic episodes: standard`.
    pub title: String,
    /// One or two sentences about the content.
    pub summary: String,
    /// Stated creators of the data set; empty without a statement.
    pub creators: Vec<Creator>,
    /// Origin of the data.
    pub collection: String,
    /// Uses that the data is meant for.
    pub uses: &'static [&'static str],
    /// Gaps of the data.
    pub limitations: &'static [&'static str],
    /// Ways in which the data differs from the world.
    pub biases: Vec<&'static str>,
    /// Statement about personal data.
    pub personal_information: String,
    /// License as an SPDX identifier; `None` if chaic cannot give one ([`common::NO_LICENSE`]).
    pub license: Option<&'static str>,
    /// Tags for catalogues of data sets.
    pub tags: &'static [&'static str],
    /// Files of one kind.
    pub files: Vec<FileGroup>,
    /// Records within the files of one group.
    pub records: RecordSet,
}

/// Files of one kind within a data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileGroup {
    /// Short name, unique within the data set.
    pub name: &'static str,
    /// Glob pattern relative to the folder of the data set.
    pub pattern: &'static str,
    /// Media type.
    pub media_type: &'static str,
    /// Content of one file.
    pub description: &'static str,
}

/// Records of a table or of one file each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordSet {
    /// Short name, unique within the data set.
    pub name: &'static str,
    /// Name of the [`FileGroup`] that holds the records.
    pub files: &'static str,
    /// One sentence about a record.
    pub description: &'static str,
    /// Fields of a record.
    pub fields: Vec<Field>,
}

/// Field of a record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name, unique within the record.
    pub name: &'static str,
    /// Type of the value, or of the elements of a list.
    pub data_type: DataType,
    /// True if the value is a list.
    pub is_list: bool,
    /// Meaning, with unit and range.
    pub description: String,
    /// Place of the value in a file.
    pub place: ValueLocation,
}

/// Types of values in records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataType {
    /// UTF-8 text.
    Text,
    /// Integer.
    Integer,
    /// Floating-point number.
    Float,
    /// True or false.
    Boolean,
}

/// Place of a value in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueLocation {
    /// Column of a table.
    Column(&'static str),
    /// JSON path within a file that holds one record.
    JsonPath(&'static str),
}

/// Facts that hold for all data sets of chaic.
pub mod common {
    /// Statement about personal data, for data without decisions of real people.
    pub const NO_PERSONAL_INFORMATION: &str =
        "None. All people are simulated, and no recording of a real person was used.";
    /// Statement about the license of data that hold, or can hold, decisions of real people.
    pub const NO_LICENSE: &str = "Not stated: chaic cannot license decisions of real people. Before the data are shared, the organizer of \
        the study or game must state a license that the consent of the people allows.";
    /// Statement about effects on society.
    pub const SOCIAL_IMPACT: &str = "Helpers trained on simulated people with impairments can fail with real ones. The data must not \
        be the only evidence that an assistant is safe or useful for a person with a disability.";
    /// Biases of the simulation.
    pub const BIASES: &[&str] = &[
        "Simulated people follow the rules of the paper and never change their minds, speak or refuse help.",
        "Constraints are simplified: one value each for reach, strength and speed, from the paper or chosen by chaic.",
        "Houses, streets and yards are those of chaic's generators, with goods of a Western household.",
    ];
}

impl DatasetDescription {
    /// Returns the card in Markdown, with the header that Hugging Face reads.
    pub fn to_markdown(&self) -> String {
        let mut text = String::from("---\n");
        let license = self.license.map_or_else(|| "other".to_owned(), str::to_lowercase);
        let _ = writeln!(text, "license: {license}");
        let _ = writeln!(text, "pretty_name: {:?}", self.title);
        text.push_str("task_categories:\n- robotics\ntags:\n");
        for tag in self.tags {
            let _ = writeln!(text, "- {tag}");
        }
        // Without this, the viewer and `load_dataset` mix the records with files of metadata.
        if let Some(group) = self.files.iter().find(|group| group.name == self.records.files) {
            text.push_str("configs:\n- config_name: default\n");
            let _ = writeln!(text, "  data_files: {}", group.pattern);
        }
        let _ = write!(text, "---\n\n# {}\n\n{}\n\n", self.title, self.summary);
        let _ = write!(text, "## Collection\n\n{}\n\n", self.collection);
        let mut section = |title: &str, items: &[&str]| {
            let _ = write!(text, "## {title}\n\n");
            for item in items {
                let _ = writeln!(text, "- {item}");
            }
            text.push('\n');
        };
        section("Intended use", self.uses);
        section("Limitations", self.limitations);
        section("Biases", &self.biases);
        section("Effects on society", &[common::SOCIAL_IMPACT]);
        section("Personal data", &[self.personal_information.as_str()]);
        section("License", &[self.license.unwrap_or(common::NO_LICENSE)]);
        if !self.creators.is_empty() {
            let names: Vec<&str> = self.creators.iter().map(Creator::name).collect();
            section("Creators", &names);
        }
        self.write_content(&mut text);
        text
    }

    fn write_content(&self, text: &mut String) {
        text.push_str("## Content\n\n| files | content |\n|---|---|\n");
        for group in &self.files {
            let _ = writeln!(text, "| `{}` | {} |", group.pattern, group.description);
        }
        let RecordSet { name, description, fields, .. } = &self.records;
        let _ = write!(
            text,
            "\n`{name}`: {description}\n\n| field | type | meaning |\n|---|---|---|\n"
        );
        for field in fields {
            let list = if field.is_list { "list of " } else { "" };
            let data_type = match field.data_type {
                DataType::Text => "text",
                DataType::Integer => "integer",
                DataType::Float => "float",
                DataType::Boolean => "boolean",
            };
            let _ =
                writeln!(text, "| `{}` | {list}{data_type} | {} |", field.name, field.description);
        }
        text.push_str("\n`croissant.json` describes the files for programs (Croissant 1.0).\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_creator_is_a_person_or_an_organization_with_a_name() {
        for (text, creator) in [
            ("person:Ada Lovelace", Creator::Person("Ada Lovelace".to_owned())),
            ("organization: Lab: A ", Creator::Organization("Lab: A".to_owned())),
        ] {
            assert_eq!(text.parse(), Ok(creator), "{text}");
        }
        let long = format!("person:{}", "a".repeat(MAX_NAME + 1));
        for text in ["Ada Lovelace", "person", "person: ", "Person:Ada", "person:A\nB", &long] {
            assert!(text.parse::<Creator>().is_err(), "{text}");
        }
    }
}
