"""One child process: limited in time and output, without our settings, and never left behind."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

KEPT = ("PATH", "LD_LIBRARY_PATH")  # all that a program needs of our environment
TICK_S = 0.02
CHUNK = 1 << 16  # bytes


@dataclass(frozen=True)
class Limits:
    """What a child may use.

    Attributes:
        seconds: time from its start.
        output: bytes printed.
        stop: once set, children are killed and no new one is started.
    """

    seconds: float = 300.0
    output: int = 1_000_000
    stop: threading.Event = field(default_factory=threading.Event)


@dataclass(frozen=True)
class Outcome:
    """How a child ended.

    Attributes:
        code: exit status; None when it was stopped, crashed or never started.
        text: what it printed to both of its outputs, as far as the limit allows.
        seconds: how long it ran.
        reason: why there is no exit status; empty when there is one.
    """

    code: int | None
    text: str
    seconds: float
    reason: str = ""


def run(command: Sequence[str], place: Path, limits: Limits) -> Outcome:
    """Run a program in a folder of its own and wait for its end.

    It reads nothing, sees no screen, and finds its home in the folder, so that the user's settings
    neither matter nor change. Whatever it started is killed when it ends.

    Args:
        command: absolute path of the program, and its arguments.
        place: an existing private folder.
        limits: of time and output.
    """
    if limits.stop.is_set():
        return Outcome(None, "", 0.0, "stopped")
    started = time.monotonic()
    try:
        child = _start(command, place)
    except (OSError, ValueError) as error:
        return Outcome(None, "", 0.0, f"cannot be started ({error})")
    with child:
        try:
            said, reason = _listen(child, started + limits.seconds, limits)
        finally:
            _kill(child)
    text = said.decode("utf-8", "replace").replace(str(place), ".")
    seconds = time.monotonic() - started
    why = reason or _crash(child.returncode)
    return Outcome(None if why else child.returncode, text, seconds, why)


def _start(command: Sequence[str], place: Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        list(command),
        cwd=place,
        env=_environment(place),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,  # a process group that can be killed as a whole
    )


def _environment(place: Path) -> dict[str, str]:
    home = place / "home"
    home.mkdir(exist_ok=True)
    own = {f"XDG_{what}_HOME": str(home / what.lower()) for what in ("CONFIG", "DATA", "CACHE")}
    return {
        **{name: os.environ[name] for name in KEPT if name in os.environ},
        **own,
        "HOME": str(home),
        "FREECAD_USER_HOME": str(home),
        "TMPDIR": str(place),
        "LC_ALL": "C.UTF-8",
        "QT_QPA_PLATFORM": "offscreen",
        "PYTHONDONTWRITEBYTECODE": "1",
    }


def _listen(child: subprocess.Popen[bytes], deadline: float, limits: Limits) -> tuple[bytes, str]:
    stream = child.stdout
    assert stream is not None
    os.set_blocking(stream.fileno(), False)
    said = bytearray()
    while True:
        ended = child.poll() is not None  # asked first: then all that it printed is there to read
        _drain(stream, said, limits.output)
        if len(said) > limits.output:
            return bytes(said[: limits.output]), f"printed more than {limits.output} bytes"
        if ended:
            return bytes(said), ""
        if time.monotonic() > deadline:
            return bytes(said), f"no answer within {limits.seconds:g} s"
        if limits.stop.wait(TICK_S):
            return bytes(said), "stopped"


def _drain(stream: IO[bytes], said: bytearray, limit: int) -> None:
    with contextlib.suppress(BlockingIOError):
        while len(said) <= limit and (more := os.read(stream.fileno(), CHUNK)):
            said += more


def _kill(child: subprocess.Popen[bytes]) -> None:
    """Kill the group, which may outlive the child that led it."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


def _crash(code: int) -> str:
    if code >= 0:
        return ""
    try:
        return f"crashed ({signal.Signals(-code).name})"
    except ValueError:
        return f"crashed (signal {-code})"
