"""Compares average precision by pycocotools and by chaic on the same files.

    pip install pycocotools==2.0.11
    chaic eval detection --views 200 --json report.json --coco coco
    python3 benches/pycocotools/compare.py coco report.json

The exit code is 1 if a value differs by more than rounding.
"""

import contextlib
import io
import json
import sys

import numpy as np
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

# Minimum instance areas in pixels, as in chaic's report.
MIN_PX = 100
SMALLER_MIN_PX = [64, 32]
SIZES = {"small": [100, 1024], "medium": [1025, 9216], "large": [9217, 1e10]}
# Tolerance for sums in another order.
ROUNDING = 1e-9


def without_output(function):
    with contextlib.redirect_stdout(io.StringIO()):
        return function()


def main(folder: str, report_path: str) -> int:
    with open(report_path) as file:
        report = json.load(file)
    truth = without_output(lambda: COCO(f"{folder}/annotations.json"))
    found = without_output(lambda: truth.loadRes(f"{folder}/detections.json"))
    ranges = {"report": [MIN_PX, 1e10], **{str(px): [px, 1e10] for px in SMALLER_MIN_PX}, **SIZES}
    evaluation = COCOeval(truth, found, "segm")
    evaluation.params.areaRng = list(ranges.values())
    evaluation.params.areaRngLbl = list(ranges)
    evaluation.params.maxDets = [100]
    without_output(evaluation.evaluate)
    without_output(evaluation.accumulate)
    # Shape [IoU thresholds, recalls, classes, areas, max detections]; -1 for a class without instances.
    precision = evaluation.eval["precision"][:, :, :, :, 0]

    def mean(values):
        """Returns the mean, or None if no class has instances, as in chaic's report."""
        return float(np.mean(values[values > -1])) if (values > -1).any() else None

    names = {c["id"]: c["name"] for c in truth.dataset["categories"]}
    rows = []
    for k, name in enumerate(ranges):
        ours = {
            "report": [report["map50"], report["map"]],
            **report["smaller"],
            **report["sizes"],
        }[name]
        rows.append((f"map50 {name}", mean(precision[0, :, :, k]), ours[0]))
        rows.append((f"map {name}", mean(precision[:, :, :, k]), ours[1]))
    for k, category in enumerate(evaluation.params.catIds):
        ours = report["classes"].get(names[category])
        of_class = precision[:, :, k, 0]
        if (ours is None) != bool((of_class == -1).all()):
            print(f"{names[category]}: present in only one of the two")
            return 1
        if ours is not None:
            rows.append((f"AP50 {names[category]}", mean(of_class[0]), ours[0]))
            rows.append((f"AP {names[category]}", mean(of_class), ours[1]))
    worst = 0.0
    print(f"{'':32} {'pycocotools':>11} {'chaic':>8}")
    for name, theirs, ours in rows:
        if theirs is None or ours is None:
            if theirs is not ours:
                print(f"{name}: undefined in only one of the two")
                return 1
            continue
        worst = max(worst, abs(theirs - ours))
        print(f"{name:32} {theirs:11.6f} {ours:8.6f}")
    print(f"largest difference {worst:.1e}")
    return int(worst > ROUNDING)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2]))
