"""The examples and the notebook run without errors."""

import http.server
import json
import subprocess
import sys
import threading
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def run(name: str, *arguments: str, cwd: Path) -> str:
    call = [sys.executable, str(ROOT / "examples" / "python" / name), *arguments]
    done = subprocess.run(call, cwd=cwd, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_ppo_with_stable_baselines(tmp_path):
    pytest.importorskip("stable_baselines3")
    assert "return of two" in run("ppo_sb3.py", "--steps", "64", "--envs", "2", cwd=tmp_path)
    assert (tmp_path / "ppo.zip").exists()


def test_the_stable_baselines_checker_passes():
    env_checker = pytest.importorskip("stable_baselines3.common.env_checker")
    import gymnasium

    sys.path.insert(0, str(ROOT / "examples" / "python"))
    from ppo_sb3 import Learnable

    env_checker.check_env(Learnable(gymnasium.make("chaic/HighTarget-v0", image_size=64)))


def test_ppo_on_the_vector_environment(tmp_path):
    pytest.importorskip("torch")
    assert "4096 decisions" in run("ppo_vector.py", "--steps", "4096", cwd=tmp_path)


def test_ppo_with_torchrl_on_plans(tmp_path):
    pytest.importorskip("torchrl")
    assert "trained on 512 plans" in run("ppo_torchrl.py", "--steps", "512", cwd=tmp_path)


def test_imitation_of_the_oracle(tmp_path):
    pytest.importorskip("torch")
    output = run("imitation.py", "--episodes", "2", "--epochs", "3", cwd=tmp_path)
    assert "epoch 3" in output


class LastPlanHandler(http.server.BaseHTTPRequestHandler):
    """Endpoint that always chooses the last plan."""

    def do_POST(self):
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        last = body["messages"][0]["content"].splitlines()[-1].split(":")[0]
        text = json.dumps({"choices": [{"message": {"content": f"Plan {last}."}}]}).encode()
        self.send_response(200)
        self.send_header("Content-Length", str(len(text)))
        self.end_headers()
        self.wfile.write(text)

    def log_message(self, *_):
        pass


def test_the_language_model_helper(tmp_path):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), LastPlanHandler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    endpoint = f"http://127.0.0.1:{server.server_port}/v1"
    run("language_helper.py", "--endpoint", endpoint, "--model", "m", cwd=tmp_path)
    results = (tmp_path / "runs" / "language" / "results.jsonl").read_text()
    assert json.loads(results)["status"] == "done"


def test_the_notebook_runs(tmp_path):
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(ROOT / "examples" / "python" / "quickstart.ipynb", as_version=4)
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": tmp_path}}).execute()
