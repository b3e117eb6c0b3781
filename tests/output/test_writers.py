"""What killed writers leave is removed, and what is being written is not."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tbcad.errors import InputError
from tbcad.output import folder as folders
from tbcad.output.folder import check_replaceable, new_folder, replacing

ROOT = Path(__file__).parents[2]
OLD = 1_600_000_000


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Of another target than the one that is written."""
    return new_folder(tmp_path / "captures" / "knot")


def left(folder: Path, host: str = "") -> Path:
    """A hidden folder as its writer left it, of this host if no other is given."""
    path = folder.with_name(f"{folder.stem.rpartition('-')[0]}-{host}.new") if host else folder
    path.mkdir(parents=True)
    (path / "half.h5").touch()
    return path


@pytest.mark.parametrize("out", ["captures/bunny", "captures", "captures/knot"])
def test_of_a_dead_writer_are_removed(tmp_path: Path, folder: Path, out: str) -> None:
    dead = left(folder)
    check_replaceable(tmp_path / out, "capture", False)
    assert not dead.exists()


def test_names_that_tbcad_gave_earlier_are_removed_and_others_the_users(tmp_path: Path) -> None:
    mine, old = tmp_path / "captures" / ".tbcad-a.new", tmp_path / ".tbcad-0123abcd-7.new"
    mine.mkdir(parents=True)
    old.mkdir()
    with pytest.raises(InputError, match=r"did not write \(\.tbcad-a\.new\)"):
        check_replaceable(tmp_path / "captures", "capture", False)
    check_replaceable(tmp_path / "it", "build", False)
    assert mine.exists()
    assert not old.exists()


def test_that_are_locked_stay(tmp_path: Path) -> None:
    with replacing(tmp_path / "captures" / "knot", "capture", False) as new:
        (new / "half.h5").touch()
        check_replaceable(tmp_path / "captures" / "bunny", "capture", False)
        with pytest.raises(InputError, match="another tbcad writes"):
            check_replaceable(tmp_path / "captures", "capture", True)
        assert (new / "half.h5").exists()
    assert [path.name for path in (tmp_path / "captures").iterdir()] == ["knot"]


@pytest.mark.parametrize("unseen", ["another host", "no locks"])
def test_whose_locks_cannot_be_seen_stay_while_they_change(
    tmp_path: Path, folder: Path, unseen: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if unseen == "no locks":
        monkeypatch.setattr(folders, "fcntl", None)
    far = left(folder, host="00000000" if unseen == "another host" else "")
    check_replaceable(tmp_path / "captures" / "bunny", "capture", False)
    assert far.exists()
    with pytest.raises(InputError, match=r"another tbcad: .*remove"):
        check_replaceable(tmp_path / "captures" / "knot", "capture", False)
    for path in (far / "half.h5", far):
        os.utime(path, (OLD, OLD))
    check_replaceable(tmp_path / "captures" / "bunny", "capture", False)
    assert not far.exists()


HANGS = """
import signal, sys
sys.path[:0] = [{root!r}]
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored by what started the tests?
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from pathlib import Path
from tbcad.app.cli import app, run
from tbcad.output.folder import replacing

@app.command()
def hang():
    with replacing(Path({out!r}), "build", False) as new:
        (new / "half.h5").touch()
        print("at work", flush=True)
        signal.pause()

sys.exit(run(["hang"]))
"""


@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_stopped_command_leaves_nothing(tmp_path: Path, kind: signal.Signals) -> None:
    script = HANGS.format(root=str(ROOT), out=str(tmp_path / "deep" / "it"))
    with subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"at work\n"
        process.send_signal(kind)
        _, told = process.communicate(timeout=600)
    assert process.returncode == 130
    assert told == b"tbcad: stopped; nothing was changed\n"
    assert list(tmp_path.iterdir()) == []


def test_tbcad_can_be_imported_without_fcntl() -> None:
    script = "import sys; sys.modules['fcntl'] = None; import tbcad, tbcad.output.folder"
    subprocess.run([sys.executable, "-c", script], check=True, cwd=ROOT, timeout=600)
