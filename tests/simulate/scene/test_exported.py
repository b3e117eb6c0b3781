"""What an export says of itself, and what is refused of it."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.errors import InputError
from tbcad.simulate.scene.exported import Exported, read_export
from tbcad.simulate.scene.rays import exact_tracer
from tbcad.simulate.scene.reflector import Reflector

Document = dict[str, Any]


def test_the_record_gives_the_designs_rays(
    exported: Exported, cameras: tuple[Reflector, Reflector]
) -> None:
    assert exported.capture_mm == 60
    assert exported.spec.optics.n == 6
    for read, made in zip(exported.reflectors, cameras, strict=True):
        rows = range(150, 200)
        one, other = (exact_tracer(at)(rows, (0.0, 0.0)) for at in (read, made))
        assert np.array_equal(one.mirror, other.mirror)
        assert one.direction == pytest.approx(other.direction, abs=1e-12)


def changed(record: Path, folder: Path, change: Callable[[Document], object]) -> Path:
    document = json.loads((record / "design.json").read_text())
    change(document)
    (folder / "design.json").write_text(json.dumps(document))
    return folder


def set_mirror(key: str, value: object) -> Callable[[Document], object]:
    return lambda document: document["mirrors"][3].update({key: value})


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        (lambda d: d.update(schema="tbcad-design/2"), "schema"),
        (lambda d: d.pop("foot_z_mm"), "foot_z_mm"),
        (lambda d: d["mirrors"].pop(), "has 102 mirrors, allowed is 103"),
        (lambda d: d["cameras"].reverse(), "not a and b"),
        (lambda d: d["cameras"][0].update(forward=[0, 0, 2]), "axes"),
        (lambda d: d["cameras"][1].update(width_px=10**9), "width_px"),
        (lambda d: d["spec"]["optics"].update(n=99), r"spec\.optics\.n"),
        (set_mirror("radius_mm", -5), "radius_mm"),
        (set_mirror("px", float("nan")), "px"),
        (set_mirror("ux", 5.0), "u of another length"),
        (set_mirror("px", 1000.0), "bound no cells"),
    ],
)
def test_records_that_cannot_be(
    record: Path, tmp_path: Path, change: Callable[[Document], object], wrong: str
) -> None:
    with pytest.raises(InputError, match=wrong) as error:
        read_export(changed(record, tmp_path, change))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["", "[]", "{", "null", '{"schema": 5}', "[" * 100_000])
def test_other_files(tmp_path: Path, text: str) -> None:
    (tmp_path / "design.json").write_text(text)
    with pytest.raises(InputError, match=r"design\.json"):
        read_export(tmp_path)


def test_no_export(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="tbcad build"):
        read_export(tmp_path)
