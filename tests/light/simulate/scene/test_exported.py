"""What an export says of itself, and what is refused of it."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.errors import InputError
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector, read_export
from tests.exported_files import Rows, edit_csv, edit_json

Document = dict[str, Any]


def test_the_record_gives_the_designs_rays(
    exported: ExportedDesign, cameras: tuple[Reflector, Reflector]
) -> None:
    assert exported.capture_mm == 60
    assert exported.spec.optics.n == 6
    for read, made in zip(exported.reflectors, cameras, strict=True):
        rows = range(150, 200)
        one, other = (exact_tracer(at)(rows, (0.0, 0.0)) for at in (read, made))
        assert np.array_equal(one.mirror, other.mirror)
        assert one.direction == pytest.approx(other.direction, abs=1e-12)


def changed(record: Path, folder: Path, change: Callable[[Document], object]) -> Path:
    shutil.copytree(record, folder, dirs_exist_ok=True)
    edit_json(folder / "design.json", change)
    return folder


def cell(key: str, value: str) -> Callable[[Rows], object]:
    """Change a cell of the fourth row."""
    return lambda rows: rows[3].update({key: value})


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        (lambda d: d.update(schema="tbcad-design/1"), "reads 'tbcad-design/2': build it again"),
        (lambda d: d.update(mirrors="../mirrors.csv"), "mirrors: input should be 'mirrors.csv'"),
        (lambda d: d.pop("foot_z_mm"), "foot_z_mm"),
        (lambda d: d["cameras"].reverse(), "not a and b"),
        (lambda d: d["cameras"][0].update(forward=[0, 0, 2]), "axes"),
        (lambda d: d["cameras"][1].update(width_px=10**9), "width_px"),
        (lambda d: d["spec"]["optics"].update(n=99), r"spec\.optics\.n"),
    ],
)
def test_records_refused(
    record: Path, tmp_path: Path, change: Callable[[Document], object], wrong: str
) -> None:
    with pytest.raises(InputError, match=wrong) as error:
        read_export(changed(record, tmp_path, change))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        (lambda rows: rows.pop(), "has 102 mirrors, allowed is 103"),
        (lambda rows: [row.pop("px") for row in rows], "row 1 px: field required"),
        (cell("camera", "c"), "row 4 camera: "),
        (cell("radius_mm", "0"), "row 4 radius_mm: "),
        (cell("ux", "5.0"), "u of another length"),
        (cell("px", "1000.0"), "bound no cells"),
    ],
)
def test_mirrors_refused(
    record: Path, tmp_path: Path, change: Callable[[Rows], object], wrong: str
) -> None:
    folder = changed(record, tmp_path, lambda _: None)
    edit_csv(folder / "mirrors.csv", change)
    with pytest.raises(InputError, match=wrong) as error:
        read_export(folder)
    assert str(tmp_path / "mirrors.csv") in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["design.json", "mirrors.csv"])
def test_a_record_that_is_not_there(record: Path, tmp_path: Path, name: str) -> None:
    folder = changed(record, tmp_path, lambda _: None)
    (folder / name).unlink()
    with pytest.raises(InputError, match=f"{name} is not there: name a folder that tbcad build"):
        read_export(folder)
