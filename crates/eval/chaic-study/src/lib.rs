//! Studies in which people play episodes in a browser.
//!
//! **What it is**: a [`Study`] is the content of `study.toml`. A [`StudyPlan`] adds the conditions, the episodes
//! and the digest, and assigns the trials of each slot. [`page_content`] returns the content of the study's
//! page. [`ParticipantData`] is the file of a participant, whose records [`RecordCheck`] compares with the
//! plan; [`export`] checks such files and writes data sets, [`deletion`] removes a participant.
//! [`lowest_free_slot`] is the slot of the next participant, and [`simulate`] a study with simulated ones.
//!
//! **What it is not**: it writes no HTML, receives no data and knows no names of participants.
//!
//! **Invariants**
//! - The trials of a participant are a pure function of the study's digest and the slot.
//! - Data contain no names, addresses or clock times.

mod assignment;
mod content;
pub mod data;
pub mod deletion;
mod error;
pub mod export;
pub mod forms;
mod plan;
mod record_check;
mod simulation;
mod slots;
mod study;

pub use assignment::Assignment;
pub use content::page_content;
pub use data::ParticipantData;
pub use error::{Result, StudyError};
pub use plan::{Condition, SEED, StudyPlan, Trial};
pub use record_check::RecordCheck;
pub use simulation::{DesignBalance, simulate};
pub use slots::{SlotHolder, lowest_free_slot};
pub use study::{
    Design, Factors, FormPlan, Input, MAX_PARTICIPANTS, PERSON, PlaySettings, Seat, Simulator,
    Study, WorldPace,
};

#[cfg(test)]
mod tests;
