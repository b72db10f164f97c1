//! Tests of the server through loopback connections, with a clock of the tests.

mod hostile;
mod kit;
mod load;
mod participation;
mod play;
mod restart;
mod secrecy;
