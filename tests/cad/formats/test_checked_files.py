"""JSON records: finite numbers, each key once, whole characters; all else is one line."""

import json
import os
import tomllib
from pathlib import Path

import pytest

from tbcad.cad.formats.checked_files import Record, parse_json, read_json, toml_text
from tbcad.errors import InputError
from tbcad.output.manifest import is_listed
from tbcad.records.document import Entry


class Numbers(Record):
    x: float


@pytest.mark.parametrize(
    ("value", "wrong"),
    [
        ("NaN", "NaN is not finite"),
        ("1e400", "1e400 is not finite"),
        ("9" * 5000, "5000 digits"),
        ("9" * 400, "400 digits"),
        ('{"a": ' * 100_000, "nested too deeply"),
        ('"\\ud800"', "half of one"),
        ('{"a": 1, "a": 2}', "'a' is there twice"),
        ("[1,", "Expecting"),
    ],
)
def test_what_is_no_record_is_refused_in_one_line(tmp_path: Path, value: str, wrong: str) -> None:
    path = tmp_path / "record.json"
    path.write_text(f'{{"schema": "s/1", "x": {value}}}', encoding="utf-8")
    with pytest.raises(InputError, match=wrong) as error:
        read_json(path, Numbers, "s/1", "build it")
    assert str(error.value).startswith(str(path))
    assert len(str(error.value)) < len(str(path)) + 200


def test_what_tbcad_writes_is_read() -> None:
    value = {"x": [1, -2.5, 1e-300, None, True], "name": "\u00e9\U0001f600", "n": 10**20}
    for escaped in (True, False):
        text = json.dumps(value, ensure_ascii=escaped)
        assert parse_json(text) == parse_json(text.encode()) == value


def test_a_pipe_or_folder_is_no_record_and_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "design.json")
    (tmp_path / "manifest.json").mkdir()
    for name in ("design.json", "manifest.json"):
        path = tmp_path / name
        assert not is_listed(path, Entry(sha256="0" * 64, size=path.lstat().st_size))


@pytest.mark.parametrize("value", [1, 2.5, True, 'a "b" \\', (1.0, (2.0, -3.0)), ("a", "b"), ()])
def test_toml_text_is_read_back(value: object) -> None:
    read = tomllib.loads(f"x = {toml_text(value)}")["x"]
    assert toml_text(read) == toml_text(value)
