//! Configurations: old keys are read as the current ones, and errors about assignments name them.

use chaic_training::{parse_config, read_config_with};

use crate::{Toy, ToyConfig};

#[test]
fn old_keys_have_bounds_and_exclude_the_current_ones() {
    let parsed = parse_config::<Toy>;
    assert_eq!(parsed("rate = 0.5"), parsed("learning_rate = 0.5"));
    for (text, expected) in [
        ("rate = 2.0", "`learning_rate` is 2; it must be from 0 to 1"),
        ("rate = 0.5\nlearning_rate = 0.5", "duplicate field `learning_rate`: it is set under"),
        ("speed = 0.5", "unknown field `speed`"),
    ] {
        let problem = parsed(text).unwrap_err();
        assert!(problem.contains(expected) && !problem.contains('\n'), "{problem}");
    }
}

#[test]
fn assignments_may_have_old_keys() {
    let read = |assignments: &[&str]| {
        let assignments: Vec<String> = assignments.iter().map(|text| (*text).to_owned()).collect();
        read_config_with::<Toy>(None, &assignments)
    };
    let expected = ToyConfig { learning_rate: 0.5, a: 1, ..ToyConfig::default() };
    assert_eq!(read(&["rate=0.5", "a=1"]).unwrap(), expected);
    assert_eq!(read(&["rate=0.25", "a=1", "learning_rate=0.5"]).unwrap(), expected);
    for (assignment, expected) in [
        ("rate=2.0", "`learning_rate` is 2; it must be from 0 to 1"),
        ("speed=0.5", "unknown field `speed`"),
        ("steps=-1", "`steps` is -1; it must be an integer from 1 to"),
    ] {
        let problem = read(&[assignment]).unwrap_err().to_string();
        assert!(problem.contains(expected) && !problem.contains('\n'), "{problem}");
    }
}

#[test]
fn an_assignment_of_another_type_is_named() {
    for wrong in ["steps=many", "rate=[0.5]", "a=true"] {
        let assignments = ["b=1", wrong, "fails=0"].map(str::to_owned);
        let problem = read_config_with::<Toy>(None, &assignments).unwrap_err().to_string();
        assert!(problem.contains(&format!("--set {wrong}: invalid type")), "{problem}");
        assert!(!problem.contains('\n'), "{problem}");
    }
}
