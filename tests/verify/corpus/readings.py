"""What a verification derives from the bytes of one file alone, shared by many verifications."""

from __future__ import annotations

import hashlib
import threading
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unittest import mock

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.record.files import FileBytes
from tbcad_verify.run import stages
from tbcad_verify.step import shell_checks


@contextmanager
def remembered() -> Iterator[None]:
    """Within, no STEP file is read twice and no mesh is put on printers twice; what fails is."""
    step, shape = _Once(shell_checks.examine, _bytes), _Once(stages.measure, _corners)
    with (
        mock.patch.object(shell_checks, "examine", step),
        mock.patch.object(stages, "measure", shape),
    ):
        yield


class _Once:
    """A function that keeps what it returned, by a key of its first argument, and the others."""

    def __init__(self, work: Callable[..., Any], key: Callable[[Any], str]) -> None:
        self._work, self._key = work, key
        self._found: dict[object, Any] = {}
        self._busy: defaultdict[object, threading.Lock] = defaultdict(threading.Lock)

    def __call__(self, first: Any, *rest: Any) -> Any:
        key = self._key(first), repr(rest)
        with self._busy[key]:
            if key not in self._found:
                self._found[key] = self._work(first, *rest)
            return self._found[key]


def _bytes(blob: FileBytes) -> str:
    return blob.sha256


def _corners(mesh: Mesh) -> str:
    return hashlib.sha256(mesh.points.tobytes() + mesh.faces.tobytes()).hexdigest()
