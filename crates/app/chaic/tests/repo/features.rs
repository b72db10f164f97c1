//! Promise: the wheel of CI gets the features that the tests of the workspace get, so that it reuses what they compiled.

use std::collections::BTreeMap;
use std::process::Command;

use crate::root;

#[test]
fn the_wheel_of_ci_has_the_features_of_the_workspace() {
    let tests = features(&["--workspace", "--features", "chaic/gpu,chaic/study-server"]);
    let wheel = features(&["-p", "chaic-python", "--features", "workspace-features"]);
    assert!(tests.len() > 200 && wheel.len() > 200);
    let differs = |(package, of_wheel): &(&String, &String)| {
        let is_wheel = package.starts_with("chaic-python ");
        !is_wheel && tests.get(*package).is_some_and(|of_tests| of_tests != *of_wheel)
    };
    let different: Vec<String> = wheel
        .iter()
        .filter(differs)
        .map(|(package, of_wheel)| format!("{package}: {of_wheel}, in tests {}", tests[package]))
        .collect();
    assert!(
        different.is_empty(),
        "adapt `workspace-features` in crates/app/chaic-python/Cargo.toml:\n{}",
        different.join("\n")
    );
}

/// Returns the features of each package, by name and version.
fn features(selection: &[&str]) -> BTreeMap<String, String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--offline", "--edges", "features", "--prefix", "none"])
        .args(["--format", "{p}|{f}"])
        .args(selection)
        .current_dir(root())
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("cargo writes UTF-8");
    // A line is `NAME vVERSION (PATH)|FEATURES (*)`, or names a feature alone.
    let package = |line: &str| {
        let (package, features) = line.split_once('|')?;
        let mut words = package.split(' ');
        let version = [words.next()?, words.next()?];
        version[1]
            .starts_with('v')
            .then(|| (version.join(" "), features.trim_end_matches(" (*)").to_owned()))
    };
    text.lines().filter(|line| !line.contains("feature \"")).filter_map(package).collect()
}
