"""Prototypes that are broken in what is driven, listed, bought, drilled or drawn."""

from __future__ import annotations

from tests.verify.corpus.mutation import Job, Mutation, fails, refused
from tests.verify.corpus.prototype_changes import (
    BALLS,
    GLB,
    HOLES,
    KLIPPER,
    LAMP,
    PLATE,
    PROGRAM,
    RECORD,
    SETTINGS,
    STEP,
    UPRIGHT,
    WHEEL,
    bought,
    compact,
    drawn_away,
    empty_step,
    fastener,
    fastener_off,
    fewer_circles,
    flat_fold,
    frame_key,
    glb,
    lamp_aside,
    lamps,
    lamps_on_their_sides,
    led,
    leds_on_one_side,
    longer_outline,
    magnet,
    mark_aside,
    mounted_in,
    moved_part,
    moved_point,
    no_fastener,
    no_lamps,
    no_led,
    no_panel,
    no_spec_led,
    nudged,
    origin_of,
    picture,
    program,
    record,
    redrawn,
    row,
    shifted,
    shifted_circle,
    shiny_card,
    spigot,
    stage_key,
    step_text,
    table,
    text_of,
    together,
    undrawn,
    unpainted,
    wider_circle,
)


def unsure(name: str, kind: str, job: Job, check: str, words: str) -> Mutation:
    """A mutation by which a check cannot be made."""
    return Mutation(name, kind, job, 1, (check,), (words,), unknown=True)


PLAN = "plan program"
DWELL = "G4 P0.500\n"

PROGRAMS: tuple[Mutation, ...] = (
    fails("program: a foreign word", PROGRAM, program(DWELL, f"$SLP\n{DWELL}", 1), PLAN, "line"),
    fails("program: G92 X50", PROGRAM, program("G92 X.*", "G92 X50.0000"), PLAN, "swing"),
    fails("program: no LED", PROGRAM, program("M64 P2\n", ""), PLAN, "outputs none on, not [2]"),
)

PARTS: tuple[Mutation, ...] = (
    fails(
        "a part not drawn", "STEP, GLB", undrawn("stage_post"), "inventory", "stage_post is missing"
    ),
    fails(
        "a body too many in the GLB",
        GLB,
        glb(lambda scene: scene.add_geometry(scene.geometry[next(iter(scene.geometry))], "extra")),
        "inventory",
        "extra",
    ),
    fails(
        "a motor that turns",
        RECORD,
        record(lambda r: [one.update(turns=True) for one in r["bought"] if one["name"] == "motor"]),
        "inventory",
        "motor turns",
    ),
    fails(
        "another number of balls in the spec",
        "design.json",
        record(lambda r: None, lambda d: d["spec"]["prototype"].update(k=3)),
        "inventory",
        "the spec asks for 3",
    ),
    fails(
        "a screw not recorded", RECORD, no_fastener("M5x16"), "fastener holes", "without a fastener"
    ),
    fails(
        "a screw beside its hole",
        RECORD,
        fastener_off("M5x16", 0.1),
        "fasteners",
        "drawn elsewhere",
    ),
    fails(
        "a screw through another part",
        RECORD,
        fastener("M5x16", through=["stage_disc", "plate"]),
        "fasteners",
        "has no hole in stage_disc",
    ),
    fails(
        "a screw of the plate that turns",
        RECORD,
        fastener("M5x16", turns=True),
        "fasteners",
        "turns otherwise than",
    ),
    fails(
        "a screw not drawn", "STEP, GLB", undrawn("M5x16_1"), "fasteners", "M5x16_1 in the assembly"
    ),
    fails(
        "screws of the wheel once the base is on its shaft",
        RECORD,
        mounted_in("wheel", "shaft"),
        "key access",
        "behind bearing_head at every base angle",
    ),
    fails(
        "a screw before what it holds",
        RECORD,
        mounted_in("stage_foot", "coupon"),
        "key access",
        "is mounted before stage_foot",
    ),
    fails(
        "a screw in no step", RECORD, mounted_in("stage_foot", None), "key access", "is in no step"
    ),
    fails("an LED elsewhere", RECORD, led(2.0, spec=False), "leds as designed", "led_1 is not"),
    fails(
        "an LED elsewhere, spec too", RECORD, led(2.0, spec=True), "leds as designed", "no pocket"
    ),
    fails("an LED less", RECORD, record(no_led), "leds as designed", "the spec has 4"),
    fails(
        "an LED less, spec too",
        RECORD,
        record(no_led, no_spec_led),
        "leds as designed",
        "4 pockets",
    ),
    fails(
        "a wider room for the object",
        "design.json",
        stage_key(object_diameter_mm=44.0),
        "object room",
        "stage_crown",
    ),
    fails(
        "a lower floor of the object's room",
        "design.json",
        stage_key(top_mm=-21.0),
        "object room",
        "stage_disc",
    ),
    fails(
        "pads that are moved otherwise",
        "design.json",
        record(
            lambda _: None,
            lambda d: d["spec"]["prototype"]["base"].update(pad_offset_mm=0.1),
        ),
        "ball centres",
        "um",
    ),
    fails("LEDs on one side", RECORD, record(leds_on_one_side), "leds seen", "past an object"),
    fails(
        "an LED that shines down",
        RECORD,
        record(lambda r: r["leds"][0].update(direction=[0.0, 0.0, -1.0])),
        "leds as designed",
        "led_1",
    ),
)

ASSEMBLIES: tuple[Mutation, ...] = (
    fails("an empty assembly", STEP, step_text(empty_step), "inventory", "solid in prototype.step"),
    fails("a plate of another size", STEP, step_text(moved_point), "assembly step", "plate"),
    unsure("a part moved", STEP, step_text(moved_part), "inventory", "the assembly moves a part"),
    fails("the motor drawn aside", GLB, glb(nudged("motor", 0.1)), "assembly step", "motor"),
    fails("a disc drawn aside", GLB, glb(nudged("stage_disc", 0.1)), "assembly step", "stage_disc"),
)

PURCHASES: tuple[Mutation, ...] = (
    refused("a plate of no holes", HOLES, table(HOLES, lambda rows: rows.clear()), HOLES, "0 rows"),
    fails(
        "a hole less",
        HOLES,
        table(HOLES, lambda rows: rows.pop()),
        "plate holes",
        "the plate has 16",
    ),
    fails(
        "holes 10 mm aside", HOLES, table(HOLES, shifted("x_mm", 10.0)), "plate holes", "elsewhere"
    ),
    fails(
        "a hole 10 um aside",
        HOLES,
        table(HOLES, lambda r: shifted("y_mm", 0.01)(r[:1])),
        "plate holes",
        "hole 1",
    ),
    fails("a cap of steel", BALLS, row(BALLS, 0, mass_g=9.0), "ball sizes", "ball 1"),
)


DRAWINGS: tuple[Mutation, ...] = (
    *(
        fails(f"drawing: {name} of {file}", file, redrawn(file, how), "drawings", words)
        for name, file, how, words in (
            ("a hole 10 um aside", PLATE, shifted_circle, "plate: no circle of 2.1 mm radius"),
            ("a wider hole", PLATE, wider_circle, "plate: no circle of 2.1 mm radius"),
            ("a hole less", WHEEL, fewer_circles, "circles for 6 holes"),
            ("a hole 10 um aside", WHEEL, shifted_circle, "wheel: no circle of 1.7 mm radius"),
            ("a longer outline", PLATE, longer_outline, "plate: its outline"),
            ("a longer outline", UPRIGHT, longer_outline, "upright_left: its outline"),
            ("a longer strip", LAMP, longer_outline, "lamp_1: its outlines are not"),
        )
    ),
    unsure("drawing: no DXF", PLATE, text_of(PLATE, "(?s).*", "plate", 1), "drawings", "no DXF"),
    fails(
        "no drawing of the plate",
        RECORD,
        record(lambda value: value["drawings"].pop(0)),
        "drawings",
        "no drawing",
    ),
)


HOMING: tuple[Mutation, ...] = (
    *(
        fails(
            f"settings: {name}", SETTINGS, text_of(SETTINGS, old, new), "controller settings", words
        )
        for name, old, new, words in (
            ("steps of another gear", r"\$100=.*", "$100=80", "$100 is 80"),
            ("too short a travel", r"\$130=.*", "$130=100", "do not hold the program"),
            ("too long a travel", r"\$130=.*", "$130=360", "above the program"),
        )
    ),
    fails(
        "home: another angle of the switch",
        RECORD,
        record(lambda r: r["home"].update(switch_deg=r["home"]["switch_deg"] + 5)),
        "homing",
        "the switch trips at",
    ),
    fails(
        "home: another end of homing",
        RECORD,
        record(lambda r: r["home"].update(homed_deg=0.0)),
        "homing",
        "homing ends at 0",
    ),
    fails(
        "home: too short a pin",
        RECORD,
        record(lambda r: r["home"].update(pin="ROD-4x10")),
        "homing",
        "does not reach",
    ),
    fails(
        "klipper: another angle",
        KLIPPER,
        text_of(KLIPPER, r"(?<=: 2 mirrors\n)(.*MOVE=).*?( SPEED)", r"\g<1>5\2", 1),
        "klipper",
        "is another",
    ),
    fails(
        "klipper: another gear",
        "klipper.cfg",
        text_of("klipper.cfg", "gear_ratio: .*", "gear_ratio: 5:1"),
        "klipper",
        "gear_ratio: 5:1",
    ),
    refused("no home", RECORD, record(lambda r: r.pop("home")), RECORD, "home is missing"),
)

CAMERA: tuple[Mutation, ...] = (
    fails(
        "camera: screws too short to move it",
        RECORD,
        record(
            lambda r: [one.update(part="M5x26") for one in r["fasteners"] if one["part"] == "M5x30"]
        ),
        "camera mount",
        "out_mm is",
    ),
    fails(
        "camera: more travel asked for",
        "design.json",
        frame_key(camera_travel_mm=40.0),
        "camera mount",
        "along_axis_mm",
    ),
    fails(
        "camera: another place of its thread",
        "design.json",
        frame_key(camera_screw_mm=55.0),
        "camera mount",
        "the tripod slot is elsewhere",
    ),
    fails(
        "camera: another length",
        "design.json",
        record(lambda _: None, lambda d: d["spec"]["prototype"].update(camera_length_mm=120.0)),
        "camera mount",
        "the fence is 100.00 mm behind",
    ),
    fails("gauge: a mark aside", RECORD, mark_aside(0.1), "camera gauge", "a mark is no corner"),
    fails(
        "gauge: a small turn",
        RECORD,
        picture(0, base_angle_deg=-30.0),
        "camera gauge",
        "not turned far enough",
    ),
    fails(
        "gauge: no picture of a side",
        RECORD,
        record(lambda r: r["camera_place"]["pictures"].pop(0)),
        "camera gauge",
        "to either side are missing",
    ),
    fails(
        "gauge: printed elsewhere",
        RECORD,
        origin_of("camera_gauge", 0.1),
        "camera gauge",
        "a mark is no corner",
    ),
    refused(
        "gauge: three marks",
        RECORD,
        record(lambda r: r["camera_place"]["marks_mm"][0].pop()),
        RECORD,
        "a near and a far one",
    ),
)

CAPS: tuple[Mutation, ...] = (
    fails(
        "cap: a spigot that is too thin",
        "STEP",
        spigot("cap_1", 1.0),
        "cap tilt",
        "tilts",
    ),
)

HEAVY = row(BALLS, -1, mass_g=20_000.0)
DRIVES: tuple[Mutation, ...] = (
    fails("a heavy ball", BALLS, HEAVY, "ball sizes", "ball"),
    fails("a heavy ball on the motor", BALLS, HEAVY, "drive", "the drive holds"),
    fails("a heavy ball on its magnet", BALLS, HEAVY, "hold ratio", "ball"),
    fails(
        "a heavy ball on the zero pin",
        BALLS,
        row(BALLS, -1, mass_g=1e6),
        "power off",
        "zero pin's pressure",
    ),
    unsure("another motor", RECORD, bought("motor", "NEMA17-20"), "drive", "NEMA17-20 is no motor"),
    unsure("a wheel of more teeth", RECORD, bought("wheel", "GT2-80"), "drive", "not 80 teeth"),
    unsure("a smaller magnet", RECORD, magnet("MAGNET-4x3"), "hold ratio", "its pocket is"),
)

PATTERN = "shroud_front.dxf"
SHROUD_AND_LAMPS: tuple[Mutation, ...] = (
    unsure("lamps: another strip", RECORD, lamps(strip="STRIP"), "lamps", "STRIP is no strip"),
    fails("lamps: on their sides", RECORD, lamps_on_their_sides, "lamps", "is drawn elsewhere"),
    fails("lamps: one aside", RECORD, lamp_aside(0, 30.0), "lamps", "no images of one another"),
    fails("lamps: light from one", RECORD, lamp_aside(0, 30.0), "light before and after", "turn"),
    fails("lamps: not listed", RECORD, record(no_lamps), "lamps", "the record has none"),
    fails(
        "lamps: one behind an upright",
        GLB,
        drawn_away("upright_left", 60.0),
        "light before and after",
        "half turn",
    ),
    fails(
        "a lamp before the pinhole",
        GLB,
        drawn_away("lamp_1", -23.0, -52.0, 35.0),
        "light paths, balls",
        "lamp_1",
    ),
    fails(
        "a carrier that is not black",
        RECORD,
        unpainted("carrier"),
        "dark background",
        "end on carrier",
    ),
    fails("card that is white", RECORD, record(shiny_card), "dark background", "shroud_lid"),
    fails("no lid", "STEP, GLB", undrawn("shroud_lid"), "inventory", "shroud_lid is missing"),
    fails("a panel too few", RECORD, record(no_panel), "inventory", "shroud_right is not"),
    fails("a lid 5 mm aside", GLB, drawn_away("shroud_lid", 5.0), "assembly step", "shroud_lid"),
    fails("a wider pattern", PATTERN, redrawn(PATTERN, longer_outline), "shroud", "its outline"),
    fails("a fold too few", PATTERN, redrawn(PATTERN, flat_fold), "shroud", "2 folds"),
    fails(
        "a motor outside the shroud",
        GLB,
        drawn_away("motor", -400.0),
        "shroud",
        "motor is -",
    ),
)

GOOD: tuple[Mutation, ...] = (
    Mutation("as it is", "none", lambda _: (), 0),
    Mutation("prototype.json in one line", RECORD, compact, 0),
    Mutation("a note in the record", RECORD, together(record(lambda r: r.update(note="mine"))), 0),
)
PROTOTYPES: tuple[Mutation, ...] = (
    *PROGRAMS,
    *PARTS,
    *ASSEMBLIES,
    *PURCHASES,
    *DRAWINGS,
    *HOMING,
    *CAMERA,
    *CAPS,
    *DRIVES,
    *SHROUD_AND_LAMPS,
)
