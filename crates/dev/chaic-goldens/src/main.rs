//! Prints the table of this machine, and fails if it differs from the committed one: `cargo run -p
//! chaic-goldens`. With `-- --update` it overwrites the committed table.

use std::process::ExitCode;

use chaic_goldens::{GOLDENS, first_difference, table};

fn main() -> ExitCode {
    let found = match table() {
        Ok(found) => found,
        Err(problem) => {
            eprintln!("error: {problem}");
            return ExitCode::FAILURE;
        }
    };
    if std::env::args().skip(1).any(|arg| arg == "--update") {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/goldens.txt");
        if let Err(problem) = std::fs::write(path, &found) {
            eprintln!("error: cannot write {path}: {problem}");
            return ExitCode::FAILURE;
        }
        println!("wrote {path}");
        return ExitCode::SUCCESS;
    }
    print!("{found}");
    match first_difference(&found, GOLDENS) {
        None => ExitCode::SUCCESS,
        Some([here, committed]) => {
            eprintln!(
                "differs from goldens.txt; first\n  here      {here}\n  committed {committed}"
            );
            ExitCode::FAILURE
        }
    }
}
