"""3MF files: own ones, and ones written by hand with units, components and colours."""

import zipfile
from pathlib import Path

import pytest
import trimesh

from tbcad.cad.formats.mesh_files import write_3mf
from tbcad.cad.kernel.mesh import Mesh
from tbcad.errors import InputError
from tbcad.light.simulate.object_files.threemf import read_3mf

NAMESPACE = "http://schemas.openxmlformats.org/package/2006"
CORE = "http://schemas.microsoft.com/3dmanufacturing"
MESH = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="2" y="0" z="0"/>'
    '<vertex x="2" y="2" z="0"/><vertex x="0" y="2" z="0"/></vertices><triangles>'
    '<triangle v1="0" v2="1" v3="2" {}/><triangle v1="0" v2="2" v3="3"/></triangles></mesh>'
)


GREEN, MIXED = 'pid="1" p1="1"', 'pid="1" p1="0" p2="1" p3="0"'


def mesh(properties: str = "") -> str:
    """A square, with properties of its first triangle."""
    return MESH.format(properties)


def written(path: Path, resources: str, build: str) -> Path:
    model = (
        f'<?xml version="1.0"?><model unit="inch" xmlns="{CORE}/core/2015/02" '
        f'xmlns:m="{CORE}/material/2015/02"><resources>{resources}</resources>'
        f"<build>{build}</build></model>"
    )
    kinds = (
        f'<Types xmlns="{NAMESPACE}/content-types"><Default Extension="rels" '
        'ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default '
        'Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
        "</Types>"
    )
    relations = (
        f'<Relationships xmlns="{NAMESPACE}/relationships"><Relationship Id="r" '
        f'Target="/3D/a.model" Type="{CORE}/2013/01/3dmodel"/>'
        "</Relationships>"
    )
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("[Content_Types].xml", kinds)
        packed.writestr("_rels/.rels", relations)
        packed.writestr("3D/a.model", model)
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
