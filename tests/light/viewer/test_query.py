"""Queries of the viewer's page: what is allowed, and the words that refuse the rest."""

import pytest

from tbcad.errors import InputError
from tbcad.light.viewer.page import Query, limits, parse_query

CAPTURE_MM = 60.0


def test_what_is_left_out_has_its_default() -> None:
    assert parse_query("", CAPTURE_MM) == Query()
    assert parse_query("azimuth=12.5&still=1", CAPTURE_MM) == Query(azimuth=12.5, still=1)


@pytest.mark.parametrize("name", limits(CAPTURE_MM))
def test_limits_are_allowed_and_what_is_beyond_is_not(name: str) -> None:
    kind = type(getattr(Query(), name))
    for value, beyond in zip(limits(CAPTURE_MM)[name], (-1, 1), strict=True):
        assert getattr(parse_query(f"{name}={kind(value)}", CAPTURE_MM), name) == value
        with pytest.raises(InputError, match=f"{name} .* is not allowed"):
            parse_query(f"{name}={kind(value) + beyond}", CAPTURE_MM)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("azimuth=north", "azimuth 'north' is no number"),
        ("azimuth=nan", "azimuth 'nan' is no number"),
        ("distance=inf", "distance 'inf' is no number"),
        ("focus=", "focus '' is no number"),
        ("width=64.5", "width '64.5' is no number"),
        ("still=maybe", "still 'maybe' is no number"),
        ("zoom=2", "'zoom' is unknown or given twice"),
        ("azimuth=1&azimuth=2", "'azimuth' is unknown or given twice"),
        ("&".join(f"azimuth={k}" for k in range(99)), "too many parts"),
    ],
)
def test_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse_query(text, CAPTURE_MM)


def test_every_allowed_viewpoint_is_a_camera() -> None:
    for elevation in limits(CAPTURE_MM)["elevation"]:
        for distance in limits(CAPTURE_MM)["distance"]:
            query = Query(elevation=elevation, distance=distance).check(CAPTURE_MM)
            assert query.camera(CAPTURE_MM).width_px == query.width
