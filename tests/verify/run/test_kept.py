"""Kept results: the key is all that a function gets, and what is damaged is not believed."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tbcad_verify.errors import BadExport
from tbcad_verify.report.checks import Check, unknown
from tbcad_verify.run.kept import STORE, Store, digest, is_kept, keeping, kept
from tbcad_verify.run.processes import Processes
from tbcad_verify.run.results import Results
from tbcad_verify.run.stages import _all_known

calls: list[object] = []


@dataclass(frozen=True)
class Disc:
    """With a figure that is worked out later."""

    radius: float
    names: frozenset[str] = frozenset()

    @cached_property
    def area(self) -> float:
        return self.radius**2


@kept("squares")
def squared(values: Any) -> Any:
    calls.append(values)
    return np.square(values)


@kept("discs")
def area(disc: Disc) -> float:
    calls.append(disc)
    return disc.area


@kept("files")
def write(folder: Path, text: str) -> int:
    calls.append(text)
    assert not list(folder.iterdir())  # nothing of another stage can be read
    (folder / "text.txt").write_text(text, encoding="utf-8")
    return len(text)


@kept("contents")
def content(file: Path) -> str:
    calls.append(file)
    return file.read_text(encoding="utf-8")


@kept("stages", heard=True, sure=lambda found: found != "lost")
def staged(value: str, sink: Callable[[str], None]) -> str:
    calls.append(value)
    sink("begun")
    sink(value)
    return "done"


@pytest.fixture(autouse=True)
def uncalled() -> Iterator[None]:
    calls.clear()
    yield
    assert STORE.get() is None


@pytest.fixture
def store(tmp_path: Path) -> Store:
    folder = tmp_path / "store"
    folder.mkdir()
    return Store(folder, "code")


def called(store: Store | None, work: Callable[..., Any], *arguments: Any) -> tuple[Any, int]:
    """Result of a call, and how often its work was done for it."""
    before = len(calls)
    with keeping(store):
        return work(*arguments), len(calls) - before


def test_equal_arguments_are_worked_out_once(store: Store) -> None:
    values = np.arange(4.0)
    assert called(store, squared, values)[1] == 1
    found, times = called(store, squared, values.copy())
    assert times == 0
    assert found.tolist() == [0, 1, 4, 9]
    assert store.reused == {"squares"}
    large = np.zeros((100_000, 3))  # which is not written by parts
    assert [called(store, squared, one)[1] for one in (large, large + 0, large.T)] == [1, 0, 1]


def test_what_a_call_would_only_read_is_known_before(store: Store) -> None:
    def known(value: str, kept_in: Store | None = store) -> bool:
        with keeping(kept_in):
            return is_kept(staged, value)

    assert not known("all")
    called(store, staged, "all", lambda _: None)
    called(store, staged, "lost", lambda _: None)
    others = None, replace(store, fresh=True), replace(store, folder=None)
    assert [known("all"), known("lost"), *(known("all", one) for one in others)] == [
        *(True, False),
        *(False, False, False),
    ]


def test_without_a_store_everything_is_worked_out() -> None:
    assert [called(None, squared, 2.0)[1] for _ in range(2)] == [1, 1]


@pytest.mark.parametrize("other", [-0.0, np.float32(0.0), 0, np.zeros(1), (0.0,), 1e-300])
def test_another_value_is_worked_out(store: Store, other: object) -> None:
    called(store, squared, 0.0)
    assert called(store, squared, other)[1] == 1


def test_other_code_and_fresh_use_nothing(store: Store) -> None:
    called(store, squared, 2.0)
    assert called(replace(store, code="other"), squared, 2.0)[1] == 1
    assert called(replace(store, fresh=True), squared, 2.0)[1] == 1


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "other"])
def test_a_damaged_entry_is_dropped_and_worked_out(store: Store, damage: str) -> None:
    assert store.folder
    called(store, squared, 3.0)
    called(store, squared, 2.0)
    (file, other) = sorted(
        store.folder.iterdir(), key=lambda one: store.get(one.name[5:])[0], reverse=False
    )
    data = file.read_bytes()
    flipped = data[:-3] + bytes([data[-3] ^ 1]) + data[-2:]
    file.write_bytes(
        {"flip": flipped, "cut": data[:-1], "empty": b"", "other": other.read_bytes()}[damage]
    )
    assert called(store, squared, 2.0) == (4.0, 1)
    assert file.read_bytes() == data  # kept again
    assert called(store, squared, 2.0) == (4.0, 0)


def test_a_store_that_cannot_be_written_keeps_nothing(store: Store) -> None:
    gone = replace(store, folder=Path("/dev/null/store"))
    assert [called(gone, squared, 2.0) for _ in range(2)] == [(4.0, 1)] * 2
    assert called(replace(store, folder=None), squared, 2.0) == (4.0, 1)


def test_files_are_written_again(store: Store, tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("one", "two")]
    for folder, times in zip(folders, (1, 0), strict=True):
        folder.mkdir()
        (folder / "another.txt").touch()
        assert called(store, write, folder, "words") == (5, times)
        assert (folder / "text.txt").read_text() == "words"


def test_a_file_counts_by_its_content(store: Store, tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_text("a")
    two.write_text("a")
    assert called(store, content, one) == ("a", 1)
    assert called(store, content, two) == ("a", 0)
    two.write_text("b")
    assert called(store, content, two) == ("b", 1)


def test_what_is_heard_is_heard_again(store: Store) -> None:
    for times in (1, 0):
        heard: list[str] = []
        assert called(store, staged, "well", heard.append) == ("done", times)
        assert heard == ["begun", "well"]
    assert [called(store, staged, "lost", heard.append)[1] for _ in range(2)] == [1, 1]


def test_unknown_checks_are_not_sure() -> None:
    good = Check("name", "file", True, 1.0, 2.0, "mm")
    assert _all_known(Results(checks=[good]))
    assert not _all_known(Results(checks=[good, unknown(("name", "file", "mm"), "no memory")]))


def test_sets_and_figures_worked_out_later_do_not_count(store: Store) -> None:
    disc = Disc(2.0, frozenset("abcdefgh"))
    assert called(store, area, disc) == (4.0, 1)
    assert "area" in vars(disc)
    again = Disc(2.0, frozenset("hgfedcba"))
    assert digest(disc) == digest(again)
    assert called(store, area, again) == (4.0, 0)
    shared = [1.5]
    assert digest([shared, shared]) == digest([[1.5], [1.5]])


def test_errors_are_raised_again(store: Store) -> None:
    @kept("errors")
    def fails(value: int) -> None:
        calls.append(value)
        raise BadExport("no")

    for _ in range(2):
        with pytest.raises(BadExport), keeping(store):
            fails(1)
    assert calls == [1, 1]


def test_processes_keep_and_tell(store: Store) -> None:
    for reused in (set(), {"squares"}):
        with keeping(store), Processes(1) as processes:
            assert processes.submit(squared, 5.0).result() == 25
        assert store.reused == reused
    with Processes(1) as processes:
        assert processes.submit(squared, 5.0).result() == 25


def test_the_oldest_are_removed(store: Store) -> None:
    assert store.folder
    for value in range(5):
        called(store, squared, np.full(1000, value))
    (store.folder / "own.txt").write_text("of the user")
    store.prune(20_000)
    assert len(list(store.folder.glob("kept-*"))) == 2
    assert (store.folder / "own.txt").exists()


def test_solids_count_by_their_facets() -> None:
    manifold3d = pytest.importorskip("manifold3d")
    ball = manifold3d.Manifold.sphere(2.0, 12)
    assert digest([ball]) == digest([manifold3d.Manifold.sphere(2.0, 12)])
    for other in (ball.translate([0, 0, 1e-9]), ball.refine(2), ball.set_tolerance(0.1)):
        assert digest([ball]) != digest([other])
