"""The GLB of an assembly, by a closed grammar: opaque or clear bodies, each at its place.

A viewer obeys what the triangles do not show: addresses of other files, extensions, animations,
scales of nodes, second scenes, emission. None of them has a use here. So names, colours, numbers
and groups are read, and the only document that tbcad writes of them must be the one that is there.
Source: glTF 2.0, chapters 3 and 4.
"""

from __future__ import annotations

import json
import struct
from typing import Any, NamedTuple

import numpy as np

from tbcad_verify.record.files import FileBytes
from tbcad_verify.record.validation import refuse_doubles, shown
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats, Ints

MAGIC, VERSION, JSON, BINARY = b"glTF", 2, b"JSON", b"BIN\0"
# Metres, y up: the columns of what the root does to millimetres, z up.
UPRIGHT = [0.001, 0.0, 0.0, 0.0, 0.0, 0.0, -0.001, 0.0, 0.0, 0.001, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
ASSET = {"version": "2.0", "generator": "https://github.com/mikedh/trimesh"}
GLOSS = {"roughnessFactor": 0.6, "metallicFactor": 0.1}
# By type of an accessor: its numbers, how many there are of a corner, and further keys.
KINDS: dict[str, tuple[str, int, dict[str, int]]] = {
    "SCALAR": ("<u4", 1, {"componentType": 5125}),
    "VEC3": ("<f4", 3, {"componentType": 5126, "byteOffset": 0}),
}
NOTHING = object()


class DrawnBody(NamedTuple):
    """One body in the frame of the shell."""

    points: Floats  # (V, 3) mm
    faces: Ints  # (F, 3)
    colour: tuple[float, ...]  # red, green, blue as light, and opacity; 0 to 1


def read_glb(blob: FileBytes) -> dict[str, DrawnBody]:
    """Bodies by name. Unknown: it is no GLB, or has something that tbcad does not write."""
    try:
        text, binary = _chunks(blob.data.tobytes())
        document = json.loads(text, object_pairs_hook=refuse_doubles)
        expected, bodies = _written(document, binary)
    except (ValueError, LookupError, TypeError, struct.error) as error:
        raise Unknown(f"{blob.name}: no GLB of tbcad's ({error!r})") from error
    if other := _difference(document, expected):
        raise Unknown(f"{blob.name}: {other}")
    return bodies


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    magic, version, size, length, kind = struct.unpack_from("<4sIII4s", data)
    binary, other = struct.unpack_from("<I4s", data, 20 + length)
    if (magic, version, size, kind, other) != (MAGIC, VERSION, len(data), JSON, BINARY):
        raise ValueError("its head is another, or its size")
    if 28 + length + binary != len(data):
        raise ValueError("two chunks are allowed, JSON and binary")
    return data[20 : 20 + length], data[28 + length :]


def _written(given: Any, binary: bytes) -> tuple[dict[str, Any], dict[str, DrawnBody]]:
    """Names, groups, colours and numbers of a document in the form of tbcad; its bodies.

    ValueError, LookupError, TypeError: they are none, or not those of bodies.
    """
    root, *others = given["nodes"]
    drawn = sorted((one for one in others if "mesh" in one), key=lambda one: int(one["mesh"]))
    below = sorted(k for one in given["nodes"] for k in one.get("children", ()))
    numbers = [one["mesh"] for one in drawn], list(range(len(given["meshes"])))
    if below != list(range(1, 1 + len(others))) or numbers[0] != numbers[1]:
        raise ValueError("each node must be in one group, and each mesh in one node")
    if not all(isinstance(one["name"], str) for one in given["nodes"]):
        raise ValueError("a node has no name")
    arrays, accessors, views, start = list[Floats | Ints](), [], [], 0
    for k, one in enumerate(given["accessors"]):
        dtype, width, keys = KINDS[one["type"]]
        rows = np.frombuffer(binary, dtype, width * one["count"], start).reshape(-1, width)
        if not np.isfinite(rows).all():
            raise ValueError(f"accessor {k} has numbers that are not finite")
        ends = {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        accessors.append({"type": one["type"], "bufferView": k, "count": len(rows), **keys, **ends})
        views.append({"buffer": 0, "byteOffset": start, "byteLength": rows.nbytes})
        arrays.append(rows)
        start += rows.nbytes
    meshes, materials, bodies, used = [], [], dict[str, DrawnBody](), set[int]()
    for k, node in enumerate(drawn):
        name, part = node["name"], given["meshes"][k]["primitives"][0]
        corners, indices = part["attributes"]["POSITION"], part["indices"]
        used |= {corners, indices}
        points, faces = arrays[corners], arrays[indices].reshape(-1, 3)
        if points.shape[1] != 3 or faces.max(initial=0) >= len(points):
            raise ValueError(f"{name} has facets without corners")
        colour = [
            float(x) for x in given["materials"][k]["pbrMetallicRoughness"]["baseColorFactor"]
        ]
        primitive = {"attributes": {"POSITION": corners}, "indices": indices, "mode": 4}
        meshes.append({"name": name, "extras": {}, "primitives": [{**primitive, "material": k}]})
        look = {"baseColorFactor": colour, **GLOSS}
        alpha = {"alphaMode": "OPAQUE" if colour[3] == 1 else "BLEND", "doubleSided": False}
        materials.append({"name": name, "pbrMetallicRoughness": look, **alpha})
        points, faces = points.astype(np.float64), faces.astype(np.int64)
        bodies[name] = DrawnBody(points, faces, tuple(colour))
    if used != set(range(len(arrays))) or len(bodies) != len(drawn):
        raise ValueError("an accessor is no mesh's, or a name is there twice")
    expected = {
        "asset": ASSET,
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": root["name"], "children": root["children"], "matrix": UPRIGHT},
            *({key: one[key] for key in ("name", _below(one))} for one in others),
        ],
        "meshes": meshes,
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    if start != len(binary):
        raise ValueError("the binary chunk must be its views, without gaps")
    return expected, bodies


def _below(node: Any) -> str:
    return "mesh" if "mesh" in node else "children"


def _difference(given: Any, allowed: Any, path: str = "") -> str:
    """Where two JSON values differ first, and how; empty where they do not."""
    if isinstance(given, dict) and isinstance(allowed, dict):
        pairs = [
            (key, given.get(key, NOTHING), allowed.get(key, NOTHING)) for key in given | allowed
        ]
    elif isinstance(given, list) and isinstance(allowed, list) and len(given) == len(allowed):
        pairs = [(str(k), *pair) for k, pair in enumerate(zip(given, allowed, strict=True))]
    elif type(given) is type(allowed) and given == allowed:
        return ""
    else:
        told = ["none" if one is NOTHING else shown(one) for one in (given, allowed)]
        return f"{path} is {told[0]}, allowed is {told[1]}"
    inner = (_difference(one, two, f"{path}.{key}".strip(".")) for key, one, two in pairs)
    return next(filter(None, inner), "")
