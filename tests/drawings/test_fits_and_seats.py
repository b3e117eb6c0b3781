"""Fits and seats on sheets: sizes of solids and lists, nothing that is not in the design."""

import math
from pathlib import Path

import numpy as np
import pytest

from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.cad.formats.step import write_step
from tbcad.cad.kernel.brep import Solid
from tbcad.cad.kernel.features import RoundFace
from tbcad.cad.kernel.solids import cut, cylinder, faces, one_solid, polygon, prism
from tbcad.core.spec.load import load_spec
from tbcad.drawings.export import DrawnExport
from tbcad.drawings.part_sheet import draw_part
from tbcad.drawings.tables import (
    DrawnHole,
    ListedSeat,
    Mate,
    SheetTable,
    fits_table,
    in_columns,
    numbered_holes,
    purchased_mate,
    reamed_to,
    seats_table,
    table_rows,
)
from tbcad.output.manifest import read_manifest, write_manifest
from tbcad.prototype.assembly_steps.machine import AssembledMachine
from tbcad.prototype.files.bom import COLUMNS, PartsList
from tbcad.prototype.purchased.parts import load_parts
from tbcad.records.design import DesignRecord
from tbcad.records.prototype import CapRecord, Prototype
from tbcad.records.tables import BallRow
from tbcad.types import Floats
from tests.prototype_records import printed_part, prototype_document
from tests.sheet_texts import check_texts, texts

PARTS = load_parts()
X, Y, Z = np.eye(3)
ORIGIN = np.zeros(3)
WHAT = "carrier of the balls, turns about the axis; ream its bore 8 H7"


def hole(place: Floats, diameter: float, along: Floats = Z) -> RoundFace:
    return RoundFace(place, place + 6 * along, diameter / 2, 360.0, hollow=True, open_start=True)


def mate(name: str, place: Floats = ORIGIN, reamed: str = "") -> Mate:
    found = purchased_mate(PARTS[name], place, Z, reamed)
    assert found is not None
    return found


def rows(holes: list[RoundFace], *mates: Mate) -> list[tuple[str, ...]]:
    return [*fits_table(numbered_holes(holes, ()), mates).rows]


@pytest.mark.parametrize(
    ("name", "diameter", "row"),
    [
        ("MAGNET-8x3", 8.2, ("B1", "8.2", "MAGNET-8x3", "8", "0.2", "glue in")),
        ("DOWEL-3x10", 3.1, ("B1", "3.1", "DOWEL-3x10", "3 m6", "0.1", "")),
        ("INSERT-M3", 4.0, ("B1", "4", "INSERT-M3", "4.6", "-0.6", "press in hot")),
        ("608-2Z", 21.95, ("B1", "21.95", "608-2Z", "22", "-0.05", "press in")),
        ("SHAFT-8x120", 8.5, ("B1", "8.5", "SHAFT-8x120", "8 h6", "0.5", "")),
    ],
)
def test_a_fit_is_of_the_hole_and_what_goes_in(
    name: str, diameter: float, row: tuple[str, ...]
) -> None:
    assert rows([hole(ORIGIN, diameter)], mate(name)) == [row]


def test_a_bore_is_reamed_where_the_part_says_so() -> None:
    assert reamed_to(WHAT) == "H7"
    assert reamed_to("head with bearings and motor") == ""
    (row,) = rows([hole(ORIGIN, 8.0)], mate("SHAFT-8x120", reamed="H7"))
    assert row == ("B1", "8 H7", "SHAFT-8x120", "8 h6", "0", "ream H7")
    (row,) = rows([hole(ORIGIN, 8.5)], mate("SHAFT-8x120", reamed="H7"))
    assert row[1] == "8.5"  # a hole that has play is not reamed


def test_screws_and_holes_elsewhere_are_no_fits() -> None:
    assert purchased_mate(PARTS["M3x12"], ORIGIN, Z) is None
    assert purchased_mate(None, ORIGIN, Z) is None
    magnet = mate("MAGNET-8x3")
    assert rows([hole(5 * X, 8.2), hole(ORIGIN, 9.0), hole(ORIGIN, 8.2, X)], magnet) == []


def test_holes_that_are_alike_share_a_row() -> None:
    places = [10.0 * k * X for k in range(7)]
    found = rows([hole(one, 6.2) for one in places], *(mate("MAGNET-6x3", one) for one in places))
    assert [row[0] for row in found] == ["B1 B2 B3 B4 B5", "B6 B7"]
    assert len({row[1:] for row in found}) == 1


def test_a_tilted_hole_has_a_second_row_rather_than_tiny_text() -> None:
    axis = np.array([math.sin(0.5), 0.0, math.cos(0.5)])
    wall = hole(ORIGIN, 4.0, axis)
    for takes, count in (("", 1), ("MAGNET-6x3", 1), ("INSERT-M3 SET-M3x16", 2)):
        found = [*table_rows("T1", DrawnHole(wall, ORIGIN, "B", np.zeros(3), takes))]
        assert len(found) == count
        assert " ".join(row[-1] for row in found) == f"{takes} (0.479 0.000 0.878)".strip()
        assert {len(row) for row in found} == {7}


def test_tables_go_on_in_the_next_column() -> None:
    def of(name: str, count: int) -> SheetTable:
        return SheetTable((name,), (10.0,), tuple((str(k),) for k in range(count)))

    columns = in_columns([of("a", 6), of("b", 0), of("c", 4), of("d", 30)], 10, 20)
    shown = [[(one.head[0], len(one.rows)) for one in column] for column in columns]
    assert shown == [[("a", 6)], [("c", 4), ("d", 13)], [("d", 17)]]
    values = [
        row[0] for column in columns for one in column if one.head == ("d",) for row in one.rows
    ]
    assert values == [str(k) for k in range(30)]


@pytest.fixture(scope="module")
def carrier() -> Solid:
    """A plate of 80 x 60 x 10 about the axis z: bore of 8, pockets of 8.2 and 6.2, two inserts."""
    corners = np.array([[-40, -30, 0], [40, -30, 0], [40, 30, 0], [-40, 30, 0]], dtype=np.float64)
    tools = [
        cylinder(-Z, Z, 4.0, 20.0),
        cylinder(np.array([25.0, 10.0, 6.0]), Z, 4.1, 5.0),
        cylinder(np.array([-25.0, 10.0, 6.0]), Z, 3.1, 5.0),
    ]
    shape = one_solid("carrier", cut(prism(polygon(corners), 10.0 * Z), tools))
    return Solid("carrier", shape, tuple((f"f{k}", one) for k, one in enumerate(faces(shape))))


def test_seats_are_listed_on_the_part_that_has_their_pads(carrier: Solid) -> None:
    contacts = np.array([[20.0, 10.0, 10.0], [30.0, 10.0, 10.0], [25.0, 15.0, 10.0]])
    here = ListedSeat(7, "ball 16 mm", 8.0, np.array([25.0, 10.0, 15.0]), Z, contacts, 3.0)
    there = ListedSeat(
        8, "ball 17 mm", 8.5, np.array([25.0, 10.0, 35.0]), Z, contacts + 20 * Z, 3.0
    )
    table = seats_table(carrier.shape, [here, there])
    assert table.rows == (("7", "ball 16 mm", "8.000", "25.00", "10.00", "15.00", "Ø3"),)


def export(folder: Path, carrier: Solid) -> DrawnExport:
    """A machine that is the plate with a cap and a ball, on a shaft of 8 mm."""
    write_step(folder / "carrier.step", carrier, pcurves=False)
    rest = dict.fromkeys(BallRow.columns(), 1)
    names = ("number", "kind", "size", "body_radius_mm", "bx", "by", "bz")
    cells = (1, "cap", "cap R 40 mm", 9, 25, 10, 16), (2, "ball", "16 mm", 8.0, -25, 10, 15)
    balls: list[Row] = [rest | dict(zip(names, one, strict=True)) for one in cells]
    write_table(folder / "balls.csv", tuple(rest), balls)
    write_manifest(folder, "build")
    pads = np.array([[4.0, 0.0, 0.0], [-4.0, 0.0, 0.0], [0.0, 4.5, 0.0]])
    seat = {"axis": [0.0, 0.0, -1.0], "pad_diameter_mm": 3.0}
    shown = {"turns": True, "finish": None}
    magnet = {"name": "magnet", "along": [0, 0, 1], "through": ["carrier"], **shown}
    cap_sizes = dict.fromkeys(CapRecord.model_fields, 1.0) | {"spigot_mm": 8.1, "socket_mm": 8.2}
    words = ("material", "finish", "polarity", "pdf", "dxf")
    record = prototype_document(
        frame={"axis": Z.tolist(), "zero": X.tolist(), "third": Y.tolist()},
        parts=[printed_part("carrier", "base", what=WHAT)],
        bought=[
            {"name": "shaft", "what": "", "part": "SHAFT-8x120", **shown},
            {"name": "camera", "what": "", "part": None, **shown},
        ],
        seats=[
            {
                "ball": ball,
                "contacts_mm": (pads + np.array(place)).tolist(),
                "normals": np.eye(3).tolist(),
                **seat,
            }
            for ball, place in ((1, [25, 10, 10]), (2, [-25, 10, 10]))
        ],
        caps=[cap_sizes | {"ball": 1} | dict.fromkeys(words, "")],
        fasteners=[
            {"part": "MAGNET-8x3", "position_mm": [25, 10, 7], **magnet},
            {"part": "MAGNET-6x3", "position_mm": [-25, 10, 7], **magnet},
        ],
    )
    row = {"item": 65, "part": "carrier", "quantity": 1, "material": "PETG"}
    bill = PartsList((dict.fromkeys(COLUMNS, None) | row,))
    machine = AssembledMachine(bill, Prototype.model_validate(record), (), {}, PARTS)
    design = DesignRecord.model_construct(spec=load_spec(None, ["n=6"]))
    manifest = read_manifest(folder)
    assert manifest is not None
    return DrawnExport(folder, manifest, design, machine)


def test_the_carriers_sheet_has_its_fits_and_seats(carrier: Solid, tmp_path: Path) -> None:
    made = export(tmp_path, carrier)
    (sheet,) = draw_part(made, made.parts["carrier"])
    check_texts(sheet)
    words = [one.text for one in texts(sheet)]

    def row(of: str, head: str, count: int) -> list[str]:
        start = words.index(of, words.index(head))
        return words[start : start + count]

    assert row("8 H7", "fits", 5) == ["8 H7", "SHAFT-8x120", "8 h6", "0", "ream H7"]
    assert row("MAGNET-8x3", "fits", 4) == ["MAGNET-8x3", "8", "0.2", "glue in"]
    assert row("MAGNET-6x3", "fits", 4) == ["MAGNET-6x3", "6", "0.2", "glue in"]
    assert row("spigot of cap 1", "fits", 3) == ["spigot of cap 1", "8.1", "0.1"]
    assert row("cap 1", "seat", 6) == ["cap 1", "9.000", "25.00", "10.00", "16.00", "Ø3"]
    assert row("ball 16 mm", "seat", 6) == ["ball 16 mm", "8.000", "-25.00", "10.00", "15.00", "Ø3"]
