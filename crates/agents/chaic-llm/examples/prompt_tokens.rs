//! Compares the token counts of a run's prompts by two tokenizers with the estimate: `cargo run
//! --release -p chaic-llm --example prompt_tokens -- RUN`.

use std::path::Path;

use chaic_llm::record::{self, DecisionLog, RecordEntry};
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
        let record = DecisionLog::read(run, &path)?;
        let key = (record.header.key.task.to_string(), record.header.key.helper.clone());
        let counts = record.entries.iter().filter_map(|entry| match entry {
            RecordEntry::Exchange(exchange) => {
                let text: Vec<&str> =
                    exchange.request.messages.iter().map(|m| m.text.as_str()).collect();
                let text = text.join("\n");
                let real = vocabularies.iter().map(|(_, v)| v.count_ordinary(&text)).max()?;
                Some([real, tokens::estimate(&text)])
            }
            RecordEntry::Decision(_) => None,
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
