"""Views in another light, against ray-traced ones; and what is refused."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from PIL import Image

import tbcad
from tbcad.app.cli import run
from tbcad.errors import InputError
from tbcad.light.reflectance.environment import read_environment
from tbcad.light.reflectance.lamp_places import lamps_of_mirrors
from tbcad.light.reflectance.transport import TRUE_LIGHTS, lit_scene, open_reflectance, relit
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import to_bytes
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import pinhole_picture
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.simulate.views.viewpoints import image_quality

SMALL = ["--width", "96", "--height", "72"]


@pytest.fixture(scope="module")
def mirrors(record: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With lamps in the places of virtual cameras."""
    out = tmp_path_factory.mktemp("captures") / "many"
    words = ["capture", str(record), "--lights", "mirrors", "--every", "2", "--out", str(out)]
    assert run(words) == 0
    return out


def test_lamps_are_where_the_virtual_cameras_are(mirrors: Path) -> None:
    with LightField.open(mirrors) as source:
        every = lamps_of_mirrors(source, 1)
        place_of = {
            f"{name}{k + 1:04d}": place
            for name, frame in source.frames.items()
            for k, place in enumerate(zip(frame.u, frame.mirrors.apex, strict=True))
        }
    with open_reflectance(mirrors) as reflectance:
        half = reflectance.lamps
    assert len(half.name) == -(-len(every.name) // 2)
    assert len({tuple(np.round(place_of[one][0], 6)) for one in every.name}) == len(every.name)
    for name, place in zip(half.name, half.place, strict=True):
        u, apex = place_of[name]
        assert np.linalg.norm(place) > np.linalg.norm(apex)  # behind the mirror
        assert np.linalg.norm(np.cross(u, place)) < 0.15 * np.linalg.norm(place)


def test_views_are_like_ray_traced_ones(mirrors: Path, hdr: Path, scene: Scene) -> None:
    """In the light itself, in that of the same lamps, and less so in the light of the capture."""
    light = read_environment(hdr)
    view = camera_around_object(0.5, 0.6, 640.0, 60.0, (160, 120))
    with LightField.open(mirrors) as source, open_reflectance(mirrors) as reflectance:
        found = relit(source, reflectance, light)
        image = synthesise(MirrorTiles(found.field), view, "blend").image
        before = synthesise(MirrorTiles(source), view, "blend").image
    lights = light.far_lights(TRUE_LIGHTS), found.lamps
    truths = [
        to_bytes(pinhole_picture(lit_scene(scene, one, found.exposure), view, 2)) for one in lights
    ]
    built_in = image_quality(to_bytes(pinhole_picture(scene, view)), before)
    itself, same = (image_quality(truth, image) for truth in truths)
    assert same.ssim > built_in.ssim - 0.02
    assert itself.ssim > built_in.ssim - 0.03
    assert itself.psnr_db > image_quality(truths[0], before).psnr_db + 3


def test_the_command_and_python(
    mirrors: Path, hdr: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "v.png"
    words = ["view", str(mirrors), *SMALL, "--light", str(hdr), "--out", str(out)]
    assert run([*words, "--light-turn", "90"]) == 0
    said = capsys.readouterr().out
    assert f"light {hdr}: by " in said
    assert "against the ray-traced picture" in said
    assert "lit by the same lamps" in said
    turned = np.asarray(Image.open(out))
    assert run([*words, "--force"]) == 0
    assert np.abs(np.asarray(Image.open(out)).astype(int) - turned).mean() > 1
    view = tbcad.view(tbcad.relight(mirrors, hdr), 20, 30, size=(64, 48), method="nearest")
    assert view.image.max() > 100


def test_the_same_bytes_each_time(
    captured: Path, record: Path, table: Path, tmp_path: Path
) -> None:
    again = tmp_path / "again"
    assert run(["capture", str(record), "--lights", str(table), "--out", str(again)]) == 0
    for name in ("reflectance.h5", "lightfield.h5"):
        assert (again / name).read_bytes() == (captured / name).read_bytes()


@pytest.mark.parametrize("name", ["lamps/place", "a/transport", "lamps/name"])
def test_damaged_files_are_refused(captured: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / "reflectance.h5").write_bytes((captured / "reflectance.h5").read_bytes())
    with h5py.File(tmp_path / "reflectance.h5", "r+") as store:
        del store[name]
    with pytest.raises(InputError, match="damaged"), open_reflectance(tmp_path):
        pass


def test_a_field_of_another_capture_is_refused(
    captured: Path, hdr: Path, light_field: LightField
) -> None:
    one = LightField({"c": light_field.frames["a"]}, light_field.capture_mm, {})
    with (
        open_reflectance(captured) as reflectance,
        pytest.raises(InputError, match="not of this light field"),
    ):
        relit(one, reflectance, read_environment(hdr))
