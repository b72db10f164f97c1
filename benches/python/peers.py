"""Measures steps per second of chaic, PyBullet and ManiSkill's CPU backend with 128x128 color and depth, one after the
other on the same cores.

    python benches/python/peers.py [--seconds 15] [--processes 2]

A step and the use of several cores differ. chaic steps 64 worlds, each with a simulated person who sees, remembers and
plans; a step is an action of the helper and takes several frames. PyBullet gets the triangles of one of chaic's houses
and a randomly pushed body, without a person; a step is one frame. ManiSkill gets PickCube, its lightest task with a
camera; a step is one frame of 1/20 s. PyBullet and ManiSkill run one world in each of several processes. A package that
is not installed is reported; the others are still measured.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path

import numpy as np

SIZE = 128
SCENE = "high_target/train/00"


def rate(step: Callable[[], int], seconds: float) -> float:
    """Returns the steps per second after a warm-up."""
    for _ in range(3):
        step()
    done, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        done += step()
    return done / (time.perf_counter() - start)


def chaic(seconds: float) -> float:
    from chaic.vector import HelperVectorEnv

    worlds = 64
    env = HelperVectorEnv(
        None, worlds, observation=("rgb", "depth", "proprioception"), image_size=SIZE, partner_image_size=SIZE, autoreset_mode="SameStep"
    )
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = env.single_action_space.nvec

    def step() -> int:
        env.step(rng.integers(0, actions, (worlds, 3)))
        return worlds

    return rate(step, seconds)


def pybullet(seconds: float, scene: str) -> float:
    import pybullet as p

    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "peers"))
    import glb

    loaded = glb.load(scene)
    p.connect(p.DIRECT)
    p.setGravity(0, -9.81, 0)
    p.setTimeStep(1 / 30)
    with tempfile.TemporaryDirectory() as folder:
        files: dict[int, str] = {}
        for part in loaded.parts:
            if part.mesh not in files:
                files[part.mesh] = glb.write_obj(
                    loaded.meshes[part.mesh], Path(folder) / f"{part.mesh}.obj"
                )
            shape = p.createVisualShape(p.GEOM_MESH, fileName=files[part.mesh], rgbaColor=[*part.srgb, 1.0])
            p.createMultiBody(
                baseVisualShapeIndex=shape, basePosition=part.origin, baseOrientation=part.rotation
            )
    camera = loaded.cameras[0]
    floor = p.createCollisionShape(p.GEOM_BOX, halfExtents=[50, 0.5, 50])
    p.createMultiBody(baseCollisionShapeIndex=floor, basePosition=[0, -0.5, 0])
    body = p.createMultiBody(
        1.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.3), basePosition=[camera.eye[0], 0.3, camera.eye[2]]
    )
    rng = np.random.default_rng(0)
    projection = p.computeProjectionMatrixFOV(np.degrees(camera.fov_rad), 1.0, camera.near_m, camera.far_m)

    def step() -> int:
        yaw = rng.uniform(0, 2 * np.pi)
        forward = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
        p.resetBaseVelocity(body, linearVelocity=forward.tolist())
        p.stepSimulation()
        eye = np.array(p.getBasePositionAndOrientation(body)[0]) + [0.0, 1.2, 0.0]
        view = p.computeViewMatrix(eye.tolist(), (eye + forward).tolist(), [0.0, 1.0, 0.0])
        p.getCameraImage(SIZE, SIZE, view, projection, renderer=p.ER_TINY_RENDERER)
        return 1

    return rate(step, seconds)


def maniskill(seconds: float) -> float:
    import gymnasium
    import mani_skill.envs  # noqa: F401

    env = gymnasium.make(
        "PickCube-v1",
        num_envs=1,
        obs_mode="rgb+depth",
        sim_backend="physx_cpu",
        render_backend="cpu",
        sensor_configs={"width": SIZE, "height": SIZE},
    )
    env.reset(seed=0)

    def step() -> int:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        if bool(terminated) or bool(truncated):
            env.reset()
        return 1

    return rate(step, seconds)


def in_processes(work: Callable[..., float], processes: int, *arguments: object) -> float:
    """Returns the total rate of `processes` processes."""
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        return sum(future.result() for future in [pool.submit(work, *arguments) for _ in range(processes)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    seconds, n = arguments.seconds, arguments.processes
    from chaic._chaic import run_command

    with tempfile.TemporaryDirectory() as scene:
        if run_command(["chaic", "bench", "scene", "--episode", SCENE, "--size", str(SIZE), "--out", scene]) != 0:
            sys.exit(1)
        peers: list[tuple[str, str, str, Callable[[], float]]] = [
            ("chaic", "chaic", "64 worlds with partners, one process", lambda: in_processes(chaic, 1, seconds)),
            ("pybullet", "PyBullet, TinyRenderer", f"that house, {n} processes", lambda: in_processes(pybullet, n, seconds, scene)),
            ("mani_skill", "ManiSkill, CPU", f"PickCube-v1, {n} processes", lambda: in_processes(maniskill, n, seconds)),
        ]
        print("| | version | worlds | steps a second | speedup of chaic |\n|---|---|---|---:|---:|")
        ours = 0.0
        for package_name, name, worlds, measured in peers:
            try:
                steps = measured()
                of = version(package_name)
            except Exception as error:
                reason = " ".join([f"{type(error).__name__}:", *str(error).splitlines()[:1]])
                print(f"| {name} | not measured: {reason[:100]} |||")
                continue
            if package_name == "chaic":
                ours = steps
            speedup = f"{ours / steps:.1f}" if ours else "/"
            print(f"| {name} | {of} | {worlds} | {steps:.1f} | {speedup} |", flush=True)


if __name__ == "__main__":
    main()
