//! Contests: sealed splits, submissions, scores and leaderboards.
//!
//! **What it is**: an organizer holds a [`Secret`] and publishes a [`Commitment`] to it. A [`SealedSplit`]
//! derives the seeds of its episodes and partners from the secret, so they stay unknown until the organizer
//! publishes it.
//! Authors send a [`Submission`] in an [`archive`]. An [`Evaluation`] holds its run on the sealed split and
//! its [`SubmissionScore`], which readers can confirm by re-simulation. A [`PlayedRun`] has a run with each
//! partner of a list if there is one. A [`Leaderboard`] compares confirmed scores, in one table for each set
//! of rules and list of partners. docs/arena.md describes the workflow.
//!
//! **What it is not**: it starts no program and plays no episode; `chaic submit run` does both. It does not
//! keep the secret safe; that is up to the organizer.
//!
//! **Invariants**
//! - An archive is read to its end before anything is written. Extraction creates files below a new folder
//!   only, and the folder appears complete or not at all.
//! - Equal content gives an equal archive. Equal submissions and runs give an equal score, byte by byte.
//! - A row of a leaderboard comes from a score that re-simulation confirmed.

pub mod archive;
mod error;
mod evaluation;
pub mod leaderboard;
mod manifest;
mod partners;
mod played;
mod score;
mod sealed;
mod secret;
mod submission;

pub use error::{ArenaError, Result};
pub use evaluation::{Evaluation, EvaluationReport, SCORE};
pub use leaderboard::Leaderboard;
pub use manifest::{
    HelperSource, MANIFEST, MAX_MANIFEST_BYTES, Manifest, PlayConditions, PublicPart, Training,
};
pub use partners::PartnersDigest;
pub use played::PlayedRun;
pub use score::{
    EpisodeOutcome, EpisodeRunRecord, EvaluationConditions, PartnerScore, PartnersScore,
    SubmissionRecord, SubmissionScore,
};
pub use sealed::{Commitment, SealedSplit};
pub use secret::{Secret, SecretError};
pub use submission::{Submission, UnpackedSubmission};
