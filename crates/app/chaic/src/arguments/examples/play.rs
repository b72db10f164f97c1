//! Examples of the commands that play.

use super::CommandExamples;

pub(super) const EXAMPLES: &[CommandExamples] = &[
    (
        "chaic eval",
        [
            ("Play a small benchmark with all rule-based helpers", "chaic eval"),
            (
                "Rank a helper on the standard split",
                "chaic eval --split standard --helper none,rhp --out runs/rhp",
            ),
            (
                "Play a helper process from images alone",
                "chaic eval --track hidden --helper 'mine=exec:python3 helper.py' --out runs/mine",
            ),
        ],
    ),
    (
        "chaic play",
        [
            ("Write a page with an episode of each task", "chaic play"),
            ("Choose the episodes", "chaic play obstacle/test/00 shopping/gen/7 --out play.html"),
            ("Play for another kind of person", "chaic play low_target/test/00/wheelchair"),
        ],
    ),
    (
        "chaic eval detection",
        [
            ("Evaluate the built-in detector", "chaic eval detection"),
            (
                "Evaluate weights of a training on fewer views",
                "chaic eval detection --weights runs/detection/detector.safetensors --views 500",
            ),
            (
                "Write the files that pycocotools reads",
                "chaic eval detection --views 200 --json report.json --coco coco",
            ),
        ],
    ),
    (
        "chaic eval behavior",
        [
            ("Evaluate the built-in network", "chaic eval behavior"),
            (
                "Evaluate weights of a training",
                "chaic eval behavior --weights runs/behavior/behavior.safetensors",
            ),
            (
                "Use ground truth for the person's position",
                "chaic eval behavior --perception gt --max-per-class 60 --n-episodes 96",
            ),
        ],
    ),
    (
        "chaic eval tracks",
        [
            ("Evaluate the built-in detector", "chaic eval tracks"),
            (
                "Evaluate weights of a training",
                "chaic eval tracks --perception learned:runs/detection/detector.safetensors",
            ),
            (
                "Use ground truth with the error rates of the detector",
                "chaic eval tracks --perception noisy --n-episodes 64 --json tracks.json",
            ),
        ],
    ),
    (
        "chaic eval opponent",
        [
            (
                "Evaluate weights of a training",
                "chaic eval opponent --weights runs/opponent/opponent.safetensors",
            ),
            (
                "Use the learned detector",
                "chaic eval opponent --weights opponent.safetensors --perception learned",
            ),
            (
                "Write all metrics as JSON",
                "chaic eval opponent --weights opponent.safetensors --json report.json",
            ),
        ],
    ),
    (
        "chaic merge",
        [
            ("Join two shards", "chaic merge --out runs/whole runs/part1 runs/part2"),
            ("Print the scores as JSON", "chaic merge --out runs/whole runs/part1 --format json"),
            ("Print no progress", "chaic merge --quiet --out runs/whole runs/part1 runs/part2"),
        ],
    ),
    (
        "chaic episodes",
        [
            ("List the test episodes", "chaic episodes list"),
            ("Draw a floor plan", "chaic episodes show obstacle/test/00 --out plan.png"),
            ("Check a file", "chaic episodes validate my_episode.json"),
        ],
    ),
    (
        "chaic episodes list",
        [
            ("List the test episodes of one task", "chaic episodes list --task shopping"),
            (
                "List the standard split as JSON",
                "chaic episodes list --split standard --format json",
            ),
            (
                "List generated episodes",
                "chaic episodes list --split gen:0..10 --task obstacle,low_target",
            ),
        ],
    ),
    (
        "chaic episodes show",
        [
            ("Draw a bundled episode", "chaic episodes show obstacle/test/00 --out plan.png"),
            ("Draw a generated one", "chaic episodes show shopping/gen/7 --out plan.png"),
            (
                "Draw a file in a larger image",
                "chaic episodes show my_episode.json --out plan.png --width 2400",
            ),
        ],
    ),
    (
        "chaic episodes generate",
        [
            (
                "Generate ten episodes",
                "chaic episodes generate --task obstacle --seeds 0..10 --out episodes",
            ),
            (
                "Write the standard split of a task",
                "chaic episodes generate --task shopping --split standard --out episodes",
            ),
            (
                "Generate episodes with the settings of the standard split",
                "chaic episodes generate --task tremor --split gen-standard:0..5 --out episodes",
            ),
        ],
    ),
    (
        "chaic episodes validate",
        [
            ("Check a file", "chaic episodes validate my_episode.json"),
            ("Check several files", "chaic episodes validate a.json b.json"),
            ("Check the standard split", "chaic episodes validate --split standard"),
        ],
    ),
    (
        "chaic episodes seal",
        [
            (
                "Seal 100 episodes of each task",
                "chaic episodes seal --secret secret.txt --out sealed",
            ),
            (
                "Seal one task, and ten partners",
                "chaic episodes seal --secret secret.txt --task obstacle --n-partners 10 --out sealed",
            ),
            (
                "Play them",
                "chaic eval --episodes sealed/episodes --helper none,rhp --out runs/sealed",
            ),
        ],
    ),
    (
        "chaic episodes open",
        [
            (
                "Check the secret and write the episodes",
                "chaic episodes open --secret secret.txt --commitment commitment.json --out episodes",
            ),
            ("Play them", "chaic eval --episodes episodes --helper none,rhp --out runs/opened"),
            ("Check a file", "chaic episodes validate episodes/obstacle-000.json"),
        ],
    ),
    (
        "chaic episodes schema",
        [
            ("Print the schema", "chaic episodes schema"),
            ("Validate a file against all rules", "chaic episodes validate my_episode.json"),
            (
                "Write an episode file",
                "chaic episodes generate --task obstacle --seeds 0..1 --out episodes",
            ),
        ],
    ),
    (
        "chaic import",
        [
            (
                "Import the original's episodes",
                "chaic import original --dataset CHAIC/dataset --tdw tdw --out original",
            ),
            (
                "Import its test half",
                "chaic import original --dataset CHAIC/dataset --tdw tdw --out original --split test",
            ),
            ("Print the help of the original's import", "chaic help import original"),
        ],
    ),
    (
        "chaic import original",
        [
            (
                "Import all episodes",
                "chaic import original --dataset CHAIC/dataset --tdw tdw --out original",
            ),
            (
                "Import the test half",
                "chaic import original --dataset CHAIC/dataset --tdw tdw --out original --split test",
            ),
            (
                "Skip what cannot be imported",
                "chaic import original --dataset CHAIC/dataset --tdw tdw --out original --keep-going",
            ),
        ],
    ),
    (
        "chaic helper",
        [
            ("Test a helper process", "chaic helper check 'python3 helper.py'"),
            ("Run a built-in helper as a process", "chaic helper serve rhp"),
            (
                "Play that process in a benchmark",
                "chaic eval --helper 'exec:chaic helper serve rhp' --exec-grants ids,goal_place \
                 --n-episodes 1",
            ),
        ],
    ),
    (
        "chaic helper check",
        [
            ("Test a Python helper", "chaic helper check 'python3 helper.py'"),
            ("Let it read a folder", "chaic helper check 'python3 helper.py' --exec-read weights"),
            ("Test it without a sandbox", "chaic helper check 'python3 helper.py' --exec-trust"),
        ],
    ),
    (
        "chaic helper serve",
        [
            ("Serve the rule-based planner", "chaic helper serve rhp"),
            ("Serve it with the original's rules", "chaic helper serve rhp --rules compat"),
            (
                "Test a served helper",
                "chaic helper check 'chaic helper serve random' --exec-grants ids,goal_place",
            ),
        ],
    ),
    (
        "chaic llm",
        [
            (
                "Test an endpoint",
                "chaic llm check --endpoint http://127.0.0.1:8000/v1 --model qwen3-8b",
            ),
            ("Print the prompts of an episode", "chaic llm show runs/llm obstacle/test/00"),
            ("Write the templates for editing", "chaic llm templates --out templates"),
        ],
    ),
    (
        "chaic llm templates",
        [
            ("Write the templates", "chaic llm templates --out templates"),
            ("Print the written folder as JSON", "chaic llm templates --out mine --format json"),
            (
                "Play with a configuration that names them",
                "chaic eval --helper none,llm --llm-config mine.toml",
            ),
        ],
    ),
    (
        "chaic llm show",
        [
            ("Print the prompts and answers", "chaic llm show runs/llm obstacle/test/00"),
            ("Print the answers alone", "chaic llm show runs/llm obstacle/test/00 --brief"),
            (
                "Print those of the partner",
                "chaic llm show runs/llm obstacle/test/00 --agent partner --helper none",
            ),
        ],
    ),
    (
        "chaic llm check",
        [
            (
                "Test a local server",
                "chaic llm check --endpoint http://127.0.0.1:8000/v1 --model qwen3-8b",
            ),
            (
                "Take the key from another variable",
                "chaic llm check --endpoint https://api.example.org/v1 --model m --llm-key-env MY_KEY",
            ),
            ("Test a configuration file", "chaic llm check --llm-config llm.toml"),
        ],
    ),
];
