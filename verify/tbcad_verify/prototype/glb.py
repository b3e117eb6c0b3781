"""The GLB of an assembly, by a closed grammar: opaque or clear bodies, each at its place.

A viewer obeys what the triangles do not show: addresses of other files, extensions, animations,
scales of nodes, second scenes, emission. None of them has a use here, so whatever tbcad does not
write is refused by its name. Source: glTF 2.0, chapters 3 and 4.
"""

from __future__ import annotations

import json
import struct
from itertools import accumulate
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tbcad_verify.record.files import FileBytes
from tbcad_verify.record.validation import key_path, refuse_doubles
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats, Ints

MAGIC, VERSION, JSON, BINARY = b"glTF", 2, b"JSON", b"BIN\0"
# Metres, y up: the columns of what the root does to millimetres, z up.
UPRIGHT = [0.001, 0, 0, 0, 0, 0, -0.001, 0, 0, 0.001, 0, 0, 0, 0, 0, 1]
ASSET = {"version": "2.0", "generator": "https://github.com/mikedh/trimesh"}
GLOSS = {"roughnessFactor": 0.6, "metallicFactor": 0.1}
WHOLE, SINGLE = 5125, 5126  # types of components

Number = Annotated[int, Field(ge=0)]


class Closed(BaseModel):
    """An object without other keys."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class Accessor(Closed):
    """Numbers of one kind, all of a view."""

    componentType: Literal[5125, 5126]
    type: Literal["SCALAR", "VEC3"]
    byteOffset: Literal[0] = 0
    bufferView: Number
    count: Number
    max: list[float]
    min: list[float]


class BufferView(Closed):
    """A piece of the binary chunk."""

    buffer: Literal[0]
    byteOffset: Number
    byteLength: Number


class Primitive(Closed):
    """Triangles."""

    attributes: dict[Literal["POSITION"], Number]  # corners only, so that facets are flat
    indices: Number
    mode: Literal[4]
    material: Number


class GlbMesh(Closed):
    """One body."""

    name: str
    extras: dict[str, str] = Field({}, max_length=0)
    primitives: list[Primitive] = Field(min_length=1, max_length=1)


class Material(Closed):
    """How one body looks."""

    name: str
    pbrMetallicRoughness: dict[str, Any]  # colour as light, and gloss
    alphaMode: Literal["OPAQUE", "BLEND"]
    doubleSided: Literal[False]


class Node(Closed):
    """The root, a group, or a body; only the root is turned and scaled."""

    name: str
    matrix: list[float] = []
    children: list[Number] = []
    mesh: int = -1


class Document(Closed):
    """The JSON chunk."""

    asset: dict[str, str]
    scene: Literal[0]
    scenes: list[dict[str, list[int]]]
    nodes: list[Node] = Field(min_length=1)
    meshes: list[GlbMesh]
    materials: list[Material]
    accessors: list[Accessor]
    bufferViews: list[BufferView]
    buffers: list[dict[str, int]]


class DrawnBody(NamedTuple):
    """One body in the frame of the shell."""

    points: Floats  # (V, 3) mm
    faces: Ints  # (F, 3)
    colour: tuple[float, ...]  # red, green, blue as light, and opacity; 0 to 1


def read_glb(blob: FileBytes) -> dict[str, DrawnBody]:
    """Bodies by name. Unknown: it is no GLB, or has something that tbcad does not write."""
    try:
        text, binary = _chunks(blob.data.tobytes())
        document = Document.model_validate(json.loads(text, object_pairs_hook=refuse_doubles))
        return _bodies(document, binary)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise Unknown(f"{blob.name}: {key_path(first['loc'])}: {first['msg']}") from error
    except (ValueError, IndexError, struct.error) as error:
        raise Unknown(f"{blob.name}: no GLB of tbcad's ({error})") from error


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    magic, version, size, length, kind = struct.unpack_from("<4sIII4s", data)
    binary, other = struct.unpack_from("<I4s", data, 20 + length)
    if (magic, version, size, kind, other) != (MAGIC, VERSION, len(data), JSON, BINARY):
        raise ValueError("its head is another, or its size")
    if 28 + length + binary != len(data):
        raise ValueError("two chunks are allowed, JSON and binary")
    return data[20 : 20 + length], data[28 + length :]


def _bodies(document: Document, binary: bytes) -> dict[str, DrawnBody]:
    root, *others = document.nodes
    below = sorted(k for node in document.nodes for k in node.children)
    meshes = sorted(node.mesh for node in others if node.mesh >= 0)
    if root.matrix != UPRIGHT or any(node.matrix for node in others):
        raise ValueError("a node is moved or scaled; only the root is, to metres with y up")
    if below != list(range(1, len(document.nodes))) or meshes != list(range(len(document.meshes))):
        raise ValueError("each node must be in one group, and each mesh in one node")
    parts = [one for mesh in document.meshes for one in mesh.primitives]
    used = {k for one in parts for k in (one.indices, one.attributes["POSITION"])}
    if used != set(range(len(document.accessors))) or len(document.materials) != len(meshes):
        raise ValueError("an accessor or a material is no mesh's")
    lengths = [0, *accumulate(view.byteLength for view in document.bufferViews)]
    offsets = [*(view.byteOffset for view in document.bufferViews), len(binary)]
    if offsets != lengths or document.buffers != [{"byteLength": len(binary)}]:
        raise ValueError("the binary chunk must be its views, without gaps")
    if (document.asset, document.scenes) != (ASSET, [{"nodes": [0]}]):
        raise ValueError(f"asset or scenes are others than {ASSET} and one of all")
    return {node.name: _body(document, binary, node, k) for node in others if (k := node.mesh) >= 0}


def _body(document: Document, binary: bytes, node: Node, k: int) -> DrawnBody:
    mesh, (part,) = document.meshes[k], document.meshes[k].primitives
    material = document.materials[part.material]
    if len({node.name, mesh.name, material.name}) > 1 or node.children:
        raise ValueError(f"{node.name} has another mesh or material")
    faces = _numbers(document, binary, part.indices, WHOLE).reshape(-1, 3)
    points = _numbers(document, binary, part.attributes["POSITION"], SINGLE)
    colour = tuple(material.pbrMetallicRoughness.get("baseColorFactor", ()))
    if material.pbrMetallicRoughness != {"baseColorFactor": [*colour], **GLOSS}:
        raise ValueError(f"{node.name} has another gloss than {GLOSS}")
    if (material.alphaMode == "OPAQUE") != (colour[3] == 1):
        raise ValueError(f"{node.name} is {material.alphaMode} with opacity {colour[3]:g}")
    if len(faces) and faces.max() >= len(points):
        raise ValueError(f"{node.name} has facets without corners")
    return DrawnBody(points.astype(np.float64), faces.astype(np.int64), colour)


def _numbers(document: Document, binary: bytes, k: int, kind: int) -> Floats | Ints:
    """(N, 1) whole numbers or (N, 3) coordinates of an accessor, with the ends that it tells."""
    accessor, view = document.accessors[k], document.bufferViews[k]
    width, dtype = (1, "<u4") if kind == WHOLE else (3, "<f4")
    name = "SCALAR" if kind == WHOLE else "VEC3"
    told = accessor.componentType, accessor.type, accessor.bufferView, 4 * width * accessor.count
    if told != (kind, name, k, view.byteLength):
        raise ValueError(f"accessor {k} is another than that of a mesh")
    rows = np.frombuffer(binary, dtype, width * accessor.count, view.byteOffset).reshape(-1, width)
    ends = [accessor.min, accessor.max]
    if not np.isfinite(rows).all() or not np.array_equal(
        ends, [rows.min(axis=0), rows.max(axis=0)]
    ):
        raise ValueError(f"accessor {k} has other numbers than it tells")
    return rows
