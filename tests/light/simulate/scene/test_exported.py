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

RECORD, MIRRORS = "design.json", "mirrors.csv"


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


def cell(key: str, value: str) -> Callable[[Rows], object]:
    """Change a cell of the fourth row."""
    return lambda rows: rows[3].update({key: value})


@pytest.mark.parametrize(
    ("name", "change", "wrong"),
    [
        (RECORD, lambda d: d.update(schema="tbcad-design/1"), "reads 'tbcad-design/2'"),
        (RECORD, lambda d: d.update(mirrors="../mirrors.csv"), "mirrors: input should be"),
        (RECORD, lambda d: d.pop("foot_z_mm"), "foot_z_mm"),
        (RECORD, lambda d: d["cameras"].reverse(), "not a and b"),
        (RECORD, lambda d: d["cameras"][0].update(forward=[0, 0, 2]), "axes"),
        (RECORD, lambda d: d["spec"]["optics"].update(n=99), r"spec\.optics\.n"),
        (MIRRORS, lambda rows: rows.pop(), "has 102 mirrors, allowed is 103"),
        (MIRRORS, lambda rows: [row.pop("px") for row in rows], "row 1 px: field required"),
        (MIRRORS, cell("camera", "c"), "row 4 camera: "),
        (MIRRORS, cell("ux", "5.0"), "u of another length"),
        (MIRRORS, cell("px", "1000.0"), "bound no cells"),
    ],
)
def test_refused(
    record: Path, tmp_path: Path, name: str, change: Callable[[Any], object], wrong: str
) -> None:
    shutil.copytree(record, tmp_path, dirs_exist_ok=True)
    edit = edit_json if name == RECORD else edit_csv
    edit(tmp_path / name, change)
    with pytest.raises(InputError, match=wrong) as error:
        read_export(tmp_path)
    assert name == RECORD or str(tmp_path / name) in str(error.value)
    assert "\n" not in str(error.value)
    (tmp_path / name).unlink()
    with pytest.raises(InputError, match=f"{name} is not there: name a folder that tbcad build"):
        read_export(tmp_path)
