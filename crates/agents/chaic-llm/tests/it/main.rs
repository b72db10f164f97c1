//! Language helpers from outside, against a stand-in on the same machine.

mod common;

mod behavior;
mod faults;
mod hidden;
mod injection;
mod prompts;
mod run;
mod secrets;
mod stop;
