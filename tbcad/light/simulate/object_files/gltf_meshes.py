"""Triangles and colours of glTF (ISO/IEC 12113, 3.6 to 3.9): factors are light, pictures sRGB."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.common.colours import srgb, srgb_light
from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import ObjectPart, even, texture, uri_bytes
from tbcad.types import Bytes, Floats, Ints

DRACO = "KHR_draco_mesh_compression"
TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
TRIANGLES, STRIP, FAN = 4, 5, 6
OTHER_MODES = {0: "points", 1: "lines", 2: "lines", 3: "lines"}
Values = NDArray[Any]
GLOSSY = "KHR_materials_pbrSpecularGlossiness"
TRANSFORM, WEBP = "KHR_texture_transform", "EXT_texture_webp"
LEFT_OUT = {
    "normalTexture": "its normal map is left out",
    "occlusionTexture": "its occlusion map is left out",
    "emissiveTexture": "light of its materials (emissive) is left out",
}
CLAMP, MIRRORED = 33071, 33648
FULL_UV = 1e-6


class Accessors:
    """Tables of numbers in the buffers of a document."""

    def __init__(self, document: dict[str, Any], buffers: list[bytes]) -> None:
        """Keep both; tables are read when they are asked for."""
        self._document, self._buffers = document, buffers

    def view(self, number: int) -> bytes:
        """The bytes of a buffer view."""
        view = self._document["bufferViews"][number]
        start = view.get("byteOffset", 0)
        data: bytes = self._buffers[view["buffer"]][start : start + view["byteLength"]]
        if len(data) < view["byteLength"]:
            raise InputError("one of its buffers is cut off: copy it again")
        return data

    def numbers(self, number: int) -> Values:
        """A table (n, width) as it is stored."""
        accessor = self._document["accessors"][number]
        count, width = int(accessor["count"]), WIDTHS[accessor["type"]]
        kind = np.dtype("<" + TYPES[accessor["componentType"]])
        if "bufferView" in accessor:
            found = self._table(accessor["bufferView"], accessor.get("byteOffset", 0), kind,
                                count, width)  # fmt: skip
        else:
            found = np.zeros((count, width), dtype=kind)
        if "sparse" in accessor:
            found = self._replaced(found.copy(), accessor["sparse"])
        return found

    def real(self, number: int) -> Floats:
        """A table (n, width); whole numbers that are normalized become 0 to 1, or -1 to 1."""
        found = self.numbers(number)
        accessor = self._document["accessors"][number]
        if accessor.get("normalized") and found.dtype.kind in "iu":
            return np.maximum(found / np.iinfo(found.dtype).max, -1.0)
        return found.astype(np.float64)

    def _table(self, view: int, offset: int, kind: np.dtype[Any], count: int, width: int) -> Values:
        data = self.view(view)
        step = self._document["bufferViews"][view].get("byteStride", 0) or width * kind.itemsize
        if offset + max(count - 1, 0) * step + width * kind.itemsize * (count > 0) > len(data):
            raise InputError("one of its buffers is cut off: copy it again")
        if count == 0:
            return np.zeros((0, width), dtype=kind)
        strides = (step, kind.itemsize)
        return np.ndarray((count, width), kind, data, offset, strides)

    def _replaced(self, values: Values, sparse: dict[str, Any]) -> Values:
        count, where, what = sparse["count"], sparse["indices"], sparse["values"]
        kind = np.dtype("<" + TYPES[where["componentType"]])
        rows = self._table(where["bufferView"], where.get("byteOffset", 0), kind, count, 1)
        values[rows[:, 0]] = self._table(
            what["bufferView"], what.get("byteOffset", 0), values.dtype, count, values.shape[1]
        )
        return values


def primitive_part(
    primitive: dict[str, Any], accessors: Accessors, materials: "Materials", notes: list[str]
) -> ObjectPart | None:
    """The triangles of a primitive with their colours; None where it is points or lines."""
    mode = primitive.get("mode", TRIANGLES)
    if mode in OTHER_MODES:
        notes.append(f"its {OTHER_MODES[mode]} are left out")
        return None
    if DRACO in primitive.get("extensions", {}):
        attributes, index = _unpacked(primitive["extensions"][DRACO], accessors)
    else:
        attributes = {name: accessors.real(k) for name, k in primitive["attributes"].items()}
        index = accessors.numbers(primitive["indices"])[:, 0] if "indices" in primitive else None
    points = attributes["POSITION"][:, :3]
    index = np.arange(len(points)) if index is None else index.astype(np.int64)
    faces = _faces(index, mode)
    if len(faces) and faces.max() >= len(points):
        raise InputError("its facets name corners that do not exist: it is damaged")
    part = ObjectPart(points, faces, attributes.get("NORMAL"))
    part = materials.coloured(part, primitive.get("material"), attributes)
    return part if part.normals is not None else part.flat()


def _faces(index: Ints, mode: int) -> Ints:
    if mode == TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    if len(index) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    if mode == FAN:
        first = np.broadcast_to(index[0], len(index) - 2)
        return np.column_stack([first, index[1:-1], index[2:]])
    faces = np.column_stack([index[:-2], index[1:-1], index[2:]])
    faces[1::2] = faces[1::2, ::-1]
    return faces


def _unpacked(
    extension: dict[str, Any], accessors: Accessors
) -> tuple[dict[str, Floats], Ints | None]:
    """Attributes and corners of a primitive that Draco compressed."""
    try:
        import DracoPy
    except ImportError:
        raise InputError(
            "it is compressed by Draco: pip install DracoPy, or export it without compression"
        ) from None
    mesh = DracoPy.decode(accessors.view(extension["bufferView"]))
    attributes = {}
    for name, identity in extension["attributes"].items():
        values = np.asarray(mesh.get_attribute_by_unique_id(identity)["data"])
        share = 1.0
        if name.startswith("COLOR") and values.dtype.kind == "u":
            share = float(np.iinfo(values.dtype).max)
        attributes[name] = values.reshape(len(mesh.points), -1).astype(np.float64) / share
    return attributes, np.asarray(mesh.faces, dtype=np.int64).ravel()


class Materials:
    """The materials of a document, with their pictures as they are asked for."""

    def __init__(
        self, path: Path, document: dict[str, Any], accessors: Accessors, notes: list[str]
    ) -> None:
        """Keep what tells the colours; notes are added to."""
        self._path, self._document = path, document
        self._accessors, self._notes = accessors, notes
        self._pictures = dict[Any, Bytes | None]()

    def coloured(
        self, part: ObjectPart, number: int | None, attributes: dict[str, Floats]
    ) -> ObjectPart:
        """A part with the colours of a material and of its corners, multiplied."""
        material = {} if number is None else self._document["materials"][number]
        factor, texture_of = self._base(material)
        self._note_left_out(material, factor)
        corner = attributes.get("COLOR_0")
        if corner is not None and corner.shape[1] > 3 and (corner[:, 3] < 1).any():
            self._notes.append("its transparency is left out")
        picture = None if texture_of is None else self._picture(texture_of, factor[:3])
        if picture is not None and texture_of is not None:
            uv = self._coordinates(texture_of, attributes, part)
            if uv is not None:
                shares = None if corner is None else srgb(corner[:, :3].clip(0, 1))[part.faces]
                name = self._image_name(texture_of)
                return replace(part, uv=uv, picture=picture, colours=shares,
                               source=f"texture {name}")  # fmt: skip
        if corner is not None:
            shares = srgb((corner[:, :3] * factor[:3]).clip(0, 1))[part.faces]
            return replace(part, colours=shares, source="vertex colours")
        if number is None:
            return part
        shares = even(srgb(factor[:3].clip(0, 1)), len(part.faces))
        return replace(part, colours=shares, source="colours of materials (baseColorFactor)")

    def _base(self, material: dict[str, Any]) -> tuple[Floats, dict[str, Any] | None]:
        """Factor (4,), light, and the reference to a texture."""
        glossy = material.get("extensions", {}).get(GLOSSY)
        if glossy is not None and "pbrMetallicRoughness" not in material:
            factor, found = glossy.get("diffuseFactor"), glossy.get("diffuseTexture")
        else:
            base = material.get("pbrMetallicRoughness", {})
            factor, found = base.get("baseColorFactor"), base.get("baseColorTexture")
        return np.array(factor or (1, 1, 1, 1), dtype=np.float64), found

    def _note_left_out(self, material: dict[str, Any], factor: Floats) -> None:
        self._notes += [note for key, note in LEFT_OUT.items() if key in material]
        if any(value > 0 for value in material.get("emissiveFactor", ())):
            self._notes.append(LEFT_OUT["emissiveTexture"])
        if "metallicRoughnessTexture" in material.get("pbrMetallicRoughness", {}):
            self._notes.append("its metallic and roughness map is left out: it is matt")
        if material.get("alphaMode", "OPAQUE") != "OPAQUE" and (
            factor[3] < 1 or material["alphaMode"] == "MASK"
        ):
            self._notes.append("its transparency is left out")

    def _picture(self, reference: dict[str, Any], factor: Floats) -> Bytes | None:
        """A picture times a factor, both of light."""
        key = (reference["index"], *factor.tolist())
        if key not in self._pictures:
            found = self._image(reference)
            if found is not None and (factor != 1).any():
                light = srgb_light(np.arange(256) / 255)[:, None] * factor
                curve = np.rint(255 * srgb(light.clip(0, 1))).astype(np.uint8)
                found = np.stack([curve[found[..., k], k] for k in range(3)], axis=-1)
            self._pictures[key] = found
        return self._pictures[key]

    def _source(self, reference: dict[str, Any]) -> dict[str, Any] | None:
        found = self._document["textures"][reference["index"]]
        number = found.get("extensions", {}).get(WEBP, {}).get("source", found.get("source"))
        return None if number is None else self._document["images"][number]

    def _image_name(self, reference: dict[str, Any]) -> str:
        image = self._source(reference) or {}
        uri = image.get("uri", "data:")
        return str(image.get("name", "in the file") if uri.startswith("data:") else uri)

    def _image(self, reference: dict[str, Any]) -> Bytes | None:
        image, name = self._source(reference), self._image_name(reference)
        if image is None:
            self._notes.append("one of its textures is of a kind that is not read")
            return None
        try:
            if "bufferView" in image:
                data = self._accessors.view(image["bufferView"])
            else:
                data = uri_bytes(self._path, image["uri"])
        except InputError as error:
            self._notes.append(f"its texture {error}")
            return None
        return texture(data, name, self._notes)

    def _coordinates(
        self, reference: dict[str, Any], attributes: dict[str, Floats], part: ObjectPart
    ) -> Floats | None:
        """Places (f, 3, 2) on a picture, from its lower left."""
        transform = reference.get("extensions", {}).get(TRANSFORM, {})
        number = transform.get("texCoord", reference.get("texCoord", 0))
        uv = attributes.get(f"TEXCOORD_{number}")
        if uv is None:
            self._notes.append("it names a texture, but has no texture coordinates")
            return None
        placed = _transformed(uv, transform)
        self._note_wrapping(reference, placed)
        return np.column_stack([placed[:, 0], 1 - placed[:, 1]])[part.faces]

    def _note_wrapping(self, reference: dict[str, Any], uv: Floats) -> None:
        sampler = self._document["textures"][reference["index"]].get("sampler")
        if sampler is None or ((uv >= -FULL_UV) & (uv <= 1 + FULL_UV)).all():
            return
        modes = self._document["samplers"][sampler]
        if {modes.get("wrapS"), modes.get("wrapT")} & {CLAMP, MIRRORED}:
            self._notes.append("a texture that is clamped or mirrored beyond its edge repeats")


def _transformed(uv: Floats, transform: dict[str, Any]) -> Floats:
    """Coordinates (v, 2) scaled, turned and moved, as KHR_texture_transform says."""
    turn = float(transform.get("rotation", 0.0))
    scaled = uv * np.array(transform.get("scale", (1, 1)), dtype=np.float64)
    turned = np.column_stack([
        np.cos(turn) * scaled[:, 0] + np.sin(turn) * scaled[:, 1],
        np.cos(turn) * scaled[:, 1] - np.sin(turn) * scaled[:, 0],
    ])  # fmt: skip
    return turned + np.array(transform.get("offset", (0, 0)), dtype=np.float64)
