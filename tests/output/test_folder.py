"""Replacing an output folder: whole or not at all, and never a user's file lost."""

import errno
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tbcad.errors import InputError
from tbcad.output import folder as folder_module
from tbcad.output.folder import check_replaceable, replacing
from tbcad.output.manifest import fingerprint, is_file, write_manifest
from tbcad.output.single_files import ALWAYS_KEPT

ROOT = Path(__file__).parents[2]
NAMES = ("design.json", "mirrors.csv", "shell_a.stl")


def fill(folder: Path, version: int) -> None:
    """Write an export all of whose files tell its version, as tbcad writes one."""
    for name in NAMES:
        (folder / name).write_text(f"{name} of version {version}\n" * 50)
    document = {"schema": "tbcad-manifest/1", "kind": "build", "files": {}}
    document["files"] = {name: fingerprint(folder / name).model_dump() for name in NAMES}
    (folder / "manifest.json").write_text(json.dumps(document))
    (folder / "verify.json").write_text(str(version))


def export(out: Path, version: int, *, force: bool = False) -> None:
    with replacing(out, "build", force) as new:
        fill(new, version)


def export_with_folders(
    out: Path, monkeypatch: pytest.MonkeyPatch, text: str, *, force: bool = False
) -> None:
    monkeypatch.setattr("tbcad.output.manifest.version", lambda _: "1")
    with replacing(out, "build", force) as new:
        (new / "images" / "deep").mkdir(parents=True)
        (new / "images" / "deep" / "a.png").write_text(text)
        write_manifest(new, "build")


def version_of(out: Path) -> int:
    """The version of an export that is whole; fails when it is not."""
    version = int((out / "verify.json").read_text())
    for name in NAMES:
        assert (out / name).read_text() == f"{name} of version {version}\n" * 50
    assert set(NAMES) <= json.loads((out / "manifest.json").read_text())["files"].keys()
    return version


def hidden(parent: Path) -> list[str]:
    return [path.name for path in parent.iterdir() if path.name.startswith(".tbcad-")]


def tree(folder: Path) -> dict[str, bytes | None]:
    """Every path below a folder, with the content of the plain files."""
    return {
        str(path.relative_to(folder)): path.read_bytes() if is_file(path) else None
        for path in sorted(folder.rglob("*"))
    }


def no_exchange(*_: object) -> bool:
    return False


def no_link(*_: object, **__: object) -> None:
    raise OSError(errno.EPERM, "no hard links here")


@pytest.fixture(params=["exchange", "two moves", "copies"])
def swap(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "two moves":
        monkeypatch.setattr(folder_module, "_exchange", no_exchange)
    if request.param == "copies":
        monkeypatch.setattr(os, "link", no_link)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "exports"


@pytest.mark.usefixtures("swap")
class TestReplacing:
    def test_makes_and_replaces(self, tmp_path: Path) -> None:
        """With parents, and what a checkout has in its folder of exports as it was, unasked."""
        out = tmp_path / "a" / "b" / "exports"
        for version in (1, 2, 3):
            export(out, version)
            assert version_of(out) == version
            assert hidden(out.parent) == []
            for name in ALWAYS_KEPT:
                (out / name).write_text(name)
        out.chmod(0o2775)
        with replacing(out, "build", force=False) as new:
            (new / "other.txt").write_text("new")
        assert out.stat().st_mode & 0o7777 == 0o2775
        assert {path.name for path in out.iterdir()} == {"other.txt", *ALWAYS_KEPT}
        assert all((out / name).read_text() == name for name in ALWAYS_KEPT)

    def test_an_error_leaves_the_old_export(self, out: Path) -> None:
        export(out, 1)
        with pytest.raises(ZeroDivisionError), replacing(out, "build", force=False) as new:
            (new / "design.json").write_text(f"version {2 // 0}")
        assert version_of(out) == 1
        assert hidden(out.parent) == []

    def test_keeps_what_the_user_has(self, out: Path, tmp_path: Path) -> None:
        export(out, 1)
        (out / "notes.txt").write_text("mine")
        (out / "sub" / "deep").mkdir(parents=True)
        (out / "sub" / "deep" / "a.txt").write_text("deep")
        (out / "empty").mkdir()
        (tmp_path / "far.txt").write_text("far")
        (out / "link").symlink_to(tmp_path / "far.txt")
        (out / "sub" / "dangling").symlink_to("nowhere")
        (out / "all").symlink_to(tmp_path)
        (out / "sub").chmod(0o750)

        with pytest.raises(InputError, match=r"\(all, empty, link and 2 more\).*--force"):
            export(out, 2)
        export(out, 2, force=True)

        assert version_of(out) == 2
        assert (out / "notes.txt").read_text() == "mine"
        assert (out / "sub" / "deep" / "a.txt").read_text() == "deep"
        assert (out / "sub").stat().st_mode & 0o777 == 0o750
        assert (out / "empty").is_dir()
        assert (out / "link").readlink() == tmp_path / "far.txt"
        assert (out / "sub" / "dangling").is_symlink()
        assert (out / "all").is_symlink()
        assert (tmp_path / "far.txt").read_text() == "far"
        assert hidden(out.parent) == []

    @pytest.mark.parametrize("content", ["file", "change", "link", "empty folder"])
    def test_a_folder_with_something_of_the_user_is_the_users(
        self, out: Path, monkeypatch: pytest.MonkeyPatch, content: str
    ) -> None:
        export_with_folders(out, monkeypatch, "first")
        inner = out / "images" / "deep"
        {
            "file": (inner / "mine.txt").touch,
            "change": lambda: (inner / "a.png").write_text("mine"),
            "link": lambda: (inner / "mine").symlink_to("a.png"),
            "empty folder": (inner / "mine").mkdir,
        }[content]()
        before = tree(out)
        with pytest.raises(InputError, match="images"):
            export_with_folders(out, monkeypatch, "other")
        assert tree(out) == before
        export_with_folders(out, monkeypatch, "other", force=True)
        assert (out / "images" / "deep" / "a.png").read_text() == "other"
        kept = tree(out / "images.kept")
        assert kept == {
            name.removeprefix("images/"): data
            for name, data in before.items()
            if name.startswith("images/")
        }

    def test_changed_files_are_the_users_and_kept_beside_the_new(self, out: Path) -> None:
        export(out, 1)
        stl = out / "shell_a.stl"
        same_size = stl.read_text().replace("version 1", "version 9")
        stl.write_text(same_size)
        (out / "shell_a.stl.kept").write_text("from before")
        (out / "design.json").write_text("edited")

        with pytest.raises(InputError, match=r"\(design.json, shell_a.stl, shell_a.stl.kept\)"):
            export(out, 2)
        export(out, 2, force=True)

        assert version_of(out) == 2
        assert (out / "design.json.kept").read_text() == "edited"
        kept = {path.read_text() for path in out.glob("shell_a.stl.kept*")}
        assert kept == {same_size, "from before"}

    def test_a_file_that_comes_while_building_is_not_lost(self, out: Path) -> None:
        export(out, 1)
        with pytest.raises(InputError, match=r"late\.txt"), replacing(out, "build", force=False):
            (out / "late.txt").write_text("mine")
        assert version_of(out) == 1
        assert (out / "late.txt").read_text() == "mine"

    def test_replaces_what_a_link_points_to(self, out: Path, tmp_path: Path) -> None:
        (tmp_path / "disk").mkdir()
        out.symlink_to("disk/real")
        for version in (1, 2):
            export(out, version)
            assert out.readlink() == Path("disk/real")
            assert version_of(tmp_path / "disk" / "real") == version


def test_a_failed_second_move_puts_the_old_export_back(
    out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export(out, 1)
    monkeypatch.setattr(folder_module, "_exchange", no_exchange)
    rename = Path.rename

    def failing(path: Path, to: Path) -> Path:
        if path.suffix == ".new":
            raise OSError(errno.EIO, "the disk is broken")
        return rename(path, to)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(InputError, match="the disk is broken"):
        export(out, 2)
    assert version_of(out) == 1
    assert hidden(out.parent) == []


class TestParents:
    def test_are_removed_again_on_failure(self, tmp_path: Path) -> None:
        (tmp_path / "a").mkdir()
        with (
            pytest.raises(ZeroDivisionError),
            replacing(tmp_path / "a/b/c/exports", "build", False) as new,
        ):
            fill(new, 1 // 0)
        assert list(tmp_path.rglob("*")) == [tmp_path / "a"]

    def test_a_check_makes_nothing(self, tmp_path: Path) -> None:
        check_replaceable(tmp_path / "a" / "b", "build", force=False)
        assert list(tmp_path.iterdir()) == []


Refused = Callable[[Path, str], None]


@pytest.fixture(
    params=[lambda out: check_replaceable(out, "build", False), lambda out: export(out, 9)],
    ids=["check", "replace"],
)
def refused(request: pytest.FixtureRequest, tmp_path: Path) -> Refused:
    """Hold that a folder is refused with some words, and nothing changed."""

    def check(out: Path, words: str) -> None:
        before = tree(tmp_path)
        with pytest.raises(InputError, match=words) as error:
            request.param(out)
        assert "\n" not in str(error.value)
        assert tree(tmp_path) == before

    return check


class TestRefused:
    def test_places_that_are_no_folder_to_replace(
        self, tmp_path: Path, refused: Refused, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        for name in ("work/deep", "homes/me", "mount", "shut"):
            (tmp_path / name).mkdir(parents=True)
        (tmp_path / "file").write_text("mine", encoding="utf-8")
        (tmp_path / "loop").symlink_to(tmp_path / "loop")
        monkeypatch.chdir(tmp_path / "work" / "deep")
        monkeypatch.setenv("HOME", str(tmp_path / "homes" / "me"))
        monkeypatch.setattr(os.path, "ismount", lambda path: path == tmp_path / "mount")
        monkeypatch.setattr(os, "access", lambda path, _mode: path != tmp_path / "shut")
        for out, words in {
            Path(): "the folder you are in",
            Path(".."): "a folder above",
            Path("/"): "a folder above",
            tmp_path / "homes" / "me": "your home",
            tmp_path / "homes": "your home",
            tmp_path / "file": "is a file",
            tmp_path / "file" / "deeper" / "still": "is a file",
            tmp_path / "mount": "mount point",
            tmp_path / "shut": "read-only",
            tmp_path / "shut" / "new": "read-only",
            tmp_path / "loop": "loop",
            tmp_path / "a\0b": "cannot be written",
            tmp_path / ("a" * 300): "cannot be written",
        }.items():
            refused(out, words)

    def test_what_tbcad_did_not_write(self, out: Path, refused: Refused) -> None:
        export(out, 1)
        mine = out / "readme.md"
        for make, remove in (
            (mine.mkdir, mine.rmdir),
            (lambda: os.mkfifo(mine), mine.unlink),
            (lambda: mine.symlink_to("design.json"), mine.unlink),
            (mine.touch, mine.unlink),
        ):
            make()
            refused(out, "readme.md")
            remove()

    @pytest.mark.parametrize(
        "manifest",
        [
            b"[" * 100_000,
            b"\xff",
            b'{"name": "a web page", "files": {}}',
            *(
                b'{"schema": "tbcad-manifest/1", "files": {"%s": {"sha256": "%s", "size": %s}}}'
                % (name, b"0" * digits, size)
                for name, digits, size in (
                    *((b"a/../../b", 64, b"1"), (b"/a", 64, b"1")),
                    *((b"a", 64, b"true"), (b"a", 63, b"1")),
                )
            ),
            b'{"schema": "tbcad-manifest/1", "files": {}}' + b" " * 4_000_000,
        ],
    )
    def test_a_manifest_that_is_none(self, out: Path, refused: Refused, manifest: bytes) -> None:
        export(out, 1)
        (out / "manifest.json").write_bytes(manifest)
        refused(out, "manifest.json")
        export(out, 2, force=True)
        assert (out / "manifest.json.kept").read_bytes() == manifest
        assert version_of(out) == 2

    def test_a_second_writer(self, out: Path, refused: Refused) -> None:
        with replacing(out, "build", force=False) as new:
            fill(new, 1)
            refused(out, "another tbcad")
            check_replaceable(out.parent / "elsewhere", "build", force=False)
        assert version_of(out) == 1
        export(out, 2)
        assert version_of(out) == 2


KILLED = '''
import os, signal, sys
sys.path[:0] = [{root!r}]
from pathlib import Path
from tbcad.output import folder
from tests.output.test_folder import check_replaceable, export, fill, replacing, version_of

os.fsync = lambda _: None  # which only a power cut could tell from the real one
if {moves}:
    folder._exchange = lambda *_: False
out = Path({out!r})

def dies_at(limit):
    """Replace the export in a child that kills itself at a number of calls; tell whether it did."""
    child = os.fork()
    if child:
        return os.WIFSIGNALED(os.waitpid(child, 0)[1])
    calls = 0
    def count(*_):
        nonlocal calls
        calls += 1
        if calls == limit:
            os.kill(os.getpid(), signal.SIGKILL)
    with replacing(out, "build", True) as new:
        fill(new, 2)
        sys.setprofile(count)
    os._exit(0)

limit, seen = 1, set()
export(out, 1)
(out / "mine").write_text("mine")
while dies_at(limit):
    if {moves} and not out.exists():
        seen.add("missing")
        check_replaceable(out, "build", True)
    seen.add(version_of(out))
    assert (out / "mine").read_text() == "mine"
    export(out, 1, force=True)
    assert [p.name for p in out.parent.iterdir()] == [out.name], list(out.parent.iterdir())
    limit += {step}
print(limit, sorted(map(str, seen)))
'''


@pytest.mark.parametrize(
    ("moves", "seen", "step"),
    [
        (False, ["1", "2"], 41),
        pytest.param(True, ["1", "2", "missing"], 11, marks=pytest.mark.slow),
    ],
)
def test_a_kill_at_any_call_leaves_one_whole_export(
    out: Path, moves: bool, seen: list[str], step: int
) -> None:
    script = KILLED.format(root=str(ROOT), out=str(out), moves=moves, step=step)
    run = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.split(maxsplit=1)[1].strip() == str(seen), run.stdout
