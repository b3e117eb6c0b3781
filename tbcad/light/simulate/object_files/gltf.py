"""glTF 2.0 (Khronos, ISO/IEC 12113): .glb and .gltf; metres, y up.

Factors and vertex colours are light, pictures sRGB (3.9).
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.common.figure_files import srgb, srgb_light
from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import (
    AGAIN,
    BESIDE,
    Fault,
    ObjectFile,
    ObjectPart,
    even,
    texture,
    uri_bytes,
    without_facets,
)
from tbcad.light.simulate.object_files.finish import Finish, dielectric_f0
from tbcad.light.simulate.object_files.gltf_file import CUT_OFF, GltfFile, Json, finite
from tbcad.types import Bytes, Floats, Ints

MAGIC = b"glTF"
JSON_START = 20  # behind the header of the file and that of its first chunk
DRACO, GLOSSY = "KHR_draco_mesh_compression", "KHR_materials_pbrSpecularGlossiness"
UNLIT, IOR, SPECULAR = (f"KHR_materials_{name}" for name in ("unlit", "ior", "specular"))
TRANSFORM, WEBP = "KHR_texture_transform", "EXT_texture_webp"
TRIANGLES, FAN = 4, 6
OTHER_MODES = {0: "points", 1: "lines", 2: "lines", 3: "lines"}
LEFT_OUT = {
    "normalTexture": "its normal map is left out",
    "occlusionTexture": "its occlusion map is left out",
    "emissiveTexture": "light of its materials (emissive) is left out",
}
CLAMP, MIRRORED = 33071, 33648
FULL_UV = 1e-6
MOST_NODES = 100_000
READ = {DRACO, TRANSFORM, WEBP, "KHR_mesh_quantization"}
ONLY_LOOKS = "KHR_materials_"  # gloss, glass, cloth ...: of the surface, not of its colour
PNG = "textures as PNG"
REMEDY = {
    "EXT_meshopt_compression": "gltfpack without -c, or gltf-transform copy",
    "KHR_texture_basisu": f"gltf-transform with {PNG}",
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
        if (part := _primitive_part(file, primitive)) is not None
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


def _primitive_part(file: GltfFile, primitive: Json) -> ObjectPart | None:
    """The triangles of a primitive with their colours; None where it is points or lines."""
    mode = primitive.get("mode", TRIANGLES)
    if mode in OTHER_MODES:
        file.notes.append(f"its {OTHER_MODES[mode]} are left out")
        return None
    if DRACO in primitive.get("extensions", {}):
        attributes, index = _unpacked(file, primitive["extensions"][DRACO])
    else:
        attributes = {name: file.real(k) for name, k in primitive["attributes"].items()}
        index = file.numbers(primitive["indices"])[:, 0] if "indices" in primitive else None
    points = attributes["POSITION"][:, :3]
    index = np.arange(len(points)) if index is None else index.astype(np.int64)
    faces = _faces(index, mode)
    if len(faces) and faces.max() >= len(points):
        raise InputError("its facets name corners that do not exist: it is damaged")
    part = ObjectPart(points, faces, attributes.get("NORMAL"))
    part = _coloured(file, part, primitive.get("material"), attributes)
    part = replace(part, finish=_finish(file, primitive.get("material"), attributes, part))
    return part if part.normals is not None else part.flat()


def _faces(index: Ints, mode: int) -> Ints:
    if mode == TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    begin = np.arange(max(len(index) - 2, 0))
    corners = np.column_stack([0 * begin if mode == FAN else begin, begin + 1, begin + 2])
    if mode != FAN:  # of a strip each second facet is turned
        corners[1::2] = corners[1::2, ::-1]
    return index[corners]


def _unpacked(file: GltfFile, extension: Json) -> tuple[dict[str, Floats], Ints | None]:
    """Attributes and corners of a primitive that Draco compressed."""
    try:
        import DracoPy
    except ImportError:
        raise InputError(
            "it is compressed by Draco: pip install DracoPy, or export it without compression"
        ) from None
    mesh = DracoPy.decode(file.view(extension["bufferView"]))
    attributes = {}
    for name, identity in extension["attributes"].items():
        values = np.asarray(mesh.get_attribute_by_unique_id(identity)["data"])
        whole = name.startswith("COLOR") and values.dtype.kind == "u"
        share = float(np.iinfo(values.dtype).max) if whole else 1.0
        attributes[name] = values.reshape(len(mesh.points), -1).astype(np.float64) / share
    return attributes, np.asarray(mesh.faces, dtype=np.int64).ravel()


def _coloured(
    file: GltfFile, part: ObjectPart, number: int | None, attributes: dict[str, Floats]
) -> ObjectPart:
    """A part with the colours of a material and of its corners, multiplied."""
    material = file.material(number)
    factor, reference = _base(file, material)
    _note_left_out(file, material, factor)
    corner = attributes.get("COLOR_0")
    if corner is not None and not np.isfinite(corner).all():
        raise InputError("its vertex colours are not finite: repair the mesh")
    if corner is not None and corner.shape[1] > 3 and (corner[:, 3] < 1).any():
        file.notes.append("its transparency is left out")
    picture = None if reference is None else _picture(file, reference, factor[:3])
    if reference is not None and picture is not None:
        uv = _coordinates(file, reference, attributes, part)
        if uv is not None:
            shares = None if corner is None else srgb(corner[:, :3].clip(0, 1))[part.faces]
            source = f"texture {_source(file, reference)[1]}"
            return replace(part, uv=uv, picture=picture, colours=shares, source=source)
    if corner is not None:
        shares, source = srgb((corner[:, :3] * factor[:3]).clip(0, 1))[part.faces], "vertex colours"
    elif number is not None:
        shares = even(srgb(factor[:3].clip(0, 1)), len(part.faces))
        source = "colours of materials (baseColorFactor)"
    else:
        return part
    return replace(part, colours=shares, source=source)


def _base(file: GltfFile, material: Json) -> tuple[Floats, Json | None]:
    """Factor (4,), light, and the reference to a texture."""
    base, name = material.get("pbrMetallicRoughness", {}), "baseColor"
    glossy = material.get("extensions", {}).get(GLOSSY)
    if glossy is not None and "pbrMetallicRoughness" not in material:
        base, name = glossy, "diffuse"
    return file.factor(base, f"{name}Factor", (1, 1, 1, 1)), base.get(f"{name}Texture")


def _note_left_out(file: GltfFile, material: Json, factor: Floats) -> None:
    file.notes += [note for key, note in LEFT_OUT.items() if key in material]
    if (file.factor(material, "emissiveFactor", (0, 0, 0)) > 0).any():
        file.notes.append(LEFT_OUT["emissiveTexture"])
    mode = material.get("alphaMode", "OPAQUE")
    if mode == "MASK" or (mode != "OPAQUE" and factor[3] < 1):
        file.notes.append("its transparency is left out")


def _finish(
    file: GltfFile, number: int | None, attributes: dict[str, Floats], part: ObjectPart
) -> Finish | None:
    """How a part shines; what its material does not say is rough metal (3.9.2)."""
    material = file.material(number)
    more, facets = material.get("extensions", {}), len(part.faces)
    if number is None or UNLIT in more:
        return None
    base, old = material.get("pbrMetallicRoughness", {}), more.get(GLOSSY)
    if old is not None and not base:
        roughness = 1 - file.factor(old, "glossinessFactor", 1)
        return Finish.even(facets, roughness, 0.0, file.factor(old, "specularFactor", (1, 1, 1)))
    index, told = file.factor(more.get(IOR, {}), "ior", 1.5, np.inf), more.get(SPECULAR, {})
    if 0 < index < 1:  # 0: reflects as metals do
        file.notes.append(Fault(f"ior is {index:g}, allowed is 0, or 1 and more: {AGAIN}"))
    tint = file.factor(told, "specularColorFactor", (1, 1, 1), np.inf)
    shares = np.minimum(dielectric_f0(float(index)) * tint, 1)
    shares = shares * file.factor(told, "specularFactor", 1)
    map_of = _roughness_and_metal(file, base.get("metallicRoughnessTexture"), attributes, part)
    rough, metal = (file.factor(base, f"{name}Factor", 1) for name in ("roughness", "metallic"))
    return Finish.even(facets, rough * map_of[:, 0], metal * map_of[:, 1], shares)


def _roughness_and_metal(
    file: GltfFile, reference: Json | None, attributes: dict[str, Floats], part: ObjectPart
) -> Floats:
    """What a map says at the middle of each facet, (f, 2): its green and its blue; 1 without."""
    picture = None if reference is None else _picture(file, reference, np.ones(3))
    uv = None if picture is None else _coordinates(file, reference or {}, attributes, part)
    if picture is None or uv is None:
        return np.ones((len(part.faces), 2))
    size = np.array(picture.shape[1::-1])
    column, row = (np.floor(uv.mean(axis=1) * [1, -1] % 1 * size).astype(int) % size).T
    return np.asarray(picture[row, column, 1:] / 255)


def _picture(file: GltfFile, reference: Json, factor: Floats) -> Bytes | None:
    """A picture times a factor, both of light."""
    key = (reference["index"], *factor.tolist())
    if key not in file.pictures:
        found = _image(file, reference)
        if found is not None and (factor != 1).any():
            light = srgb_light(np.arange(256) / 255)[:, None] * factor
            curve = np.rint(255 * srgb(light.clip(0, 1))).astype(np.uint8)
            found = np.stack([curve[found[..., k], k] for k in range(3)], axis=-1)
        file.pictures[key] = found
    return file.pictures[key]


def _source(file: GltfFile, reference: Json) -> tuple[Json | None, str]:
    """The image of a texture, None where it is of a kind that is not read, and its name."""
    found = file.document["textures"][reference["index"]]
    number = found.get("extensions", {}).get(WEBP, {}).get("source", found.get("source"))
    image = None if number is None else file.document["images"][number]
    uri = (image or {}).get("uri", "data:")
    inside = (image or {}).get("name", "in the file")
    return image, str(inside if uri.startswith("data:") else uri)


def _image(file: GltfFile, reference: Json) -> Bytes | None:
    image, name = _source(file, reference)
    if image is None:
        kind = f"a texture of it is of a kind that is not read: write it with {PNG}"
        file.notes.append(Fault(kind))
        return None
    try:
        inside = "bufferView" in image
        data = file.view(image["bufferView"]) if inside else uri_bytes(file.path, image["uri"])
    except InputError as error:
        file.notes.append(Fault(f"its texture {error}: {BESIDE}"))
        return None
    return texture(data, name, file.notes)


def _coordinates(
    file: GltfFile, reference: Json, attributes: dict[str, Floats], part: ObjectPart
) -> Floats | None:
    """Places (f, 3, 2) on a picture, from its lower left, moved as KHR_texture_transform says."""
    transform = reference.get("extensions", {}).get(TRANSFORM, {})
    number = transform.get("texCoord", reference.get("texCoord", 0))
    given = attributes.get(f"TEXCOORD_{number}")
    if given is None:
        file.notes.append(Fault(f"it names a texture, but has no texture coordinates: {AGAIN}"))
        return None
    turn = finite(transform, "rotation", 0.0)
    cosine, sine = np.cos(turn), np.sin(turn)
    scaled = given * finite(transform, "scale", (1, 1))
    uv = scaled @ np.array([[cosine, -sine], [sine, cosine]])
    uv += finite(transform, "offset", (0, 0))
    sampler = file.document["textures"][reference["index"]].get("sampler")
    if sampler is not None and not ((uv >= -FULL_UV) & (uv <= 1 + FULL_UV)).all():
        modes = file.document["samplers"][sampler]
        if {modes.get("wrapS"), modes.get("wrapT")} & {CLAMP, MIRRORED}:
            file.notes.append("a texture that is clamped or mirrored beyond its edge repeats")
    return np.column_stack([uv[:, 0], 1 - uv[:, 1]])[part.faces]
