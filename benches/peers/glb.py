"""Reads the scene and the cameras that `chaic bench scene` writes."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass
class Mesh:
    """Triangles of one color, in the object's frame, meters, y up."""

    positions: np.ndarray  # float32 [n, 3]
    normals: np.ndarray  # float32 [n, 3]
    triangles: np.ndarray  # uint32 [m, 3], counter-clockwise from outside


@dataclass
class Part:
    """A mesh with a pose in the world."""

    entity: int
    mesh: int  # index in Scene.meshes
    color: tuple  # linear red, green, blue, 0 to 1
    rotation: tuple  # quaternion x, y, z, w
    origin: tuple  # meters

    @property
    def srgb(self):
        """Color in sRGB, 0 to 1."""
        return tuple(12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055 for c in self.color)


@dataclass
class Camera:
    """A camera; directions are unit vectors in the world frame."""

    eye: np.ndarray
    right: np.ndarray
    up: np.ndarray
    forward: np.ndarray
    fov_rad: float  # vertical
    width: int
    height: int
    near_m: float
    far_m: float


@dataclass
class Scene:
    meshes: list
    parts: list
    cameras: list


def load(folder):
    """Returns the scene and its cameras from the folder of `chaic bench scene --out`."""
    folder = Path(folder)
    root, blob = _chunks((folder / "scene.glb").read_bytes())
    meshes, index_of, parts = [], {}, []
    for node in root["nodes"]:
        if "mesh" not in node:
            continue
        for primitive in root["meshes"][node["mesh"]]["primitives"]:
            key = primitive["indices"]
            if key not in index_of:
                index_of[key] = len(meshes)
                meshes.append(
                    Mesh(
                        _array(root, blob, primitive["attributes"]["POSITION"]),
                        _array(root, blob, primitive["attributes"]["NORMAL"]),
                        _array(root, blob, key).reshape(-1, 3),
                    )
                )
            material = root["materials"][primitive["material"]]
            color = tuple(material["pbrMetallicRoughness"]["baseColorFactor"][:3])
            entity = node["extras"]["entity"]
            parts.append(Part(entity, index_of[key], color, tuple(node["rotation"]), tuple(node["translation"])))
    described = json.loads((folder / "cameras.json").read_text())["cameras"]
    return Scene(meshes, parts, [_camera(c) for c in described])


def matrix(rotation):
    """Returns the rotation matrix of a quaternion x, y, z, w."""
    x, y, z, w = rotation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def write_obj(mesh, path):
    """Writes a mesh as Wavefront OBJ and returns the path as text, which PyBullet requires."""
    lines = ["v %.6f %.6f %.6f" % tuple(p) for p in mesh.positions]
    lines += ["vn %.4f %.4f %.4f" % tuple(n) for n in mesh.normals]
    vertex = "{0}//{0}".format
    lines += ["f " + " ".join(vertex(k + 1) for k in t) for t in mesh.triangles]
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def _camera(c):
    direction = {k: np.array(c[k]) for k in ("eye", "right", "up", "forward")}
    return Camera(
        **direction,
        fov_rad=c["vertical_fov_rad"],
        width=c["width"],
        height=c["height"],
        near_m=c["near_m"],
        far_m=c["far_m"],
    )


def _chunks(data):
    magic, version, _ = struct.unpack_from("<4sII", data)
    assert (magic, version) == (b"glTF", 2), "not a binary glTF 2.0 file"
    at, found = 12, {}
    while at < len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        found[kind] = data[at + 8 : at + 8 + length]
        at += 8 + length
    return json.loads(found[b"JSON"]), found[b"BIN\0"]


def _array(root, blob, index):
    accessor = root["accessors"][index]
    view = root["bufferViews"][accessor["bufferView"]]
    dtype = {5125: np.uint32, 5126: np.float32}[accessor["componentType"]]
    width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
    begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    flat = np.frombuffer(blob, dtype, accessor["count"] * width, begin)
    return flat.reshape(-1, width) if width > 1 else flat
