"""OBJ, OFF, PLY and STL files as programs write them, and broken ones."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import Fault, ObjectFile, ObjectPart
from tbcad.light.simulate.object_files.read import read_object_file

CORNERS = ("-1 -1 0", "1 -1 0", "1 1 0", "-1 1 0")
QUAD = "4 0 1 2 3"
ORANGE = [1.0, 128 / 255, 0.0]
Write = Callable[[str, str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def _write(name: str, text: str) -> Path:
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return _write


def ply(properties: str = "", values: str = "", faces: tuple[str, ...] = (QUAD,),
        of_face: str = "", comment: str = "") -> str:  # fmt: skip
    """A square with more properties of its corners."""
    names = [f"property {one}" for one in properties.split(",") if one]
    lines = [
        "ply", "format ascii 1.0", *([comment] if comment else []), "element vertex 4",
        "property float x", "property float y", "property float z", *names,
        f"element face {len(faces)}", "property list uchar int vertex_indices",
        *(f"property {one}" for one in of_face.split(",") if one), "end_header",
        *(f"{corner} {values}" for corner in CORNERS), *faces,
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def obj(*lines: str) -> str:
    return "\n".join([*(f"v {corner}" for corner in CORNERS), *lines]) + "\n"


def only(found: ObjectFile) -> ObjectPart:
    (part,) = found.parts
    return part


def area(part: ObjectPart) -> float:
    return float(trimesh.Trimesh(part.points, part.faces, process=False).area)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.ply", ply("uchar red,uchar green,uchar blue", "255 128 0")),
        ("a.ply", ply("uchar diffuse_red,uchar diffuse_green,uchar diffuse_blue", "255 128 0")),
        ("a.ply", ply("ushort red,ushort green,ushort blue", "65535 32896 0")),
        ("a.ply", ply("float red,float green,float blue", f"1 {128 / 255} 0")),
        ("a.ply", ply("float red,float green,float blue", "255 128 0")),
        ("a.off", "COFF\n4 1 0\n" + "".join(f"{c} 255 128 0 255\n" for c in CORNERS) + QUAD),
        ("a.off", "OFF 4 1 0\n" + "\n".join(CORNERS) + f"\n{QUAD} 1.0 {128 / 255} 0.0\n"),
        ("a.obj", "".join(f"v {c} 255 128 0\n" for c in CORNERS) + "f 1 2 3 4\n"),
    ],
)
def test_colours_of_all_types(write: Write, name: str, text: str) -> None:
    part = only(read_object_file(write(name, text)))
    assert part.colours is not None
    assert part.colours[1, 2] == pytest.approx(ORANGE, abs=1e-6)


@pytest.mark.parametrize("values", ["-1 0 0", "1e9 0 0", "1.5 1 0", "nan 0 0"])
def test_colours_out_of_range(write: Write, values: str) -> None:
    path = write("a.ply", ply("float red,float green,float blue", values))
    with pytest.raises(InputError, match="out of range"):
        read_object_file(path)


@pytest.mark.parametrize("encoding", ["little", "big"])
def test_binary_polygons_of_several_sizes(tmp_path: Path, encoding: str) -> None:
    """A triangle before a square, with a colour behind each list."""
    order = {"little": "<", "big": ">"}[encoding]
    head = ply(faces=("",) * 2, of_face="uchar red,uchar green,uchar blue")
    head = head[: head.index("end_header")].replace("ascii", f"binary_{encoding}_endian")
    points = np.array([corner.split() for corner in CORNERS], dtype=order + "f4")
    faces = b"".join(
        bytes([len(face)]) + np.array(face, dtype=order + "i4").tobytes() + bytes(colour)
        for face, colour in (([0, 1, 2], (255, 0, 0)), ([0, 1, 2, 3], (0, 255, 0)))
    )
    (tmp_path / "a.ply").write_bytes(head.encode() + b"end_header\n" + points.tobytes() + faces)
    part = only(read_object_file(tmp_path / "a.ply"))
    assert part.faces.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3]]
    assert part.colours is not None
    assert part.colours[:, 0].tolist() == [[1, 0, 0], [0, 1, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("text", "note"),
    [
        (ply("float s,float t", "0 0"), "names no texture"),
        (ply("float s,float t", "0 0", comment="comment TextureFile no.png"), "no.png is not in"),
        (ply(comment="comment TextureFile no.png"), "no texture coordinates"),
        (ply("uchar farbe", "3"), "farbe are not understood"),
        (ply("uchar red,uchar green,uchar blue,uchar alpha", "1 2 3 4"), "transparency"),
    ],
)
def test_notes_of_ply(write: Write, text: str, note: str) -> None:
    assert note in " ".join(read_object_file(write("a.ply", text)).notes)


@pytest.mark.parametrize(
    "name", ["tex.png", "C:\\scans\\tex.png", "/home/else/TEX.PNG", "./tex.png", '"tex.png"']
)
def test_pictures_are_found_beside_the_mesh(tmp_path: Path, write: Write, name: str) -> None:
    deep = np.full((2, 2), 0x8000, dtype=np.uint16)
    Image.fromarray(deep).save(tmp_path / "tex.png")
    write("a.mtl", f"newmtl m\nmap_Kd {name}\n")
    lines = "mtllib a.mtl", "usemtl m", "vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"
    found = read_object_file(write("a.obj", obj(*lines, "f 1/1 2/2 3/3 4/4")))
    part = only(found)
    assert found.notes == []
    assert part.picture is not None
    assert part.picture[0, 0].tolist() == [128, 128, 128]
    assert part.uv is not None
    assert part.uv[0].tolist() == [[0, 0], [1, 0], [1, 1]]


def test_pictures_that_are_transparent_or_unreadable_are_noted(
    tmp_path: Path, write: Write
) -> None:
    lines = "mtllib a.mtl", "usemtl m", "vt 0 0", "f 1/1 2/1 3/1"
    write("a.mtl", "newmtl m\nmap_Kd tex.png\n")
    Image.new("RGBA", (2, 2), (9, 8, 7, 100)).save(tmp_path / "tex.png")
    found = read_object_file(write("a.obj", obj(*lines)))
    assert found.notes == ["the transparency of its texture tex.png is left out"]
    assert only(found).picture is not None
    write("tex.png", "rubbish")
    found = read_object_file(write("a.obj", obj(*lines)))
    assert "its texture tex.png is no" in found.notes[0]
    assert only(found).picture is None


def test_links_do_not_lead_out(tmp_path: Path, write: Write) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    write("secret.mtl", "newmtl m\nKd 1 0 0\n")
    (inside / "a.mtl").symlink_to(tmp_path / "secret.mtl")
    (inside / "a.obj").write_text(obj("mtllib a.mtl", "usemtl m", "f 1 2 3"))
    found = read_object_file(inside / "a.obj")
    assert only(found).colours is None
    lost = "its materials a.mtl is not in the folder of the mesh: put it there, or do not name it"
    assert found.notes == [lost]
    assert isinstance(found.notes[0], Fault)


def test_materials_of_several_files(write: Write) -> None:
    write("one.mtl", "newmtl red one\nKd 1 0 0\nmap_Bump b.png\nd 0.5\n")
    write("two.mtl", "newmtl green\nKd 0 1 0\n")
    lines = ("mtllib one.mtl two.mtl", "usemtl red one", "f 1 2 3", "usemtl green", "f 1 3 4",
             "usemtl none", "f 1 2 4", "l 1 2")  # fmt: skip
    found = read_object_file(write("a.obj", obj(*lines)))
    colours = {tuple(p.colours[0, 0].tolist()) for p in found.parts if p.colours is not None}
    assert colours == {(1, 0, 0), (0, 1, 0)}
    notes = " ".join(found.notes)
    for word in ("map_Bump", "transparency", "none is in no MTL file", "lines"):
        assert word in notes


def test_numbers_that_count_back_count_from_their_line(write: Write) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 9 9 9\nf 1 2 -1\n"
    part = only(read_object_file(write("a.obj", text)))
    assert part.points[part.faces][:, 2].tolist() == [[1, 1, 0], [9, 9, 9]]


def test_hollow_polygons_keep_their_area(write: Write) -> None:
    """An L, which a fan from its first corner would not cut."""
    places = "3 0", "3 1", "1 1", "1 3", "0 3", "0 0"
    for turn in range(6):
        own = places[turn:] + places[:turn]
        text = "".join(f"v {place} 0\n" for place in own) + "f 1 2 3 4 5 6\n"
        part = only(read_object_file(write("a.obj", text)))
        assert area(part) == pytest.approx(5)
        sides = trimesh.Trimesh(part.points, part.faces, process=False).face_normals[:, 2]
        assert (sides > 0).all()


@pytest.mark.parametrize(
    ("header", "word", "wanted"),
    [
        (b"", 0x8000 | 31 << 10, [1, 0, 0]),  # VisCAM: red is high, and the bit says own
        (b"COLOR=\0\0\0\xff", 31, [1, 0, 0]),  # Materialise: red is low, and the bit says whole
        (b"COLOR=\0\0\xff\xff", 0x8000, [0, 0, 1]),
    ],
)
def test_stl_with_colours(tmp_path: Path, header: bytes, word: int, wanted: list[float]) -> None:
    data = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).export(file_type="stl")
    stored = header.ljust(80, b"\0") + data[80:-2] + word.to_bytes(2, "little")
    (tmp_path / "a.stl").write_bytes(stored)
    part = only(read_object_file(tmp_path / "a.stl"))
    assert part.colours is not None
    assert part.colours[0, 0].tolist() == wanted


@pytest.mark.parametrize(
    ("name", "text", "wrong"),
    [
        ("a.step", "ISO-10303-21;", "solid, no mesh: write it as STL"),
        ("a.pcd", "# .PCD", "cloud of points"),
        ("a.stl.gz", "", "unpack it"),
        ("a.ply", "\x1f\x8b", "no header"),
        ("a.ply", ply()[:-12], "cut off"),
        ("a.ply", ply(faces=("3 0 1 7",)), "corners that do not exist"),
        ("a.ply", ply(faces=()), "no facets: name a triangle mesh; MeshLab"),
        ("a.ply", ply().replace("ascii", "ebcdic"), "its format is 'ebcdic'"),
        ("a.ply", ply().replace("property float z", "property strange"), "not understood"),
        ("a.obj", obj("f 1 2 9"), "corners that do not exist"),
        ("a.obj", obj("f 0 1 2"), "corners that do not exist"),
        ("a.obj", obj("f 1 2 x"), "damaged"),
        ("a.obj", "v 1 2\nf 1 1 1\n", "fewer than 3 numbers"),
        ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\n" + 9 * "vertex 0 0 0\n", "length"),
        ("a.off", "4OFF\n1 1 0\n", "not OFF"),
        ("a.off", "OFF\n4 1 0\n0 0 0\n", "cut off"),
        ("a.3mf", "PK\3\4rubbish", "lib3mf says"),
    ],
)
def test_refused_in_one_line(write: Write, name: str, text: str, wrong: str) -> None:
    with pytest.raises(InputError, match=wrong) as error:
        read_object_file(write(name, text))
    assert "\n" not in str(error.value)


def test_packed_whatever_its_name(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(b"\x1f\x8b\x08\0")
    with pytest.raises(InputError, match="is packed: unpack it"):
        read_object_file(tmp_path / "a.ply")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_texts_of_other_systems(tmp_path: Path, encoding: str, ending: str) -> None:
    text = ("# Fläche\n" + obj("f 1 2 \\\n3 4")).replace("\n", ending)
    (tmp_path / "a.obj").write_bytes(text.encode(encoding))
    assert area(only(read_object_file(tmp_path / "a.obj"))) == pytest.approx(4)
