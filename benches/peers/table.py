"""Prints the measurements of the peers and of chaic as a table: `table.py FOLDER`."""

import json
import sys
from pathlib import Path


def main():
    folder = Path(sys.argv[1])
    ours = {}
    rows = []
    for path in sorted(folder.glob("chaic-*.json")):
        speed = json.loads(path.read_text())
        cost = speed["cpu_ms_per_frame"] or speed["ms_per_frame"]
        ours[speed["channels"]] = cost
        rows.append(("chaic", speed["channels"], speed["machine"]["chaic"], cost))
    for path in sorted(folder.glob("peer-*.jsonl")):
        # PyBullet also prints its build date.
        for line in filter(lambda line: line.startswith("{"), path.read_text().splitlines()):
            speed = json.loads(line)
            rows.append((speed["name"], speed["channels"], speed["version"], speed["cpu_ms_per_frame"]))
    print("| renderer | images | version | CPU ms a frame | ratio to chaic |")
    print("|---|---|---|---:|---:|")
    for name, channels, version, cost in rows:
        ratio = f"{cost / ours[channels]:.1f}" if channels in ours else ""
        print(f"| {name} | {channels} | {version} | {cost:.2f} | {ratio} |")
    for path in sorted(folder.glob("peer-*.reason")):
        print(f"\nNot measured: {path.stem.removeprefix('peer-')}: {path.read_text().strip()}")


main()
