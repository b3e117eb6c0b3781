import math
from pathlib import Path

import pytest

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.purchased.parts import (
    COMMON_COLUMNS,
    SIZES,
    load_parts,
    of_kind,
    package_lists,
)

PARTS = load_parts()


def package_copy(folder: Path) -> Path:
    for path in Path(str(package_lists())).glob("*.csv"):
        (folder / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    return folder


def test_nema_17_has_its_pattern() -> None:
    for name in ("NEMA17-40", "NEMA17-48", "NEMA17-60"):
        motor = PARTS[name]
        assert [motor[size] for size in ("hole_square_mm", "thread_mm")] == [31, 3]
        assert [motor[size] for size in ("pilot_mm", "shaft_mm")] == [22, 5]


def test_every_kind_has_parts() -> None:
    assert {part.kind for part in PARTS.values()} == set(SIZES)
    bearing = PARTS["608-2Z"]
    assert [bearing[size] for size in ("bore_mm", "outer_mm", "width_mm")] == [8, 22, 7]


@pytest.mark.parametrize(
    ("kind", "density", "size"),
    [("magnets", 7.5, "height_mm"), ("dowels", 7.85, "length_mm"), ("shafts", 7.85, None)],
)
def test_masses_of_rods(kind: str, density: float, size: str | None) -> None:
    for part in of_kind(PARTS, kind):
        volume = math.pi / 4 * part["diameter_mm"] ** 2 * part[size or "length_mm"]
        assert part.mass_g == pytest.approx(density * 1e-3 * volume, rel=1e-3)


def test_longer_screws_are_heavier() -> None:
    screws = of_kind(PARTS, "screws")
    for one in screws:
        for other in screws:
            if one["thread_mm"] == other["thread_mm"]:
                longer = one["length_mm"] > other["length_mm"]
                assert not longer or one.mass_g > other.mass_g


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (",w,m,1,3,3,s", "magnets.csv, line 3, column part: empty"),
        ("A,,m,1,3,3,s", "column what: empty"),
        ("A,w,m,0,3,3,s", "line 3, column mass_g: '0', allowed is a number above 0 to"),
        ("A,w,m,1,3,3 mm,s", "column height_mm: '3 mm'"),
        ("A,w,m,1,3,1e9,s", "column height_mm: '1e9'"),
        ("A,w,m,1,3,3,", "column source: empty"),
        ("OK,w,m,1,3,3,s", "line 3, column part: 'OK' twice"),
        ("608-2Z,w,m,1,3,3,s", "column part: '608-2Z' twice"),
    ],
)
def test_wrong_cells_are_named(tmp_path: Path, row: str, message: str) -> None:
    path = package_copy(tmp_path) / "magnets.csv"
    header = ",".join([*COMMON_COLUMNS, *SIZES["magnets"], "source"])
    path.write_text(f"{header}\nOK,w,m,1,3,3,s\n{row}\n")
    with pytest.raises(SpecError) as caught:
        load_parts(tmp_path)
    assert message in str(caught.value)


def test_missing_list(tmp_path: Path) -> None:
    (package_copy(tmp_path) / "leds.csv").unlink()
    with pytest.raises(SpecError, match=r"leds\.csv: cannot be read"):
        load_parts(tmp_path)


def test_kind_and_sizes() -> None:
    assert [part.name for part in of_kind(PARTS, "screws", thread_mm=3, length_mm=8)] == ["M3x8"]
    assert len(of_kind(PARTS, "motors")) == 3
    assert not of_kind(PARTS, "magnets", diameter_mm=2.001)
