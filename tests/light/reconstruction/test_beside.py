"""Whether a field is of a light field."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.errors import InputError, PlausibilityWarning
from tbcad.light.reconstruction.field import (
    field_file,
    field_of,
    light_field_fingerprint,
    wanted_field,
    write_field,
)
from tbcad.light.simulate.capture.light_field import LightField
from tests.light.simulate.conftest import cameras, knot, light_field  # noqa: F401
from tests.light.viewer.fields import ball, write_ball


def brighter(source: LightField) -> LightField:
    """With one pixel of one camera a little brighter."""
    frame = source.frames["b"]
    colour = frame.image().copy()
    colour[70, 90, 1] += 1
    planes = {**frame.planes, "colour": colour}
    return replace(source, frames={**source.frames, "b": replace(frame, planes=planes)})


def turned(source: LightField) -> LightField:
    """With other rays of the same colours."""
    frame = source.frames["a"]
    planes = {**frame.planes, "direction": -frame.planes["direction"]}
    return replace(source, frames={**source.frames, "a": replace(frame, planes=planes)})


def shrunk(source: LightField) -> LightField:
    return replace(source, capture_mm=59.0)


def half(source: LightField) -> LightField:
    return replace(source, frames={"a": source.frames["a"]})


@pytest.mark.parametrize("change", [brighter, turned, shrunk, half])
def test_each_light_field_has_its_own_fingerprint(
    light_field: LightField,  # noqa: F811
    change: Callable[[LightField], LightField],
) -> None:
    assert light_field_fingerprint(change(light_field)) != light_field_fingerprint(light_field)


def test_a_file_has_the_fingerprint_of_what_is_in_it(captured: Path) -> None:
    with LightField.open(captured) as stored:
        inside = LightField.read(captured)
        assert light_field_fingerprint(stored) == light_field_fingerprint(inside)


def test_a_field_is_read_with_its_light_field_only(
    light_field: LightField,  # noqa: F811
    tmp_path: Path,
) -> None:
    file = write_ball(light_field, tmp_path)
    assert np.array_equal(field_of(file, light_field).values, ball().values)
    with pytest.raises(InputError, match=r"is of another capture, or of an older one: write it"):
        field_of(file, brighter(light_field))
    write_field(file, ball())
    with pytest.raises(InputError, match="does not say of which light field"):
        field_of(file, light_field)


@pytest.mark.filterwarnings("error")
def test_what_is_used_by_default(light_field: LightField, tmp_path: Path) -> None:  # noqa: F811
    assert wanted_field(None, tmp_path, light_field) is None
    write_ball(light_field, tmp_path)
    for place in (tmp_path, tmp_path / "lightfield.h5"):
        assert wanted_field(None, place, light_field) is not None
    assert wanted_field("depth", tmp_path, light_field) is None
    assert wanted_field(None, tmp_path / "other.h5", light_field) is None
    assert wanted_field(None, tmp_path, light_field, frame=1) is None
    write_ball(light_field, tmp_path, frame=1)
    assert wanted_field(None, tmp_path, light_field, frame=1) is not None


@pytest.mark.parametrize("damaged", [False, True])
def test_what_is_of_no_use_is_told_or_refused(
    light_field: LightField,  # noqa: F811
    tmp_path: Path,
    damaged: bool,
) -> None:
    file = field_file(tmp_path)
    if damaged:
        file.write_bytes(b"PK")
    else:
        write_ball(brighter(light_field), tmp_path)
    with pytest.warns(PlausibilityWarning, match="it is not used here"):
        assert wanted_field(None, tmp_path, light_field) is None
    with pytest.raises(InputError, match=str(file)):
        wanted_field("field", tmp_path, light_field)
