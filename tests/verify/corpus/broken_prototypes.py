"""Prototypes that are broken in what is driven, listed, bought, drilled or drawn."""

from __future__ import annotations

from tests.verify.corpus.copies import put
from tests.verify.corpus.mutation import Mutation, fails, refused
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
    STOPS,
    UPRIGHT,
    WHEEL,
    better_calibration,
    compact,
    drawn_away,
    drive,
    empty_step,
    exchange,
    fastener,
    fastener_off,
    fewer_circles,
    flat_fold,
    frame_key,
    glb,
    held,
    in_place,
    lamp_aside,
    lamps,
    lamps_on_their_sides,
    led,
    leds_on_one_side,
    longer_outline,
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
    scaled,
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
    upside_down,
    wider_circle,
)

PLAN = "plan program"
DWELL = r"G4 P0\.500\n"
WORDS = (
    *("G28", "G2 X1.0000", "Y5000", "G93", "G10 L2 P1 X5.0000", "G55", "M7", "G20", "G91", "M30"),
    *("G0 X1.0000", "G1 X1.0000 (hold on!)", "$H"),
    *("M18", "M84", "$SLP", "$1=25", "$37=0", "!"),  # by which the motor lets go, or runs no longer
)

PROGRAMS: tuple[Mutation, ...] = (
    *(
        fails(f"program: {word}", PROGRAM, program(DWELL, f"{word}\nG4 P0.500\n", 1), PLAN, "line")
        for word in WORDS
    ),
    fails("program: G92 X50", PROGRAM, program("G92 X.*", "G92 X50.0000"), PLAN, "swing"),
    fails("program: no homing", PROGRAM, program(r"\$H\n", ""), PLAN, "before a person"),
    fails(
        "program: homing with the pin in",
        PROGRAM,
        program(r"M0 \(MSG, zero pin.*\n", ""),
        PLAN,
        "before the zero pin",
    ),
    fails("program: M2 halfway", PROGRAM, program(DWELL, "M2\n", 1), PLAN, "after the end"),
    fails("program: never turned", PROGRAM, program(r"M0 \(MSG, turn.*\n", ""), PLAN, "pauses for"),
    fails("program: no dwell", PROGRAM, program("G4 .*\n", ""), PLAN, "0 s after the motion"),
    fails("program: too short a dwell", PROGRAM, program("P0.500", "P0.100"), PLAN, "0.2 s after"),
    fails("program: a light stays on", PROGRAM, program("M65 P0\n", ""), PLAN, "a light is on"),
    fails("program: no LED", PROGRAM, program("M64 P2\n", ""), PLAN, "outputs none on, not [2]"),
    fails(
        "program: a light before the end of the motion",
        PROGRAM,
        program(DWELL, "M64 P1\nM65 P1\nG4 P0.500\n", 1),
        PLAN,
        "before the motion has ended",
    ),
    fails(
        "program: lamp and LED exchanged",
        PROGRAM,
        together(program("P1\n", "P9\n"), program("P0\n", "P1\n"), program("P9\n", "P0\n")),
        PLAN,
        "outputs [0] on, not [1]",
    ),
    fails("program: no M9", PROGRAM, program("M9\n", ""), PLAN, "release is on"),
    fails("program: no F", PROGRAM, program(" F900", ""), PLAN, "without a speed"),
    fails("program: F0", PROGRAM, program(" F900", " F0"), PLAN, "without a speed"),
    fails("program: no photograph", PROGRAM, program("M8\n", "", 1), PLAN, "is not on"),
    fails("program: other steps", PROGRAM, program(r"\$100=[\d.]+", r"$100=99"), PLAN, "steps is"),
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
    fails(
        "a fall of half the energy",
        RECORD,
        record(lambda r: r["power_off"].update(fall_energy_j=r["power_off"]["fall_energy_j"] / 2)),
        "power off",
        "fall_energy_j is 0.",
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
    fails("a better calibration", RECORD, record(better_calibration), "calibration", "median"),
    fails(
        "no calibration",
        RECORD,
        record(lambda r: r.update(calibration=None)),
        "calibration",
        "missing",
    ),
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
    Mutation(
        "an assembly that moves a part",
        STEP,
        step_text(moved_part),
        1,
        ("inventory",),
        ("the assembly moves a part",),
        unknown=True,
    ),
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
    fails(
        "sizes of two balls exchanged",
        BALLS,
        table(BALLS, exchange("size")),
        "ball labels",
        "ball 1 is no",
    ),
    fails(
        "a grade that does not exist", BALLS, row(BALLS, 0, grade="G7"), "ball labels", "grade G7"
    ),
    fails("a cap of steel", BALLS, row(BALLS, 0, mass_g=9.0), "ball labels", "a cap has none"),
    fails("an error of direction", BALLS, row(BALLS, 0, error_deg=0.0), "ball labels", "deg off"),
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
    Mutation(
        "drawing: no DXF",
        PLATE,
        lambda folder: put(folder, PLATE, b"plate") or (),
        1,
        ("drawings",),
        ("is no DXF",),
        unknown=True,
    ),
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
            f"settings: {name}",
            SETTINGS,
            text_of(SETTINGS, pattern, new),
            "controller settings",
            words,
        )
        for name, pattern, new, words in (
            ("steps of another gear", r"\$100=.*", "$100=80", "$100 is 80"),
            ("another speed", r"\$110=.*", "$110=90000", "$110 is 90000"),
            ("another acceleration", r"\$120=.*", "$120=5000", "$120 is 5000"),
            ("too short a travel", r"\$130=.*", "$130=100", "do not hold the program"),
            ("too long a travel", r"\$130=.*", "$130=360", "above the program"),
            ("no travel", r"\$130=.*\n", "", "do not hold the program"),
            ("homing upward", r"\$23=.*", "$23=0", "$23 is 0"),
            ("a switch that closes", r"\$5=.*", "$5=7", "$5 is 7"),
            ("empty inputs that read as pressed", r"\$5=.*", "$5=0", "$5 is 0"),
            ("no soft limits", r"\$20=.*", "$20=0", "$20 is 0"),
            ("the motor turned off", r"\$1=.*", "$1=25", "$1 is 25"),
            ("homing of all axes", r"\$45=.*", "$45=3", "$45 is 3"),
            ("homing too fast", r"\$25=.*", "$25=3000", "homing at 3000"),
            ("a setting too many", r"\$26=", "$30=1\n$26=", "$30 is not needed"),
            ("the board's enable inverted", r"\$26=", "$4=1\n$26=", "$4 is not needed"),
            ("the motor off in alarms", r"\$37=.*", "$37=0", "$37 is 0"),
            ("the motor on of no axis", r"\$37=.*\n", "", "$37 is missing"),
            ("sleep", r"\$62=.*", "$62=1", "$62 is 1"),
            ("silent homing", r"\$10=.*", "$10=511", "$10 is 511"),
            ("reports of GRBL", r"\$10=.*", "$10=1", "$10 is 1"),
            ("reports in inches", r"\$13=.*", "$13=1", "$13 is 1"),
            ("a laser", r"\$32=.*", "$32=1", "$32 is 1"),
            ("a lathe", r"\$32=.*", "$32=2", "$32 is 2"),
            ("too short a pulse", r"\$0=.*", "$0=1", "$0 is 1"),
            ("switches without pull-up", r"\$18=.*", "$18=1", "$18 is 1"),
            ("many passes of homing", r"\$43=.*", "$43=9", "$43 is 9"),
            ("a setting twice", r"\$26=", "$22=1\n$26=", "$22 is there twice"),
            ("no setting at all", r"\$26=", "G28\n$26=", "is no setting"),
        )
    ),
    fails(
        "settings: soft limits before homing",
        SETTINGS,
        together(
            text_of(SETTINGS, r"\$20=1\n", ""),
            text_of(SETTINGS, r"\$22=1\n", "$20=1\n$22=1\n"),
        ),
        "controller settings",
        "$20 before $22",
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
        "home: an angle zero that is not known",
        RECORD,
        record(lambda r: r["home"].update(zero_error_deg=5.0)),
        "homing",
        "angle zero is known to 5.00 deg",
    ),
    *(
        fails(f"klipper: {name}", KLIPPER, text_of(KLIPPER, pattern, new, 1), "klipper", words)
        for name, pattern, new, words in (
            ("another angle", r"(?<=: 2 mirrors\n)(.*MOVE=).*?( SPEED)", r"\g<1>5\2", "is another"),
            ("another speed", r"(MOVE=.* SPEED=)15", r"\g<1>1500", "a speed of 1500"),
            ("a light left on", r"SET_PIN PIN=lamp VALUE=0\n(?=; stop)", "", "with lamp on"),
            ("no LED", r"SET_PIN PIN=led_2 VALUE=1\n", "", "is another"),
            ("no homing", r".*STOP_ON_ENDSTOP=1\n.*SET_POSITION.*\n", "", "before homing"),
            ("another switch", r"SET_POSITION=-\S+", "SET_POSITION=-50", "deg at the switch"),
            ("never turned", r'RESPOND MSG="turn.*\nPAUSE\n', "", "is another"),
            ("a foreign line", r"(?=; stop 1 )", "G28\n", "is none that a plan has"),
            *(
                (f"motor off by {line}", r"(?=; stop 2 )", f"{line}\n", "is none that a plan has")
                for line in (
                    *("M84", "M18", "m84", "M112", "HOLD", "SET_IDLE_TIMEOUT TIMEOUT=1"),
                    *("SET_STEPPER_ENABLE STEPPER=base ENABLE=0", "RESTART", "FIRMWARE_RESTART"),
                    "MANUAL_STEPPER STEPPER=base ENABLE=0",
                )
            ),
        )
    ),
    *(
        fails(
            f"klipper.cfg: {name}",
            "klipper.cfg",
            text_of("klipper.cfg", pattern, new, 1),
            "klipper",
            words,
        )
        for name, pattern, new, words in (
            ("no idle timeout", r"\[idle_timeout\]\n.*\n.*\n.*\n", "", "no [idle_timeout]"),
            ("the default at idle", r"gcode:\n.*\n", "", "no [idle_timeout] with a gcode"),
            *(
                (f"{line} at idle", r"    RESPOND .*", f"    {line}", "may let the motor go")
                for line in (
                    *("M84", "M18", "m84", "HOLD", "{% if 1 %}M84{% endif %}"),
                    "SET_STEPPER_ENABLE STEPPER=base ENABLE=0",
                    "MANUAL_STEPPER STEPPER=base ENABLE=0",
                )
            ),
            ("M84 after a message", r"(    RESPOND .*)", r"\1\n    M84", "does 'M84'"),
            ("M84 beside gcode", r"gcode:\n.*\n", "gcode: M84\n", "gcode of [idle_timeout]"),
            ("gcode twice", r"(?=\[static)", "gcode:\n    M84\n", "gcode of [idle_timeout]"),
            ("idle twice", r"\Z", "[idle_timeout]\ngcode:\n", "[idle_timeout] is twice"),
            ("a macro", r"\Z", "[gcode_macro RESPOND]\ngcode:\n    M84\n", "[gcode_macro RESPOND]"),
            ("a timer", r"\Z", "[delayed_gcode off]\ngcode:\n    M84\n", "[delayed_gcode off]"),
            ("an include", r"\A", "[include more.cfg]\n", "[include more.cfg]"),
            ("homing of its own", r"\Z", "[homing_override]\ngcode:\n", "[homing_override]"),
            ("a saved section", r"\Z", "#*# [idle_timeout]\n", "is none that a configuration has"),
            ("another separator", r"timeout: ", "timeout = ", "is none that a configuration has"),
            ("an enable pin", r"(dir_pin.*)", r"\1\nenable_pin: PA1", "enable_pin of [manual_st"),
            ("no enable", r"\[static.*\n.*\n", "", "a shutdown lets the motor go"),
            ("another output", r"\[output_pin lamp\]", "[output_pin lamb]", "pins are others"),
        )
    ),
    fails(
        "klipper: another gear",
        "klipper.cfg",
        text_of("klipper.cfg", "gear_ratio: .*", "gear_ratio: 5:1"),
        "klipper",
        "gear_ratio is 5:1",
    ),
    refused("no home", RECORD, record(lambda r: r.pop("home")), RECORD, "home is missing"),
)

CAMERA: tuple[Mutation, ...] = (
    fails(
        "screws too short to tilt the camera",
        RECORD,
        record(
            lambda r: [one.update(part="M5x26") for one in r["fasteners"] if one["part"] == "M5x30"]
        ),
        "camera mount",
        "30.0 are needed to tilt",
    ),
    fails(
        "a camera without a place",
        RECORD,
        record(lambda r: r.update(camera_place=None)),
        "camera mount",
        "no camera_place",
    ),
    *(
        fails(f"camera: {key}", RECORD, in_place("travel", key, value), "camera mount", key)
        for key, value in (
            *(("along_axis_mm", 12.0), ("across_mm", 8.0), ("out_mm", 6.0)),
            *(("along_plate_mm", 9.0), ("yaw_deg", 9.0), ("roll_deg", 9.0), ("across_mm", 1.0)),
        )
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
        "gauge: another length",
        RECORD,
        in_place("lengths_mm", "near_width", 60.0),
        "camera gauge",
        "near_width is 60.000",
    ),
    fails(
        "gauge: better than it is",
        RECORD,
        in_place("error", "along_mm", 0.05),
        "camera gauge",
        "other errors",
    ),
    fails(
        "gauge: another pixel",
        RECORD,
        picture(0, column_px=100.0),
        "camera gauge",
        "appears elsewhere",
    ),
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

DRIVES: tuple[Mutation, ...] = (
    *(
        fails(f"drive: {key}", RECORD, scaled(key, 1.1), "drive", key)
        for key in (
            *("mass_g", "moment_g_mm", "azimuth_deg", "inertia_g_mm2", "worst_torque_nmm"),
            *("required_torque_nmm", "holding_torque_nmm", "ratio", "steps_per_deg"),
            *("belt_pull_n", "belt_centre_mm", "peak_torque_nmm", "teeth_in_mesh"),
            *("belt_rating_n", "belt_tension_n", "belt_tone_hz", "motor_wind_up_deg"),
            *("belt_wind_up_deg", "hold_current_a", "hold_loss_w"),
            *("motor_rise_k", "motor_radial_n"),
        )
    ),
    fails(
        "the carrier printed upside down",
        RECORD,
        upside_down("carrier"),
        "pads printed up",
        "of 15 pads",
    ),
    *(
        fails(f"holding: {key}", RECORD, held(3, **{key: by}), "holding", f"ball 3: {words}")
        for key, by, words in (
            ("force_needed_n", 0.5, "force_needed_n is"),
            ("force_available_n", 1.05, "force_available_n is"),
            ("ratio", 2.0, "ratio is"),
            ("wider_gap_n", 1.1, "wider_gap_n is"),
        )
    ),
    fails(
        "holding: another magnet",
        RECORD,
        record(lambda r: r["holding"]["balls"][0].update(magnet="MAGNET-4x3")),
        "holding",
        "ball 1: magnet MAGNET-4x3, its pocket is for",
    ),
    fails(
        "holding: glue where a magnet is",
        RECORD,
        record(lambda r: r["holding"]["balls"][0].update(by="glue")),
        "holding",
        "ball 1: held by glue",
    ),
    fails(
        "holding: a heavy ball",
        BALLS,
        row(BALLS, -1, mass_g=20_000.0),
        "hold ratio",
        "ball",
    ),
    fails("drive: centre", RECORD, drive(centre_mm=[0.0, 0.0, 0.0]), "drive", "centre_mm"),
    fails("drive: a torque", STOPS, row(STOPS, 1, torque_nmm=5.0), "drive", "stop 2: torque_nmm"),
    fails("drive: a turn", STOPS, row(STOPS, 1, wind_up_deg=0.3), "drive", "stop 2: wind_up_deg"),
    fails("drive: a hard pull", RECORD, scaled("peak_torque_nmm", 9.0), "motor bearing", "N are"),
    fails("drive: another motor", RECORD, drive(motor="NEMA17-60"), "drive", "motor is NEMA17-60"),
    fails("drive: another kind", RECORD, drive(drive="stage-60"), "drive", "drive is stage-60"),
    refused("drive: less than nothing", RECORD, drive(mass_g=-1.0), RECORD, "drive.mass_g is -1.0"),
    refused("no drive", RECORD, record(lambda r: r.pop("drive")), RECORD, "drive is missing"),
    fails(
        "pads of 10 mm error",
        RECORD,
        record(lambda r: r.update(target_pad_um=10_000.0)),
        "prototype requirements",
        "target_pad_um",
    ),
)

PATTERN = "shroud_front.dxf"
SHROUD_AND_LAMPS: tuple[Mutation, ...] = (
    fails("lamps: brighter", RECORD, lamps(lumen_each=900.0), "lamps", "lumen_each is 900"),
    fails("lamps: another strip", RECORD, lamps(strip="STRIP"), "lamps", "2 strips STRIP"),
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
        "light past lamps and card",
        "by lamp_1",
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
