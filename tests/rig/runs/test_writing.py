"""A run's folder after writes that ended anywhere."""

import hashlib
import io
import json
from datetime import UTC, datetime
from pathlib import Path

import pytest
from PIL import Image

from tbcad.errors import InputError
from tbcad.records.exposure import Exposure, Frame, exposure_name
from tbcad.records.run import RunRecord
from tbcad.rig.runs import RunWriter, check_new, new_run, read_run, resumed_run

FRAMES = tuple(Frame(object_turn_deg=0, stop=stop, base_angle_deg=stop) for stop in (1, 2))
RECORD = RunRecord(
    export_sha256={"design.json": "0" * 64},
    source="camera",
    camera="X100",
    width_px=32,
    height_px=16,
    phases=("dark", "lit"),
    frames=FRAMES,
    locked={"iso": 100},
    seconds=12.0,
)


def image(value: int) -> bytes:
    file = io.BytesIO()
    Image.new("L", (32, 16), value).save(file, "PNG")
    return file.getvalue()


def add(writer: RunWriter, frame: Frame, phase: str, value: int = 7) -> None:
    data = image(value)
    exposure = Exposure(
        frame=frame,
        phase=phase,
        file=f"{exposure_name(frame, phase)}.png",
        sha256=hashlib.sha256(data).hexdigest(),
        width_px=32,
        height_px=16,
        exposure_s=0.1,
        taken=datetime.now(UTC),
        settings={"iso": 100},
    )
    writer.add(exposure, data)


@pytest.fixture
def writer(tmp_path: Path) -> RunWriter:
    """A run with all photographs of its first frame."""
    begun = new_run(tmp_path / "run", RECORD)
    begun.log("started")
    for phase in RECORD.phases:
        add(begun, FRAMES[0], phase)
    return begun


def taken(folder: Path) -> list[str]:
    lines = map(json.loads, (folder / "journal.jsonl").read_text().splitlines())
    return [line["name"] for line in lines if line["event"] == "taken"]


def test_what_is_written_is_read(writer: RunWriter) -> None:
    run = read_run(writer.folder)
    assert run.record == RECORD
    assert set(run.exposures) == {"a_0001_dark", "a_0001_lit"} == writer.taken
    assert set(run.faults) == {"a_0002_dark", "a_0002_lit"}


def test_whole_photographs_are_kept(writer: RunWriter) -> None:
    before = {path: path.read_bytes() for path in writer.folder.rglob("*.*")}
    assert resumed_run(writer.folder).taken == writer.taken
    assert before == {path: path.read_bytes() for path in writer.folder.rglob("*.*")}


@pytest.mark.parametrize("suffix", [".png", ".json"])
@pytest.mark.parametrize("length", [0, 40])
def test_cut_file_is_taken_again(writer: RunWriter, suffix: str, length: int) -> None:
    path = writer.folder / "photographs" / f"a_0001_lit{suffix}"
    path.write_bytes(path.read_bytes()[:length])
    again = resumed_run(writer.folder)
    assert again.taken == {"a_0001_dark"}
    names = {one.name for one in path.parent.iterdir()}
    assert names == {"a_0001_dark.png", "a_0001_dark.json"}


def test_image_without_sidecar_and_partial_files_go(writer: RunWriter) -> None:
    photographs = writer.folder / "photographs"
    for name in ("a_0002_dark.jpg", "a_0001_lit.jpg"):
        (photographs / name).write_bytes(image(3))
    (photographs / ".tbcad-a_0002_lit.png").write_bytes(b"half")
    (photographs / "notes.txt").write_text("mine")
    resumed_run(writer.folder)
    assert {one.stem for one in photographs.iterdir()} == {*writer.taken, "notes"}
    assert not (photographs / "a_0001_lit.jpg").exists()


def test_journal_is_made_whole(writer: RunWriter) -> None:
    """Killed after the sidecar and within the journal's line."""
    path = writer.folder / "journal.jsonl"
    path.write_bytes(path.read_bytes()[:-9])
    resumed_run(writer.folder)
    assert taken(writer.folder) == ["a_0001_dark", "a_0001_lit"]
    resumed_run(writer.folder)
    assert taken(writer.folder) == ["a_0001_dark", "a_0001_lit"]


def test_new_run_needs_a_free_folder(writer: RunWriter, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds a run: go on with it by --resume"):
        check_new(writer.folder)
    with pytest.raises(InputError, match="is not empty"):
        check_new(tmp_path)
    (tmp_path / "killed").mkdir()
    (tmp_path / "killed" / ".tbcad-run.json").touch()
    check_new(tmp_path / "killed")
    with pytest.raises(InputError, match=r"run\.json is not there"):
        resumed_run(tmp_path)
