"""The code of docs/tutorial-python.md and of the README runs, and its helpers beat no helper."""

import json
import re
import sys
import types
from pathlib import Path

import pytest

import chaic

ROOT = Path(__file__).resolve().parents[2]


def blocks(page: str) -> list[str]:
    """Returns the Python blocks of a page, in order."""
    return re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)


def execute(page: str, n_blocks: int) -> dict[str, object]:
    """Executes all Python blocks of a page in one namespace, with few and quiet episodes; returns the namespace."""
    code = blocks(page)
    assert len(code) == n_blocks, f"{page}: {len(code)} blocks"
    namespace: dict[str, object] = {}
    for number, block in enumerate(code, 1):
        short = re.sub(r"n_episodes=\d+", "n_episodes=2, quiet=True", block)
        exec(compile(short, f"{page}, block {number}", "exec"), namespace)
    return namespace


def mean_tr(run: chaic.Run) -> dict[str, float]:
    """Returns the mean transport rate of each helper."""
    records = run.records()
    return {
        str(name): float(records["tr"][records["helper"] == name].mean())
        for name in set(records["helper"])
    }


@pytest.mark.parametrize(("page", "n_blocks"), [("docs/tutorial-python.md", 10), ("README.md", 1)])
def test_the_code_runs_and_its_helper_beats_no_helper(page, n_blocks, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = execute(page, n_blocks)["run"]
    assert isinstance(run, chaic.Run)
    tr = mean_tr(run)
    assert tr["carrier"] > tr["none"] + 0.1, tr
    assert not run.records()["failed"].any()


def test_the_cells_of_the_notebook_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    display = types.ModuleType("IPython.display")
    display.Image = bytes
    monkeypatch.setitem(sys.modules, "IPython", types.ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    notebook = json.loads((ROOT / "examples/python/quickstart.ipynb").read_text())
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    # The last one renders a video, which takes half a minute.
    assert cells.pop().startswith("run.replay(")
    namespace: dict[str, object] = {}
    for number, cell in enumerate(cells, 1):
        exec(compile(cell.replace("n_episodes=2", "n_episodes=1"), f"cell {number}", "exec"), namespace)
    assert isinstance(namespace["run"], chaic.Run)
