//! Examples in the long help of each command. A test parses all of them.

/// A purpose, and the command line.
type Example = (&'static str, &'static str);

/// Commands with their examples.
pub(super) const EXAMPLES: &[(&str, [Example; 3])] = &[
    (
        "chaic",
        [
            ("Play a small benchmark, about half a minute", "chaic eval"),
            ("Print its scores", "chaic report runs/quick"),
            ("Check this machine", "chaic doctor"),
        ],
    ),
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
                "chaic eval --helper 'served=exec:chaic helper serve rhp' --n-episodes 1",
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
            ("Test a served helper", "chaic helper check 'chaic helper serve random'"),
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
    (
        "chaic report",
        [
            ("Print the tables", "chaic report runs/quick"),
            ("Print Markdown with intervals", "chaic report runs/quick --format md"),
            ("Draw the figure", "chaic report runs/quick --figure scores.svg"),
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
        "chaic list rules",
        [
            ("List the rules", "chaic list rules"),
            ("List them as JSON", "chaic list rules --format json"),
            ("Change one rule", "chaic eval --set world.dropped_counts=true"),
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
    (
        "chaic collect",
        [
            ("Collect labeled images", "chaic collect detection --out data/detection"),
            ("Collect labeled clips", "chaic collect behavior --out data/behavior"),
            (
                "Collect observations of partners",
                "chaic collect opponent --out data/opponent.safetensors",
            ),
        ],
    ),
    (
        "chaic collect detection",
        [
            ("Collect 1000 images", "chaic collect detection --out data/detection"),
            (
                "Collect validation images",
                "chaic collect detection --split validation --views 200 --out data/validation",
            ),
            (
                "Collect images in the benchmark's appearance",
                "chaic collect detection --scenes natural --appearance canonical --out data/natural",
            ),
        ],
    ),
    (
        "chaic collect behavior",
        [
            ("Collect clips", "chaic collect behavior --out data/behavior"),
            (
                "Collect validation clips",
                "chaic collect behavior --split validation --max-per-class 20 --out data/validation",
            ),
            (
                "Use ground truth for the person's position",
                "chaic collect behavior --perception gt --out data/behavior",
            ),
        ],
    ),
    (
        "chaic collect opponent",
        [
            ("Collect windows", "chaic collect opponent --out data/opponent.safetensors"),
            (
                "Collect validation windows",
                "chaic collect opponent --split validation --out data/validation.safetensors",
            ),
            (
                "Collect a few from one episode",
                "chaic collect opponent --max-per-class 20 --n-episodes 1 --out data/few.safetensors",
            ),
        ],
    ),
    (
        "chaic train",
        [
            ("Train the detector", "chaic train detection --out runs/detection"),
            ("Train a policy", "chaic train ppo --out runs/ppo"),
            ("Continue a training", "chaic train ppo --resume --out runs/ppo"),
        ],
    ),
    (
        "chaic train detection",
        [
            ("Train with the default configuration", "chaic train detection --out runs/detection"),
            ("Train for fewer steps", "chaic train detection --steps 1000 --out runs/short"),
            ("Continue a training", "chaic train detection --resume --out runs/detection"),
        ],
    ),
    (
        "chaic train behavior",
        [
            ("Train with the default configuration", "chaic train behavior --out runs/behavior"),
            (
                "Train with a configuration",
                "chaic train behavior --config behavior.toml --out runs/behavior",
            ),
            ("Continue a training", "chaic train behavior --resume --out runs/behavior"),
        ],
    ),
    (
        "chaic train ppo",
        [
            ("Train with the default configuration", "chaic train ppo --out runs/ppo"),
            (
                "Start from a cloned policy",
                "chaic train ppo --weights runs/clone/policy.safetensors --out runs/ppo",
            ),
            ("Continue a training", "chaic train ppo --resume --out runs/ppo"),
        ],
    ),
    (
        "chaic train clone",
        [
            ("Train with the default configuration", "chaic train clone --out runs/clone"),
            (
                "Train with a configuration",
                "chaic train clone --config clone.toml --out runs/clone",
            ),
            ("Continue a training", "chaic train clone --resume --out runs/clone"),
        ],
    ),
    (
        "chaic train primitive",
        [
            ("Train with the default configuration", "chaic train primitive --out runs/primitive"),
            ("Train for fewer updates", "chaic train primitive --steps 100 --out runs/short"),
            ("Continue a training", "chaic train primitive --resume --out runs/primitive"),
        ],
    ),
    (
        "chaic train opponent",
        [
            ("Train with the default configuration", "chaic train opponent --out runs/opponent"),
            (
                "Train with a configuration",
                "chaic train opponent --config opponent.toml --out runs/opponent",
            ),
            ("Continue a training", "chaic train opponent --resume --out runs/opponent"),
        ],
    ),
    (
        "chaic export",
        [
            ("Export all episodes", "chaic export lerobot runs/quick --out data/quick"),
            ("Export one helper", "chaic export lerobot runs/quick --helper rhp --out data/rhp"),
            (
                "Export the partner's view",
                "chaic export lerobot runs/quick --agent partner --out data/partner",
            ),
        ],
    ),
    (
        "chaic export lerobot",
        [
            ("Export all episodes", "chaic export lerobot runs/quick --out data/quick"),
            (
                "Export one helper in one task",
                "chaic export lerobot runs/quick --helper rhp --task obstacle --out data/rhp",
            ),
            (
                "Export 10 samples per second with small images",
                "chaic export lerobot runs/quick --every 3 --size 128 --out data/small",
            ),
        ],
    ),
    (
        "chaic verify",
        [
            ("Verify a run", "chaic verify runs/quick"),
            ("Use two threads", "chaic verify runs/quick --jobs 2"),
            ("Print the findings as JSON", "chaic verify runs/quick --format json"),
        ],
    ),
    (
        "chaic fidelity",
        [
            ("Compare both rule sets", "chaic fidelity --episodes original --out runs/fidelity"),
            (
                "Try one rule on few episodes",
                "chaic fidelity --episodes original --n-episodes 2 --switch world.blocking --out runs/try",
            ),
            (
                "Write the document again",
                "chaic fidelity --only-document --out runs/fidelity --doc fidelity.md",
            ),
        ],
    ),
    (
        "chaic bench",
        [
            ("Measure the renderer", "chaic bench render"),
            ("Measure the simulator", "chaic bench world --task obstacle"),
            ("Measure many environments", "chaic bench env --envs 64 --threads 8"),
        ],
    ),
    (
        "chaic bench render",
        [
            ("Measure the default scene", "chaic bench render"),
            (
                "Measure an episode with small images",
                "chaic bench render --episode shopping/test/00 --size 128",
            ),
            ("Print JSON", "chaic bench render --threads 8 --format json"),
        ],
    ),
    (
        "chaic bench world",
        [
            ("Measure all tasks", "chaic bench world"),
            ("Measure two tasks", "chaic bench world --task obstacle,shopping"),
            ("Print JSON", "chaic bench world --seconds 1 --format json"),
        ],
    ),
    (
        "chaic bench env",
        [
            ("Measure 64 environments", "chaic bench env"),
            ("Use eight threads", "chaic bench env --envs 256 --threads 8"),
            ("Measure without images of helpers", "chaic bench env --channels none"),
        ],
    ),
    (
        "chaic bench scene",
        [
            ("Write the default scene", "chaic bench scene --out scene"),
            ("Write a smaller one", "chaic bench scene --objects 20 --out scene"),
            ("Write an episode", "chaic bench scene --episode shopping/test/00 --out scene"),
        ],
    ),
    (
        "chaic doctor",
        [
            ("Check this machine", "chaic doctor"),
            ("Print the checks as JSON", "chaic doctor --format json"),
            ("Print them without colors", "chaic doctor --color never"),
        ],
    ),
    (
        "chaic completions",
        [
            ("Print the script for bash", "chaic completions bash"),
            ("Print the script for zsh", "chaic completions zsh"),
            ("Print the script for fish", "chaic completions fish"),
        ],
    ),
    (
        "chaic man",
        [
            ("Write the pages into a folder", "chaic man man1"),
            ("Write them for your user", "chaic man ~/.local/share/man/man1"),
            ("List the written pages as JSON", "chaic man man1 --format json"),
        ],
    ),
];
