"""glTF and 3MF files: against trimesh, tbcad's own writers, and files written by hand."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial import cKDTree

from tbcad.cad.formats.glb import ColouredMesh, write_glb
from tbcad.cad.formats.mesh_files import write_3mf
from tbcad.cad.kernel.mesh import Mesh
from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import ObjectFile
from tbcad.light.simulate.object_files.gltf import read_gltf
from tbcad.light.simulate.object_files.read import read_3mf
from tbcad.light.simulate.scene.object_from_file import load_object

# sRGB's code of light 0.5 and 0.2, by the standard's table.
HALF, FIFTH = 0.735357, 0.484529
CORE = "http://schemas.microsoft.com/3dmanufacturing"
MESH = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="2" y="0" z="0"/>'
    '<vertex x="2" y="2" z="0"/><vertex x="0" y="2" z="0"/></vertices><triangles>'
    '<triangle v1="0" v2="1" v3="2" {}/><triangle v1="0" v2="2" v3="3"/></triangles></mesh>'
)


GREEN, MIXED = 'pid="1" p1="1"', 'pid="1" p1="0" p2="1" p3="0"'


def square(size: float = 0.01) -> trimesh.Trimesh:
    corners = [[-size, -size, 0], [size, -size, 0], [size, size, 0], [-size, size, 0]]
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)


def painted(**material: Any) -> trimesh.Trimesh:
    mesh = square()
    mesh.visual = trimesh.visual.TextureVisuals(
        uv=[[0, 0], [1, 0], [1, 1], [0, 1]],
        material=trimesh.visual.material.PBRMaterial(**material),
    )
    return mesh


def document(folder: Path, mesh: trimesh.Trimesh) -> dict[str, Any]:
    """The JSON of a mesh, its buffers beside it in a folder."""
    files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh))
    for name, data in files.items():
        (folder / name).write_bytes(data)
    found: dict[str, Any] = json.loads(files["model.gltf"])
    return found


def read(folder: Path, changed: dict[str, Any]) -> ObjectFile:
    (folder / "changed.gltf").write_text(json.dumps(changed))
    return read_gltf(folder / "changed.gltf")


def test_own_prototype_reads_back(tmp_path: Path) -> None:
    box = trimesh.creation.box((10, 20, 30))
    mesh = Mesh(np.add(box.vertices, [1, 2, 3]), np.asarray(box.faces))
    body = ColouredMesh("box", "group", mesh, (1.0, 0.5, 0.25, 1.0))
    write_glb(tmp_path / "a.glb", "whole", [body])
    found = read_gltf(tmp_path / "a.glb")
    (part,) = found.parts
    assert (found.unit, found.up) == ("m", "y")
    upright = 1000 * part.points @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert upright.min(axis=0) == pytest.approx([-4, -8, -12], abs=1e-5)
    assert upright.max(axis=0) == pytest.approx([6, 12, 18], abs=1e-5)
    assert part.colours is not None
    assert part.colours[0, 0] == pytest.approx([1, 0.5, 0.25], abs=0.01)


def test_instances_in_nested_nodes(tmp_path: Path) -> None:
    scene, random = trimesh.Scene(), np.random.default_rng(1)
    scene.add_geometry(
        trimesh.creation.icosphere(subdivisions=1),
        geom_name="a",
        node_name="top",
        transform=trimesh.transformations.rotation_matrix(0.5, [1, 2, 3], [1, 0, 0]),
    )
    for k in range(3):
        place = trimesh.transformations.random_rotation_matrix(random.random(3))
        place[:3, :3] *= 1 + 0.3 * k
        place[:3, 3] = random.random(3)
        scene.graph.update(frame_from="top", frame_to=f"i{k}", matrix=place, geometry="a")
    scene.export(tmp_path / "a.glb")
    wanted = trimesh.load_scene(tmp_path / "a.glb").to_geometry().vertices
    found = np.concatenate([part.points for part in read_gltf(tmp_path / "a.glb").parts])
    assert len(found) == 3 * 4 * 80  # flat, for the file has no normals
    assert cKDTree(wanted).query(found)[0].max() < 1e-9
    assert cKDTree(found).query(wanted)[0].max() < 1e-9


def test_factors_are_light_also_of_pictures(tmp_path: Path) -> None:
    white = Image.fromarray(np.full((4, 4, 3), 255, dtype=np.uint8))
    for material in ({"baseColorFactor": [1.0, 1.0, 1.0, 1.0]}, {"baseColorTexture": white}):
        changed = document(tmp_path, painted(**material))
        changed["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [1.0, 0.5, 0.2, 1.0]
        (part,) = read(tmp_path, changed).parts
        found = part.colours if part.picture is None else part.picture / 255
        assert found is not None
        assert found[0, 0] == pytest.approx([1, HALF, FIFTH], abs=0.003)
        assert "baseColorFactor" in part.source or part.picture is not None


def test_what_is_left_out_is_noted(tmp_path: Path) -> None:
    changed = document(tmp_path, painted(baseColorFactor=[1.0, 1.0, 1.0, 0.5], alphaMode="BLEND"))
    changed["materials"][0] |= {"emissiveFactor": [1, 0, 0], "normalTexture": {"index": 0}}
    changed["animations"] = [{}]
    notes = " ".join(read(tmp_path, changed).notes)
    for word in ("transparency", "emissive", "normal map", "animations"):
        assert word in notes


def test_lost_pictures_are_noted_and_the_factor_stays(tmp_path: Path) -> None:
    picture = Image.fromarray(np.zeros((4, 4, 3), dtype=np.uint8))
    changed = document(tmp_path, painted(baseColorTexture=picture))
    changed["images"] = [{"uri": "C:\\scan\\lost.png"}]
    found = read(tmp_path, changed)
    assert "lost.png" in found.notes[0]
    assert found.parts[0].picture is None
    assert found.parts[0].colours is not None


def test_sparse_strided_and_normalized_numbers(tmp_path: Path) -> None:
    """One corner is replaced; texture places are bytes in rows of four."""
    changed = document(tmp_path, square())
    place = changed["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    moved = np.array([0.5, 0.25, 0.125], dtype="<f4").tobytes()
    colours = np.array([[255, 0, 0, 9]] * 4, dtype=np.uint8).tobytes()
    (tmp_path / "more.bin").write_bytes(b"\2\0\0\0" + moved + colours)
    buffer, view = len(changed["buffers"]), len(changed["bufferViews"])
    changed["buffers"].append({"uri": "more.bin", "byteLength": 32})
    changed["bufferViews"] += [
        {"buffer": buffer, "byteLength": 4},
        {"buffer": buffer, "byteOffset": 4, "byteLength": 12},
        {"buffer": buffer, "byteOffset": 16, "byteLength": 16, "byteStride": 4},
    ]
    changed["accessors"][place]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": view, "componentType": 5121},
        "values": {"bufferView": view + 1},
    }
    changed["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = len(changed["accessors"])
    changed["accessors"].append({"bufferView": view + 2, "componentType": 5121, "count": 4,
                                 "type": "VEC3", "normalized": True})  # fmt: skip
    (part,) = read(tmp_path, changed).parts
    assert np.isclose(part.points, [0.5, 0.25, 0.125]).all(axis=1).any()
    assert part.colours is not None
    assert part.colours == pytest.approx(np.broadcast_to([1.0, 0, 0], (2, 3, 3)))


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        ({"extensionsRequired": ["EXT_meshopt_compression"]}, "gltfpack"),
        ({"asset": {"version": "1.0"}}, "version 2"),
        ({"buffers": [{"uri": "../secret.bin", "byteLength": 1}]}, "not in the folder"),
        ({"buffers": [{"uri": "http://localhost:1/x.bin", "byteLength": 1}]}, "not in the folder"),
        ({"scenes": [{}]}, "empty"),
        ({"nodes": [{"children": [0]}]}, "hold each other"),
    ],
)
def test_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any], wrong: str
) -> None:
    monkeypatch.setattr("tbcad.light.simulate.object_files.gltf.MOST_NODES", 1000)
    (tmp_path / "secret.bin").write_bytes(b"0" * 1000)
    inside = tmp_path / "inside"
    inside.mkdir()
    with pytest.raises(InputError, match=wrong):
        read(inside, document(inside, square()) | change)


def test_draco(tmp_path: Path) -> None:
    pytest.importorskip("DracoPy")
    ball = trimesh.creation.icosphere(subdivisions=2)
    path = tmp_path / "a.glb"
    path.write_bytes(trimesh.exchange.gltf.export_glb(trimesh.Scene(ball), extension_draco=True))
    (part,) = read_gltf(path).parts
    assert len(part.faces) == len(ball.faces)
    assert np.linalg.norm(part.points, axis=1) == pytest.approx(np.ones(len(part.points)), abs=2e-4)


def test_draco_without_its_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "DracoPy", None)
    changed = document(tmp_path, square())
    changed["meshes"][0]["primitives"][0]["extensions"] = {
        "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}
    }
    with pytest.raises(InputError, match="pip install DracoPy"):
        read(tmp_path, changed)


def mesh(properties: str = "") -> str:
    """A square, with properties of its first triangle."""
    return MESH.format(properties)


def written(path: Path, resources: str, build: str) -> Path:
    """A file of tbcad's own writer, with another model in it."""
    write_3mf(path, "box", Mesh(np.eye(4, 3), np.array([[0, 1, 2]])))
    with zipfile.ZipFile(path) as packed:
        files = {name: packed.read(name) for name in packed.namelist()}
    (model,) = (name for name in files if name.endswith(".model"))
    text = (
        f'<?xml version="1.0"?><model unit="inch" xmlns="{CORE}/core/2015/02" '
        f'xmlns:m="{CORE}/material/2015/02"><resources>{resources}</resources>'
        f"<build>{build}</build></model>"
    )
    with zipfile.ZipFile(path, "w") as packed:
        for name, data in (files | {model: text.encode()}).items():
            packed.writestr(name, data)
    return path


def test_own_files(tmp_path: Path) -> None:
    box = trimesh.creation.box((10, 20, 30))
    write_3mf(tmp_path / "a.3mf", "box", Mesh(box.vertices, box.faces))
    found = read_3mf(tmp_path / "a.3mf")
    assert (found.unit, found.up) == ("mm", "z")
    assert found.parts[0].points.max(axis=0).tolist() == [5, 10, 15]
    assert found.parts[0].colours is None


def test_components_are_where_they_are_built(tmp_path: Path) -> None:
    resources = (
        '<basematerials id="1"><base name="r" displaycolor="#FF0000"/>'
        '<base name="g" displaycolor="#00FF00FF"/></basematerials>'
        f'<object id="2" pid="1" pindex="0">{mesh(GREEN)}</object>'
        '<object id="3"><components><component objectid="2" '
        'transform="0 3 0 -3 0 0 0 0 3 0 0 0"/></components></object>'
    )
    build = '<item objectid="3" transform="1 0 0 0 1 0 0 0 1 0 0 5"/>'
    found = read_3mf(written(tmp_path / "a.3mf", resources, build))
    (part,) = found.parts
    assert found.unit == "in"
    assert part.points.tolist() == [[0, 0, 5], [0, 6, 5], [-6, 6, 5], [-6, 0, 5]]
    assert part.colours is not None
    assert part.colours[:, 0].tolist() == [[0, 1, 0], [1, 0, 0]]


def test_colours_of_corners(tmp_path: Path) -> None:
    resources = (
        '<m:colorgroup id="1"><m:color color="#FF8000"/><m:color color="#0000FF80"/></m:colorgroup>'
        f'<object id="2">{mesh(MIXED)}</object>'
    )
    found = read_3mf(written(tmp_path / "a.3mf", resources, '<item objectid="2"/>'))
    (part,) = found.parts
    assert part.colours is not None
    orange = [1, 128 / 255, 0]
    assert part.colours[0].tolist() == [orange, [0, 0, 1], orange]
    assert found.notes == ["its transparency is left out"]


def test_nothing_built(tmp_path: Path) -> None:
    path = written(tmp_path / "a.3mf", f'<object id="2">{mesh()}</object>', "")
    with pytest.raises(InputError, match="builds no mesh"):
        read_3mf(path)


@pytest.mark.parametrize("colour", ["red", "#FF00"])
def test_colours_that_cannot_be(tmp_path: Path, colour: str) -> None:
    resources = (
        f'<basematerials id="1"><base name="r" displaycolor="{colour}"/></basematerials>'
        f'<object id="2" pid="1" pindex="0">{mesh()}</object>'
    )
    path = written(tmp_path / "a.3mf", resources, '<item objectid="2"/>')
    with pytest.raises(InputError, match="is not #RRGGBB"):
        load_object(path, 150.0)
