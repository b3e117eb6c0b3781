"""tbcad parts: sums and rows of a parts list, prices of one's own, bad lists."""

import csv
import json
import math
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import trimesh

from tbcad.core.camera.lists import CAMERA_COLUMNS, LENS_COLUMNS
from tbcad.prototype.files.bom import COLUMNS
from tbcad.prototype.purchased.parts import PRICE_FIELDS as PRICE_FILE
from tests.app.cli.commands import Command

ROWS = (
    *(["1", "2", "608-2Z", "bearing (ISO 15)", "ISO 15", "steel", "12.0", "24.0", "", "", ""],),
    *(["2", "1", "MOTOR", "stepper" * 9, "", "steel", "400.0", "400.0", "", "", ""],),
    *(["3", "1", "carrier", "carrier", "", "PETG", "300.0", "300.0", "236220", "250.0", "25.0"],),
)
PRICED = (
    *(["1.5", "3.0", "EUR", "2026-11", "me", "bought"],),
    *(["", "", "", "", "", "bought"],),
    *(["5.5", "5.5", "EUR", "2026-11", "me", "printed"],),
)
SAMPLE = Path(__file__).parents[3] / "docs" / "sample"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    with (tmp_path / "bom.csv").open("w", newline="") as file:
        rows = [[*row, *price] for row, price in zip(ROWS, PRICED, strict=True)]
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])
    return tmp_path


def test_sums_come_first(folder: Path, cli: Command) -> None:
    first, second, summed, third, fourth, _, *rows = lines = cli("parts", folder).out.splitlines()
    assert first == "2 kinds of parts to buy: 3 EUR, 1 of them without a price"
    assert second == "1 parts to print: 0.2 kg, 6 EUR, 25 h (1.0 days)"
    assert summed == "in all 8 EUR, as estimated and without shipping"
    assert third.startswith("0.7 kg in all")
    assert fourth.startswith("not in the list: camera, lens")
    assert [row.split()[2] for row in rows] == ["carrier", "608-2Z", "MOTOR"]  # the dearest first
    assert all(len(line) <= 80 for line in lines)
    rows = cli("parts", folder, "--full").out.splitlines()[6:]
    assert [row.split()[0] for row in rows] == ["1", "2", "3"]  # as in the list


def test_ones_own_prices(folder: Path, cli: Command) -> None:
    mine = folder / "mine.csv"
    mine.write_text(",".join(PRICE_FILE) + "\nMOTOR,20,,USD,2026-10,shop\nPETG,,40,USD,2026-10,s\n")
    before = (folder / "bom.csv").read_bytes()
    record = json.loads(cli("parts", folder, "--json", "--prices", mine).out)
    assert record["totals"]["bought_price"] == {"EUR": 3.0, "USD": 20.0}
    assert record["totals"]["filament_price"] == {"USD": 10.0}
    assert record["totals"]["without_price"] == 0
    assert record["rows"][1]["price_source"] == "shop"
    assert (folder / "bom.csv").read_bytes() == before


def test_a_broken_list(folder: Path, cli: Command) -> None:
    path = folder / "bom.csv"
    text = path.read_text()
    for old, new, message in (
        ("608-2Z", "608-2Z,", "bom.csv, line 2: 18 columns, not 17"),
        ("400.0,400.0", "heavy,400.0", "bom.csv, line 3, column mass_g: no number"),
        ("printed", "found", "line 4, column from: allowed are bought, printed"),
        ("item", "number", "bom.csv, line 1: the columns must be item,quantity"),
    ):
        path.write_text(text.replace(old, new, 1))
        assert message in refused(cli, "parts", folder)


def test_lines_of_the_sheet(cli: Command) -> None:
    lines = cli("camera", "--n", "6").out.splitlines()
    assert "listed cameras meet the requirements" in lines[0]
    assert all(len(line) <= 80 for line in lines)


def test_a_users_camera_is_a_candidate(tmp_path: Path, cli: Command) -> None:
    file = tmp_path / "mine.csv"
    file.write_text(",".join(CAMERA_COLUMNS) + "\nMine,Sony E,36,24,30000,20000,usb,,,,,,,,me\n")
    record = json.loads(cli("camera", "--n", "6", "--cameras", file, "--json").out)
    assert record["candidates"][0]["camera"] == "Mine"
    assert record["requirements"]["near_mm"] < record["requirements"]["far_mm"]


def test_a_camera_to_use_is_tried_with_all_bodies(tmp_path: Path, cli: Command) -> None:
    """A lens of one's own suits n = 6; light is that of the prototype's lamps."""
    file = tmp_path / "lenses.csv"
    file.write_text(",".join(LENS_COLUMNS) + "\nmine,C,6,6,1.8,16,0.17,20,54,57,215,me\n")
    name = "FLIR Blackfly S BFS-U3-244S8C (IMX540)"
    words = ["camera", "--n", "6", "--lenses", file, "--use", name]
    first, axis, *_, design = cli(*words).out.splitlines()
    assert first == f"{name} with mine fits"
    assert "22.5 mm over what the camera stands on, a riser of 7.5 mm" in axis
    assert design.endswith(f'prototype.frame.camera = "{name} with mine"')
    record = json.loads(cli(*words, "--json").out)
    assert record["exposure"]["illuminance_lux"] == pytest.approx(1000, rel=0.05)
    assert record["sets"]["camera_back_mm"] == pytest.approx(78.9)
    found = next(one for one in record["candidates"] if one["camera"] == name)
    assert record["sets"]["exposure_s"] == pytest.approx(found["exposure_s"], abs=1e-3)
    assert record["mounted"] == f"{name} with mine"


def test_a_camera_that_does_not_fit_is_refused_with_one_that_does(
    tmp_path: Path, cli: Command
) -> None:
    file, bodies = tmp_path / "lenses.csv", tmp_path / "cameras.csv"
    file.write_text(",".join(LENS_COLUMNS) + "\nmine,C,6,6,1.8,16,0.17,20,54,57,215,me\n")
    tall = "tall,C,14.58,12.6,5320,4600,usb,wire,29,300,39,22.5,15,53,me"
    bodies.write_text(",".join(CAMERA_COLUMNS) + f"\n{tall}\n")
    own = ["camera", "--n", "6", "--set", "prototype.k=4", "--lenses", file]
    for name, fault in (
        ("Raspberry Pi High Quality Camera (IMX477)", "shows "),
        ("Canon EOS R5", "not known"),
        ("tall", "reaches down to"),
    ):
        error = refused(cli, *own, "--cameras", bodies, "--use", name)
        assert fault in error
        assert "FLIR Blackfly S BFS-U3-244S8C (IMX540) with mine" in error


def test_a_sensor_that_no_camera_has(cli: Command) -> None:
    large = ("--set", "width_px=32768", "--set", "height_px=24000")
    out = cli("camera", "--n", "6", *large, code=1).out
    assert out.startswith("no listed camera meets the requirements: ")
    assert "pixels across the mirrors" in out


def refused(cli: Command, *words: object) -> str:
    shown = cli(*words, code=2)
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    return str(shown.err)


def test_the_section_of_the_samples_shell(tmp_path: Path, cli: Command) -> None:
    """View A is as wide and high as the shell's mesh, cut in the same plane."""
    cli("drawings", SAMPLE, "--only", "shell_a", "--out", tmp_path)
    space = ezdxf.readfile(tmp_path / "shell_a.dxf").modelspace()
    mesh = trimesh.load_mesh(SAMPLE / "shell_a.stl")
    cut = mesh.section([0, 1, 0], [0, 0, 0])
    low, high = cut.bounds[:, [0, 2]]
    design = json.loads((SAMPLE / "design.json").read_text())
    chord = design["spec"]["mesh"]["structure_error_mm"]  # the mesh is inside by that at most
    lines = [one for one in space.query("LINE") if one.dxf.layer == "cut"]
    ends = np.array([(*one.dxf.start.vec2, *one.dxf.end.vec2) for one in lines]).reshape(-1, 2)
    view = ends[(ends > low - 1).all(axis=1) & (ends < high + 1).all(axis=1)]
    assert view.max(axis=0) == pytest.approx(high, abs=chord)
    assert view[:, 0].min() == pytest.approx(low[0], abs=chord)
    width, height, depth = (one.dxf.actual_measurement for one in space.query("DIMENSION"))
    assert (width, height) == pytest.approx((high - low).tolist(), abs=chord)
    assert depth == pytest.approx(np.ptp(mesh.vertices[:, 1]), abs=chord)
    assert len(space.query('LINE[layer=="hatch"]')) > 20


def test_the_optical_layout_of_the_sample(tmp_path: Path, cli: Command) -> None:
    """Its foci, capture sphere and virtual cameras are the design's; never written twice."""
    words = ["drawings", SAMPLE, "--only", "optical_layout", "--out", tmp_path]
    (sheet,) = json.loads(cli(*words, "--json").out)["sheets"]
    assert sheet["files"] == ["optical_layout.pdf", "optical_layout.dxf"]
    space = ezdxf.readfile(tmp_path / "optical_layout.dxf").modelspace()
    design = json.loads((SAMPLE / "design.json").read_text())["spec"]["optics"]
    x, _, z = design["camera_mm"]
    (sphere,) = [
        one
        for one in space.query('CIRCLE[layer=="cut"]')
        if one.dxf.center.magnitude < 1e-9 and one.dxf.radius > 5
    ]
    assert sphere.dxf.radius == pytest.approx(design["capture_diameter_mm"] / 2)
    (orbit,) = [one for one in space.query("ARC") if one.dxf.layer == "centre"]
    major = math.hypot(design["semi_minor_mm"], math.hypot(x, z) / 2)
    assert orbit.dxf.radius == pytest.approx(2 * major)
    ellipses = [one for one in space.query("LWPOLYLINE") if len(one) > 300]
    assert len(ellipses) == 2
    for sign, ellipse in zip((1, -1), ellipses, strict=True):
        for px, pz, *_ in ellipse:
            total = math.hypot(px, pz) + math.hypot(px - sign * x, pz - z)
            assert total == pytest.approx(2 * major, abs=1e-3)
    rays = space.query('LWPOLYLINE[layer=="rays"]')
    assert rays
    for ray in rays:
        assert ray[0][:2] == pytest.approx((x, z))
    sizes = {one.dxf.text: one.dxf.actual_measurement for one in space.query("DIMENSION")}
    assert sizes == {
        "capture sphere <>": pytest.approx(design["capture_diameter_mm"]),
        "<>": pytest.approx(2 * x),
    }
    assert refused(cli, *words).endswith("replace it with --force\n")
