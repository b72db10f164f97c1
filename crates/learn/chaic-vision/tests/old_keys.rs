//! Configurations and error rates with the keys of earlier versions are read as those with current
//! keys. An old key besides its current one, and an unknown key, are refused with one clear
//! message.

use chaic_training::conformance::check_renamed_keys;
use chaic_training::parse_config;
use chaic_vision::behavior::train::BehaviorTrainer;
use chaic_vision::noisy::DetectorNoiseModel;
use chaic_vision::train::DetectorLearner;

#[test]
fn old_keys_are_read_and_conflicting_and_unknown_keys_are_refused() {
    check_renamed_keys::<DetectorLearner>("", &[("rate", "learning_rate", "0.5")]);
    check_renamed_keys::<DetectorLearner>(
        "[views]\n",
        &[
            ("swapped", "swap_fraction", "0.125"),
            ("added", "n_added", "3"),
            ("decor", "decor_fraction", "0.125"),
            ("large", "large_fraction", "0.125"),
            ("refurnished", "furniture_swap", "[0.125, 2.0]"),
            ("wanted", "wanted_class_fraction", "0.125"),
            ("carrying", "carrying_fraction", "0.125"),
            ("filled", "filled_fraction", "0.125"),
            ("varied", "varied_fraction", "0.125"),
            ("aimed", "aimed_fraction", "0.125"),
            ("aimed_movable", "aimed_movable_fraction", "0.125"),
        ],
    );
    check_renamed_keys::<DetectorLearner>(
        "[loss]\n",
        &[
            ("even_px", "reference_area_px", "5000.0"),
            ("power", "area_exponent", "0.5"),
            ("weights", "weight_range", "[0.25, 8.0]"),
            ("offset", "offset_coef", "0.25"),
            ("least_px", "min_px", "10"),
        ],
    );
    check_renamed_keys::<DetectorLearner>("[adam]\n", &[("clip_norm", "max_grad_norm", "2.0")]);
    check_renamed_keys::<BehaviorTrainer>(
        "",
        &[
            ("rate", "learning_rate", "0.5"),
            ("clips", "batch_size", "3"),
            ("mixed", "mixed_fraction", "0.25"),
            ("smoothing", "label_smoothing", "0.125"),
        ],
    );
    check_renamed_keys::<BehaviorTrainer>(
        "[collect]\n",
        &[
            ("of_each", "max_per_class", "5"),
            ("varied", "varied_fraction", "0.5"),
            ("learned", "learned_fraction", "0.25"),
        ],
    );
}

/// Crops have no defaults, so both tables state all keys.
#[test]
fn old_keys_of_crops_are_read_and_conflicting_and_unknown_keys_are_refused() {
    let crops = |per_view: &str, uniform: &str| {
        let table = format!("{{ views = 1, side_px = 64, {per_view} = 2, {uniform} = 0.25 }}");
        parse_config::<DetectorLearner>(&format!("crops = [{table}, {table}]\n"))
    };
    let current = crops("crops_per_view", "uniform_crop_fraction").unwrap();
    assert_eq!(crops("of_view", "anywhere").unwrap(), current);
    for (uniform, expected) in [
        ("anywhere = 0.25, uniform_crop_fraction", "duplicate field `uniform_crop_fraction`"),
        ("no_such_key", "unknown field `no_such_key`"),
    ] {
        let problem = crops("crops_per_view", uniform).unwrap_err();
        assert!(problem.contains(expected) && !problem.contains('\n'), "{problem}");
    }
    let problem = parse_config::<DetectorLearner>("rate = -1").unwrap_err();
    assert!(problem.contains("`learning_rate` is -1"), "{problem}");
}

#[test]
fn old_keys_of_error_rates_are_read() {
    let old = r#"{"missed": [[5, 0.5]], "misnamed": 0.25, "invented": 0.5, "scores": [0.9, 0.5]}"#;
    let rates: DetectorNoiseModel = serde_json::from_str(old).unwrap();
    let current = r#"{"miss_rate_by_area":[[5,0.5]],"misclassification_rate":0.25,"false_positives_per_image":0.5,"scores":[0.9,0.5]}"#;
    assert_eq!(serde_json::to_string(&rates).unwrap(), current);
    let both = old.replace("\"missed\"", "\"misclassification_rate\": 0.1, \"missed\"");
    let problem = serde_json::from_str::<DetectorNoiseModel>(&both).unwrap_err().to_string();
    assert!(problem.contains("duplicate field `misclassification_rate`"), "{problem}");
    assert!(serde_json::from_str::<DetectorNoiseModel>("{\"lost\": 0.5}").is_err());
}
