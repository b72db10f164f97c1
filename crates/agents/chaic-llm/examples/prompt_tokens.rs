//! How long the questions of a run are, by two real tokenizers and by the estimate that prompts are
//! kept short with: `cargo run --release -p chaic-llm --example prompt_tokens -- RUN`.

use std::path::Path;

use chaic_llm::record::{self, Entry, Record};
use chaic_llm::tokens;

fn main() -> chaic_llm::Result<()> {
    let run = std::env::args().nth(1).unwrap_or_else(|| "runs/llm".to_owned());
    let vocabularies = [
        ("cl100k", tiktoken_rs::cl100k_base_singleton()),
        ("o200k", tiktoken_rs::o200k_base_singleton()),
    ];
    println!("task               helper    questions  mean  longest  estimate/longest");
    let mut rows: Vec<(String, String, Vec<[usize; 2]>)> = Vec::new();
    let run = Path::new(&run);
    for path in record::all(run)? {
        let record = Record::read(run, &path)?;
        let key = (record.head.of.task.to_string(), record.head.of.helper.clone());
        let counts = record.entries.iter().filter_map(|entry| match entry {
            Entry::Exchange(exchange) => {
                let said: Vec<&str> =
                    exchange.ask.messages.iter().map(|m| m.text.as_str()).collect();
                let said = said.join("\n");
                let real = vocabularies.iter().map(|(_, v)| v.count_ordinary(&said)).max()?;
                Some([real, tokens::estimate(&said)])
            }
            Entry::Decided(_) => None,
        });
        let counts: Vec<[usize; 2]> = counts.collect();
        match rows.iter_mut().find(|(task, helper, _)| (task, helper) == (&key.0, &key.1)) {
            Some((_, _, all)) => all.extend(counts),
            None => rows.push((key.0, key.1, counts)),
        }
    }
    for (task, helper, counts) in rows {
        let n = counts.len().max(1);
        let mean = counts.iter().map(|c| c[0]).sum::<usize>() / n;
        let [longest, estimate] = counts.iter().max().copied().unwrap_or_default();
        println!("{task:<18} {helper:<9} {n:>9} {mean:>5} {longest:>8}  {estimate}");
    }
    Ok(())
}
