"""Embree, Intel's ray tracer, through Open3D: one ray per pixel for depth, ids and normals, then minimal
shading in NumPy. The rays are made before the measurement."""

import numpy as np
import open3d
from open3d.core import Tensor

import glb
from measure import measure, options, save


def main():
    args = options()
    scene = glb.load(args.folder)
    traced = open3d.t.geometry.RaycastingScene(nthreads=1)
    colors, entities = [], []
    for part in scene.parts:
        mesh = scene.meshes[part.mesh]
        positions = mesh.positions @ glb.matrix(part.rotation).T + np.array(part.origin)
        traced.add_triangles(Tensor(positions.astype(np.float32)), Tensor(mesh.triangles.copy()))
        colors.append(part.srgb)
        entities.append(part.entity)
    # Rays without a hit have the largest id.
    colors = np.array(colors + [(0.7, 0.8, 0.9)], np.float32)
    entities = np.array(entities + [0], np.uint16)
    rays = [Tensor(pixel_rays(camera)) for camera in scene.cameras]
    light = np.array([0.3, 0.9, 0.3], np.float32)

    def depth_and_ids(k):
        # Ray directions have length 1 along the camera's axis, so hit distances are depths.
        hits = traced.cast_rays(rays[k], nthreads=1)
        ids = np.minimum(hits["geometry_ids"].numpy(), len(colors) - 1)
        return hits, hits["t_hit"].numpy(), entities[ids], ids

    def all_channels(k):
        hits, depth, entity, ids = depth_and_ids(k)
        lit = 0.6 + 0.4 * np.abs(hits["primitive_normals"].numpy() @ light)
        rgb = (255 * np.clip(colors[ids] * lit[:, :, None], 0, 1)).astype(np.uint8)
        return rgb, depth, entity

    save(all_channels(0)[0], args.folder, "embree")
    for channels, draw in [("rgb+depth+ids", all_channels), ("depth+ids", depth_and_ids)]:
        title = "Embree through Open3D"
        measure(title, channels, open3d.__version__, draw, scene.cameras, args.seconds)


def pixel_rays(camera):
    """Returns the origin and direction of each pixel's ray: float32 [height, width, 6]."""
    focal = 0.5 * camera.height / np.tan(0.5 * camera.fov_rad)
    x = (np.arange(camera.width) + 0.5 - 0.5 * camera.width) / focal
    y = -(np.arange(camera.height) + 0.5 - 0.5 * camera.height) / focal
    ahead = camera.forward + x[None, :, None] * camera.right + y[:, None, None] * camera.up
    return np.concatenate([np.broadcast_to(camera.eye, ahead.shape), ahead], axis=2).astype(np.float32)


main()
