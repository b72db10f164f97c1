//! The language helpers from outside, against a stand-in on this machine; one program, as each
//! takes long to link.

mod common;

mod faults;
mod hidden;
mod injection;
mod prompts;
mod run;
mod secrets;
mod stop;
