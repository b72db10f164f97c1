"""PyBullet's renderer on the CPU (TinyRenderer): RGB, depth and ids in one call, with and without
shadows."""

import tempfile
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pybullet

import glb
from measure import measure, options, save


def main():
    args = options()
    scene = glb.load(args.folder)
    pybullet.connect(pybullet.DIRECT)
    with tempfile.TemporaryDirectory() as folder:
        files = [glb.write_obj(mesh, Path(folder) / f"{k}.obj") for k, mesh in enumerate(scene.meshes)]
        for part in scene.parts:
            shape = pybullet.createVisualShape(
                pybullet.GEOM_MESH, fileName=files[part.mesh], rgbaColor=[*part.srgb, 1.0]
            )
            pybullet.createMultiBody(
                baseVisualShapeIndex=shape, basePosition=part.origin, baseOrientation=part.rotation
            )
    matrices = [camera_matrices(camera) for camera in scene.cameras]
    for shadow, name in [(0, "pybullet"), (1, "pybullet-shadow")]:

        def draw(k, shadow=shadow):
            camera, (view, projection) = scene.cameras[k], matrices[k]
            return pybullet.getCameraImage(
                camera.width,
                camera.height,
                viewMatrix=view,
                projectionMatrix=projection,
                shadow=shadow,
                lightDirection=[0.3, 0.9, 0.3],
                renderer=pybullet.ER_TINY_RENDERER,
            )

        pixels = np.reshape(draw(0)[2], (scene.cameras[0].height, scene.cameras[0].width, 4))
        save(pixels[:, :, :3].astype(np.uint8), args.folder, name)
        title = "PyBullet TinyRenderer" + (", shadows" if shadow else "")
        measure(title, "rgb+depth+ids", version("pybullet"), draw, scene.cameras, args.seconds)


def camera_matrices(camera):
    view = pybullet.computeViewMatrix(
        camera.eye.tolist(), (camera.eye + camera.forward).tolist(), camera.up.tolist()
    )
    projection = pybullet.computeProjectionMatrixFOV(
        np.degrees(camera.fov_rad), camera.width / camera.height, camera.near_m, camera.far_m
    )
    return view, projection


main()
