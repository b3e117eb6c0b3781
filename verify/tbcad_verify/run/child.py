"""One child process, limited in time and output, without the user's settings.

It is never left running.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

KEPT_VARIABLES = ("PATH", "LD_LIBRARY_PATH")  # all that a program needs of our environment
POLL_S = 0.02


@dataclass(frozen=True)
class Limits:
    """Resources that a child may use."""

    seconds: float = 300.0  # time from its start
    output: int = 1_000_000  # bytes printed
    # once this is set, children are killed and none is started
    stop: threading.Event = field(default_factory=threading.Event)


@dataclass(frozen=True)
class Outcome:
    """How a child ended."""

    code: int | None  # exit status; None if it was stopped, crashed or never started
    text: str  # what it printed to stdout and stderr, up to the limit
    seconds: float  # how long it ran
    reason: str = ""  # why there is no exit status; empty if there is one


def run(command: Sequence[str], folder: Path, limits: Limits) -> Outcome:
    """Run a program in a private folder and wait for its end.

    The program has no input and no screen. Its home is in the folder, so that the user's settings
    neither matter nor change. Processes that it started are killed when it ends.
    """
    if limits.stop.is_set():
        return Outcome(None, "", 0.0, "stopped")
    started = time.monotonic()
    with tempfile.TemporaryFile() as output:
        try:
            child = _start(command, folder, output)
        except (OSError, ValueError) as error:
            return Outcome(None, "", 0.0, f"cannot be started ({error})")
        try:
            reason = _wait(child, output, started + limits.seconds, limits)
        finally:
            _kill_group(child)
        output.seek(0)
        text = output.read(limits.output).decode("utf-8", "replace").replace(str(folder), ".")
    reason = reason or crash_reason(child.returncode)
    code = None if reason else child.returncode
    return Outcome(code, text, time.monotonic() - started, reason)


def _kill_group(child: subprocess.Popen[bytes]) -> None:
    """Kill a child's process group, which may outlive the child, and wait for the child's end."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(child.pid, signal.SIGKILL)
        else:
            child.kill()
    child.wait()


def crash_reason(code: int) -> str:
    """The signal that ended a process, from its return code; empty if it ended by itself."""
    if code >= 0:
        return ""
    try:
        return f"crashed ({signal.Signals(-code).name})"
    except ValueError:
        return f"crashed (signal {-code})"


def _start(command: Sequence[str], folder: Path, output: IO[bytes]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        list(command),
        cwd=folder,
        env=_environment(folder),
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT,
        start_new_session=True,  # a process group that can be killed as a whole
    )


def _environment(folder: Path) -> dict[str, str]:
    home = folder / "home"
    home.mkdir(exist_ok=True)
    xdg = {f"XDG_{what}_HOME": str(home / what.lower()) for what in ("CONFIG", "DATA", "CACHE")}
    return {
        **{name: os.environ[name] for name in KEPT_VARIABLES if name in os.environ},
        **xdg,
        "HOME": str(home),
        "FREECAD_USER_HOME": str(home),
        "TMPDIR": str(folder),
        "LC_ALL": "C.UTF-8",
        "QT_QPA_PLATFORM": "offscreen",
        "PYTHONDONTWRITEBYTECODE": "1",
    }


def _wait(
    child: subprocess.Popen[bytes], output: IO[bytes], deadline: float, limits: Limits
) -> str:
    """Wait for a child's end; why it must be killed before, or nothing."""
    while True:
        ended = child.poll() is not None  # asked first: then all that it printed is in the file
        if os.fstat(output.fileno()).st_size > limits.output:
            return f"printed more than {limits.output} bytes"
        if ended:
            return ""
        if time.monotonic() > deadline:
            return f"no answer within {limits.seconds:g} s"
        if limits.stop.wait(POLL_S):
            return "stopped"
