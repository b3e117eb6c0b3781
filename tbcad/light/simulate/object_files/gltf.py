"""glTF 2.0 (Khronos, ISO/IEC 12113): .glb and .gltf; metres, y up, colours of materials linear."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    ObjectFile,
    uri_bytes,
    without_facets,
)
from tbcad.light.simulate.object_files.gltf_meshes import (
    CUT_OFF,
    DRACO,
    TRANSFORM,
    WEBP,
    GltfFile,
    Json,
    primitive_part,
)
from tbcad.types import Floats

MAGIC = b"glTF"
JSON_START = 20  # behind the header of the file and that of its first chunk
MOST_NODES = 100_000
READ = {DRACO, TRANSFORM, WEBP, "KHR_mesh_quantization"}
ONLY_LOOKS = "KHR_materials_"  # gloss, glass, cloth ...: of the surface, not of its colour
REMEDY = {
    "EXT_meshopt_compression": "gltfpack without -c, or gltf-transform copy",
    "KHR_texture_basisu": "gltf-transform with textures as PNG",
}
AS_MODELLED = "are left out: it stands as it was modelled"


def read_gltf(path: Path) -> ObjectFile:
    """Read all triangles of the file's scene, in the frame of the scene.

    InputError: it is no glTF 2.0, damaged, needs an extension that is not read, or has none.
    """
    document, binary = _document(path)
    if str(document.get("asset", {}).get("version", "2")).split(".")[0] != "2":
        raise InputError("it is not version 2 of glTF: export it again")
    for name in document.get("extensionsRequired", []):
        if name not in READ and not name.startswith(ONLY_LOOKS):
            how = REMEDY.get(name, "another exporter")
            raise InputError(f"it needs {name}, which is not read: write it without, as by {how}")
    file = GltfFile(path, document, _buffers(path, document, binary))
    parts = [
        part.moved(matrix)
        for mesh, matrix in _placed_meshes(document)
        for primitive in document["meshes"][mesh]["primitives"]
        if (part := primitive_part(file, primitive)) is not None
    ]
    if not parts:
        raise without_facets(0)
    primitives = (p for mesh in document["meshes"] for p in mesh["primitives"])
    for found, note in (
        (document.get("skins"), f"bones {AS_MODELLED}"),
        (any("targets" in p for p in primitives), f"morph targets {AS_MODELLED}"),
        (document.get("animations"), "animations are left out"),
    ):
        if found:
            file.notes.append(note)
    return ObjectFile(parts, list(dict.fromkeys(file.notes)), "m", "y")


def _document(path: Path) -> tuple[Json, bytes]:
    """The JSON, and the binary chunk of a .glb."""
    data, binary = path.read_bytes(), b""
    if data.startswith(MAGIC):
        if len(data) < JSON_START or int.from_bytes(data[8:12], "little") > len(data):
            raise InputError("it is cut off: copy it again")
        end = JSON_START + int.from_bytes(data[12:16], "little")
        data, binary = data[JSON_START:end], data[end + 8 :]
    try:
        document = json.loads(data.decode("utf-8-sig"))
    except ValueError:
        raise InputError("it is no glTF") from None
    if not isinstance(document, dict) or "asset" not in document:
        raise InputError("it is no glTF")
    return document, binary


def _buffers(path: Path, document: Json, binary: bytes) -> list[bytes]:
    buffers = document.get("buffers", [])
    found = [uri_bytes(path, one["uri"]) if "uri" in one else binary for one in buffers]
    if any(len(data) < one["byteLength"] for data, one in zip(found, buffers, strict=True)):
        raise InputError(CUT_OFF)
    return found


def _placed_meshes(document: Json) -> Iterator[tuple[int, Floats]]:
    """Meshes of the scene by number, with their matrices (4, 4); all meshes without a scene."""
    scenes = document.get("scenes", [])
    if not scenes:
        yield from ((k, np.eye(4)) for k in range(len(document.get("meshes", []))))
        return
    nodes = document.get("nodes", [])
    queue = [(k, np.eye(4)) for k in scenes[document.get("scene", 0)].get("nodes", [])]
    count = 0
    while queue:
        number, above = queue.pop(0)
        if (count := count + 1) > MOST_NODES:
            raise InputError(f"it has over {MOST_NODES} nodes, or they hold each other")
        node = nodes[number]
        matrix = above @ _matrix(node)
        if "mesh" in node:
            yield node["mesh"], np.eye(4) if "skin" in node else matrix
        queue += [(child, matrix) for child in node.get("children", [])]


def _matrix(node: Json) -> Floats:
    """From a node to the one above it (section 3.5.3): translation, rotation, scale."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    turn = Rotation.from_quat(node.get("rotation", (0, 0, 0, 1))).as_matrix()
    matrix[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix
