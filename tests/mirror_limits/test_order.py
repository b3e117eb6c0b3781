"""Files of an order as other readers get them, what a chain holds, and the page of a workshop."""

import json
import shutil
from collections.abc import Callable
from math import hypot, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Surface

from tbcad.app.api import order
from tbcad.app.cli import run
from tbcad.cad.formats.step import read_named_solid
from tbcad.cad.formats.step_tolerances import read_tolerances
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.optics.reflection import roughness_nm, scattered_share
from tbcad.core.spec.load import load_spec
from tbcad.drawings.order_sheet import order_sheet
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.mirror_limits.held import chain_of, confidence, sampled, two_sigma
from tbcad.mirror_limits.sensitivity import MirrorLimits
from tbcad.shell.files import write_mandrels
from tbcad.shell.halves import design_mandrel
from tbcad.tolerancing.process.chain import ChainStep
from tbcad.tolerancing.process.process import BUILT_IN, load_process
from tests.exported_files import contents, read_csv
from tests.sheet_texts import check_texts, texts
from tests.shell_meshes import export_with_solids

SMALL = ["n=4", "mirrors.coating_um=20"]
OWN = """based_on = "nickel-diamond"
steps = ["diamond-mandrel", "bath", "coat"]
[step.bath]
title = "electroformed in K\u00f6ln"
"""


@pytest.fixture(scope="module")
def coated() -> MirrorDesign:
    return design(load_spec(None, [*SMALL, "shell.negative=true", "mirrors.margin_mm=0.8"]))


@pytest.fixture(scope="module")
def exports(coated: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = export_with_solids(tmp_path_factory.mktemp("mandrels"), coated)
    write_mandrels(coated, design_mandrel(coated), folder)
    return folder


@pytest.fixture(scope="module")
def written(exports: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("order") / "out"
    assert run(["order", str(exports), "--out", str(out)]) == 0
    return out


def table(folder: Path, column: str) -> np.ndarray:
    return np.array([float(row[column]) for row in read_csv(folder / "inspection_a.csv")])


def test_spheres_are_those_below_the_coat(written: Path, coated: MirrorDesign) -> None:
    array = coated.arrays[0]
    assert [row["id"] for row in read_csv(written / "inspection_a.csv")] == array.ids
    assert table(written, "radius_mm") == pytest.approx(array.mirrors.radius - 0.020, abs=1e-12)
    centre = np.stack([table(written, f"centre_{axis}_mm") for axis in "xyz"], axis=1)
    assert centre == pytest.approx(array.mirrors.centre, abs=1e-9)


@pytest.mark.parametrize("half", ["a", "b"])
def test_the_datums_are_the_planes_of_seam_and_foot(
    exports: Path, coated: MirrorDesign, half: str
) -> None:
    """By their names in the STEP file, whose faces the kernel reads in another order."""
    faces = dict(read_named_solid(exports / f"shell_{half}.step").faces)
    for name, axis in (("seam", 0), ("foot", 2)):
        plane = BRepAdaptor_Surface(faces[name]).Plane()
        normal = np.array(plane.Axis().Direction().Coord())
        assert np.abs(normal) == pytest.approx(np.eye(3)[axis], abs=1e-12)
        level = coated.arrays[0].cells.surfaces.apex[-1, 2] if name == "foot" else 0.0
        assert plane.Location().Coord()[axis] == pytest.approx(level, abs=1e-9)


def test_tolerances_as_a_parser_of_the_grammar_reads_them(written: Path) -> None:
    """No CAD kernel: the schema, one zone a mirror in the frame A, B, C, and notes."""
    from steputils import p21

    file = p21.readfile(str(written / "shell_a_tolerances.step"))
    assert "AP242" in str(file.header.entities["FILE_SCHEMA"].params)
    zones, frames, names, notes = [], set(), {}, {}
    for instance in file.data[0].instances.values():
        entities = [instance.entity] if hasattr(instance, "entity") else instance.entities
        kinds = {entity.name: entity.params for entity in entities}
        if "SURFACE_PROFILE_TOLERANCE" in kinds:
            width = file[kinds["GEOMETRIC_TOLERANCE"][2]].entity.params[0]
            zones.append(float(width.param))
            frames.add(kinds["GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE"][0][0])
        if "DATUM" in kinds:
            names[instance.ref] = kinds["DATUM"][4]
        if "DESCRIPTIVE_REPRESENTATION_ITEM" in kinds:
            name, note = kinds["DESCRIPTIVE_REPRESENTATION_ITEM"]
            notes[name] = note
    assert sorted(zones) == pytest.approx(np.sort(table(written, "profile_mm")), abs=1e-12)
    for frame in frames:
        compartments = file[frame].entity.params[4]
        assert [names[file[one].entity.params[4]] for one in compartments] == ["A", "B", "C"]
    assert "Rq 4.4 nm" in notes["surface finish"]


def test_what_is_refused(
    record: Path, exports: Path, tmp_path: Path, cli: Callable[..., Any]
) -> None:
    sample, out = Path(__file__).parents[2] / "docs" / "sample", tmp_path / "out"
    for words, wrong in (
        ((record,), "shell_a.step is not there: build the shell too"),
        ((sample, "--out", out), "its mirrors are planar"),
        ((exports, "--yield", "1.5"), "--yield 1.5: allowed is"),
    ):
        assert wrong in cli("order", "--process", "cnc", *words, code=2).err
    told = cli("inspection", exports, code=2).err
    assert "tbcad inspection is now called order: write tbcad order" in told
    assert not out.exists()


def test_same_bytes(exports: Path, written: Path, tmp_path: Path) -> None:
    order(exports, out=tmp_path / "again")
    assert contents(tmp_path / "again") == contents(written)


def test_mandrel_and_nickel_share_the_limit(written: Path) -> None:
    """Linearly, by what each adds: both at their parts are at the limit of the shell."""
    defocus = sqrt(3 * 4 / 21)  # 1 of 3 terms of order 2, which have 4 / 7 of the variance
    mandrel, nickel = (
        hypot(centre, radius, defocus * waviness)
        for centre, radius, waviness in ((0.25, 0.25, 0.06), (0.1, 0.1, 0.05))
    )
    read = read_tolerances(written / "mandrel_a_tolerances.step")
    zones = sorted(one.value for one, _ in read if one.kind == "profile")
    parts = table(written, "offset_limit_um") * mandrel / (mandrel + nickel)
    assert zones == pytest.approx(np.sort(2e-3 * parts), abs=3e-6)
    whole = 2 * hypot(0.25, 0.25, 0.1, 0.1, defocus * 0.06, defocus * 0.05)
    assert table(written, "offset_chain_um") == pytest.approx(whole)


def test_radius_is_what_a_fit_of_the_patch_finds() -> None:
    """Of a sphere with defocus, by least squares over the patch."""
    step = ChainStep.model_validate(
        {"title": "x", "waviness_um": {"magnitude": 0.3, "source": "test"}}
    )
    radius, half = 40.0, 3.5
    held = two_sigma([step], np.array([radius]), np.array([half]), 80.0)[0]
    rho = np.sqrt(np.linspace(0, 1, 2001))
    amplitude = 2 * 0.3e-3 * sqrt(4 / 21)
    height = amplitude * sqrt(3) * (2 * rho**2 - 1)
    fit = np.polynomial.polynomial.polyfit((half * rho) ** 2 / 2, height, 1)
    assert held[0] == pytest.approx(-1e3 * fit[0])
    assert held[2] == pytest.approx(fit[1] * radius**2)


def test_the_page_is_whole_and_legible(exports: Path, written: Path) -> None:
    record = json.loads((written / "order.json").read_text(encoding="utf-8"))
    sheet = order_sheet(exports, record, load_spec(None, ["n=4"]))
    check_texts(sheet)
    told = [one.text for one in texts(sheet)]
    assert min(one.height for one in texts(sheet)) >= 1.6
    assert {"A", "B", "C", "B7", "C8", "MB7", "MC8", "5", "8.6"} <= set(told)
    whole = " ".join(told)
    for words in (
        "Rq (Sq) 4.4 nm",
        "190 degrees",
        "SiO2",
        "ball cutter R 0.5 mm",
        "0.99^60 = 45%",
        "22 x Ø 4.3, 8 x Ø 4",
    ):
        assert words in whole, words
    assert b"/Count 1" in (written / "order.pdf").read_bytes()


def test_what_is_not_held_is_never_quoted_as_held(
    exports: Path, tmp_path: Path, cli: Callable[..., Any]
) -> None:
    out = tmp_path / "out"
    told = cli("order", exports, "--process", "sla", "--out", out, code=1).out
    remedy = "not held: tbcad build --process sla has larger margins"
    offset = next(line for line in told.splitlines() if "offset" in line)
    assert offset.endswith(remedy)
    assert (out / "shell_a_tolerances.step").read_text("ascii").count(remedy) >= 2
    record = json.loads((out / "order.json").read_text(encoding="utf-8"))
    assert not record["chain"]["holds"]
    assert (table(out, "offset_chain_um") > table(out, "offset_limit_um")).any()


def test_chains_that_are_refused(exports: Path, tmp_path: Path, cli: Callable[..., Any]) -> None:
    own, out = tmp_path / "own.toml", tmp_path / "out"
    for text, wrong in (
        (OWN + "material = { value = 'Ω', source = 'test' }", "step bath"),
        (OWN + "measured_with = { value = 'a', source = 'test', uncertainty_um = 0 }", "step bath"),
    ):
        own.write_text(text, encoding="utf-8")
        assert wrong in cli("order", exports, "--process", own, "--out", out, code=2).err
    process = load_process("nickel-milled").model_copy(update={"mandrel_cutter_mm": 90.0})
    limits = MirrorLimits(np.ones((98, 3)), np.ones((98, 3)), 1.0)
    with pytest.raises(InputError, match="radius of 90 mm, allowed is less than"):
        chain_of(read_export(exports), process, "big", limits, 0.99)
    shells = shutil.copytree(
        exports, tmp_path / "shells", ignore=shutil.ignore_patterns("*mandrel*")
    )
    told = cli("order", shells, "--out", out, code=2).err
    assert "tbcad build --set shell.negative=true" in told
    assert not out.exists()


def test_every_built_in_chain_says_what_it_is_made_of() -> None:
    for name in BUILT_IN:
        steps = load_process(name).made
        assert any(step.material for step in steps), name
        assert any(step.measured_with for step in steps), name


def test_samples_are_tight_ones_all_over_the_shell() -> None:
    places = np.random.default_rng(3).uniform(0, 100, (400, 3)) * (1, 1, 0)
    each = np.random.default_rng(4).uniform(1, 2, (800, 3))
    each[[17, 417 + 5]] = 0.1
    chosen = sampled(places, MirrorLimits(each, each, 1.0), 20)
    assert len(set(chosen.tolist())) == 20
    assert {17, 22} & set(chosen.tolist())
    tight = (each / np.median(each, axis=0)).min(axis=1).reshape(2, -1).min(axis=0)
    assert tight[chosen].max() < np.median(tight)
    away = np.linalg.norm(places[:, None] - places[chosen], axis=2).min(axis=1)
    assert away.max() < 45  # of a side of 100
    assert confidence(299) >= 0.95 > confidence(298)


def test_scatter_of_roughness() -> None:
    """Small: (4 pi Rq / wavelength)^2; balls at the limit of G40 scatter most of the light."""
    assert scattered_share(0.1) == pytest.approx((4 * np.pi * 0.1 / 550) ** 2, rel=1e-5)
    assert scattered_share(roughness_nm(0.37)) == pytest.approx(0.37)
    assert roughness_nm() == pytest.approx(4.388, abs=1e-3)
    assert scattered_share(60 * sqrt(np.pi / 2)) == pytest.approx(0.947, abs=1e-3)
