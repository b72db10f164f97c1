//! Makes sealed splits, whose episodes only the organizer knows.
//!
//! An organizer holds a [`Secret`] and publishes a [`Commitment`] to it. A [`SealedSplit`] derives the
//! seeds of its episodes and partners from the secret, so they are unknown until the secret is. Once it is
//! published, the public can check that it is the committed one, and play the same episodes.
//!
//! **What it is not**: it plays no episodes, and it does not keep the secret safe; that is up to the
//! organizer.

mod sealed;
mod secret;

pub use sealed::{ArenaError, Commitment, SealedSplit};
pub use secret::{Secret, SecretError};
