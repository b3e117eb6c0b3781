"""prototype.json and the tables that go with it, strictly.

What is wrong in form is refused here; what is wrong in fact is for the checks.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from tbcad_verify.errors import BadExport
from tbcad_verify.record.fields import (
    Record,
    limited,
    number,
    objects,
    parse,
    plain_file,
    three,
    triple,
    typed,
    vector,
    word,
)
from tbcad_verify.record.files import AGAIN, MAX_TEXT_BYTES, read
from tbcad_verify.record.prototype_record import (
    BALL_COLUMNS,
    BALLS,
    NUMBERS,
    PLAN,
    PROGRAM,
    RECORD,
    ROLES,
    STOPS,
    Balls,
    Bought,
    Led,
    Printed,
    Prototype,
    Seats,
)
from tbcad_verify.record.prototype_tables import cells, read_plan, read_stops
from tbcad_verify.types import Floats

TABLES = (BALLS, PLAN, STOPS, PROGRAM)
SCHEMA = "tbcad-prototype/1"
PICTURES = ("moved", "fixed")
KINDS = ("ball", "cap")
KINDS_OF_ALL = ("step", "glb")
MOST = 1000  # balls, parts or LEDs
WORDS = ("size", "grade", "standard")


def read_prototype(folder: Path, cameras: Collection[str]) -> Prototype:
    """Read prototype.json and its tables.

    Args:
        folder: the export, resolved.
        cameras: ids that the design has.

    Raises:
        BadExport: anything missing, foreign, malformed, not finite or absurd.
    """
    texts = {name: read(folder, name, MAX_TEXT_BYTES) for name in (RECORD, *TABLES)}
    found = parse(texts[RECORD])
    if found.get("schema") != SCHEMA:
        raise BadExport(f"{RECORD}: schema must be {SCHEMA!r}, not {found.get('schema')!r:.60}")
    camera = word(found, "camera", RECORD)
    if camera not in cameras:
        raise BadExport(f"{RECORD}: camera {camera!r} is not in design.json; {AGAIN}")
    balls = _balls(objects(found, "balls", RECORD))
    return Prototype(
        camera=camera,
        target_mm=number(found, "target_mm", 1e-3, 1e6, RECORD),
        moved=_choice(found, "picture", PICTURES) == "moved",
        frame=_frame(typed(found, "frame", dict, RECORD)),
        swing=_swing(typed(found, "swing_deg", list, RECORD)),
        pad_um=number(found, "target_pad_um", 1e-3, 1e4, RECORD),
        balls=balls,
        seats=_seats(objects(found, "seats", RECORD), len(balls)),
        parts=_parts(objects(found, "parts", RECORD), balls),
        leds=_leds(found),
        bought=_bought(found),
        plan=read_plan(texts[PLAN]),
        stops=read_stops(texts[STOPS]),
        program=texts[PROGRAM].text(),
        ball_rows=cells(texts[BALLS], BALL_COLUMNS),
        assembly=_assembly(found),
        digests={name: blob.digest for name, blob in texts.items()},
    )


def _choice(record: Record, key: str, allowed: tuple[str, ...]) -> str:
    value = typed(record, key, str, RECORD)
    if value not in allowed:
        raise BadExport(f"{RECORD}: {key} must be one of {', '.join(allowed)}; {AGAIN}")
    return str(value)


def _frame(record: Record) -> Floats:
    return np.stack([vector(record, key, RECORD) for key in ("axis", "zero", "third")])


def _swing(value: list[Any]) -> tuple[float, float]:
    if len(value) != 2:
        raise BadExport(f"{RECORD}: swing_deg must be two numbers, not {value!r:.60}; {AGAIN}")
    low, high = (limited(f"{RECORD}: swing_deg", item, -360, 360) for item in value)
    if low > high:
        raise BadExport(f"{RECORD}: swing_deg must ascend, not {value!r:.60}; {AGAIN}")
    return low, high


def _balls(items: Any) -> Balls:
    _refuse_many("balls", len(items), 1)
    for k, item in enumerate(items, 1):
        if item.get("number") != k or isinstance(item["number"], bool):
            raise BadExport(f"{RECORD}: ball {k} must have number {k}; {AGAIN}")
        for key in WORDS:
            if not isinstance(item.get(key), str | None):
                raise BadExport(f"{RECORD}: ball {k}: {key} must be a text or null; {AGAIN}")
        if item.get("mass_g") is not None:
            number(item, "mass_g", 0, 1e9, RECORD)
    cap = [_choice(item, "kind", KINDS) == "cap" for item in items]
    table = np.array([[_ball_number(item, key) for key in NUMBERS] for item in items])
    return Balls(np.array(cap), table, tuple(items))


def _ball_number(item: Record, key: str) -> float:
    positive = key in ("diameter_mm", "radius_mm", "body_radius_mm")
    what = f"{RECORD}: ball {item['number']}: {key}"
    return limited(what, item.get(key), 1e-3 if positive else -1e9, 1e4 if positive else 1e9)


def _seats(items: Any, count: int) -> Seats:
    if [item.get("ball") for item in items] != list(range(1, count + 1)):
        raise BadExport(f"{RECORD}: seats must be one for each ball, in order; {AGAIN}")
    return Seats(
        np.array([vector(item, "axis", RECORD) for item in items]),
        np.array([triple(item, "normals", RECORD) for item in items]),
        np.array([triple(item, "contacts_mm", RECORD) for item in items]),
        np.array([number(item, "pad_diameter_mm", 1e-3, 1e3, RECORD) for item in items]),
    )


def _parts(items: Any, balls: Balls) -> tuple[Printed, ...]:
    _refuse_many("parts", len(items), 1)
    parts = tuple(_part(item, balls) for item in items)
    if len({part.name for part in parts}) != len(parts):
        raise BadExport(f"{RECORD}: parts must have names of their own; {AGAIN}")
    if len({part.stl for part in parts}) != len(parts):
        raise BadExport(f"{RECORD}: parts must each have an STL of their own; {AGAIN}")
    return parts


def _part(item: Record, balls: Balls) -> Printed:
    role, ball = _choice(item, "role", ROLES), item.get("ball")
    good = type(ball) is int and 1 <= ball <= len(balls) if role == "cap" else ball is None
    if not good:
        raise BadExport(f"{RECORD}: ball of a part must be a cap's ball or null; {AGAIN}")
    return Printed(
        word(item, "name", RECORD),
        role,
        ball - 1 if isinstance(ball, int) else -1,
        _whole(item, "quantity"),
        plain_file(item, "stl", RECORD),
        plain_file(item, "step", RECORD) if item.get("step") else "",
        plain_file(item, "3mf", RECORD) if item.get("3mf") else "",
        triple(item, "axes", RECORD),
        vector(item, "origin_mm", RECORD),
    )


def _whole(item: Record, key: str) -> int:
    value = item.get(key)
    if type(value) is not int or not 1 <= value <= MOST:
        raise BadExport(f"{RECORD}: {key} must be a whole number from 1 to {MOST}; {AGAIN}")
    return value


def _leds(found: Record) -> tuple[Led, ...]:
    items = objects(found, "leds", RECORD)
    _refuse_many("leds", len(items), 0)
    return tuple(
        Led(
            word(item, "name", RECORD),
            three(f"{RECORD}: position_mm", item.get("position_mm")),
            three(f"{RECORD}: direction", item.get("direction")),
        )
        for item in items
    )


def _bought(found: Record) -> tuple[Bought, ...]:
    items = objects(found, "bought", RECORD)
    _refuse_many("bought parts", len(items), 0)
    for item in items:
        if not isinstance(item.get("turns"), bool):
            raise BadExport(f"{RECORD}: turns of a bought part must be true or false; {AGAIN}")
    return tuple(Bought(word(item, "name", RECORD), item["turns"]) for item in items)


def _assembly(found: Record) -> tuple[str, str]:
    if found.get("assembly") is None:
        return "", ""
    record = typed(found, "assembly", dict, RECORD)
    names = {
        kind: plain_file(record, kind, RECORD) if record.get(kind) else "" for kind in KINDS_OF_ALL
    }
    return names["step"], names["glb"]


def _refuse_many(what: str, count: int, least: int) -> None:
    if not least <= count <= MOST:
        raise BadExport(f"{RECORD}: {count} {what}; allowed are {least} to {MOST}; {AGAIN}")
