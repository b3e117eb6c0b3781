"""Processes: what they take, the one line they say otherwise, and what their figures mean."""

import json
import math
from dataclasses import fields
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from tbcad.core.optics.sphere_forms import FORM_TERMS
from tbcad.core.spec.errors import SpecError, section_of
from tbcad.core.spec.errors import dotted_fields as keys_of
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.process.chain import STEPS_FILE
from tbcad.tolerancing.process.process import (
    BUILT_IN,
    BY_USER,
    CAPS_FILE,
    Process,
    ball_radius_error,
    cap_forms,
    load_process,
    process_errors,
)

KINDS = tuple(key for key, field in keys_of(Process) if section_of(field))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "own.toml"


def refusal(which: str, *options: str) -> str:
    with pytest.raises(SpecError) as error:
        load_process(which, options)
    text = str(error.value)
    assert text.isprintable()
    return text


def refused(file: Path, text: str | bytes) -> str:
    """What is said about a file, which is always named."""
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    said = refusal(str(file))
    assert said.startswith(f"{file}: ")
    return said.removeprefix(f"{file}: ")


CAPS = ("cap_sagitta", *(f"cap_{name}" for name in FORM_TERMS))


def table(magnitude: float, mean: float, without: str = "", **others: str) -> str:
    """A file whose kinds have the same figures, whole but for one kind."""
    head = 'name = "even"\ntitle = "All the same"\nschema = 1\nball_grade = "G3"\n'
    body = f'magnitude = {magnitude}\nmean = {mean}\nsource = "tests"\n'
    form = f'magnitude = {magnitude}\nsource = "tests"\n'
    caps = (f"{one}_um" for one in CAPS)
    forms = dict.fromkeys(("waviness_um", "cutter_radius_mm", "ridge_rounding_um", *caps), form)
    bodies = {"warp_um": f"{form}length_mm = 50\n"} | forms | others
    kinds = (kind for kind in KINDS if kind != without)
    return head + "".join(f"[{kind}]\n{bodies.get(kind, body)}" for kind in kinds)


class TestBuiltIn:
    def test_are_all_files_there_are(self) -> None:
        there = files("tbcad.tolerancing").joinpath("process").iterdir()
        assert sorted(f"{name}.toml" for name in BUILT_IN) == sorted(
            file.name
            for file in there
            if file.name.endswith(".toml") and file.name not in {STEPS_FILE, CAPS_FILE}
        )

    @pytest.mark.parametrize(
        ("name", "limit_mm"),
        [("fdm", 0.2), ("sls", 0.3), ("sla", 0.1), ("diamond", 0.005)],
    )
    def test_centres_and_radii_follow_from_the_tolerance_of_short_lengths(
        self, name: str, limit_mm: float
    ) -> None:
        """Of a length between two mirrors the maker's limit is two standard deviations.

        Farther apart than the correlation length, they share no warp. A part of one mirror keeps
        a quarter of the limit for its radius (docs/decisions/0007).
        """
        got, drawing = process_errors(load_process(name)), np.random.default_rng(7)
        centres = got.sphere_centre.sample(drawing, 2, 400_000)
        ends = centres + got.sphere_radius.sample(drawing, 2, 400_000)
        ends += got.warp.sample(drawing, 2, 400_000)
        assert 2 * np.std(ends[0] - ends[1]) == pytest.approx(limit_mm, rel=0.01)
        assert got.whole_radius.spread == pytest.approx(limit_mm / 4, rel=0.01)

    def test_plain_dict_is_json_and_leads_back(self) -> None:
        for name in BUILT_IN:
            process = load_process(name)
            text = process.model_dump_json(by_alias=True)
            assert Process.model_validate(json.loads(text)) == process


# What is said about options of a built-in process, and about files; what a file is based on.
OPTIONS = {
    "warp_um.length_mm=5": "option: warp_um.length_mm is 5",
    "warp_um.mean=1": "option: warp_um.mean is 1",
    "warp_um.distribution=uniform": "option: warp_um.distribution is 'uniform'",
    "waviness_um=-1": "option: waviness_um.magnitude is -1",
    "waviness_um.mean=0.1": "option: waviness_um.mean is 0.1",
    "seat_um": "option 'seat_um' is not kind=value: write for instance seat_um=20",
    "=3": "option '=3' is not kind=value",
    "seet_um=3": "option: unknown key seet_um: did you mean seat_um?",
    "seat_um.meen=3": "option: unknown key seat_um.meen: did you mean seat_um.mean?",
    "seat_um=-3": "option: seat_um.magnitude is -3, allowed is a number from 0 to 10000",
    "seat_um=three": "option: seat_um.magnitude is 'three', allowed is a number",
}
BODIES = (
    ("seat_um", 'magnitude = 1e5\nsource = "x"', "from 0 to 10000: change it"),
    ("seat_um", 'magnitude = nan\nsource = "x"', "is nan, allowed is a number"),
    ("seat_um", 'magnitude = 1\nsource = " "', "is ' ', allowed is text that matches"),
    ("seat_um", "magnitude = 1", "seat_um.source is missing, allowed is text"),
    ("seat_um", 'source = "x"', "seat_um.magnitude is missing, allowed is a number"),
    ("axis_tilt_mrad", 'magnitude = 501\nsource = "x"', "from 0 to 500: change it"),
    ("rotation_angle_deg", 'magnitude = 46\nsource = "x"', "from 0 to 45: change it"),
    ("scale_axis_permille", 'magnitude = 201\nsource = "x"', "from 0 to 200: change it"),
    ("facets_mm", 'magnitude = 101\nsource = "x"', "from 0 to 100: change it"),
)
LACKING = 'based_on = "fdm"\n[coating_um]\nmagnitude = 1\n'
FILES: tuple[tuple[str | bytes, str], ...] = (
    (b"name = ", "not valid TOML"),
    (b"name = '\xff'", "not UTF-8 text"),
    (b"a = " + b"[" * 100_000, "nested too deeply"),
    (b"#" * 1_000_001, "over 1 MB, too large for a process"),
    ('based_on = "mine"\n', "based_on is 'mine', allowed is fdm or sls or sla or cnc or diamond"),
    (LACKING, "coating_um.source is missing, allowed is text"),
    ('name = "x"\ntitle = "x"\nball_grade = "G40"\n', "sphere_centre_um is missing, allowed is"),
    (table(1, 0) + "[spere_centre_um]\nmagnitude = 1\n", "unknown key spere_centre_um: did you"),
    (table(1, 0).replace('"G3"', '"G4"'), "ball_grade is 'G4', allowed is G3 or G5"),
    (table(1, 0).replace("schema = 1", "schema = 2"), "schema is 2, allowed is 1"),
    (table(1, 0).replace("schema = 1", "schema = true"), "allowed is a whole number"),
    *((table(1, 0, kind), f"{kind} is missing") for kind in ("warp_um", "waviness_um")),
    *((table(1, 0, **{kind: f"{body}\n"}), said) for kind, body, said in BODIES),
)


class TestErrors:
    def test_every_kind_is_one_of_the_models(self) -> None:
        made = {kind.rpartition("_")[0] for kind in KINDS} | {"ball_radius"}
        assert made == {field.name for field in fields(Errors)}

    def test_units(self, file: Path) -> None:
        file.write_text(table(2, 1), encoding="utf-8")
        got = process_errors(load_process(str(file)))
        degree, others = math.pi / 180, {"ball_radius", "cutter_radius", "ridge_rounding"}
        known = {
            "facets": Error(2, 1),
            "warp": Error(0.002, length=50),
            "waviness": Error(0.002),
            "rotation_angle": Error(2 * degree, degree),
            "wind_up": Error(0.02, 0.01),
            "sag": Error(0.02, 0.01),
        }
        for name, error in vars(got).items():
            known |= {name: Error(0.002)} if name in CAPS else {}
            assert name in others or error == known.get(name, Error(0.002, 0.001)), name

    def test_forms_of_caps_are_by_how_they_are_made_unless_stated(self) -> None:
        printed, turned, none = (
            process_errors(load_process("fdm"), caps=caps) for caps in ("printed", "turned", "none")
        )
        assert printed.cap_sagitta == Error(0.01)
        assert turned.cap_sagitta == Error(pytest.approx(0.0003))
        assert none.cap_sagitta == Error()
        assert (
            set(cap_forms("printed")) == set(cap_forms("turned")) == {f"{one}_um" for one in CAPS}
        )
        own = process_errors(load_process("fdm", ["cap_coma_um=5"]), caps="turned")
        assert (own.cap_coma, own.cap_sagitta) == (Error(0.005), turned.cap_sagitta)

    def test_of_the_coat_only_what_the_design_does_not_know(self) -> None:
        process = load_process("fdm", ["coating_um.mean=40", "coating_um=15"])
        assert process_errors(process).coating == Error(0.015, 0.04)
        assert process_errors(process, known_coating_um=50).coating.mean == pytest.approx(-0.01)

    def test_balls_are_those_of_iso_3290(self) -> None:
        """G40: form 1 um of radius over the ball, lot 2 um of diameter; G10: 0.25 and 0.5."""
        assert ball_radius_error("G40") == Error(pytest.approx(1.0e-3), 0.0, "uniform")
        made = process_errors(load_process("sla", ["ball_grade=G10"]))
        assert made.ball_radius == Error(pytest.approx(0.25e-3), 0.0, "uniform")


class TestOwnFile:
    def test_may_rest_on_a_built_in_one_and_replaces_whole_kinds(self, file: Path) -> None:
        """A figure must not inherit the mean, nor the source, of another."""
        file.write_text(f'{LACKING}source = "measured"\n', encoding="utf-8")
        process, base = load_process(str(file)), load_process("fdm")
        assert (process.name, process.coating_um.magnitude, process.coating_um.mean) == (
            "own",
            1,
            0,
        )
        assert process.sphere_centre_um == base.sphere_centre_um
        assert base.coating_um.mean > 0

    def test_is_refused_in_one_line(self, file: Path) -> None:
        for data, said in FILES:
            assert said in refused(file, data)

    def test_that_is_not_there(self, tmp_path: Path) -> None:
        assert "process 'SLA' is neither built in (fdm" in refusal("SLA")
        assert refusal("slaa").endswith("did you mean sla?")
        assert refusal(str(tmp_path)).endswith("name one of these or check the path")
        assert "nor a file" in refusal("\0")


class TestChains:
    """Steps add up to one process."""

    own = """
based_on = "diamond"
steps = ["cut", "diamond-mandrel", "swell", "coat"]
[step.cut]
title = "cut"
warp_um = { magnitude = 3, length_mm = 90, source = "x" }
coating_um = { magnitude = 3, mean = 2, source = "x" }
cutter_radius_mm = { magnitude = 0.3, source = "x" }
[step.swell]
title = "swells"
warp_um = { magnitude = 4, length_mm = 30, source = "y" }
coating_um = { magnitude = 6, mean = 5, distribution = "uniform", source = "y" }
ridge_rounding_um = { magnitude = 1, source = "y" }
"""

    def test_variances_and_means_add_and_the_largest_radius_counts(self, file: Path) -> None:
        file.write_text(self.own, encoding="utf-8")
        process = load_process(str(file))
        mandrel = load_process("nickel-diamond")
        assert process.name == "own"
        assert process.warp_um.magnitude == pytest.approx(math.sqrt(9 + 16 + 1.73**2))
        assert process.warp_um.length_mm == 30
        assert process.coating_um.magnitude == pytest.approx(math.sqrt(9 + 12 + 0.02**2))
        assert process.coating_um.mean == pytest.approx(7.1)
        assert process.coating_um.source.startswith("cut: x; swell: y; coat: tungsten")
        assert process.ridge_rounding_um == mandrel.ridge_rounding_um.model_copy(
            update={"source": process.ridge_rounding_um.source}
        )

    def test_a_cutter_of_the_mandrel_leaves_no_fillet_but_must_fit_its_pockets(
        self, file: Path
    ) -> None:
        file.write_text(self.own, encoding="utf-8")
        process = load_process(str(file))
        assert (process.cutter_radius_mm.magnitude, process.mandrel_cutter_mm) == (0.3, 0.5)
        nickel = load_process("nickel-diamond")
        assert (nickel.cutter_radius_mm.magnitude, nickel.mandrel_cutter_mm) == (0, 0.5)
        assert load_process("cnc").mandrel_cutter_mm is None
        named = [load_process(name).ball_mm for name in ("nickel-milled", "cnc", "epoxy", "fdm")]
        assert [process.ball_mm, *named] == [0.5, 2, 0.5, 0.5, None]

    def test_a_step_that_is_taken_twice_counts_twice(self, file: Path) -> None:
        file.write_text('based_on = "cnc"\nsteps = ["coat", "coat"]\n', encoding="utf-8")
        coat, once = load_process(str(file)).coating_um, load_process("cnc").coating_um
        assert coat.mean == pytest.approx(2 * once.mean)
        assert coat.magnitude == pytest.approx(math.sqrt(2) * once.magnitude)

    def test_what_no_step_has_is_zero_whatever_it_rests_on(self) -> None:
        inserts = load_process("inserts")
        assert load_process("cnc").ridge_rounding_um.magnitude > 0
        assert (inserts.ridge_rounding_um.magnitude, inserts.cutter_radius_mm.magnitude) == (0, 0)
        assert inserts.camera_shift_um == load_process("cnc").camera_shift_um

    def test_others_are_refused_in_one_line(self, file: Path) -> None:
        for text, said in {
            'steps = "mill"': "steps is 'mill', allowed is a list of names of steps",
            'steps = [["mill"]]': "allowed is a list of names of steps",
            'steps = ["mil"]': "there is no step 'mil', allowed are mill, ",
            'steps = ["x"]\n[step.x]\nseat_um = {}': "step x: title is missing",
            'steps = ["coat"]\nstep = 3': "step is 3, allowed are tables [step.NAME]",
            'steps = ["coat"]\n[step.x]\ntitle = "x"': "step x is not in steps",
            "step = 3": "unknown key step: did you mean steps?",
        }.items():
            file.write_text(f'based_on = "cnc"\n{text}', encoding="utf-8")
            assert said in refusal(str(file))


def test_options() -> None:
    """A kind is its magnitude; other keys by their whole name."""
    options = ["sphere_centre_um=12", "coating_um.mean=5", "coating_um.source=scale"]
    process, base = (
        load_process("sla", [*options, "ball_grade=G5", "name=mine"]),
        load_process("sla"),
    )
    centre, coating = process.sphere_centre_um, process.coating_um
    assert (centre.magnitude, centre.source) == (12, BY_USER)
    assert process.sphere_radius_um == base.sphere_radius_um
    assert (coating.mean, coating.magnitude) == (5, base.coating_um.magnitude)
    assert (coating.source, process.ball_grade, process.name) == ("scale", "G5", "mine")
    for option, said in OPTIONS.items():
        assert refusal("sla", option).startswith(said)
