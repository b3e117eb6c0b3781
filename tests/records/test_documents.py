"""Documents: what is written is read, in the same bytes; anything else is refused in one line."""

import json
from pathlib import Path
from typing import Any

import pytest

from tbcad.errors import InputError
from tbcad.records.calibration import MachineRecord
from tbcad.records.document import Document
from tbcad.records.prototype import Prototype
from tbcad.records.run import RunRecord
from tests.prototype_records import prototype_document

FRAMES = [
    {"object_turn_deg": turn, "stop": stop, "base_angle_deg": 1.5 * stop}
    for turn in (0, 180)
    for stop in (1, 2)
]
DOCUMENTS: dict[type[Document], dict[str, Any]] = {
    Prototype: prototype_document(),
    RunRecord: {
        "schema": "tbcad-run/1",
        "export_sha256": {"design.json": "0" * 64},
        **{"source": "simulated", "camera": "test", "width_px": 640, "height_px": 480},
        "phases": ["dark", "lit"],
        "frames": FRAMES,
        "locked": {"iso": "100", "shutter": 0.5, "raw": True},
        "exposures": {"lit": {"asked_s": 0.1, "settings": {}}},
        **{"seconds": 12.0, "geometry": "prototype"},
    },
    MachineRecord: {
        "schema": "tbcad-machine/1",
        "camera": {
            "pinhole_mm": [1.0, 2.0, 3.0],
            "axes": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            **{"focal_px": [900.0, 901.0], "principal_px": [320.0, 240.0]},
            **{"distortion": [0.0] * 5, "width_px": 640, "height_px": 480},
        },
        **{"axis": [0.0, 0.0, 1.0], "axis_point_mm": [0.0, 0.0, 0.1]},
        **{"frames": FRAMES, "angle_deg": [0.1 + 0.2, 1e-17, -3.0, 4.0]},
        "spheres": [{"centre_mm": [1.0, 2.0, 3.0], "radius_mm": 4.0}],
        **{"leds_mm": [], "turn_rad": None, "shift_mm": None, "sag_mm": None},
        "seat_turn_rad": None,
        "forms": None,
    },
}
EVERY = pytest.mark.parametrize(("model", "document"), DOCUMENTS.items())


def refused(path: Path, model: type[Document], document: object) -> str:
    path.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        model.read(path)
    (line,) = str(caught.value).splitlines()
    assert str(path) in line
    return line


@EVERY
def test_bytes_are_the_same_after_reading(
    tmp_path: Path, model: type[Document], document: dict[str, Any]
) -> None:
    path, text = tmp_path / "it.json", json.dumps(document, indent=1) + "\n"
    path.write_text(text)
    model.read(path).write(path)
    assert path.read_text() == text


@EVERY
def test_every_key_is_needed_and_no_other_is_read(
    tmp_path: Path, model: type[Document], document: dict[str, Any]
) -> None:
    path = tmp_path / "it.json"
    with pytest.raises(InputError, match=r"it\.json is not there: "):
        model.read(path)
    assert "noise: extra inputs are not permitted" in refused(path, model, document | {"noise": 1})
    for key, field in model.model_fields.items():
        name = field.alias or key
        less = {one: value for one, value in document.items() if one != name}
        if name == "schema" or field.is_required():
            assert name in refused(path, model, less)
        assert name in refused(path, model, document | {name: {"a": [name]}})


def test_what_is_wrong_with_the_whole_is_told_in_one_line(tmp_path: Path) -> None:
    twice = DOCUMENTS[RunRecord] | {"frames": [FRAMES[0], FRAMES[0]]}
    assert ": names a frame or phase twice: " in refused(tmp_path / "run.json", RunRecord, twice)
