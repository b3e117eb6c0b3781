"""tbcad view and show of captures with a field beside them, and of a field alone."""

import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import tbcad
from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import LightField
from tests.app.cli.commands import Command
from tests.light.viewer.fields import CAPTURE_MM, COLOUR, RADIUS_MM, write_ball

SMALL = ["--width", "160", "--height", "120"]
COLOUR_8 = tuple(np.rint(255 * np.array(COLOUR)).astype(int).tolist())


@pytest.fixture
def folder(captured: Path, tmp_path: Path) -> Path:
    """A capture of the knot, with a ball as its field: so both are told apart."""
    copied = tmp_path / "knot"
    shutil.copytree(captured, copied)
    with LightField.open(copied) as source:
        write_ball(source, copied)
    return copied


@pytest.fixture
def view(folder: Path, cli: Command) -> Command:
    """View the capture with more options."""
    return partial(cli, "view", folder, *SMALL, "--force", "--out", folder.parent / "v.png")


def test_by_its_path_in_python(folder: Path, captured: Path) -> None:
    light_field, size = LightField.open(captured), (160, 120)
    views = tbcad.Views(str(folder))
    ball = views.view(size=size).image
    assert tuple(ball[60, 80]) == COLOUR_8
    knot = tbcad.view(light_field, size=size, method="nearest").image
    assert np.array_equal(views.view(size=size, method="nearest").image, knot)
    assert np.array_equal(tbcad.view(captured, size=size, method="nearest").image, knot)
    with pytest.raises(InputError, match="source is 3, allowed is a light field, the folder"):
        tbcad.view(3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="no such file; give a light field"):
        tbcad.view(folder.parent)


def test_a_field_beside_the_capture(folder: Path, view: Command) -> None:
    """Shown by default and where it is asked for; other methods leave it alone."""
    for words, line in (
        ("", "method field: its file is in the capture's folder"),
        ("--method field", "method field: as --method says"),
        ("--method depth", "method depth: as --method says"),
        ("--method nearest", "method nearest: as --method says"),
    ):
        printed = view(*words.split())
        assert [one for one in printed.out.splitlines() if one.startswith("method ")] == [line]
        assert "PSNR" in printed.out
        assert "warning" not in printed.err
        middle = Image.open(folder.parent / "v.png").getpixel((80, 60))
        assert (middle == COLOUR_8) == ("method field" in line)


def test_depth_normals_and_opacity(folder: Path, view: Command) -> None:
    """The ball's front is 15 mm in front of the middle, and faces the view at elevation 30."""
    names = {name: folder.parent / f"{name}.png" for name in ("depth", "normals", "opacity")}
    points = folder.parent / "points.ply"
    options = [word for name, file in names.items() for word in (f"--{name}", file)]
    view(*options, "--depth", points)
    depth, normals, opacity = (np.asarray(Image.open(file)) for file in names.values())
    assert depth.shape == opacity.shape == (120, 160)
    front = 1 + 65534 * (0.5 + RADIUS_MM / CAPTURE_MM)
    assert abs(int(depth[60, 80]) - front) < 65534 / CAPTURE_MM  # within a millimetre
    assert (depth[0, 0], opacity[0, 0], opacity[60, 80]) == (0, 0, 255)
    facing = 127.5 * (1 + np.array([np.cos(np.radians(30)), 0.0, 0.5]))
    assert np.abs(normals[60, 80] - facing).max() < 16  # of a coarse grid
    assert tuple(normals[0, 0]) == (0, 0, 0)
    assert points.read_bytes().startswith(b"ply\n")


def test_a_field_of_another_capture(folder: Path, view: Command) -> None:
    """Refused when it is asked for; told and left alone when it is only beside the capture."""
    with LightField.open(folder) as source:
        other = LightField({"a": source.frames["a"]}, source.capture_mm, {})
        file = write_ball(other, folder)
    words = f"{file} is of another capture, or of an older one"
    assert words in view("--method", "field", code=2).err.splitlines()[-1]
    assert not (folder.parent / "v.png").exists()
    printed = view()
    assert f"tbcad: warning: {words}" in printed.err
    assert "method depth: a blend at the depth that is found" in printed.out


def test_turntables(folder: Path, cli: Command) -> None:
    """By a field beside the capture, and by a field alone: the same pictures and title."""
    pages = []
    for shown in (folder, folder / "field.npz"):
        file = folder.parent / f"{len(pages)}.html"
        words = ["show", shown, "--turntable", file, "--frames", "4", "--rows", "1", *SMALL]
        assert "4 views by method field" in cli(*words).out
        pages.append(file.read_bytes())
    assert pages[0] == pages[1]
