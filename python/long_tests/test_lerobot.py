"""LeRobot reads the data sets of `chaic export lerobot`.

The test needs LeRobot 0.4 with PyAV: `pip install lerobot==0.4.0`.
"""

import subprocess
import sys

import pytest

av = pytest.importorskip("av")
torch = pytest.importorskip("torch")
lerobot_dataset = pytest.importorskip("lerobot.datasets.lerobot_dataset")

EVERY = 6
FPS = 30 // EVERY


def decode(path, timestamps, tolerance_s, backend=None):
    """Decodes video frames with PyAV; LeRobot's default decoders need system libraries."""
    with av.open(str(path)) as video:
        pictures = [(float(p.time), p.to_ndarray(format="rgb24")) for p in video.decode(video=0)]
    found = []
    for wanted in timestamps:
        at, picture = min(pictures, key=lambda p: abs(p[0] - wanted))
        assert abs(at - wanted) < tolerance_s
        found.append(torch.from_numpy(picture).permute(2, 0, 1).float() / 255)
    return torch.stack(found)


def chaic(command, folder):
    subprocess.run([sys.executable, "-m", "chaic", *command.split()], cwd=folder, check=True)


def test_lerobot_reads_an_exported_run(tmp_path, monkeypatch):
    evaluate = "eval --task moving_house,low_target --split gen:40000001..40000002 --helper rhp --out run"
    chaic(evaluate, tmp_path)
    export = f"export lerobot run --out set --every {EVERY} --image-size 64"
    chaic(export, tmp_path)
    monkeypatch.setattr(lerobot_dataset, "decode_video_frames", decode)
    data = lerobot_dataset.LeRobotDataset(
        "chaic/run", root=tmp_path / "set", delta_timestamps={"action": [0.0, 1 / FPS]}
    )
    assert data.num_episodes == 2 and data.fps == FPS
    first, last = data[0], data[len(data) - 1]
    assert first["observation.images.ego"].shape == (3, 64, 64)
    assert first["action"].shape == (2, 3) and first["observation.state"].shape == (9,)
    assert isinstance(first["plan"], str) and first["task"] in {"moving house", "low target"}
    assert bool(last["next.done"]) and not bool(first["next.done"])
    assert 0.05 < float(first["observation.images.ego"].mean()) < 0.95
