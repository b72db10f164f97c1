//! Tests of archives and submissions.

mod archives;
mod hostile;
mod manifest;
mod raw_tar;
