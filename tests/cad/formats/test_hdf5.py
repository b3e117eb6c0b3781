"""HDF5 files: plain arrays of the file itself are read, all else is refused before it is."""

import json
import os
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tbcad.cad.formats.checked_files import Record, parse_json, read_json, toml_text
from tbcad.cad.formats.hdf5 import StoredGroup, open_hdf5
from tbcad.errors import InputError
from tbcad.output.manifest import is_listed
from tbcad.records.document import Entry

SCHEMA = "tbcad-test/1"
NUMBERS = np.arange(6.0)


def made(path: Path, change: Callable[[h5py.File], object] = lambda _: None) -> Path:
    with h5py.File(path, "w") as store:
        store.attrs["schema"], store.attrs["facts"] = SCHEMA, '{"n": 1}'
        store.create_group("a")["x"] = NUMBERS
        store["a/y"] = NUMBERS
        change(store)
    return path


def both(store: StoredGroup) -> tuple[Any, Any, Any]:
    group = store.group("a")
    return group.array("x"), group.array("y"), store.facts


def read(path: Path) -> Any:
    with open_hdf5(path, SCHEMA, "test", "make it again", both) as (x, y, facts):
        return x[:], y[1:3], facts


def put(name: str, value: object) -> Callable[[h5py.File], None]:
    """Put something in the place of an array or group."""

    def change(store: h5py.File) -> None:
        del store[name]
        store[name] = store[value] if isinstance(value, str) else value

    return change


def dataset(**options: Any) -> Callable[[h5py.File], None]:
    def change(store: h5py.File) -> None:
        del store["a/x"]
        store["a"].create_dataset("x", **options)

    return change


def virtual(store: h5py.File) -> None:
    layout = h5py.VirtualLayout((6,), "f8")
    layout[:] = h5py.VirtualSource("/etc/other.h5", "x", (6,))
    del store["a/x"]
    store["a"].create_virtual_dataset("x", layout)


def facts(text: str) -> Callable[[h5py.File], None]:
    return lambda store: store.attrs.__setitem__("facts", text)


BAD = {
    "soft link": (put("a/x", h5py.SoftLink("/a/y")), "elsewhere"),
    "external link": (put("a/x", h5py.ExternalLink("/etc/other.h5", "/x")), "elsewhere"),
    "two names": (put("a/x", "a/y"), "another name"),
    "its own parent": (put("a/x", "a"), "no dataset"),
    "external data": (dataset(shape=(6,), dtype="f8", external=[("/etc/hostname", 0, 48)]),
                      "elsewhere"),
    "virtual": (virtual, "elsewhere"),
    "group": (put("a/x", "/"), "no dataset"),
    "texts": (dataset(data=["a"], dtype=h5py.string_dtype()), "not numbers"),
    "references": (dataset(shape=(2,), dtype=h5py.ref_dtype), "not numbers"),
    "huge": (dataset(shape=(1 << 40, 9), dtype="f8", chunks=(1 << 10, 9)), "claims"),
    "huge chunk": (dataset(shape=(1 << 30,), dtype="u1", chunks=(1 << 30,)), "claims"),
    "other packing": (dataset(data=NUMBERS, compression="lzf"), "filter"),
    "other schema": (lambda store: store.attrs.__setitem__("schema", "x/2"), "schema is 'x/2'"),
    "facts": (facts("{"), "Expecting"),
    "infinite fact": (facts('{"n": 1e400}'), "not finite"),
    "list of facts": (facts("[1]"), "no table"),
    "deep facts": (facts("[" * 100_000), "deeply"),
}  # fmt: skip


@pytest.mark.parametrize(("change", "wrong"), BAD.values(), ids=BAD.keys())
def test_what_tbcad_never_writes_is_refused(
    tmp_path: Path, change: Callable[[h5py.File], None], wrong: str
) -> None:
    path = made(tmp_path / "bad.h5", change)
    with pytest.raises(InputError, match=wrong) as error:
        read(path)
    text = str(error.value)
    assert text.startswith(f"{path} is a damaged test: ")
    assert text.endswith(": make it again")
    assert "\n" not in text
    assert len(text) < len(str(path)) + 300


def test_arrays_and_facts_are_read(tmp_path: Path) -> None:
    x, y, told = read(made(tmp_path / "good.h5"))
    assert (x.tolist(), y.tolist(), told) == (NUMBERS.tolist(), [1.0, 2.0], {"n": 1})


def test_damage_inside_an_array_is_told_when_it_is_read(tmp_path: Path) -> None:
    path = made(tmp_path / "bad.h5", dataset(data=np.arange(9999) % 7, compression=1))
    with h5py.File(path) as store:
        place = store["a/x"].id.get_chunk_info(0).byte_offset
    data = bytearray(path.read_bytes())
    data[place : place + 8] = b"\xff" * 8
    path.write_bytes(data)
    with pytest.raises(InputError, match="damaged test"):
        read(path)


def test_an_error_of_who_reads_is_none_of_the_file(tmp_path: Path) -> None:
    path = made(tmp_path / "good.h5")
    with pytest.raises(ValueError, match="mine"), open_hdf5(path, SCHEMA, "test", "", both):
        raise ValueError("mine")


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
