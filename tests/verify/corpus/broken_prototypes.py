"""Prototypes that are broken in what is driven, bought, drilled, drawn, or seen through."""

from __future__ import annotations

import io
import json
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
from scipy.spatial.transform import Rotation

from tests.exported_files import Rows, edit_csv, read_csv
from tests.verify.corpus.copies import load, put, store
from tests.verify.corpus.mutation import (
    DROP,
    Job,
    Mutation,
    as_bytes,
    at,
    fails,
    plus,
    refused,
    together,
)

RECORD, DESIGN, PROGRAM = "prototype.json", "design.json", "rotation_plan.nc"
STEP, GLB = "prototype.step", "prototype.glb"
BALLS, HOLES, SAG = "balls.csv", "plate_holes.csv", "sag.csv"
PLAN, STOPS = "rotation_plan.csv", "stops.csv"
SETTINGS = "grbl_settings.txt"
CAP, SHEET = "drawing_cap_1.dxf", "drawing_plate.pdf"
PLATE, WHEEL, LAMP = (f"drawing_{name}.dxf" for name in ("plate", "wheel", "lamp"))


def record(path: str, to: object = DROP) -> Job:
    """Another value in the record, or none."""
    return at(path, to, RECORD)


def asked(key: str, to: object) -> Job:
    """Another value of a key of the spec's prototype."""
    return at(f"spec/prototype/{key}", to)


def table(name: str, how: Callable[[Rows], object]) -> Job:
    """Change the rows of a table."""

    def job(folder: Path) -> None:
        put(folder, name, (folder / name).read_bytes())  # a file of its own
        edit_csv(folder / name, how)

    return job


def row(name: str, number: int, **cells: object) -> Job:
    """Other cells in one row of a table."""
    return table(name, lambda rows: rows[number].update({k: str(v) for k, v in cells.items()}))


def half_the_carriers(rows: Rows) -> None:
    """Half of the carrier's sag, as of a stiffer material."""
    for one in rows:
        one.update({k: str(float(v) / 2) for k, v in one.items() if k.startswith("carrier")})


def seats_turned(share: float) -> Callable[[Rows], None]:
    """So much of the turns of seats."""

    def how(rows: Rows) -> None:
        for one in rows:
            one.update({k: str(share * float(v)) for k, v in one.items() if k.endswith("_rad")})

    return how


def seats_of_others(rows: Rows) -> None:
    """Turns of the next ball."""
    others = [dict(one) for one in (*rows[1:], rows[0])]
    for one, other in zip(rows, others, strict=True):
        one.update({k: v for k, v in other.items() if k.endswith("_rad")})


def more_of_the_shaft(rows: Rows) -> None:
    """All balls half a millimetre lower at all stops."""
    for one in rows:
        one.update(shaft_z_mm=str(float(one["shaft_z_mm"]) - 0.5))


def swaying(most: float) -> Job:
    """The frame turns by up to so many radians from stop to stop, and no ball on the mean."""

    def job(folder: Path) -> None:
        value = load(folder, RECORD)
        axis, across = (np.array(value["frame"][name]) for name in ("axis", "third"))
        balls, plan, stops = (read_csv(folder / name) for name in (BALLS, PLAN, STOPS))
        names = (("bx", "sag_x_mm"), ("by", "sag_y_mm"), ("bz", "sag_z_mm"))
        bodies = [[sum(float(one[x]) for x in some) for some in names] for one in balls]
        angles = np.radians([float(one["base_angle_deg"]) for one in stops])
        turns = Rotation.from_rotvec(angles[:, None] * axis).as_matrix()
        moved = np.cross(turns.swapaxes(1, 2) @ across, np.array(bodies)[:, None]).swapaxes(0, 1)
        shown = np.zeros(moved.shape[:2])
        for one in plan:
            shown[int(one["stop"]) - 1, int(one["ball"]) - 1] += 1
        means = (shown[..., None] * moved).reshape(len(moved), -1)
        turn = np.resize([1.0, -1.0], len(moved))
        turn -= means @ np.linalg.lstsq(means, turn, rcond=None)[0]
        moved = most / np.abs(turn).max() * turn[:, None, None] * moved @ turns.swapaxes(1, 2)

        def how(rows: Rows) -> None:
            for one, way in zip(rows, moved.reshape(-1, 3), strict=True):
                for name, by in zip("xyz", way.tolist(), strict=True):
                    key = f"uprights_{name}_mm"
                    one[key] = repr(float(one[key]) + by)

        table(SAG, how)(folder)

    return job


def redrawn(name: str, how: Callable[[Any], object]) -> Job:
    """Change the entities of a DXF."""

    def job(folder: Path) -> None:
        document = ezdxf.filemanagement.readfile(folder / name)
        how(document.modelspace())
        text = io.StringIO()
        document.write(text)
        put(folder, name, text.getvalue().encode())

    return job


def smallest_circle(space: Any) -> Any:
    """Of those to be cut."""
    found = [one for one in space.query("CIRCLE") if one.dxf.layer == "cut"]
    return min(found, key=lambda one: one.dxf.radius)


def shifted_circle(space: Any) -> None:
    smallest_circle(space).dxf.center += (0.01, 0)


def fewer_circles(space: Any) -> None:
    space.delete_entity(smallest_circle(space))


def longer_outline(space: Any) -> None:
    for line in space.query("LWPOLYLINE"):
        if line.dxf.layer == "cut":
            line.set_points([(1.001 * x, y, *rest) for x, y, *rest in line.get_points()])


def rewritten(name: str, how: Callable[[str], str]) -> Job:
    """Change a text."""
    return as_bytes(name, lambda data: how(data.decode()).encode())


def text_of(name: str, pattern: str, new: str, count: int = 0) -> Job:
    """Change a text, with a regular expression."""
    return rewritten(name, lambda text: re.sub(pattern, new, text, count=count))


def sheet(old: bytes, new: bytes, name: str = SHEET) -> Job:
    """Change a drawing's PDF."""
    return as_bytes(name, lambda data: data.replace(old, new, 1))


def undrawn(name: str) -> Job:
    """A body under another name, in STEP and GLB alike."""

    def other(document: Any, _: bytearray) -> None:
        for key in ("nodes", "meshes", "materials"):
            next(one for one in document[key] if one["name"] == name)["name"] = "thing"

    return together(rewritten(STEP, lambda text: text.replace(f"'{name}'", "'thing'")), glb(other))


def glb(how: Callable[[Any, bytearray], object]) -> Job:
    """Change the JSON or the numbers of the GLB."""

    def job(folder: Path) -> None:
        data = (folder / GLB).read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        document, binary = json.loads(data[20 : 20 + length]), bytearray(data[28 + length :])
        how(document, binary)
        text = json.dumps(document).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
        put(folder, GLB, struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)

    return job


def mounted_in(body: str, key: str) -> Job:
    """The first fastener that presses on a body is mounted in another step."""

    def how(value: Any) -> Any:
        name = next(one["name"] for one in value["fasteners"] if one["through"][0] == body)
        for step in value["assembly_steps"]:
            others = [one for one in step["mounts"] if one != name]
            step["mounts"] = [*others, *[name] * (step["key"] == key)]
        return value

    return lambda folder: store(folder, RECORD, how(load(folder, RECORD)))


def spigot(cap: str, by: float) -> Job:
    """Make the widest cylinder of a cap's own STEP file thinner, mm."""
    pattern = re.compile(r"(CYLINDRICAL_SURFACE\('[^']*',#\d+,)([-+\d.E]+)")

    def how(text: str) -> str:
        widest = max(float(found[2]) for found in pattern.finditer(text))
        return pattern.sub(
            lambda m: f"{m[1]}{widest - by}" if float(m[2]) == widest else m[0], text
        )

    return rewritten(f"{cap}.step", how)


def renamed(old: str, new: str) -> Job:
    """A file of the carrier under another name, which the record tells."""

    def job(folder: Path) -> None:
        (folder / old).rename(folder / new)
        manifest = load(folder, "manifest.json")
        manifest["files"][new] = manifest["files"].pop(old)
        store(folder, "manifest.json", manifest)
        record("parts/carrier/step", new)(folder)

    return job


def white(material: Any) -> None:
    material["pbrMetallicRoughness"]["baseColorFactor"] = [1.0, 1.0, 1.0, 1.0]


def drawn_on(space: Any, layer: str) -> None:
    space.add_line((0, 0), (10, 10), {"layer": layer})


def bent_outline(space: Any) -> None:
    (outline,) = (one for one in space.query("LWPOLYLINE") if one.dxf.layer == "cut")
    outline.set_points([(x, y, 0, 0, 0.5) for x, y, *_ in outline.get_points()])


def flat_fold(space: Any) -> None:
    space.delete_entity(next(one for one in space.query("LINE") if one.dxf.layer == "fold"))


def drawn_away(name: str, x: float, y: float = 0.0, z: float = 0.0) -> Job:
    """Draw a body of the GLB elsewhere, mm."""

    def how(document: Any, binary: bytearray) -> None:
        (mesh,) = (one for one in document["meshes"] if one["name"] == name)
        accessor = document["accessors"][mesh["primitives"][0]["attributes"]["POSITION"]]
        view = document["bufferViews"][accessor["bufferView"]]
        start, count = view["byteOffset"], 3 * accessor["count"]
        points = np.frombuffer(binary, "<f4", count, start).reshape(-1, 3) + np.float32([x, y, z])
        accessor.update(min=points.min(axis=0).tolist(), max=points.max(axis=0).tolist())
        binary[start : start + 4 * count] = points.astype("<f4").tobytes()

    return glb(how)


def moved_point(text: str) -> str:
    """The plate's box a millimetre longer: one coordinate of its corners."""
    start = text.index("PRODUCT('plate'")
    head, tail = text[:start], text[start:]
    values = re.findall(r"CARTESIAN_POINT\('',\(([-\d.E+]+),", tail)
    return head + tail.replace(f"({values[3]},", f"({float(values[3]) + 1.0!r},")


def moved_part(text: str) -> str:
    """The assembly moves a part by 5 mm."""
    start = text.index("ITEM_DEFINED_TRANSFORMATION")
    place = re.search(r"#(\d+),#(\d+)\)", text[start:])
    assert place
    point = re.search(rf"#{place[2]} = AXIS2_PLACEMENT_3D\('',#(\d+)", text)
    assert point
    old = f"#{point[1]} = CARTESIAN_POINT('',(0.,0.,0.))"
    assert old in text
    return text.replace(old, f"#{point[1]} = CARTESIAN_POINT('',(5.,0.,0.))")


def moved_hole(rows: Rows) -> None:
    rows[0]["y_mm"] = repr(float(rows[0]["y_mm"]) + 0.01)


ENTITY_END = r"(ENDSEC;\s+END)"
BOTH, PATTERN = "STEP, GLB", "shroud_front.dxf"
SCREW, LAMP_X = "fasteners/M5x16", "lamps/places/0/position_mm/0"
HEAVY = row(BALLS, -1, mass_g=20_000.0)


def one_side(leds: list[dict[str, object]]) -> list[dict[str, object]]:
    return [led | {"position_mm": [-23.0, float(k), -5.0]} for k, led in enumerate(leds)]


def shorter_screws(some: list[dict[str, str]]) -> list[dict[str, str]]:
    return [one | {"part": one["part"].replace("M5x30", "M5x26")} for one in some]


# By check and kind of file: name, what breaks it, and words of the detail.
Broken = dict[tuple[str, str], dict[str, tuple[Job, str]]]
FAILING: Broken = {
    ("plan program", PROGRAM): {
        "program: G92 X50": (text_of(PROGRAM, "G92 X.*", "G92 X50.0000"), "swing")
    },
    ("inventory", BOTH): {
        "a part not drawn": (undrawn("stage_post"), "stage_post is missing"),
        "a white body": (glb(lambda d, _: white(d["materials"][0])), "carrier has another colour"),
    },
    ("inventory", RECORD): {
        "a motor that turns": (record("bought/motor/turns", True), "motor turns"),
        "a panel too few": (record("shroud/panels/-1"), "shroud_right is not"),
    },
    ("fastener holes", RECORD): {
        "a screw not recorded": (record(SCREW), "without a fastener"),
        "a bracket without its screw": (
            record("fasteners/M5x8"),
            "upright_left_bracket_1: 2 of 5.5 mm without a fastener",
        ),
    },
    ("fasteners", RECORD): {
        "a screw beside its hole": (record(f"{SCREW}/position_mm/0", plus(0.1)), "elsewhere"),
        "a screw through another": (
            record(f"{SCREW}/through", ["stage_disc", "plate"]),
            "no hole in stage_disc",
        ),
    },
    ("key access", RECORD): {
        "screws of the wheel at last": (
            mounted_in("wheel", "shaft"),
            "bearing_head at every base angle",
        )
    },
    ("leds as designed", RECORD): {
        "an LED elsewhere": (record("leds/0/position_mm/0", plus(2.0)), "no pocket"),
        "an LED less": (record("leds/-1"), "4 pockets"),
        "LEDs not in the spec": (asked("stage/leds_mm", [[0.0, 0.0, -8.0]]), "LEDs elsewhere"),
    },
    ("leds seen", RECORD): {"LEDs on one side": (record("leds", one_side), "past an object")},
    ("object room", DESIGN): {
        "a lower floor of the object's room": (asked("stage/top_mm", -21.0), "stage_disc")
    },
    ("plays", DESIGN): {
        f"another {key}": (asked(key, to), words)
        for key, to, words in (
            ("base/clearance_mm", 0.6, "the cup of ball 1 is 0.500 mm from it"),
            ("base/cap_play_mm", 0.2, "a spigot has 0.100 mm of play"),
            ("frame/bearing_fit_mm", 0.0, "no hole for bearing_front"),
        )
    },
    ("plays", "carrier.step"): {
        "cups that are no spheres": (
            text_of("carrier.step", "SPHERICAL_SURFACE", "CYLINDRICAL_SURFACE"),
            "is no sphere about it",
        )
    },
    ("ball centres", DESIGN): {
        "pads that are moved otherwise": (asked("base/pad_offset_mm", 0.1), "um")
    },
    ("assembly step", BOTH): {
        "a plate of another size": (rewritten(STEP, moved_point), "plate"),
        "the motor drawn aside": (drawn_away("motor", 0.1), "motor"),
    },
    ("plate holes", HOLES): {
        "a hole less": (table(HOLES, list.pop), "the plate has 14"),
        "a hole 10 um aside": (table(HOLES, moved_hole), "hole 1"),
    },
    ("drawings", "DXF"): {
        f"drawing: {name} of {file}": (redrawn(file, how), words)
        for name, file, how, words in (
            ("a hole 10 um aside", PLATE, shifted_circle, "plate: no circle of 2.1 mm radius"),
            ("a hole less", WHEEL, fewer_circles, "circles for 6 holes"),
            ("a longer outline", PLATE, longer_outline, "plate: its outline"),
            ("a longer strip", LAMP, longer_outline, "lamp_1: its outlines are not"),
            ("a cut beside the holes", PLATE, lambda s: drawn_on(s, "cut"), "1 lines and 0 arcs"),
        )
    }
    | {
        f"sheet: {name}": (sheet(old, new), words)
        for name, old, new, words in (
            ("a script", b"/Catalog", b"/Catalog/OpenAction<</S/JavaScript/JS(x)>>", "objects"),
            ("half the page", b"1190.5512 841.8898", b"595.2756 420.9449", "its frame"),
            ("a scaled page", b"/Type/Page/", b"/Type/Page/UserUnit 2/", "objects"),
        )
    },
    ("drawings", "PDF"): {
        "assembly: a script": (
            sheet(b"/Catalog", b"/Catalog/OpenAction<</S/JavaScript/JS(x)>>", "assembly.pdf"),
            "objects",
        ),
        "assembly: a picture that is run": (
            sheet(b" S\n", b" S\n/X Do\n", "assembly.pdf"),
            "/X Do",
        ),
    },
    ("drawings", RECORD): {"no drawing of the plate": (record("drawings/0"), "no drawing")},
    ("controller settings", SETTINGS): {
        "settings: a short travel": (text_of(SETTINGS, r"\$130=.*", "$130=100"), "do not hold"),
        "settings: a long travel": (
            text_of(SETTINGS, r"\$130=.*", "$130=360"),
            "above the program",
        ),
    },
    ("homing", RECORD): {
        "home: another switch": (record("home/switch_deg", plus(5.0)), "the switch trips at"),
        "home: another end of homing": (record("home/homed_deg", 0.0), "homing ends at 0"),
        "home: a 67th of its error": (
            record("home/zero_error_deg", lambda value: value / 67),
            "the play of pin",
        ),
        "home: too short a pin": (record("home/pin", "ROD-4x10"), "does not reach"),
    },
    ("part files", RECORD): {
        f"{name} of the carrier": (record(f"parts/carrier/{key}", to), "carrier has")
        for name, key, to in (("no STEP", "step", ""), ("no 3MF", "3mf", ""))
    }
    | {"a STEP of another suffix": (renamed("carrier.step", "carrier.stp"), "carrier.stp")},
    ("coupons", DESIGN): {
        "coupons of fewer sizes": (asked("base/coupon_sizes", 1), "asks for 3"),
        "more offsets of coupons": (
            asked("base/coupon_offsets_mm", [0.0, 0.1, 0.2, 0.3]),
            "asks for 12",
        ),
    },
    ("requirements", DESIGN): {
        "a smaller swing": (asked("max_swing_deg", 1.0), "above prototype.max_swing"),
        "no caps": (asked("caps", False), "caps without"),
    },
    ("printable", DESIGN): {
        "a bed of 90 mm": (at("spec/printer/bed_mm", [90.0, 90.0, 90.0]), "bed")
    },
    ("camera mount", RECORD): {
        "camera: screws too short to move it": (record("fasteners", shorter_screws), "out_mm is"),
        "camera: more travel asked for": (asked("frame/camera_travel_mm", 40.0), "along_axis_mm"),
        "camera: another thread": (asked("frame/camera_screw_mm", 60.0), "the tripod slot is"),
        "camera: another length": (
            asked("frame/camera_back_mm", 120.0),
            "the fence is 78.90 mm behind",
        ),
        "camera: too high over its plate": (
            asked("frame/camera_axis_mm", 25.0),
            "the camera stands 22.50 mm from its axis",
        ),
    },
    ("sag left", SAG): {
        "sag: a modulus of rubber": (at("spec/printer/modulus_gpa", 0.02), "ball "),
    },
    ("sag as written", SAG): {
        "sag: half as much": (table(SAG, half_the_carriers), "root mean square"),
        "sag: bent below the hub": (row(SAG, 4, shaft_x_mm=0.5), "bend the base"),
    },
    ("turns as written", SAG): {
        "sag: seats that do not turn": (table(SAG, seats_turned(0.0)), "mrad"),
        "sag: half of the seats' turns": (table(SAG, seats_turned(0.5)), "mrad"),
        "sag: seats turned the other way": (table(SAG, seats_turned(-1.0)), "mrad"),
        "sag: turns in milliradians": (table(SAG, seats_turned(1e3)), "mrad"),
        "sag: turns of other seats": (table(SAG, seats_of_others), "mrad"),
    },
    ("coverage, balls", SAG): {
        "sag: caps that turn too much": (swaying(0.2), "shows too little"),
    },
    ("balls under weight", SAG): {
        "sag: seats for a stiffer carrier": (at("spec/printer/modulus_gpa", 0.1), "ball "),
        "sag: a weaker shaft": (table(SAG, more_of_the_shaft), "ball "),
    },
    ("camera gauge", RECORD): {
        "gauge: a mark aside": (record("camera_place/marks_mm/0/0/1", plus(0.1)), "is no corner"),
        "gauge: far turned": (
            record("camera_place/pictures/0/base_angle_deg", -150.0),
            "not turn so far",
        ),
    },
    ("cap tilt", STEP): {"cap: a spigot that is too thin": (spigot("cap_1", 1.0), "tilts")},
    ("ball sizes", BALLS): {"a cap of steel": (row(BALLS, 0, mass_g=9.0), "ball 1")},
    ("drive", BALLS): {"a heavy ball on the motor": (HEAVY, "the drive holds")},
    ("hold ratio", BALLS): {"a heavy ball on its magnet": (HEAVY, "ball")},
    ("ball contrast", BALLS): {"a rough ball": (row(BALLS, -1, grade="G40"), "ball 5")},
    ("fall energy", RECORD): {
        "no brake that is known": (record("bought/4/part", "BRAKE-17-0.1"), "with BRAKE-17-0.1")
    },
    ("board outputs", PROGRAM): {
        "a board of no outputs": (record("controller/board", "UNO-CNC-SHIELD"), "of UNO-CNC-SHIELD")
    },
    ("power off", BALLS): {
        "a heavy ball on the zero pin": (row(BALLS, -1, mass_g=1e6), "zero pin's pressure")
    },
    ("lamps", RECORD): {
        "lamps: one aside": (record(LAMP_X, plus(30.0)), "is drawn elsewhere"),
        "lamps: not listed": (record("lamps", None), "the record has none"),
    },
    ("upper lamps", GLB): {
        "upper lamps: asked for": (asked("light/upper", True), "the record has none")
    },
    ("light before and after", RECORD): {
        "lamps: light from one": (record(LAMP_X, plus(30.0)), "turn"),
        "lamps: one behind an upright": (drawn_away("upright_left", 60.0), "half turn"),
    },
    ("light paths, balls", GLB): {
        "a lamp before the pinhole": (drawn_away("lamp_1", -23.0, -52.0, 35.0), "lamp_1")
    },
    ("bodies apart", GLB): {
        "a washer in a web": (drawn_away("WASHER_5_15", 0, 2.0), "WASHER_5_15 and camera_bracket"),
        "a screw's head in a web": (drawn_away("M5x16_3", 0, 3.0), "M5x16_3 and camera_bracket"),
        "an upright in the belt": (
            drawn_away("pinion", -155.0, 64.0, -168.0),
            "belt and upright_left",
        ),
        "the camera in its bracket": (drawn_away("camera", 40.0), "camera and camera_bracket"),
        "the camera through its fence": (drawn_away("camera", 1.0, 0, -6.0), "camera and camera_f"),
        "the camera too high": (drawn_away("camera", 5.0), "camera and camera_fence"),
        "the lens in its camera": (drawn_away("camera_lens", 1.0, 0, -6.0), "camera and camera_l"),
        "a bracket in its upright": (
            drawn_away("upright_left_bracket_1", -1.0),
            "upright_left and upright_left_bracket_1",
        ),
        "a lamp in its post": (drawn_away("lamp_1", 2.0), "lamp_1 and lamp_post_left"),
        "two inserts in one place": (
            drawn_away("INSERT_M3_1", -14.0, 0.0, -14.0),
            "and INSERT_M3_2",
        ),
    },
    ("dark background", RECORD): {
        "a carrier not black": (record("parts/carrier/finish", None), "end on carrier"),
        "card that is white": (record("shroud/finish", "white"), "shroud_lid"),
    },
    ("shroud", PATTERN): {
        "a wider pattern": (redrawn(PATTERN, longer_outline), "its outline"),
        "a fold too few": (redrawn(PATTERN, flat_fold), "2 folds"),
        "a motor outside the shroud": (drawn_away("motor", -400.0), "motor is -"),
    },
}
# By which a check cannot be made.
UNSURE: Broken = {
    ("inventory", STEP): {
        "a part moved": (rewritten(STEP, moved_part), "the assembly moves a part"),
        **{
            f"STEP: {name}": (text_of(STEP, old, new, 1), words)
            for name, old, new, words in (
                ("centimetres", r"\.MILLI\.,\.METRE", ".CENTI.,.METRE", "MILLI"),
                ("thousandths of a radian", r"\$,\.RADIAN", ".MILLI.,.RADIAN", "RADIAN"),
                ("another product", r"PRODUCT\('plate'", "PRODUCT('steel plate'", "PRODUCT(@,@"),
                ("a tolerance", ENTITY_END, r"#999999=GEOMETRIC_TOLERANCE('',#1);\n\1", "no such"),
                ("a material", ENTITY_END, r"#999999=MATERIAL_DESIGNATION('x',#1);\n\1", "no such"),
                ("a face's name", r"ADVANCED_FACE\(''", "ADVANCED_FACE('tap M5'", "no name"),
                ("a comment", "DATA;", "DATA; /* scale by 10 */", "a comment"),
                (
                    "a solid listed twice",
                    r"(BREP_SHAPE\w+\('',\(#\d+,)(#\d+)",
                    r"\1\2,\2",
                    "(#AXIS2",
                ),
                (
                    "a body that is hidden",
                    r"ENDSEC;\s+END",
                    "#999999=INVISIBILITY((#1));\nENDSEC;\nEND",
                    "no such entity",
                ),
            )
        },
    },
    ("step solid", "carrier.step"): {
        f"carrier.step: {name}": (text_of("carrier.step", old, new, 1), words)
        for name, old, new, words in (
            ("volume in square millimetres", r"(UNIT_ELEMENT\(#\d+,)3\.", r"\g<1>2.", "other"),
            ("a tolerance", ENTITY_END, r"#999999=GEOMETRIC_TOLERANCE('',#1);\n\1", "no such"),
        )
    },
    ("inventory", GLB): {
        f"GLB: {name}": (glb(how), words)
        for name, how, words in (
            ("a body too many", lambda d, _: d["nodes"].append({"name": "x", "mesh": 0}), "node"),
            ("another file", lambda d, _: d["buffers"][0].update(uri="http://x/y"), "buffers"),
            ("an extension", lambda d, _: d.update(extensionsRequired=["x"]), "extensionsRequired"),
            ("ten times the size", lambda d, _: d["nodes"][0].update(scale=[10, 10, 10]), "scale"),
            ("a second scene", lambda d, _: d["scenes"].append({"nodes": [1]}), "scenes"),
        )
    },
    ("drawings", "DXF"): {
        f"drawing: {name}": (job, words)
        for name, job, words in (
            ("no DXF", text_of(PLATE, "(?s).*", "plate", 1), "no DXF"),
            ("a cap in inches", text_of(CAP, r"(INSUNITS\n 70\n)4", r"\g<1>1"), "$INSUNITS is 1"),
            ("other measures", text_of(CAP, r"(MEASUREMENT\n 70\n)1", r"\g<1>0"), "$MEASUREMENT"),
            ("an engraving", redrawn(PLATE, lambda s: drawn_on(s, "engrave")), "layer engrave"),
            ("a layer off", redrawn(PLATE, lambda s: s.doc.layers.get("cut").off()), "hidden"),
            ("a bent outline", redrawn(PLATE, bent_outline), "group code 42"),
        )
    },
    ("drive", RECORD): {
        "another motor": (record("bought/motor/part", "NEMA17-20"), "NEMA17-20 is no motor"),
        "a wheel of other teeth": (record("bought/wheel/part", "GT2-80"), "not have 80 teeth"),
    },
    ("hold ratio", RECORD): {
        "a smaller magnet": (record("fasteners/MAGNET/part", "MAGNET-4x3"), "its pocket is")
    },
    ("lamps", RECORD): {
        "lamps: another strip": (record("lamps/strip", "STRIP"), "STRIP is no strip")
    },
}
GOOD: tuple[Mutation, ...] = (
    Mutation("as it is", "none", lambda _: (), 0),
    Mutation("a note in the record", RECORD, record("note", "mine"), 0),
)
PROTOTYPES: tuple[Mutation, ...] = (
    *(
        fails(name, kind, job, check, words)
        for (check, kind), some in FAILING.items()
        for name, (job, words) in some.items()
    ),
    *(
        Mutation(name, kind, job, 1, (check,), (words,), unknown=True)
        for (check, kind), some in UNSURE.items()
        for name, (job, words) in some.items()
    ),
    refused("a plate of no holes", HOLES, table(HOLES, list.clear), HOLES, "0 rows"),
    refused("no home", RECORD, record("home"), RECORD, "home is missing"),
    refused(
        "three marks", RECORD, record("camera_place/marks_mm/0/-1"), RECORD, "a near and a far"
    ),
)
