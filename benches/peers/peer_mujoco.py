"""MuJoCo with OpenGL on the CPU (Mesa's llvmpipe): one pass each for RGB, depth and ids."""

import mujoco
import numpy as np

import glb
from measure import measure, options, save


def main():
    args = options()
    scene = glb.load(args.folder)
    model = compile_model(scene)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    first = scene.cameras[0]
    renderer = mujoco.Renderer(model, first.height, first.width)

    def rgb(k):
        renderer.update_scene(data, camera=k)
        return renderer.render()

    def all_channels(k):
        image = rgb(k)
        renderer.enable_depth_rendering()
        depth = renderer.render()
        renderer.disable_depth_rendering()
        renderer.enable_segmentation_rendering()
        ids = renderer.render()
        renderer.disable_segmentation_rendering()
        return image, depth, ids

    save(rgb(0), args.folder, "mujoco")
    for channels, draw in [("rgb+depth+ids", all_channels), ("rgb", rgb)]:
        measure("MuJoCo, llvmpipe", channels, mujoco.__version__, draw, scene.cameras, args.seconds)


def compile_model(scene):
    spec = mujoco.MjSpec()
    first = scene.cameras[0]
    visual = getattr(spec.visual, "global_")
    visual.offwidth, visual.offheight = first.width, first.height
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.4] * 3, [0.5] * 3
    # Distances are in units of the model's extent.
    spec.stat.extent = 1.0
    spec.visual.map.znear, spec.visual.map.zfar = first.near_m, first.far_m
    for k, mesh in enumerate(scene.meshes):
        spec.add_mesh(
            name=str(k),
            uservert=mesh.positions.flatten(),
            usernormal=mesh.normals.flatten(),
            userface=mesh.triangles.astype(np.int32).flatten(),
            userfacenormal=mesh.triangles.astype(np.int32).flatten(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
    for part in scene.parts:
        x, y, z, w = part.rotation
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=str(part.mesh),
            pos=part.origin,
            quat=[w, x, y, z],
            rgba=[*part.srgb, 1.0],
            contype=0,
            conaffinity=0,
        )
    for k, camera in enumerate(scene.cameras):
        eye = spec.worldbody.add_camera(
            name=f"view {k}", pos=camera.eye, fovy=np.degrees(camera.fov_rad)
        )
        eye.alt.type = mujoco.mjtOrientation.mjORIENTATION_XYAXES
        eye.alt.xyaxes = [*camera.right, *camera.up]
    return spec.compile()


main()
