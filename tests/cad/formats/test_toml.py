"""Values as TOML, read by Python's own library."""

import tomllib

import pytest

from tbcad.cad.formats.checked_files import toml_text


@pytest.mark.parametrize("value", [1, 2.5, True, 'a "b" \\', (1.0, (2.0, -3.0)), ("a", "b"), ()])
def test_toml_text_is_read_back(value: object) -> None:
    read = tomllib.loads(f"x = {toml_text(value)}")["x"]
    assert toml_text(read) == toml_text(value)
