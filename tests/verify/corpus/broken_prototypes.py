"""Prototypes that are broken in what is driven, bought, drilled, drawn, or seen through."""

from __future__ import annotations

from tests.verify.corpus.mutation import Job, Mutation, fails, refused
from tests.verify.corpus.prototype_changes import (
    BALLS,
    DESIGN,
    GLB,
    HOLES,
    KLIPPER,
    KLIPPER_CONFIG,
    LAMP,
    PLATE,
    PROGRAM,
    RECORD,
    SETTINGS,
    STEP,
    UPRIGHT,
    WHEEL,
    at,
    compact,
    drawn_away,
    empty_step,
    fewer_circles,
    flat_fold,
    glb,
    longer_outline,
    mounted_in,
    moved_part,
    moved_point,
    plus,
    program,
    redrawn,
    row,
    shifted,
    shifted_circle,
    spigot,
    step_text,
    table,
    text_of,
    undrawn,
    wider_circle,
)

BOTH, PATTERN, DWELL = "STEP, GLB", "shroud_front.dxf", "G4 P0.500\n"
SPEC, SCREW, LAMP_X = "spec/prototype/", "fasteners/M5x16", "lamps/places/0/position_mm/0"
HEAVY = row(BALLS, -1, mass_g=20_000.0)


def one_side(leds: list[dict[str, object]]) -> list[dict[str, object]]:
    return [led | {"position_mm": [-23.0, float(k), -5.0]} for k, led in enumerate(leds)]


def shorter_screws(some: list[dict[str, str]]) -> list[dict[str, str]]:
    return [one | {"part": one["part"].replace("M5x30", "M5x26")} for one in some]


# By check and kind of file: name, what breaks it, and words of the detail.
Broken = dict[tuple[str, str], dict[str, tuple[Job, str]]]
FAILING: Broken = {
    ("plan program", PROGRAM): {
        "program: a foreign word": (program(DWELL, f"$SLP\n{DWELL}", 1), "line"),
        "program: G92 X50": (program("G92 X.*", "G92 X50.0000"), "swing"),
        "program: no LED": (program("M64 P2\n", ""), "outputs none on, not [2]"),
    },
    ("inventory", BOTH): {
        "a part not drawn": (undrawn("stage_post"), "stage_post is missing"),
        "a body too many": (
            glb(lambda scene: scene.add_geometry(next(iter(scene.geometry.values())), "extra")),
            "extra",
        ),
        "an empty assembly": (step_text(empty_step), "solid in prototype.step"),
        "no lid": (undrawn("shroud_lid"), "shroud_lid is missing"),
    },
    ("inventory", RECORD): {
        "a motor that turns": (at("bought/motor/turns", True), "motor turns"),
        "a panel too few": (at("shroud/panels/-1"), "shroud_right is not"),
    },
    ("fastener holes", RECORD): {"a screw not recorded": (at(SCREW), "without a fastener")},
    ("fasteners", RECORD): {
        "a screw beside its hole": (at(f"{SCREW}/position_mm/0", plus(0.1)), "drawn elsewhere"),
        "a screw through another part": (
            at(f"{SCREW}/through", ["stage_disc", "plate"]),
            "has no hole in stage_disc",
        ),
        "a screw of the plate that turns": (at(f"{SCREW}/turns", True), "turns otherwise than"),
        "a screw not drawn": (undrawn("M5x16_1"), "M5x16_1 in the assembly"),
    },
    ("key access", RECORD): {
        "screws of the wheel once the base is on its shaft": (
            mounted_in("wheel", "shaft"),
            "behind bearing_head at every base angle",
        ),
        "a screw before what it holds": (
            mounted_in("stage_foot", "coupon"),
            "is mounted before stage_foot",
        ),
        "a screw in no step": (mounted_in("stage_foot", None), "is in no step"),
    },
    ("leds as designed", RECORD): {
        "an LED elsewhere": (at("leds/0/position_mm/0", plus(2.0)), "no pocket"),
        "an LED less": (at("leds/-1"), "4 pockets"),
    },
    ("leds seen", RECORD): {"LEDs on one side": (at("leds", one_side), "past an object")},
    ("object room", DESIGN): {
        "a wider room for the object": (
            at(f"{SPEC}stage/object_diameter_mm", 44.0, DESIGN),
            "stage_crown",
        ),
        "a lower floor of the object's room": (
            at(f"{SPEC}stage/top_mm", -21.0, DESIGN),
            "stage_disc",
        ),
    },
    ("ball centres", DESIGN): {
        "pads that are moved otherwise": (at(f"{SPEC}base/pad_offset_mm", 0.1, DESIGN), "um"),
    },
    ("assembly step", BOTH): {
        "a plate of another size": (step_text(moved_point), "plate"),
        "the motor drawn aside": (drawn_away("motor", 0.1), "motor"),
        "a disc drawn aside": (drawn_away("stage_disc", 0.1), "stage_disc"),
        "a lid 5 mm aside": (drawn_away("shroud_lid", 5.0), "shroud_lid"),
    },
    ("plate holes", HOLES): {
        "a hole less": (table(HOLES, lambda rows: rows.pop()), "the plate has 16"),
        "holes 10 mm aside": (table(HOLES, shifted("x_mm", 10.0)), "elsewhere"),
        "a hole 10 um aside": (table(HOLES, lambda r: shifted("y_mm", 0.01)(r[:1])), "hole 1"),
    },
    ("drawings", "DXF"): {
        f"drawing: {name} of {file}": (redrawn(file, how), words)
        for name, file, how, words in (
            ("a hole 10 um aside", PLATE, shifted_circle, "plate: no circle of 2.1 mm radius"),
            ("a wider hole", PLATE, wider_circle, "plate: no circle of 2.1 mm radius"),
            ("a hole less", WHEEL, fewer_circles, "circles for 6 holes"),
            ("a hole 10 um aside", WHEEL, shifted_circle, "wheel: no circle of 1.7 mm radius"),
            ("a longer outline", PLATE, longer_outline, "plate: its outline"),
            ("a longer outline", UPRIGHT, longer_outline, "upright_left: its outline"),
            ("a longer strip", LAMP, longer_outline, "lamp_1: its outlines are not"),
        )
    },
    ("drawings", RECORD): {"no drawing of the plate": (at("drawings/0"), "no drawing")},
    ("controller settings", SETTINGS): {
        f"settings: {name}": (text_of(SETTINGS, old, new), words)
        for name, old, new, words in (
            ("steps of another gear", r"\$100=.*", "$100=80", "$100 is 80"),
            ("too short a travel", r"\$130=.*", "$130=100", "do not hold the program"),
            ("too long a travel", r"\$130=.*", "$130=360", "above the program"),
        )
    },
    ("homing", RECORD): {
        "home: another angle of the switch": (
            at("home/switch_deg", plus(5.0)),
            "the switch trips at",
        ),
        "home: another end of homing": (at("home/homed_deg", 0.0), "homing ends at 0"),
        "home: too short a pin": (at("home/pin", "ROD-4x10"), "does not reach"),
    },
    ("klipper", KLIPPER): {
        "klipper: another angle": (
            text_of(KLIPPER, r"(?<=: 2 mirrors\n)(.*MOVE=).*?( SPEED)", r"\g<1>5\2", 1),
            "at 5.0000 deg",
        ),
        "klipper: another gear": (
            text_of(KLIPPER_CONFIG, "gear_ratio: .*", "gear_ratio: 5:1"),
            "gear_ratio: 5:1",
        ),
    },
    ("camera mount", RECORD): {
        "camera: screws too short to move it": (at("fasteners", shorter_screws), "out_mm is"),
        "camera: more travel asked for": (
            at(f"{SPEC}frame/camera_travel_mm", 40.0, DESIGN),
            "along_axis_mm",
        ),
        "camera: another place of its thread": (
            at(f"{SPEC}frame/camera_screw_mm", 55.0, DESIGN),
            "the tripod slot is elsewhere",
        ),
        "camera: another length": (
            at(f"{SPEC}camera_length_mm", 120.0, DESIGN),
            "the fence is 100.00 mm behind",
        ),
    },
    ("camera gauge", RECORD): {
        "gauge: a mark aside": (
            at("camera_place/marks_mm/0/0/1", plus(0.1)),
            "a mark is no corner",
        ),
        "gauge: too far a turn": (
            at("camera_place/pictures/0/base_angle_deg", -150.0),
            "the base does not turn so far",
        ),
        "gauge: printed elsewhere": (
            at("parts/camera_gauge/origin_mm/0", plus(0.1)),
            "a mark is no corner",
        ),
    },
    ("cap tilt", STEP): {"cap: a spigot that is too thin": (spigot("cap_1", 1.0), "tilts")},
    ("ball sizes", BALLS): {
        "a cap of steel": (row(BALLS, 0, mass_g=9.0), "ball 1"),
        "a heavy ball": (HEAVY, "ball"),
    },
    ("drive", BALLS): {"a heavy ball on the motor": (HEAVY, "the drive holds")},
    ("hold ratio", BALLS): {"a heavy ball on its magnet": (HEAVY, "ball")},
    ("power off", BALLS): {
        "a heavy ball on the zero pin": (row(BALLS, -1, mass_g=1e6), "zero pin's pressure"),
    },
    ("lamps", RECORD): {
        "lamps: on their sides": (at("lamps/level", lambda v: not v), "is drawn elsewhere"),
        "lamps: one aside": (at(LAMP_X, plus(30.0)), "is drawn elsewhere"),
        "lamps: not listed": (at("lamps", None), "the record has none"),
    },
    ("light before and after", RECORD): {
        "lamps: light from one": (at(LAMP_X, plus(30.0)), "turn"),
        "lamps: one behind an upright": (drawn_away("upright_left", 60.0), "half turn"),
    },
    ("light paths, balls", GLB): {
        "a lamp before the pinhole": (drawn_away("lamp_1", -23.0, -52.0, 35.0), "lamp_1"),
    },
    ("dark background", RECORD): {
        "a carrier that is not black": (at("parts/carrier/finish", None), "end on carrier"),
        "card that is white": (at("shroud/finish", "white"), "shroud_lid"),
    },
    ("shroud", PATTERN): {
        "a wider pattern": (redrawn(PATTERN, longer_outline), "its outline"),
        "a fold too few": (redrawn(PATTERN, flat_fold), "2 folds"),
        "a motor outside the shroud": (drawn_away("motor", -400.0), "motor is -"),
    },
}
# By which a check cannot be made.
UNSURE: Broken = {
    ("inventory", STEP): {"a part moved": (step_text(moved_part), "the assembly moves a part")},
    ("drawings", PLATE): {"drawing: no DXF": (text_of(PLATE, "(?s).*", "plate", 1), "no DXF")},
    ("drive", RECORD): {
        "another motor": (at("bought/motor/part", "NEMA17-20"), "NEMA17-20 is no motor"),
        "a wheel of more teeth": (at("bought/wheel/part", "GT2-80"), "not 80 teeth"),
    },
    ("hold ratio", RECORD): {
        "a smaller magnet": (at("fasteners/MAGNET/part", "MAGNET-4x3"), "its pocket is"),
    },
    ("lamps", RECORD): {"lamps: another strip": (at("lamps/strip", "STRIP"), "STRIP is no strip")},
}
GOOD: tuple[Mutation, ...] = (
    Mutation("as it is", "none", lambda _: (), 0),
    Mutation("prototype.json in one line", RECORD, compact, 0),
    Mutation("a note in the record", RECORD, at("note", "mine"), 0),
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
    refused("a plate of no holes", HOLES, table(HOLES, lambda rows: rows.clear()), HOLES, "0 rows"),
    refused("no home", RECORD, at("home"), RECORD, "home is missing"),
    refused("three marks", RECORD, at("camera_place/marks_mm/0/-1"), RECORD, "a near and a far"),
)
