"""A reconstruction is the same on any number of threads, and however often it is stopped."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.app.api import reconstruct
from tbcad.errors import InputError
from tbcad.light.reconstruction.field import read_field
from tbcad.light.reconstruction.fitted import levels, reconstruction, used_rays
from tbcad.light.reconstruction.rays import captured_rays
from tbcad.light.reconstruction.start import part_file
from tbcad.light.simulate.capture.light_field import RAY_SIGMAS, LightField
from tbcad.options.captures import ReconstructOptions
from tests.ball_captures import RADIUS_MM, quick_choice, without_trials  # noqa: F401

SMALL: dict[str, Any] = {"nodes": 24, "epochs": 3, "order": "0"}
ASKED = ReconstructOptions("", **SMALL)


@pytest.fixture(scope="module")
def made(ball: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("made") / "field.npz"
    with pytest.MonkeyPatch.context() as patch:
        without_trials(patch)
        reconstruct(ball, out=out, **SMALL)
    return out


def stopped_after(epochs: int) -> Callable[[str], None]:
    """What ends a reconstruction as Ctrl-C does, when so many epochs are done."""
    left = [epochs]

    def detail(text: str) -> None:
        left[0] -= text.startswith("epoch")
        if left[0] == 0:
            raise KeyboardInterrupt

    return detail


def test_a_ball_is_where_it_is(made: Path) -> None:
    field = read_field(made)
    radius = np.linalg.norm(field.grid.points, axis=1)
    dense = field.density() > 0.5 * field.density().max()
    assert radius[dense].max() < RADIUS_MM + 2 * field.grid.pitch_mm
    facts = field.facts
    assert facts["psnr_left_out_db"] > 20
    assert facts["mirrors_left_out"] == 2
    assert facts["unexplained_light"] < 0.01


def test_same_bytes_on_another_number_of_threads(
    ball: Path, made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tbcad.light.simulate.parallel.THREADS", 3)
    reconstruct(ball, out=tmp_path / "again.npz", **SMALL)
    assert (tmp_path / "again.npz").read_bytes() == made.read_bytes()


@pytest.mark.parametrize("epochs", [1, 6])
def test_same_bytes_after_a_stop(epochs: int, ball: Path, made: Path, tmp_path: Path) -> None:
    out = tmp_path / "field.npz"
    with pytest.raises(KeyboardInterrupt):
        reconstruct(ball, out=out, **SMALL, detail=stopped_after(epochs))
    assert [file.name for file in tmp_path.iterdir()] == [".field.npz.part"]
    with pytest.raises(InputError, match="go on with --resume, or begin anew with --force"):
        reconstruct(ball, out=out, **SMALL)
    told: list[str] = []
    reconstruct(ball, out=out, **SMALL, resume=True, detail=told.append)
    assert out.read_bytes() == made.read_bytes()
    assert [file.name for file in tmp_path.iterdir()] == ["field.npz"]
    assert len(told) == sum(level.epochs for level in levels(ASKED)) - epochs


def test_same_bytes_after_a_stop_where_pixels_have_an_area(ball: Path, tmp_path: Path) -> None:
    """The grids before the last have single rays: also where the stop is between them."""
    options: dict[str, Any] = {"nodes": 16, "epochs": 2, "order": "1", "rays": 4, "blur_px": 0.4}
    whole, out = tmp_path / "whole.npz", tmp_path / "field.npz"
    reconstruct(ball, out=whole, **options)
    assert read_field(whole).facts["rays_a_pixel"] == 4
    with pytest.raises(KeyboardInterrupt):
        reconstruct(ball, out=out, **options, detail=stopped_after(3))
    reconstruct(ball, out=out, **options, resume=True)
    assert out.read_bytes() == whole.read_bytes()


def test_a_checkpoint_of_other_options_is_refused(ball: Path, tmp_path: Path) -> None:
    out = tmp_path / "field.npz"
    with pytest.raises(KeyboardInterrupt):
        reconstruct(ball, out=out, **SMALL, detail=stopped_after(1))
    kept = part_file(out).read_bytes()
    for other, message in (
        ({"seed": 1}, "is of seed 0, not 1"),
        ({"nodes": 30}, "is of nodes 24, not 30"),
        ({"frame": 1}, "is of another capture"),
    ):
        with pytest.raises(InputError, match=message):
            reconstruct(ball, out=out, resume=True, **{**SMALL, **other})
    assert part_file(out).read_bytes() == kept
    part_file(out).write_bytes(kept[:-2000])
    with pytest.raises(InputError, match=r"is damaged .*: begin anew with --force"):
        reconstruct(ball, out=out, **SMALL, resume=True)


def test_frames_start_from_the_one_before(ball: Path, tmp_path: Path) -> None:
    stages: list[str] = []
    out = tmp_path / "turn.npz"
    reconstruct(ball, out=out, **SMALL, frame="all", progress=stages.append)
    first, second = (read_field(tmp_path / f"turn-{k}.npz").facts for k in (0, 1))
    assert first["started_from"] is None
    assert second["started_from"] == first["light_field"] != second["light_field"]
    assert "frame 0: grid of 10 nodes" in stages
    assert "frame 1: grid of 10 nodes" not in stages
    assert second["psnr_left_out_db"] > first["psnr_left_out_db"] - 1
    whole = (tmp_path / "turn-1.npz").read_bytes()
    (tmp_path / "turn-1.npz").unlink()
    reconstruct(ball, out=out, **SMALL, frame="all", resume=True)
    assert (tmp_path / "turn-1.npz").read_bytes() == whole


def test_mirrors_left_out_are_whole_and_few(ball: Path) -> None:
    rays = captured_rays(LightField.read(ball))
    used = used_rays(rays, 0)
    assert not set(rays.mirror[used]) & set(rays.mirror[~used])
    assert 1 <= len(set(rays.mirror[~used])) <= 4
    assert not np.array_equal(used, used_rays(rays, 1))


def test_facts_tell_how_it_was_made(made: Path) -> None:
    facts = read_field(made).facts
    assert facts["trials"] == [{"order": 0, "smooth_density": 5e-5, "loss": 0.5}]
    assert [level["nodes"] for level in facts["chosen"]["levels"]] == [10, 17, 24]
    assert json.dumps(facts)


@pytest.mark.parametrize(
    ("plane", "message"),
    [("colour", "show nothing brighter than"), ("mirror", "no ray .* meets its capture sphere")],
)
def test_what_shows_nothing_is_refused(plane: str, message: str, ball: Path) -> None:
    source = LightField.read(ball)
    for frame in source.frames.values():
        frame.planes[plane][:] = 0
    with pytest.raises(InputError, match=message):
        reconstruction(source, ASKED)


def test_light_that_no_hull_explains(ball: Path) -> None:
    """A bright mirror that no other confirms is outside of the hull."""
    source = LightField.read(ball)
    frame = source.frames["a"]
    alone = frame.planes["mirror"] == 20
    frame.planes["colour"][alone] = 200
    facts = reconstruction(source, ReconstructOptions("", nodes=72, epochs=1)).facts
    assert 0.0003 < facts["unexplained_light"] < 0.1


def test_mirrors_that_are_known_badly_count_less(ball: Path) -> None:
    """Also where each pixel is its central ray, as it is by default."""
    source = LightField.read(ball)
    told = {
        name: [0.0 if k % 2 else 5.0 for k in range(len(frame.u))]
        for name, frame in source.frames.items()
    }
    known = replace(source, facts={**source.facts, RAY_SIGMAS: told})
    even, weighted = (reconstruction(one, ASKED) for one in (source, known))
    assert not np.array_equal(even.values, weighted.values)
