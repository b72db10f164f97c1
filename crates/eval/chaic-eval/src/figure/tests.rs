//! Promise: a figure names every task and helper, and shows the given values only.

use super::*;
use chaic_core::TaskId;

fn bars(helpers: &[&str]) -> BarChart {
    let tasks: Vec<String> = TaskId::paper().map(|t| t.info().title.to_owned()).collect();
    let helpers = helpers
        .iter()
        .enumerate()
        .map(|(h, helper)| HelperBars {
            helper: (*helper).to_owned(),
            values: (0..tasks.len())
                .map(|t| {
                    let mean = ((h * 13 + t * 29) % 60) as f64 / 100.0 + 0.2;
                    let se = 0.02 + t as f64 * 0.005;
                    Some(BarValue { mean, interval: Some([mean - se, mean + 2.0 * se]), dot: None })
                })
                .collect(),
        })
        .collect();
    BarChart { tasks, helpers, dots: None }
}

fn svg(bars: &BarChart) -> String {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("figure.svg");
    transport_rate(bars, &path).unwrap();
    std::fs::read_to_string(path).unwrap()
}

/// Counts rectangles of a color: the swatch in the legend and the bars.
fn n_fills(svg: &str, color: RGBColor) -> usize {
    let hex = format!("fill=\"#{:02X}{:02X}{:02X}\"", color.0, color.1, color.2);
    svg.lines().filter(|line| line.starts_with("<rect") && line.contains(&hex)).count()
}

#[test]
fn every_task_and_helper_is_named() {
    let helpers = ["No helper", "Random", "Rule-based", "LLM", "VLM", "Oracle"];
    let bars = bars(&helpers);
    let svg = svg(&bars);
    for label in bars.tasks.iter().map(String::as_str).chain(helpers) {
        assert!(svg.contains(label), "no `{label}`");
    }
    assert!(svg.contains("transport rate") && svg.contains("95 % intervals"));
    assert!(svg.contains("font-family=\"sans-serif\""));
    for (index, helper) in helpers.iter().enumerate() {
        assert_eq!(n_fills(&svg, color(index)), 1 + 8, "{helper}");
    }
}

#[test]
fn markup_in_a_name_is_escaped() {
    let svg = svg(&bars(&["<b>&"]));
    assert!(svg.contains("&lt;b&gt;&amp;"), "{svg}");
}

#[test]
fn a_missing_value_leaves_a_gap_and_zero_does_not() {
    let mut bars = bars(&["A", "B"]);
    bars.helpers[0].values[3] = None;
    bars.helpers[1].values[3] = Some(BarValue { mean: 0.0, interval: None, dot: None });
    let svg = svg(&bars);
    assert_eq!(n_fills(&svg, color(0)), 1 + 7);
    assert_eq!(n_fills(&svg, color(1)), 1 + 8);
}

#[test]
fn dots_are_drawn_and_explained() {
    let n_circles = |svg: &str| svg.matches("<circle").count();
    let mut bars = bars(&["A", "B"]);
    assert_eq!(n_circles(&svg(&bars)), 0);
    bars.dots = Some("the paper".to_owned());
    for (dot, task) in [(0.0, 2), (1.0, 5)] {
        bars.helpers[1].values[task] = Some(BarValue { mean: 0.5, interval: None, dot: Some(dot) });
    }
    let svg = svg(&bars);
    assert_eq!(n_circles(&svg), 2 * 2, "each a disk and its edge");
    assert!(svg.contains("dots: the paper"));
}

#[test]
fn png_has_the_size_and_the_colors() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("figure.PNG");
    transport_rate(&bars(&["A", "B", "C"]), &path).unwrap();
    let image =
        image::load_from_memory_with_format(&std::fs::read(path).unwrap(), ImageFormat::Png)
            .unwrap()
            .to_rgb8();
    assert_eq!(image.dimensions(), SIZE_PX);
    for helper in 0..3 {
        let RGBColor(r, g, b) = color(helper);
        let n = image.pixels().filter(|p| p.0 == [r, g, b]).count();
        assert!(n > 10_000, "{n} pixels of helper {helper}");
    }
}

#[test]
fn the_maximum_number_of_helpers_has_different_colors() {
    let names: Vec<String> = (0..MAX_HELPERS).map(|i| format!("a helper, number {i}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let svg = svg(&bars(&names));
    for helper in 0..MAX_HELPERS {
        assert_eq!(n_fills(&svg, color(helper)), 1 + 8, "helper {helper}");
    }
}

#[test]
fn invalid_rates_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("figure.svg");
    let with = |mean, interval| {
        let mut bars = bars(&["A"]);
        bars.helpers[0].values[1] = Some(BarValue { mean, interval, dot: None });
        bars
    };
    for bad in [
        with(1.1, None),
        with(-0.1, None),
        with(f64::NAN, None),
        with(0.5, Some([f64::NAN, 0.6])),
        with(0.5, Some([0.4, 1.1])),
        with(0.5, Some([0.6, 0.7])),
    ] {
        assert!(matches!(transport_rate(&bad, &out), Err(FigureError::Value { .. })));
    }
    let mut short = bars(&["A"]);
    short.helpers[0].values.pop();
    assert!(matches!(
        transport_rate(&short, &out),
        Err(FigureError::Shape { expected: 8, got: 7, .. })
    ));
    assert!(matches!(transport_rate(&bars(&[]), &out), Err(FigureError::Count { .. })));
    let error = transport_rate(&bars(&["A"]), &dir.path().join("figure.pdf")).unwrap_err();
    assert!(error.to_string().contains("svg, png"), "{error}");
    let missing = dir.path().join("missing/figure.svg");
    assert!(matches!(transport_rate(&bars(&["A"]), &missing), Err(FigureError::Write(_))));
    assert!(!out.exists());
}
