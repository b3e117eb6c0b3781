"""The assembly sheets: hidden edges by rays, call-outs by number."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from tbcad.cad.drafting.line_pictures import line_picture
from tbcad.cad.drafting.views import FRONT
from tbcad.cad.formats.entities import Circle, Layer, Line, Text
from tbcad.cad.formats.glb import ColouredMesh, write_glb
from tbcad.cad.kernel.mesh import Mesh
from tbcad.drawings.write import EYES, assembly_sheets

BOX, POST = (40.0, 20.0, 10.0), (5.0, 5.0, 30.0)


@pytest.fixture
def bodies() -> dict[str, trimesh.Trimesh]:
    """A box from y = -10 to 10, and a post behind it that stands out 15 mm above, 5 below."""
    box, post = trimesh.creation.box(BOX), trimesh.creation.box(POST)
    post.apply_translation([0.0, 20.0, 5.0])
    return {"box": box, "post": post}


def test_what_is_behind_is_hidden(bodies: dict[str, trimesh.Trimesh]) -> None:
    picture = line_picture(bodies, FRONT, 1.0)
    ends = [(one.start, one.end) for one in picture.lines]
    lengths = [np.hypot(b[0] - a[0], b[1] - a[1]) for a, b in ends]
    post = 15 + 5 + 15 + 5 + 5 + 5  # above the box, and below it
    assert sum(lengths) == pytest.approx(2 * (40 + 10) + post, abs=0.5)
    assert max(end[1] for line in ends for end in line) == 20.0
    behind = [line for line in ends if all(abs(x) < 3 and -4 < z < 4 for x, z in line)]
    assert not behind


def test_anchors_are_on_what_is_seen(bodies: dict[str, trimesh.Trimesh]) -> None:
    bodies["inside"] = trimesh.creation.box((2.0, 2.0, 2.0))
    anchors = line_picture(bodies, FRONT, 1.0).anchors
    assert anchors.keys() == {"box", "post"}
    assert anchors["post"][1] > 5.0


def test_edges_of_contact_stay(bodies: dict[str, trimesh.Trimesh]) -> None:
    """A foot on a plate hides none of its own lower edge."""
    foot = trimesh.creation.box((10.0, 10.0, 10.0))
    foot.apply_translation([0.0, 0.0, 10.0])
    eye = np.array([[1.0, 0, 0], [0, 0.6, 0.8], [0, -0.8, 0.6]])
    drawn = line_picture({"box": bodies["box"], "foot": foot}, eye, 20.0).lines
    x, y = (eye[:2] @ [5.0, -5.0, 5.0]).round(3).tolist()
    assert Line(Layer.CUT, (-x, y), (x, y)) in drawn


def test_each_part_is_called_out_once(bodies: dict[str, trimesh.Trimesh], tmp_path: Path) -> None:
    meshes = bodies | {"shroud_lid": bodies["post"]}
    path, white = tmp_path / "some.glb", (1.0, 1.0, 1.0, 1.0)
    shown = {name: Mesh(np.array(one.vertices), one.faces) for name, one in meshes.items()}
    write_glb(path, "all", [ColouredMesh(name, "g", one, white) for name, one in shown.items()])
    parts, listed = {"box": "BOX-1", "post": "POST-2"}, {"BOX-1": (3, 1), "POST-2": (12, 4)}
    sheets = assembly_sheets(path, parts, listed, "some")
    assert [one.name for one in sheets] == ["assembly", "assembly_2", "assembly_3"]
    assert len(sheets) == len(EYES)
    words = [text.text for one in sheets for text in one.entities if isinstance(text, Text)]
    assert words.count("POST-2") == 1
    balloons = [
        text
        for one in sheets
        for text in one.entities
        if isinstance(text, Text) and text.align == "centre"
    ]
    assert sorted(text.text for text in balloons) == ["12", "3"]
    circles = [one for one in sheets[0].entities if isinstance(one, Circle)]
    assert len(circles) == 2 * len(balloons)  # a balloon and a dot each
