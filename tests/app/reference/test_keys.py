"""What is said about the keys of a design."""

import tomllib

from tbcad.app.reference.keys import key_sections, unit_of
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import dotted_fields, section_of

KEYS = [key for section in key_sections() for key in section.keys]


def test_are_all_keys_of_the_models() -> None:
    known = {name for name, field in dotted_fields(Spec) if section_of(field) is None}
    assert {key.name for key in KEYS} == known


def test_every_section_is_described() -> None:
    assert all(section.description for section in key_sections())


def test_every_key_is_described_and_its_default_is_toml() -> None:
    for key in KEYS:
        assert key.description.endswith("."), key
        assert key.allowed, key
        assert "a table" not in key.allowed, key
        assert tomllib.loads(f"x = {key.default}"), key


def test_every_key_has_the_unit_of_its_name() -> None:
    for key in KEYS:
        last = key.name.rpartition(".")[2].rpartition("_")[2]
        named = last in {"mm", "deg", "um", "px", "percent", "s", "ma", "v"}
        assert bool(key.unit) == (named or key.name.endswith(("widths", "g_cm3", "_min", "_s2")))


def test_units() -> None:
    assert unit_of("mirrors.margin_mm") == "mm"
    assert unit_of("prototype.motion.feed_deg_min") == "degrees per minute"
    assert unit_of("optics.n") == unit_of("prototype.motion.safety") == ""
