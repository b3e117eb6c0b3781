"""The spec: what it takes, and the one line it says about what it does not take."""

import json
import math
import os
import re
from pathlib import Path
from typing import get_args

import pytest
from annotated_types import Ge, Gt, Le, Lt
from hypothesis import example, given
from hypothesis import strategies as st

from tbcad.core.spec.design import FootFlangeSpec, PrinterSpec, Spec
from tbcad.core.spec.errors import SpecError, allowed_text, dotted_fields, nearest_key, section_of
from tbcad.core.spec.load import load_spec, spec_dict
from tbcad.core.spec.prototype import GradeName
from tbcad.core.spec.sizes import OpticsSpec
from tbcad.errors import InputError
from tbcad.prototype.balls.catalogue import load_grades

KEYS = {key: field for key, field in dotted_fields(Spec) if section_of(field) is None}
REFUSED = {
    "n=4.0": "optics.n is 4.0, allowed is a whole number from 2 to 60",
    "stretch=[3, 1]": "x of optics.stretch is 3, allowed is two numbers in brackets, each",
    "stretch=[1]": "y of optics.stretch is missing, allowed is two numbers in brackets, each",
    "stretch=1.2,1.3": "stretch is '1.2,1.3', allowed is two numbers in brackets, each",
    "bed_mm=[99, -1, 99]": "depth of printer.bed_mm is -1, allowed",
    "camera_mm=[5, 5, 5]": "z of optics.camera_mm is 5, allowed",
    "camera_mm=[0, 0, -1]": "three numbers in brackets: above 0 to 10000, from -10000 ",
    "own_margins_mm=[21]": "allowed is numbers in brackets, each from 0 to 20: change",
    "grade=G11": "allowed is G3 or G5",
    "shell=3": "shell is a section: set one of shell.wall_mm",
    "bolts=3": "shell.foot_flange.bolts or shell.seam_flange.bolts",
    **dict.fromkeys(
        ("prototype.k=0", "prototype.k=1.0"), "allowed is a whole number from 1 to 1000, or auto"
    ),
    **dict.fromkeys(
        ("prototype.prices=estimates", "prototype.prices=[1]"),
        "allowed is texts in brackets",
    ),
    **dict.fromkeys(("", "n", "=4", " =4"), "not key=value"),
    **{
        f"name={value}": "name is "
        for value in ("''", "'a\\nb'", "'../x'", "7", "'" + "a" * 81 + "'")
    },
    **{
        f"n={value}": "option: optics.n is "
        for value in ("4\nname = 'x'", "4]\n[x", "", "[" * 50_000)
    },
}
NUMBERS = {key: field for key, field in KEYS.items() if field.annotation in (int, float)}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "design.toml"


def refusal(path: Path | None, *options: str) -> str:
    with pytest.raises(SpecError) as error:
        load_spec(path, options)
    text = str(error.value)
    assert text.isprintable()
    assert len(text) < 400 + len(str(path))
    return text


def refused(file: Path, text: str | bytes) -> str:
    """The error about a file, which is always named."""
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    message = refusal(file)
    assert message.startswith(f"{file}: ")
    return message.removeprefix(f"{file}: ")


def test_defaults_stay_where_a_section_is_given_in_part(file: Path) -> None:
    file.write_text("[shell.foot_flange]\nwidth_mm = 20\n", encoding="utf-8")
    assert load_spec(file).shell.foot_flange == FootFlangeSpec(width_mm=20)
    assert load_spec(file).shell.foot_flange.bolts == 5
    assert load_spec(file).shell.seam_flange.bolts == 6


def test_plain_dict_is_json_and_leads_back() -> None:
    spec = load_spec(None, ["n=7", "camera_mm=[90, 5, -80]", "radius_rule=paper"])
    table = json.loads(json.dumps(spec_dict(spec)))
    assert Spec.model_validate(table) == spec


class TestFile:
    @pytest.mark.parametrize("text", [b"", b"\xef\xbb\xbfschema = 2", b"[optics]\r\nn = 18\r\n"])
    def test_may_be_empty_or_from_windows(self, file: Path, text: bytes) -> None:
        file.write_bytes(text)
        assert load_spec(file) == Spec()

    def test_missing_or_a_pipe(self, file: Path) -> None:
        assert "No such file" in refusal(file)
        os.mkfifo(file)
        assert "not a file" in refusal(file)  # and does not hang

    @pytest.mark.parametrize(
        ("text", "wrong"),
        [
            ("[optics\n", "not valid TOML.* line "),
            ("n = 1\nn = 2\n", "not valid TOML.* line "),
            ("a = " + "[" * 50_000, "tables nested too deeply"),
            ("\na" + ".a" * 400_000 + " = 1", "line 2: tables nested"),
        ],
        ids=["cut", "twice", "lists", "keys"],
    )
    def test_not_toml(self, file: Path, text: str, wrong: str) -> None:
        assert re.match(wrong, refused(file, text))

    @given(text=st.one_of(st.binary(max_size=60), st.text(max_size=60).map(str.encode)))
    @example(text=b'"" = 1')
    @example(text=b'"a\\nb" = 1')
    @example(text=b"[optics]\nn = 2026-11-21")
    @example(text=b"[optics]\nsemi_minor_mm = 0x" + b"f" * 9000)
    @example(text=b"[optics]\nn = " + b"9" * 9000)
    @example(text=b"[[optics]]\nn = 1")
    @example(text=b"[shell.seam_flange.bolts]\nx = 1")
    def test_any_file_is_a_spec_or_one_line(
        self, tmp_path_factory: pytest.TempPathFactory, text: bytes
    ) -> None:
        file = tmp_path_factory.getbasetemp() / "any.toml"
        file.write_bytes(text)
        try:
            assert isinstance(load_spec(file), Spec)
        except SpecError as error:
            assert str(error).isprintable()  # noqa: PT017


class TestUnknownKey:
    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("[optic]\nn = 1", "optic: did you mean optics"),
            ("wall_mm = 1", "wall_mm: did you mean shell.wall_mm"),
            ("[mesh]\nwall = 1", "mesh.wall: did you mean shell.wall_mm"),
            ("schema_version = 1", "schema_version: did you mean schema"),
            *(
                (f"[prototype.base]\n{key} = 1", f"{key}: did you mean printer.{key}?")
                for key in PrinterSpec.model_fields
            ),
        ],
    )
    def test_names_the_nearest(self, file: Path, text: str, said: str) -> None:
        message = refused(file, text)
        assert message.startswith("unknown key ")
        assert said in message

    @given(st.sampled_from(sorted(KEYS)), st.data())
    def test_one_wrong_letter_is_understood(self, key: str, data: st.DataObject) -> None:
        at = data.draw(st.integers(key.rfind(".") + 1, len(key) - 1))
        likely = nearest_key(key[:at] + "#" + key[at + 1 :], KEYS)
        # One letter may be all of a leaf, and only the section is then known.
        assert likely == key or len(key.rpartition(".")[2]) == 1


class TestValue:
    def test_range_ends_where_it_says(self) -> None:
        limits = [
            (key, field, limit)
            for key, field in NUMBERS.items()
            for limit in field.metadata
            if isinstance(limit, (Ge, Gt, Le, Lt))
        ]
        for key, field, limit in limits:
            ends = {name: getattr(limit, name, None) for name in ("ge", "gt", "le", "lt")}
            value = next(end for end in ends.values() if end is not None)
            outward = 1 if ends["le"] is not None or ends["lt"] is not None else -1
            step = 1 if field.annotation is int else abs(value) * 1e-9 or 1e-9
            message = refusal(None, f"{key}={value + outward * step!r}")
            assert message.startswith(f"option: {key} is ")
            assert allowed_text(field.annotation, field.metadata) in message
            assert f"{value:g}" in message

    @pytest.mark.parametrize("value", ["nan", "inf", "-inf", "true", "'1'", "[1]", "{a = 1}", "x"])
    def test_only_finite_numbers_are_numbers(self, value: str) -> None:
        for key in NUMBERS:
            assert f"{key} is " in refusal(None, f"{key}={value}")

    def test_whole_numbers_are_numbers(self) -> None:
        assert load_spec(None, ["wall_mm=4"]).shell.wall_mm == 4

    @pytest.mark.parametrize("value", ["1", "3", "true", "2.0", "'2'"])
    def test_of_another_schema(self, value: str) -> None:
        assert re.search("schema.* allowed is (a whole number|2)", refusal(None, f"schema={value}"))

    @pytest.mark.parametrize(("given", "said"), REFUSED.items())
    def test_what_a_key_takes_in_words(self, given: str, said: str) -> None:
        assert said in refusal(None, given)

    def test_several_faults_are_counted(self, file: Path) -> None:
        message = refused(file, "[optics]\nn = 99\nsemi_minor_mm = 0\n[mesh]\nx = 1\n")
        assert message.startswith("optics.n is 99")
        assert message.endswith("(and 2 more)")


class TestTogether:
    @pytest.mark.parametrize("flange", ["seam_flange", "foot_flange"])
    @pytest.mark.parametrize("hole", ["bolt_hole_mm", "dowel_hole_mm"])
    def test_holes_fit_their_flange(self, flange: str, hole: str) -> None:
        key = f"shell.{flange}.{hole}"
        load_spec(None, [f"{key}=10"])
        message = refusal(None, f"{key}=10.01")
        assert f"shell.{flange}: {hole} 10.01 does not fit in width_mm 12" in message

    def test_capture_sphere_fits_the_ellipsoid(self) -> None:
        message = refusal(None, "semi_minor_mm=71")
        least = float(message.split("semi_minor_mm more than ")[1].split()[0])
        assert least == pytest.approx(math.sqrt(30**2 + 30 * math.sqrt(2) * 100), rel=1e-3)
        load_spec(None, [f"semi_minor_mm={least * 1.001}"])
        refusal(None, f"semi_minor_mm={least * 0.999}")

    def test_facets_are_finer_than_the_wall(self) -> None:
        assert "structure_error_mm" in refusal(None, "structure_error_mm=1", "wall_mm=1")

    def test_options_are_blamed_with_the_file(self, file: Path) -> None:
        file.write_text("[optics]\nsemi_minor_mm = 100\n", encoding="utf-8")
        message = refusal(file, "capture_diameter_mm=200")
        assert message.startswith(f"{file} with options: ")

    @given(
        st.floats(1, 5000),
        st.tuples(st.floats(0.1, 1e4), st.floats(-1e4, 1e4), st.floats(-1e4, -0.1)),
        st.floats(0.001, 1000),
    )
    def test_what_is_taken_fits(
        self, semi_minor: float, camera: tuple[float, float, float], capture: float
    ) -> None:
        """Closed form: the ellipsoid comes to a - c of its focus."""
        c = math.hypot(*camera) / 2
        a = math.sqrt(semi_minor**2 + c**2)
        options = {
            "optics.semi_minor_mm": repr(semi_minor),
            "optics.camera_mm": repr(list(camera)),
            "optics.capture_diameter_mm": repr(capture),
        }
        if min(a - c, 2 * c) > capture / 2 * (1 + 1e-9):
            optics = OpticsSpec(
                semi_minor_mm=semi_minor, camera_mm=camera, capture_diameter_mm=capture
            )
            assert load_spec(None, options).optics == optics
        elif min(a - c, 2 * c) < capture / 2 * (1 - 1e-9):
            with pytest.raises(SpecError, match="capture sphere"):
                load_spec(None, options)


class TestOptions:
    @pytest.mark.parametrize(
        "option", ["optics.n=4", "n=4", " n = 4 ", "n=0x4", "optics.n=4 # small"]
    )
    def test_set_a_key(self, option: str) -> None:
        assert load_spec(None, [option]).optics.n == 4

    def test_go_over_the_file_and_the_later_over_the_earlier(self, file: Path) -> None:
        file.write_text("[optics]\nn = 5\nsemi_minor_mm = 90\n", encoding="utf-8")
        optics = load_spec(file, ["n=6", "n=7"]).optics
        assert (optics.n, optics.semi_minor_mm) == (7, 90)

    def test_the_end_of_a_key_that_is_the_only_one_is_enough(self) -> None:
        assert load_spec(None, ["seam_flange.bolts=3"]).shell.seam_flange.bolts == 3

    @given(st.text(max_size=40))
    def test_any_text_is_a_spec_or_one_line(self, text: str) -> None:
        try:
            load_spec(None, [text])
        except InputError as error:
            assert str(error).isprintable()  # noqa: PT017


class TestPrototype:
    def test_grades_are_those_of_the_table(self) -> None:
        assert list(load_grades()) == list(get_args(GradeName))

    def test_the_key_nearest_to_the_top_is_meant(self) -> None:
        """Short names of the shell were in use before the prototype had keys."""
        spec = load_spec(None, ["wall_mm=4", "base.relief_mm=0.5"])
        assert spec.shell.wall_mm == 4
        assert spec.prototype.base.relief_mm == 0.5
        assert load_spec(None, ["magnet_gap_mm=0.4"]).prototype.base.magnet_gap_mm == 0.4


def test_the_papers_design_has_the_sizes_it_was_tried_with() -> None:
    prototype = load_spec(None).prototype
    assert (prototype.largest_ball_mm, prototype.ball_wall_mm) == (40, 3)
    assert (prototype.post_diameter_mm, prototype.camera_diameter_mm) == (20, 60)
    assert (prototype.auto_direction_max_deg, prototype.auto_direction_median_deg) == (3.5, 1.5)
    assert (prototype.stage.disc_mm, prototype.stage.top_mm) == (17, -19)
    assert prototype.stage.leds_mm[0] == (23.1, -4.1, -8.0)
    assert prototype.frame.floor_mm == -230


def test_half_the_size() -> None:
    options = ["capture_diameter_mm=30", "camera_mm=[50, 0, -50]", "semi_minor_mm=50"]
    prototype = load_spec(None, options).prototype
    assert (prototype.largest_ball_mm, prototype.ball_wall_mm) == (40, 2)
    assert (prototype.post_diameter_mm, prototype.camera_diameter_mm) == (10, 40)
    assert (prototype.stage.disc_mm, prototype.stage.leds_mm) == (12, ())
    assert prototype.frame.floor_mm == -180
    set_by_hand = load_spec(None, [*options, "post_diameter_mm=12", "frame.floor_mm=-300"])
    assert set_by_hand.prototype.post_diameter_mm == 12
    assert set_by_hand.prototype.frame.floor_mm == -300


@given(
    scale=st.floats(0.2, 5),
    lean=st.floats(0.3, 3),
    minor=st.floats(0.9, 2),
)
def test_every_design_gets_allowed_numbers(scale: float, lean: float, minor: float) -> None:
    """The record of a design, with the numbers, is a design again."""
    camera = [100 * scale, 0.0, -100 * scale * lean]
    options = [
        f"camera_mm={camera}",
        f"semi_minor_mm={150 * scale * minor}",
        f"capture_diameter_mm={50 * scale}",
    ]
    spec = load_spec(None, options)
    assert Spec.model_validate(spec_dict(spec)) == spec
    stage, capture = spec.prototype.stage, 25 * scale
    assert -capture <= stage.top_mm <= 0
    assert all(math.dist(place, (0, 0, 0)) < capture for place in stage.leds_mm)


@pytest.mark.parametrize(
    ("given", "meant"),
    [("true", "printed"), ("false", "none"), ("turned", "turned"), ("printed", "printed")],
)
def test_how_caps_are_made(given: str, meant: str) -> None:
    """True and false are of designs before there were words."""
    spec = load_spec(None, [f"prototype.caps={given}"])
    assert spec.prototype.caps == meant
    assert spec.cap_density_g_cm3 == {"printed": 1.18, "turned": 2.7, "none": 0.0}[meant]


def test_caps_of_another_kind_are_refused_in_one_line() -> None:
    with pytest.raises(SpecError, match="caps is 'resin', allowed is printed or turned or none"):
        load_spec(None, ["prototype.caps=resin"])
