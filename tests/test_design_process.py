"""What is computed ahead in a process is what would be computed here."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import islice

import pytest

from tbcad.design_process import design_process
from tbcad.mirrors.array import MirrorDesign, design
from tbcad.own_process import own_process
from tbcad.prototype.arrangement import Arrangement, arrange, arrangements
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.spec.load import load_spec


def few() -> Spec:
    return load_spec(None, ["n=4"])


def ahead_of_use(spec: Spec) -> tuple[list[bytes], list[str], list[str]]:
    """Figures of mirrors and of two arrangements, and what was reported."""
    heard: list[str] = []
    with own_process(), design_process(spec, arranged=True) as ahead:
        mirrors = ahead.mirrors(heard.append)
        return figures(mirrors), first_two(ahead.arrangements(mirrors)), heard


def figures(mirrors: MirrorDesign) -> list[bytes]:
    return [
        figure.tobytes()
        for array in mirrors.arrays
        for figure in (array.mirrors.radius, array.mirrors.centre, array.coverage)
    ]


def first_two(arranged: Iterable[Arrangement]) -> list[str]:
    """All but the layout of the balls, whose catalogue has sets, in no order."""
    return [str(replace(one, layout=None)) for one in islice(arranged, 2)]


def test_mirrors_and_arrangements_are_those_computed_here() -> None:
    heard: list[str] = []
    mirrors, arranged, reported = ahead_of_use(few())
    here = design(few(), heard.append)
    assert mirrors == figures(here)
    assert reported == heard
    assert arranged == first_two(arrangements(here))


def test_mirrors_that_cannot_be_made_are_refused() -> None:
    spec = load_spec(
        None, ["n=9", "camera_mm=[174, 24, -243]", "semi_minor_mm=78", "capture_diameter_mm=36"]
    )
    with pytest.raises(SpecError) as here:
        design(spec)
    with (
        own_process(),
        design_process(spec, arranged=True) as ahead,
        pytest.raises(SpecError) as there,
    ):
        ahead.mirrors(lambda _: None)
    assert str(there.value) == str(here.value)


def test_a_prototype_that_cannot_be_arranged_is_refused() -> None:
    spec = load_spec(None, ["n=4", "camera_diameter_mm=500", "camera_length_mm=1000"])
    with pytest.raises(SpecError) as here:
        arrange(design(spec))
    with (
        own_process(),
        design_process(spec, arranged=True) as ahead,
        pytest.raises(SpecError) as there,
    ):
        next(ahead.arrangements(ahead.mirrors(lambda _: None)))
    assert str(there.value) == str(here.value)


def test_an_arrangement_that_is_not_wanted_is_not_computed_ahead() -> None:
    with own_process(), design_process(few(), arranged=False) as ahead:
        assert not ahead.arranged
        assert next(ahead.arrangements(ahead.mirrors(lambda _: None))) is not None
