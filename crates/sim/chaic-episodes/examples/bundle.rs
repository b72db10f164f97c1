//! Regenerates the bundled episodes and the digests of the standard split: `cargo run --release -p
//! chaic-episodes --example bundle`.
//!
//! This changes the benchmark. The files are written to the crate's `data` folder.

use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let bundled = chaic_episodes::regenerate_bundled()?;
    let standard = chaic_episodes::standard_table()?;
    let files =
        [("train.jsonl", bundled.train), ("test.jsonl", bundled.test), ("standard.txt", standard)];
    for (name, text) in files {
        println!("{name}: {} episodes, {} bytes", text.lines().count(), text.len());
        std::fs::write(folder.join(name), text)?;
    }
    Ok(())
}
