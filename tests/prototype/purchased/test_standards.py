import pytest

from tbcad.prototype.files.bom_csv import standard_in


@pytest.mark.parametrize(
    ("what", "standard"),
    [
        ("socket head cap screw ISO 4762 M3 x 12", "ISO 4762"),
        ("steel ball 1 3/8 in ISO 3290-1 G40", "ISO 3290-1"),
        ("shaft collar DIN 705 A 8 with set screw", "DIN 705 A"),
        ("screw ASME B18.3 1/4-20 UNC for the camera's thread (ISO 1222)", "ASME B18.3"),
        ("deep groove ball bearing 608-2Z (ISO 15)", "ISO 15"),
        ("disc magnet 6 x 3 mm N42 nickel plated", ""),
        ("stepper NEMA 17 of 40 mm", ""),
    ],
)
def test_the_first_standard_named(what: str, standard: str) -> None:
    assert standard_in(what) == standard
