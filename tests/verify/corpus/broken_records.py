"""Records that are broken while the files they describe are good, and halves of other designs."""

from __future__ import annotations

from dataclasses import replace

from tests.verify.corpus.mutation import Mutation, fails, refused
from tests.verify.corpus.record_changes import (
    JSON,
    MANIFEST,
    TABLE,
    angle,
    apex,
    as_text,
    beyond_the_worst,
    cell,
    centre,
    coat,
    coverage,
    cut_line,
    design,
    exchange,
    figure,
    first_part,
    flange,
    foot,
    half,
    json_file,
    leave_out,
    lines,
    loose,
    mirror,
    mirror_spec,
    mirrors,
    no_meshes,
    nothing_asked,
    other_design,
    pixels,
    radius,
    second_column,
    second_key,
    shell_spec,
    shift_camera,
    shift_one,
    skew,
    subdivision,
    target,
    turn,
    twin,
    without,
    word,
)
from tests.verify.corpus.seam_designs import not_aimed

RECORDS: tuple[Mutation, ...] = (
    fails("two ids exchanged", TABLE, exchange, "step surfaces"),
    fails("a radius 20 um off", TABLE, mirror(radius(0.02)), "radius error"),
    fails("a radius 1 nm off", TABLE, mirror(radius(1e-6)), "step surfaces"),
    fails("a centre 10 nm off the normal", TABLE, mirror(centre), "poses"),
    fails("a cell's area", TABLE, mirror(cell), "cell areas"),
    *(
        fails(f"a mirror's {key}", TABLE, mirror(figure(key)), "figures")
        for key in ("size_mm", "theta0_deg", "theta1_deg", "polar_deg", "azimuth_deg")
    ),
    fails("a mirror 1 um further out", TABLE, mirror(apex), "poses"),
    fails(
        "a mirror not in the record",
        TABLE,
        mirrors(leave_out, 0),
        "mirrors found",
        "1 not in the record",
    ),
    fails("a direction without its mirror", TABLE, mirrors(leave_out, 0), "directions", "1 vert"),
    fails("a mirror twice in the record", TABLE, mirrors(twin, 0), "directions", "a9999"),
    fails(
        "an id twice in the record",
        TABLE,
        mirrors(lambda rows, _: rows[3].update(id="a0010"), 0),
        "ids",
        "a0010",
    ),
    fails("an odd id", TABLE, mirrors(lambda rows, _: rows[3].update(id="m 4"), 0), "ids", "m 4"),
    fails(
        "cameras 0.1 mm lower", JSON, design(shift_camera(-0.1, False)), "requirements", "pinhole"
    ),
    fails("cameras and spec 0.1 mm lower", JSON, design(shift_camera(-0.1, True)), "poses"),
    fails("camera b 0.1 mm aside", JSON, design(shift_one), "requirements", "camera b pinhole 1"),
    fails("cameras turned by 30 degrees", JSON, design(turn(30)), "frame margin"),
    fails("another view angle", JSON, design(angle(0.99, False)), "requirements", "hfov"),
    fails("a view angle half as wide, spec too", JSON, design(angle(0.5, True)), "frame margin"),
    fails("a sensor of 16 x 16 pixels, spec too", JSON, design(pixels), "pixels, minimum"),
    fails("a coat that is not there", JSON, design(coat), "radius error", "0.020"),
    fails("a coat that is not there, by STEP", JSON, design(coat), "step surfaces", "0.02 mm"),
    fails("a target not met", JSON, target(beyond_the_worst, True), "coverage, spheres"),
    fails("a target not met on facets", JSON, target(beyond_the_worst, True), "coverage, facets"),
    fails(
        "a lower target than the spec's",
        JSON,
        target(lambda _: 30.0, False),
        "requirements",
        "target_mm",
    ),
    fails("the foot 10 um higher", JSON, design(foot), "step cells"),
    fails("another n in the spec", JSON, design(subdivision), "directions", "without a mirror"),
    fails("a mirror's coverage", TABLE, mirror(coverage), "recorded coverage"),
    *(
        fails(f"a wall of {mm:g} mm", JSON, design(shell_spec(wall_mm=mm)), "step wall", "3.000 mm")
        for mm in (1.0, 2.9, 9.0)
    ),
    fails("20 bolts", JSON, design(flange("seam_flange", bolts=20)), "step holes", "not 20"),
    fails("no dowels", JSON, design(flange("foot_flange", dowels=0)), "step holes", "not 0"),
    fails(
        "bolts of 10 mm", JSON, design(flange("foot_flange", bolt_hole_mm=10.0)), "step holes", "10"
    ),
    fails(
        "a flange of 9 mm",
        JSON,
        design(flange("seam_flange", thickness_mm=9.0)),
        "step holes",
        "not 9",
    ),
    fails(
        "a flange wider by 1 mm",
        JSON,
        design(flange("foot_flange", width_mm=13.0)),
        "step holes",
        "from its place",
    ),
    *(
        fails(f"radius rule: {what}", JSON, design(mirror_spec(**keys)), "radius rule", "by rule")
        for what, keys in (
            ("paper", {"radius_rule": "paper"}),
            ("flat", {"radius_rule": "flat"}),
            ("another margin", {"margin_mm": 1.0}),
            ("a larger margin of one mirror", {"own_margins_mm": [2.0] * 48 + [2.01]}),
            ("margins of fewer mirrors", {"own_margins_mm": [2.0] * 48}),
            ("margins below that of all", {"margin_mm": 2.1, "own_margins_mm": [2.0] * 49}),
            ("larger mirrors", {"max_radius_widths": 100.0}),
        )
    ),
    fails("a mesh error of 5 mm", JSON, design(loose(5.0)), "requirements", "mesh error"),
    refused(
        "a mesh error of 50 mm",
        JSON,
        design(loose(50.0)),
        "spec.mesh.structure_error_mm is 50.0, allowed is a number from 0.002 to 5",
    ),
    refused("a spec that asks nothing", JSON, design(nothing_asked), "spec.optics is missing"),
    refused(
        "a second column of the same name",
        TABLE,
        as_text(TABLE, second_column),
        "column radius_mm is there twice",
    ),
    refused(
        "a second target", JSON, as_text(JSON, second_key("target_mm", "1.0")), "key target_mm is"
    ),
    replace(
        refused(
            "a second list of files",
            MANIFEST,
            as_text(MANIFEST, second_key("files", "{}")),
            "key files is there twice",
        ),
        signed=False,
    ),
    refused(
        "a manifest of another program",
        MANIFEST,
        json_file(MANIFEST, lambda m: m.update(schema="x")),
        "schema is x, this version verifies tbcad-manifest/1",
    ),
    refused(
        "a manifest of a capture",
        MANIFEST,
        json_file(MANIFEST, lambda m: m.update(kind="capture")),
        "kind",
    ),
    fails("a part forgotten", JSON, design(no_meshes), "mirrors found", "missing: b0001"),
    fails("no STEP in the record", JSON, design(without("step")), "manifest", "shell_a.step"),
    fails("no 3MF in the record", JSON, design(without("3mf")), "manifest", "shell_a.3mf"),
    fails("a part for the other camera", JSON, first_part(camera="b"), "mirrors found", "missing"),
    fails("seam mirrors with the old radii", "all", not_aimed, "seam gap", "neither half sees"),
    fails("seam mirrors with the old radii, by coverage", "all", not_aimed, "coverage, spheres"),
    fails("one half of another design", "STL, 3MF, STEP", other_design, "centre error"),
    fails("one half of another design, by STEP", "STL, 3MF, STEP", other_design, "step surfaces"),
    refused(
        "NaN in the table",
        TABLE,
        lines(word(b"nan")),
        TABLE,
        "line 6: px is nan, allowed",
    ),
    refused("infinity in the table", TABLE, lines(word(b"1e999")), TABLE, "line 6: px is 1e999"),
    refused("a word in the table", TABLE, lines(word(b"left")), TABLE, "line 6: px is left"),
    refused("a field empty in the table", TABLE, lines(word(b"")), TABLE, "line 6: px is ''"),
    refused("a field too many in the table", TABLE, lines(word(b"1.0,2.0")), TABLE, "line 6 has"),
    refused("the table cut short", TABLE, as_text(TABLE, cut_line), TABLE, "truncated"),
    refused("the table empty", TABLE, as_text(TABLE, lambda _: b""), TABLE, "first line"),
    refused("the table without its heading", TABLE, lines(lambda r: r[1:]), TABLE, "first line"),
    refused("design.json cut short", JSON, as_text(JSON, half), JSON, "broken JSON"),
    refused("design.json empty", JSON, as_text(JSON, lambda _: b""), JSON, "broken JSON"),
    refused("design.json not UTF-8", JSON, as_text(JSON, lambda b: b"\xff" + b), JSON, "UTF-8"),
    refused(
        "design.json of another program", JSON, design(lambda d: d.update(schema="x")), "schema"
    ),
    refused(
        "design.json of the version before",
        JSON,
        design(lambda d: d.update(schema="tbcad-design/1")),
        "schema is tbcad-design/1, this version verifies tbcad-design/2",
    ),
    refused(
        "mirrors in a file outside",
        JSON,
        design(lambda d: d.update(mirrors="../m.csv")),
        "../m.csv",
    ),
    refused("axes that are no axes", JSON, design(skew), JSON, "forward and right"),
    refused(
        "a sensor without columns",
        JSON,
        design(lambda d: d["cameras"][0].update(width_px=0)),
        "width_px",
    ),
    refused(
        "a target that is a word", JSON, design(lambda d: d.update(target_mm="60")), "target_mm"
    ),
    refused("no parts", JSON, design(lambda d: d.update(parts=[])), "parts"),
    refused("a part outside", JSON, first_part(stl="../shell_a.stl"), "plain file name"),
    refused("a part at the root", JSON, first_part(step="/etc/hostname"), "plain file name"),
    refused("a part that is not there", JSON, first_part(**{"3mf": "x.3mf"}), "x.3mf", "missing"),
)
