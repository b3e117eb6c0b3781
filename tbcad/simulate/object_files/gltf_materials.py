"""Colours of glTF (ISO/IEC 12113, section 3.9): factors are light, pictures are sRGB."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.simulate.object_files.beside import texture, uri_bytes
from tbcad.simulate.object_files.contents import Part, even
from tbcad.simulate.object_files.gltf_geometry import Accessors
from tbcad.srgb import srgb, srgb_light
from tbcad.types import Bytes, Floats

GLOSSY = "KHR_materials_pbrSpecularGlossiness"
TRANSFORM, WEBP = "KHR_texture_transform", "EXT_texture_webp"
LEFT_OUT = {
    "normalTexture": "its normal map is left out",
    "occlusionTexture": "its occlusion map is left out",
    "emissiveTexture": "light of its materials (emissive) is left out",
}
CLAMP, MIRRORED = 33071, 33648
FULL_UV = 1e-6


class Materials:
    """The materials of a document, with their pictures as they are asked for."""

    def __init__(
        self, path: Path, document: dict[str, Any], accessors: Accessors, notes: list[str]
    ) -> None:
        """Keep what tells the colours; notes are added to."""
        self._path, self._document = path, document
        self._accessors, self._notes = accessors, notes
        self._pictures = dict[Any, Bytes | None]()

    def coloured(self, part: Part, number: int | None, attributes: dict[str, Floats]) -> Part:
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
        self, reference: dict[str, Any], attributes: dict[str, Floats], part: Part
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
