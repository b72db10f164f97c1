//! Examples of the commands that show results and scenes.

use super::CommandExamples;

pub(super) const EXAMPLES: &[CommandExamples] = &[
    (
        "chaic report",
        [
            ("Print the tables", "chaic report runs/quick"),
            ("Draw the figure", "chaic report runs/quick --figure scores.svg"),
            (
                "Print what learned perception costs",
                "chaic report runs/hidden --baseline runs/standard",
            ),
        ],
    ),
    (
        "chaic show",
        [
            ("Summarize a run", "chaic show runs/quick"),
            ("Summarize it as JSON", "chaic show runs/quick --format json"),
            ("Summarize a part of a fidelity experiment", "chaic show runs/fidelity/compat"),
        ],
    ),
    (
        "chaic list",
        [
            ("List the helpers", "chaic list helpers"),
            ("List the rules as JSON", "chaic list rules --format json"),
            ("List the runs in ./runs", "chaic list runs"),
        ],
    ),
    (
        "chaic list helpers",
        [
            ("List the helpers", "chaic list helpers"),
            ("List them as JSON", "chaic list helpers --format json"),
            ("Play two of them", "chaic eval --helper none,rhp"),
        ],
    ),
    (
        "chaic list tasks",
        [
            ("List the tasks", "chaic list tasks"),
            ("List them as JSON", "chaic list tasks --format json"),
            ("Play two of them", "chaic eval --task obstacle,shopping"),
        ],
    ),
    (
        "chaic list people",
        [
            ("List people and impairments", "chaic list people"),
            ("List them as JSON", "chaic list people --format json"),
            ("Play with another partner", "chaic eval --person child+one_handed --n-episodes 1"),
        ],
    ),
    (
        "chaic list partners",
        [
            ("List the agents that may control the partner", "chaic list partners"),
            ("List them as JSON", "chaic list partners --format json"),
            ("Play with one of them", "chaic eval --partner farthest --n-episodes 1"),
        ],
    ),
    (
        "chaic list rules",
        [
            ("List the rules", "chaic list rules"),
            ("List them as JSON", "chaic list rules --format json"),
            ("Change one rule", "chaic eval --set world.failed_put_on_can_deliver=true"),
        ],
    ),
    (
        "chaic list runs",
        [
            ("List the runs in ./runs", "chaic list runs"),
            ("List those in another folder", "chaic list runs results"),
            ("List them as JSON", "chaic list runs --format json"),
        ],
    ),
    (
        "chaic explain",
        [
            ("Explain the helper infer", "chaic explain runs/quick obstacle/test/00"),
            ("Explain another helper", "chaic explain runs/quick obstacle/test/00 --helper rhp"),
            ("Print the records", "chaic explain runs/quick obstacle/test/00 --format json"),
        ],
    ),
    (
        "chaic view",
        [
            ("Write a page with the replays of a run", "chaic view runs/quick"),
            ("Only one episode, by all helpers", "chaic view runs/quick low_target/test/00"),
            ("Only one helper", "chaic view runs/quick --helper rhp --out replays.html"),
        ],
    ),
    (
        "chaic replay",
        [
            (
                "Make a video",
                "chaic replay runs/quick obstacle/test/00 --helper rhp --out replay.mp4",
            ),
            (
                "Draw the detections",
                "chaic replay runs/quick obstacle/test/00 --masks --out masks.mp4",
            ),
            (
                "Make a small animation",
                "chaic replay runs/quick obstacle/test/00 --out replay.gif --every 30 --fps 10",
            ),
        ],
    ),
    (
        "chaic render",
        [
            ("Render the first frame", "chaic render obstacle/test/00 --out images"),
            (
                "Render a later view of the partner",
                "chaic render obstacle/test/00 --agent partner --frame 500 --out images",
            ),
            (
                "Render with random light and colors",
                "chaic render obstacle/test/00 --appearance varied:7 --out images",
            ),
        ],
    ),
    (
        "chaic scene",
        [
            ("Export a scene", "chaic scene export shopping/test/00 --out scene.glb"),
            (
                "Export a house without ceilings",
                "chaic scene export obstacle/test/00 --out house.glb --no-ceiling",
            ),
            (
                "Export coarse meshes",
                "chaic scene export shopping/test/00 --out scene.glb --detail 1",
            ),
        ],
    ),
    (
        "chaic scene export",
        [
            ("Export a scene", "chaic scene export shopping/test/00 --out scene.glb"),
            (
                "Export a house without ceilings",
                "chaic scene export obstacle/test/00 --out house.glb --no-ceiling",
            ),
            ("Export an episode file", "chaic scene export my_episode.json --out scene.glb"),
        ],
    ),
];
