"""Roughness, metal and reflectance of materials, as glTF and MTL define them."""

import json
import re
from base64 import b64encode
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.finish import Finish, phong_finish
from tbcad.light.simulate.object_files.read import read_object_file
from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_object

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype="<f4") / 100
PLACES = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype="<f4")
INDEX = np.array([0, 1, 2, 0, 2, 3], dtype="<u2")


def data_uri(data: bytes) -> str:
    return "data:;base64," + b64encode(data).decode()


def gltf(folder: Path, *materials: dict[str, Any], **more: Any) -> Path:
    """A square of two facets for each material."""
    data = CORNERS.tobytes() + PLACES.tobytes() + INDEX.tobytes()
    views = [(0, 48), (48, 32), (80, 12)]
    kinds = [(5126, 4, "VEC3"), (5126, 4, "VEC2"), (5123, 6, "SCALAR")]
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data), "uri": data_uri(data)}],
        "bufferViews": [{"buffer": 0, "byteOffset": a, "byteLength": b} for a, b in views],
        "accessors": [
            {"bufferView": k, "componentType": t, "count": n, "type": w}
            for k, (t, n, w) in enumerate(kinds)
        ],
        "materials": materials,
        "meshes": [
            {"primitives": [{"attributes": attributes, "indices": 2, "material": k}]}
            for k in range(len(materials))
        ],
        **more,
    }
    path = folder / "square.gltf"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def finish_of(path: Path) -> list[Finish | None]:
    return [part.finish for part in read_object_file(path).parts]


def pbr(**factors: Any) -> dict[str, Any]:
    return {"pbrMetallicRoughness": factors}


@pytest.mark.parametrize(
    ("material", "roughness", "metal", "f0"),
    [
        (pbr(roughnessFactor=0.3, metallicFactor=0), 0.3, 0, 0.04),
        (pbr(roughnessFactor=0.2), 0.2, 1, 0.04),
        ({}, 1, 1, 0.04),  # what is not said is 1
        (pbr(roughnessFactor=0.0, metallicFactor=0.25), 0.05, 0.25, 0.04),
        (pbr(metallicFactor=0) | {"extensions": {"KHR_materials_ior": {"ior": 2.0}}}, 1, 0, 1 / 9),
        (
            pbr(metallicFactor=0)
            | {"extensions": {"KHR_materials_specular": {"specularFactor": 0.5}}},
            *(1, 0, 0.02),
        ),
    ],
)
def test_gltf(
    tmp_path: Path, material: dict[str, Any], roughness: float, metal: float, f0: float
) -> None:
    (finish,) = finish_of(gltf(tmp_path, material))
    assert finish is not None
    assert finish.roughness == pytest.approx(np.full(2, roughness))
    assert finish.metal == pytest.approx(np.full(2, metal))
    assert finish.f0 == pytest.approx(np.full((2, 3), f0))


def test_unlit_is_matt(tmp_path: Path) -> None:
    assert finish_of(gltf(tmp_path, {"extensions": {"KHR_materials_unlit": {}}})) == [None]


def test_a_map_is_read_at_the_middle_of_each_facet(tmp_path: Path) -> None:
    """Left half rough, right half metal: facets' middles are at 2/3 and 1/3 of the width."""
    picture = np.zeros((8, 8, 3), dtype=np.uint8)
    picture[:, :4, 1], picture[:, 4:, 1], picture[:, 4:, 2] = 255, 51, 255
    file = BytesIO()
    Image.fromarray(picture).save(file, "png")
    image = [{"uri": data_uri(file.getvalue()), "mimeType": "image/png"}]
    textured = pbr(metallicRoughnessTexture={"index": 0}, roughnessFactor=0.5)
    path = gltf(tmp_path, textured, images=image, textures=[{"source": 0}])
    (finish,) = finish_of(path)
    assert finish is not None
    assert finish.roughness == pytest.approx([0.1, 0.5])
    assert finish.metal.tolist() == [1, 0]


def obj(folder: Path, material: str) -> Path:
    (folder / "m.mtl").write_text(f"newmtl one\nKd 0.5 0.4 0.3\n{material}\n", encoding="utf-8")
    lines = "mtllib m.mtl\nv 0 0 0\nv 9 0 0\nv 0 9 0\nusemtl one\nf 1 2 3\n"
    path = folder / "one.obj"
    path.write_text(lines, encoding="utf-8")
    return path


def test_mtl_by_phong(tmp_path: Path) -> None:
    """Height and width of the highlight are those of Ks (H N)^Ns."""
    (finish,) = finish_of(obj(tmp_path, "Ks 0.5 0.5 0.25\nNs 98\nillum 2"))
    assert finish is not None
    alpha2 = finish.roughness[0] ** 4
    assert alpha2 == pytest.approx(0.02)
    assert finish.f0[0] / (4 * alpha2) == pytest.approx([0.5, 0.5, 0.25])
    # Near the middle (H N)^98 and GGX fall alike: 1 - 49 t^2 and 1 - 2 t^2 / alpha^2.
    t = 0.01
    ggx = alpha2**2 / (np.cos(t) ** 2 * (alpha2 - 1) + 1) ** 2
    assert 1 - ggx == pytest.approx(2 * (1 - np.cos(t) ** 98), rel=0.02)


@pytest.mark.parametrize(
    "material", ["Ks 0.5 0.5 0.5", "Ks 0 0 0\nNs 50", "Ks 1 1 1\nNs 9\nillum 1"]
)
def test_mtl_without_highlights_is_matt(tmp_path: Path, material: str) -> None:
    assert finish_of(obj(tmp_path, material)) == [None]


def test_mtl_by_roughness(tmp_path: Path) -> None:
    (finish,) = finish_of(obj(tmp_path, "Ks 1 1 1\nNs 50\nPr 0.4\nPm 1"))
    assert finish is not None
    assert (finish.roughness.tolist(), finish.metal.tolist()) == ([0.4], [1.0])


def test_what_is_told(tmp_path: Path) -> None:
    """The line that a user reads, also with a part that is matt."""
    lines = list[str]()
    path = gltf(tmp_path, pbr(roughnessFactor=0.2), {"extensions": {"KHR_materials_unlit": {}}})
    found = load_object(path, 60.0, ObjectOptions(fit=True), lines.append)
    assert found.finish is not None
    assert lines[0].endswith("gloss in real optics: roughness 0.2, 50% metal, 50% matt")
    assert load_object(path, 60.0, ObjectOptions(fit=True, paint="plain")).finish is None
    assert phong_finish(1, 1e9, [1, 1, 1]).roughness == pytest.approx([0.05])


@pytest.mark.parametrize(
    ("f0", "lines"), [(1 / 9, "Ni 2"), (0.04, "Ni 1.0"), (0.04, "Ni 0"), (0.04, "")]
)
def test_mtl_by_index(tmp_path: Path, f0: float, lines: str) -> None:
    (finish,) = finish_of(obj(tmp_path, f"Pr 0.4 # rough\nd -halo 1\n{lines}"))
    assert finish is not None
    assert finish.f0 == pytest.approx(np.full((1, 3), f0))


@pytest.mark.parametrize(
    ("line", "allowed"),
    [
        *((f"{key} {text}", "0 to 1") for key in ("Pr", "Pm", "d") for text in ("nan", "-0.1", "")),
        *((f"{key} {text}", "0 to 1 or three") for key in ("Kd", "Ks")
          for text in ("1 x 1", "2", "1 1", "0.5 inf 0", "spectral a.rfl")),
        *((f"Ns {text}", "of 0 or more") for text in ("many", "-1", "inf", "1 2", "1e999")),
        ("Ni -1.5", "0 to 10"),
        ("illum two", "0 to 10"),
        ("Ke 1 1", "of 0 or more or three"),
        ("Tr 1.5", "0 to 1"),
    ],
)  # fmt: skip
def test_numbers_of_mtl_that_cannot_be(tmp_path: Path, line: str, allowed: str) -> None:
    """Refused by their place, unless its colours are not asked for."""
    path, (word, _, text) = obj(tmp_path, line), line.partition(" ")
    refused = rf"m.mtl, line 3: {word} is {re.escape(text)}, allowed is a number .*{allowed}: mend"
    with pytest.raises(InputError, match=refused) as error:
        load_object(path, 60.0, ObjectOptions(fit=True))
    assert "\n" not in str(error.value)
    assert load_object(path, 60.0, ObjectOptions(fit=True, paint="plain")).finish is None


def extended(name: str, **values: Any) -> dict[str, Any]:
    return pbr() | {"extensions": {f"KHR_materials_{name}": values}}


@pytest.mark.parametrize(
    ("material", "said"),
    [
        (pbr(roughnessFactor=-0.3), "roughnessFactor is -0.3, allowed is a number from 0 to 1"),
        (pbr(roughnessFactor="0.5"), "roughnessFactor is 0.5"),
        (pbr(roughnessFactor=True), "roughnessFactor is True"),
        (pbr(metallicFactor=float("nan")), "metallicFactor is nan"),
        (pbr(metallicFactor=float("inf")), "metallicFactor is inf"),
        (pbr(baseColorFactor=[1, 1, 1.5, 1]), "baseColorFactor .* from 0 to 1, 4 times"),
        (pbr(baseColorFactor=[1, 1, 1]), "baseColorFactor"),
        (pbr(baseColorFactor=None), "baseColorFactor is None"),
        ({"emissiveFactor": [0, 0, -1]}, "emissiveFactor"),
        (extended("ior", ior=-1), "ior is -1"),
        (extended("ior", ior=0.5), "ior is 0.5, allowed is 0, or 1 and more"),
        (extended("specular", specularFactor=2), "specularFactor is 2"),
        (extended("specular", specularColorFactor=[1, float("nan"), 1]), "specularColorFactor"),
        (
            {"extensions": {"KHR_materials_pbrSpecularGlossiness": {"glossinessFactor": 1.2}}},
            "glossinessFactor is 1.2",
        ),
        (pbr(metallicRoughnessTexture={"index": 0}), "lost.png is not in .*: put it there"),
        (pbr(baseColorTexture={"index": 0}), "lost.png is not in the folder"),
    ],
)
def test_factors_of_gltf_that_cannot_be(
    tmp_path: Path, material: dict[str, Any], said: str
) -> None:
    lost = {"images": [{"uri": "lost.png"}], "textures": [{"source": 0}]}
    with pytest.raises(InputError, match=said) as error:
        load_object(gltf(tmp_path, material, **lost), 60.0, ObjectOptions(fit=True))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("number", [-1, 1])
def test_materials_of_gltf_that_are_not_there(tmp_path: Path, number: int) -> None:
    path = gltf(tmp_path, pbr())
    path.write_text(path.read_text().replace('"material": 0', f'"material": {number}'))
    with pytest.raises(InputError, match=f"names material {number}, which it does not have"):
        read_object_file(path)
