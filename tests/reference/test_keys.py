"""What is said about the keys of a design."""

import tomllib

import pytest

from tbcad.reference.keys import Key, key_sections, unit_of
from tbcad.spec.design import Spec
from tbcad.spec.errors import dotted_fields, section_of

KEYS = [key for section in key_sections() for key in section.keys]


def test_are_all_keys_of_the_models() -> None:
    known = {name for name, field in dotted_fields(Spec) if section_of(field) is None}
    assert {key.name for key in KEYS} == known


def test_every_section_is_described() -> None:
    assert all(section.description for section in key_sections())


@pytest.mark.parametrize("key", KEYS, ids=lambda key: key.name)
class TestEveryKey:
    def test_is_described(self, key: Key) -> None:
        assert key.description.endswith(".")
        assert key.allowed
        assert "a table" not in key.allowed

    def test_default_is_toml(self, key: Key) -> None:
        assert tomllib.loads(f"x = {key.default}")

    def test_has_the_unit_of_its_name(self, key: Key) -> None:
        last = key.name.rpartition(".")[2].rpartition("_")[2]
        assert bool(key.unit) == (
            last in {"mm", "deg", "um", "px", "percent", "s", "ma", "v"}
            or key.name.endswith(("widths", "g_cm3", "_min", "_s2"))
        )


def test_units() -> None:
    assert unit_of("mirrors.margin_mm") == "mm"
    assert unit_of("prototype.motion.feed_deg_min") == "degrees per minute"
    assert unit_of("optics.n") == unit_of("prototype.motion.safety") == ""
