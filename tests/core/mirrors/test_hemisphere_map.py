"""The map of a design: equal areas, a dot for each mirror, nothing else."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import tbcad
from tbcad.core.mirrors.record import SIZE_PX, equal_area, hemisphere_map


def test_areas_are_equal() -> None:
    """Of random directions those above a height z are the share 1 - z, and so is their disc."""
    polar = np.arccos(np.linspace(1, 0, 11))
    u = np.column_stack([np.sin(polar), 0 * polar, np.cos(polar)])
    assert equal_area(u)[:, 0] ** 2 == pytest.approx(1 - u[:, 2])


def test_it_has_all_mirrors_in_their_places() -> None:
    design = tbcad.design(n=3)
    dots = ET.fromstring(hemisphere_map(design.arrays)).findall(
        "{http://www.w3.org/2000/svg}circle"
    )
    u = np.concatenate([array.u for array in design.arrays])
    assert len(dots) == len(u)
    x, y = np.array([[float(dot.attrib[key]) for key in ("cx", "cy")] for dot in dots]).T
    assert ((x - SIZE_PX / 2) * u[:, 0] >= 0).all()
    assert ((SIZE_PX / 2 - y) * u[:, 1] >= 0).all()
    radius = np.concatenate([array.mirrors.radius for array in design.arrays])
    colours = [dot.attrib["fill"] for dot in dots]
    assert colours[radius.argmin()] == "#440154"
    assert colours[radius.argmax()] == "#fde725"


@pytest.mark.parametrize("settings", [(), ("radius_rule=flat", "name=plane")])
def test_notebooks_show_it(settings: tuple[str, ...]) -> None:
    text = tbcad.design(n=3, settings=settings)._repr_html_()
    tree = ET.fromstring(text)
    assert tree.findtext(".//caption") == ("plane" if settings else "turtleback")
    assert ("planar" in text) == bool(settings)
    assert not re.search("nan", text)
