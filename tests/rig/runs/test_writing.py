"""A run's folder after writes that ended anywhere."""

import io
import json
from datetime import UTC, datetime
from pathlib import Path

import pytest
from PIL import Image

from tbcad.records.run import Frame, RunRecord
from tbcad.rig.runs import RunWriter, check_new, exposure_of, new_run, read_run, resumed_run
from tests.exported_files import contents

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


@pytest.fixture
def writer(tmp_path: Path) -> RunWriter:
    """A run with all photographs of its first frame."""
    begun = new_run(tmp_path / "run", RECORD)
    begun.log("started")
    data = image(7)
    for phase in RECORD.phases:
        told = (data, ".png", (32, 16)), 0.1, datetime.now(UTC), {"iso": 100}
        begun.add(exposure_of(FRAMES[0], phase, *told), data)
    return begun


def test_what_is_written_is_read_and_kept(writer: RunWriter) -> None:
    run = read_run(writer.folder)
    assert run.record == RECORD
    assert set(run.exposures) == {"a_0001_dark", "a_0001_lit"} == writer.taken
    assert set(run.faults) == {"a_0002_dark", "a_0002_lit"}
    before = contents(writer.folder)
    assert resumed_run(writer.folder).taken == writer.taken
    assert before == contents(writer.folder)


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
    for _ in range(2):
        resumed_run(writer.folder)
        lines = map(json.loads, path.read_text().splitlines())
        taken = [line["name"] for line in lines if line["event"] == "taken"]
        assert taken == ["a_0001_dark", "a_0001_lit"]


def test_folder_of_a_run_that_was_killed_at_its_begin_is_free(tmp_path: Path) -> None:
    (tmp_path / ".tbcad-run.json").touch()
    check_new(tmp_path)
