"""The camera that the mount is made for: where its bodies are, and what is refused."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from tbcad.cad.kernel.meshing import primitive_mesh
from tbcad.core.camera.lists import CAMERA_COLUMNS, LENS_COLUMNS
from tbcad.core.geometry.primitives import Component
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.prototype.arrangement import frame_layout
from tbcad.prototype.frame.camera_mount import CameraMount, camera_mount
from tbcad.prototype.frame.chosen_camera import chosen_camera, plate_face, with_camera
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.part import FrameLayout, Site

BODIES = {  # width, height, depth, axis, thread, mass
    "cube": "29,37,39,22.5,15,53",
    "wide": "150,100,60,42,25,900",
    "tall": "29,300,39,22.5,15,53",
    "unmeasured": "150,100,60,,,900",
}
FOV = "14.58,12.6,5320,4600,usb,wire"
MM3 = 0.5  # a clash of less is of facets


@pytest.fixture(scope="session")
def lists(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Lists of a user's own: bodies of several sizes, and a lens for all of them."""
    folder = tmp_path_factory.mktemp("cameras")
    rows = [f"{name},C,{FOV},{body},test" for name, body in BODIES.items()]
    rows.append(f"few pixels,C,14.58,12.6,600,519,usb,,{BODIES['cube']},test")
    lens = "wide lens,C,6,6,1.8,16,0.174,20,54,57,215,test"
    files = {"cameras": (CAMERA_COLUMNS, rows), "lenses": (LENS_COLUMNS, [lens])}
    for name, (columns, some) in files.items():
        (folder / name).write_text("\n".join([",".join(columns), *some]) + "\n")
    return {name: str(folder / name) for name in files}


def using(site: Site, lists: dict[str, str], **keys: object) -> Site:
    """A site with a user's lists and other keys of the frame."""
    prototype = site.spec.prototype
    frame = prototype.frame.model_copy(update={**lists, **keys})
    spec = site.spec.model_copy(update={"prototype": prototype.model_copy(update={"frame": frame})})
    return replace(site, spec=spec)


def mount_of(frame: FrameLayout) -> CameraMount:
    found = frame.find(CameraMount)
    assert found
    assert found.chosen
    return found


def solid(part: Component) -> Manifold:
    added, removed = (
        Manifold.batch_boolean([primitive_mesh(one) for one in some], op) if some else Manifold()
        for some, op in ((part.added, OpType.Add), (part.removed, OpType.Add))
    )
    return added - removed


def clashes(parts: list[Component]) -> list[set[str]]:
    """Pairs of parts that share room."""
    solids = {part.name: solid(part) for part in parts}
    return [
        {one, other}
        for one, other in combinations(solids, 2)
        if (solids[one] ^ solids[other]).volume() > MM3
    ]


def beside_camera(frame: FrameLayout) -> list[Component]:
    stock = ("plate", "upright_left", "upright_right")
    return [
        one
        for one in (*frame.printed, *frame.purchased)
        if one.name.startswith(("camera", "lamp")) or one.name in stock
    ]


@pytest.mark.parametrize(("name", "riser", "half_width"), [("cube", 7.5, 14.5), ("wide", 0, 75)])
def test_nothing_meets_the_camera(
    site: Site, lists: dict[str, str], name: str, riser: float, half_width: float
) -> None:
    """Body, lens, mount and lamps with their stands, each against all others."""
    frame = frame_layout(using(site, lists, camera=name))
    mount = mount_of(frame)
    assert mount.riser == riser
    assert {"camera", "camera_lens"} <= {one.name for one in mount.purchased}
    (fence,) = (one for one in mount.printed if one.name == "camera_fence")
    assert len(fence.added) == 1 + (riser > 0)
    assert clashes(beside_camera(frame)) == []
    lamps = frame.find(LampLayout)
    assert lamps
    assert lamps.column - 10 > half_width


def test_a_camera_through_its_fence_or_into_its_plate_is_found(
    site: Site, lists: dict[str, str]
) -> None:
    """By what finds nothing in a mount that fits."""
    frame = frame_layout(using(site, lists, camera="cube"))
    back = -site.layout.array.camera.forward
    for along, other in ((6 * back, "camera_fence"), (np.array([9.0, 0, 0]), "camera_plate")):
        parts = {one.name: one for one in beside_camera(frame)}
        body = parts["camera"].added[0]
        moved = replace(body, corners=body.corners + along)  # type: ignore[call-arg,union-attr]
        parts["camera"] = replace(parts["camera"], added=(moved,))
        assert {"camera", other} in clashes([*parts.values()])


def test_where_the_cube_is(site: Site, lists: dict[str, str]) -> None:
    """A lens of 57 mm has its pupil 17.1 mm behind its front; the body begins at its end."""
    named = using(site, lists, camera="cube with wide lens")
    keys = with_camera(named.spec, site.layout.array).prototype.frame
    assert keys.camera == "cube with wide lens"
    places = keys.camera_axis_mm, keys.camera_screw_mm, keys.camera_back_mm
    assert places == pytest.approx((22.5, 39.9 + 15, 39.9 + 39))
    mount = camera_mount(named, FrameLayout(()))
    assert mount
    screw = next(one for one in mount.fasteners if one.part.name.startswith("UNC"))
    assert screw.through == ("camera_plate", "camera_fence", "camera")
    # Its end is 4.7 mm in the camera.
    camera = site.layout.array.camera
    out = mount.printed[0].downs[1]
    end = (screw.place - camera.pinhole) @ out - screw.part["length_mm"]
    assert end == pytest.approx(22.5 - 4.7)


def test_a_plate_clears_the_lens() -> None:
    assert plate_face(42.0, 27.0) == 42.0
    assert plate_face(22.5, 27.0) == 30.0
    assert plate_face(29.0, 27.0) == 32.0  # no riser of 1 mm


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"camera": "nobody's"}, "is not in the lists"),
        ({"camera": "cube with nothing"}, "'nothing' is not in the lists"),
        ({"camera": "Nikon D850 with wide lens"}, "lens of the list fits its mount"),
        ({"camera": "few pixels"}, " of 1919 pixels across"),
        ({"camera": "unmeasured"}, "camera_axis_mm, camera_screw_mm not known"),
        ({"camera": "tall"}, "reaches down to"),
        ({"camera": "cube", "camera_back_mm": 70.0}, "the fence would stand in the camera"),
        ({"camera": "cube", "camera_screw_mm": 30.0}, "too near to the pinhole"),
    ],
)
def test_what_does_not_fit_is_refused(
    site: Site, lists: dict[str, str], keys: dict[str, object], message: str
) -> None:
    with pytest.raises(SpecError) as caught:
        frame_layout(using(site, lists, **keys))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_refusal_names_one_that_does(site: Site, lists: dict[str, str]) -> None:
    with pytest.raises(SpecError, match=r"does$"):
        chosen_camera(using(site, lists, camera="unmeasured").spec, site.layout.array)


def test_measured_keys_take_the_place_of_what_the_list_lacks(
    site: Site, lists: dict[str, str]
) -> None:
    keys = {"camera": "unmeasured", "camera_axis_mm": 42.0, "camera_screw_mm": 65.0}
    mount = mount_of(frame_layout(using(site, lists, **keys)))
    assert mount.riser == 0


def test_the_default_is_a_camera_that_fits(
    site: Site, paper_design: MirrorDesign, lists: dict[str, str]
) -> None:
    """Of the paper's design; that of n = 6 needs a wider lens than the list has."""
    found = chosen_camera(load_spec(None), paper_design.arrays[0])
    assert found
    assert found.best.camera.name.startswith("FLIR")
    assert not found.unknown
    assert found.has_room(load_spec(None).prototype)
    assert chosen_camera(site.spec, site.layout.array) is None
    assert chosen_camera(using(site, lists).spec, site.layout.array)
    assert chosen_camera(using(site, lists, camera="none").spec, site.layout.array) is None


def test_a_list_that_is_not_there(site: Site, tmp_path: Path) -> None:
    keys = {"cameras": str(tmp_path / "missing.csv")}
    with pytest.raises(SpecError, match=r"missing\.csv: cannot be read"):
        chosen_camera(using(site, keys).spec, site.layout.array)
