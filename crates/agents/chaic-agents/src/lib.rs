//! All minds: the simulated people and the rule-based helpers.
//!
//! **What it is**: one [`mind::Mind`] joins [`perception`] (what is in the image), [`memory`]
//! (where everything is), [`behavior`] (what the others do), [`decision`] (what to do next, by a
//! [`decision::Policy`]) and [`execution`] (how to do it, action by action). [`partners`] are part
//! of the benchmark's definition; [`helpers`] are what is measured. Both are the same kind of
//! thing with different data.
//!
//! **What it is not**: it holds no state of a world and makes no pixels; it never depends on
//! `chaic-world` or `chaic-render`.
//!
//! **Invariants**
//! - A mind knows its briefing, its observations and what was granted; nothing else reaches it.
//! - The same briefing and observations lead to the same actions on every machine: random numbers
//!   come from [`chaic_core::rng::Stream`], there is no clock, and no hash map is iterated.
//!
//! ```
//! use chaic_agents::sight::TrueSight;
//! use chaic_agents::{HelperInfo, PlannerRules};
//! let rhp = HelperInfo::named("rhp").expect("it is in the table");
//! assert!((rhp.make)(PlannerRules::paper(), &TrueSight).senses().depth);
//! assert!((rhp.grants)(PlannerRules::paper()).ids);
//! ```

pub mod track;

pub mod perception;
pub mod rules;

pub mod mapping;
pub mod planning;

pub mod memory;

pub mod behavior;
pub mod sight;

pub mod decision;
pub mod policies;

pub mod execution;

pub mod mind;

pub mod helpers;
pub mod partners;

mod child;

#[cfg(test)]
mod test_support;

pub use helpers::{HELPERS, HelperInfo};
pub use mind::Mind;
pub use partners::{child, partner, partner_grants};
pub use rules::PlannerRules;
pub use track::{Intent, TrackId};
