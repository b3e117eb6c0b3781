"""The report of an export: its data are those of the files, its text is escaped, it is small."""

import base64
import json
import re
import shutil
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from tbcad_verify.report.as_made import AsMade, ProcessYield
from tbcad_verify.run.verify import verify

from tbcad.app.cli import run
from tbcad.errors import InputError
from tbcad.output.manifest import fingerprint
from tbcad.output.single_files import foreign_files
from tbcad.report.page.bodies import KINDS, PackedArrays
from tbcad.report.page.write import MAX_BYTES, page, write_report
from tests.exported_files import read_csv

pytestmark = pytest.mark.usefixtures("standing")

SAMPLE = Path(__file__).parents[3] / "docs" / "sample"
HOSTILE = '<script>alert("1")</script>&.png'


@pytest.fixture
def export(tmp_path: Path) -> Path:
    return shutil.copytree(SAMPLE, tmp_path / "exports")


def data_of(text: str) -> dict[str, Any]:
    """What the scripts read."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    data: dict[str, Any] = json.loads(found[1])
    return data


def array(data: dict[str, Any], place: list[Any]) -> Any:
    """An array as the browser unpacks it."""
    first, count, kind = place
    unpacked = zlib.decompress(base64.b64decode(data["arrays"]))
    return np.frombuffer(unpacked, KINDS[kind], count, first)


def changed_verdict(folder: Path, **values: Any) -> None:
    path = folder / "verify.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **values}))


def test_arrays_come_back() -> None:
    packed, numbers = PackedArrays(), np.arange(7)
    places = [packed.add(numbers, kind) for kind in KINDS]
    data = {"arrays": packed.text()}
    for place in places:
        assert int(str(place[0])) % 4 == 0
        assert array(data, place).tolist() == numbers.tolist()


def test_mirrors_are_those_of_the_files(export: Path) -> None:
    data, rows = data_of(page(export)), read_csv(export / "mirrors.csv")
    table = data["mirrors"]
    assert table["ids"] == [row["id"] for row in rows]
    pose = array(data, table["pose"]).reshape(-1, 9)
    assert pose[:, 3] == pytest.approx([float(row["px"]) for row in rows], rel=1e-6)
    measured = {
        one["id"]: one for one in json.loads((export / "verify.json").read_text())["mirrors"]
    }
    covered = next(one for one in table["quantities"] if one["key"] == "covered")
    assert array(data, covered["values"]) == pytest.approx(
        [measured[name]["coverage_fitted_mm"] for name in table["ids"]], rel=1e-6
    )


def test_shell_is_drawn_where_the_file_has_it(export: Path) -> None:
    import trimesh

    data, stl = data_of(page(export)), trimesh.load_mesh(export / "shell_a.stl")
    shell, image = data["bodies"]
    places = array(data, shell["vertices"]).reshape(3, -1).T
    points = shell["low"] + shell["step"] * places
    assert points.min(axis=0) == pytest.approx(stl.bounds[0], abs=0.3)
    assert points.max(axis=0) == pytest.approx(stl.bounds[1], abs=0.3)
    owner = array(data, shell["owner"])
    assert set(owner) == {*range(50)}  # 49 mirrors, and what is none
    drawn = trimesh.Trimesh(points, array(data, shell["triangles"]).reshape(-1, 3))
    assert drawn.is_watertight
    assert drawn.volume == pytest.approx(stl.volume, rel=0.02)
    assert image == {**image, "name": "shell_b", "mirrored": "shell_a"}


def test_verdict_is_on_top(export: Path) -> None:
    yields = ProcessYield("diamond", 0.74, 60.1, 50), ProcessYield("<fdm>", 0.0, 42.0, 5)
    made = AsMade(50, yields)
    text = page(export, made)
    assert text.index("PASS") < text.index('id="model"')
    assert "74% of 50" in text
    assert "no built-in process yields 95%" in text
    assert "&lt;fdm&gt;" in text
    assert "<fdm>" not in text
    changed_verdict(export, **{"pass": False})
    assert "FAIL" in page(export)
    (export / "verify.json").unlink()
    assert "not verified" in page(export)


def test_text_of_files_is_escaped(export: Path) -> None:
    check = {"name": HOSTILE, "pass": False, "detail": HOSTILE, "file": HOSTILE, "unit": HOSTILE}
    row = {"part": HOSTILE, "profile": HOSTILE, "problems": [HOSTILE], "material": HOSTILE}
    changed_verdict(export, checks=[check], printing=[row], **{"pass": False})
    Image.new("RGB", (4, 4)).save(export / HOSTILE.replace("/", "_"))
    text = page(export)
    assert "alert(" in text
    assert "<script>alert" not in text
    assert 'alert("' not in text
    assert text.count("<script") == 2


def test_page_asks_for_nothing_outside_and_has_the_same_bytes_each_time(export: Path) -> None:
    text = page(export)
    assert page(export) == text
    assert "default-src 'none'" in text
    assert re.findall(r"https?://[^\"'\s]*", text) == ["http://www.w3.org/2000/svg"]
    assert not re.findall(r"<(?:link|script|img|iframe)[^>]* (?:src|href)=\"(?!data:)", text)


def test_pictures_are_shown_as_far_as_there_is_room(
    export: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (1600, 1600, 3), dtype=np.uint8)
    for k in range(6):
        Image.fromarray(noise).save(export / f"noise_{k}.png", compress_level=0)
    (export / "broken.png").write_bytes(b"no picture")
    text = page(export)
    assert len(text.encode()) <= MAX_BYTES
    shown = re.findall(r'alt="(noise_\d.png)"', text)
    assert 0 < len(shown) < 6
    assert "Left out, to keep this file small" in text
    assert "broken.png" not in text


def test_report_is_no_foreign_file_and_the_verification_takes_no_notice(export: Path) -> None:
    before = (export / "verify.json").read_bytes()
    write_report(export)
    assert foreign_files(export) == []
    assert verify(export).passed
    names = [one["name"] for one in json.loads(before)["checks"]]
    assert [
        one["name"] for one in json.loads((export / "verify.json").read_text())["checks"]
    ] == names


def test_a_page_of_the_user_is_kept(export: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (export / "report.html").write_text("<!doctype html>mine")
    assert [path.name for path in foreign_files(export)] == ["report.html"]
    assert run(["report", str(export)]) == 2
    assert "tbcad did not write it" in capsys.readouterr().err
    assert (export / "report.html").read_text() == "<!doctype html>mine"
    assert run(["report", str(export), "--force"]) == 0
    assert run(["report", str(export)]) == 0  # its own is replaced unasked


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("mirrors.csv", "other", r"mirrors\.csv is not as tbcad wrote it"),
        ("design.json", "other", r"design\.json is not as tbcad wrote it"),
        ("manifest.json", None, r"manifest\.json is not there"),
        ("verify.json", '{"pass": true}', r"verify\.json: target_mm: field required"),
    ],
)
def test_a_damaged_export_is_refused(
    export: Path, name: str, content: str | None, words: str
) -> None:
    (export / name).unlink() if content is None else (export / name).write_text(content)
    with pytest.raises(InputError, match=words):
        page(export)


def test_without_shells_there_is_a_map_and_no_model(export: Path) -> None:
    path = export / "manifest.json"
    manifest = json.loads(path.read_text())
    for name in [name for name in manifest["files"] if name.startswith("shell_")]:
        del manifest["files"][name]
        (export / name).unlink()
    path.write_text(json.dumps(manifest))
    assert fingerprint(export / "design.json").model_dump() == manifest["files"]["design.json"]
    data = data_of(page(export))
    assert data["bodies"] == []
    assert len(data["mirrors"]["ids"]) == 98
