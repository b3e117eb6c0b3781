"""What a verification derives from the bytes of one file alone, shared by many verifications."""

from __future__ import annotations

import hashlib
import threading
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest import mock

import manifold3d
import numpy as np
from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.prototype import stages as prototype_stages
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype
from tbcad_verify.prototype.swing import AxialSolid
from tbcad_verify.record.files import FileBytes
from tbcad_verify.run import stages
from tbcad_verify.run.child import Limits
from tbcad_verify.step import step_file
from tbcad_verify.step.step_file import StepFile


@contextmanager
def remembered() -> Iterator[None]:
    """Within, nothing slow is done twice on the same input; what fails is.

    No STEP file is read twice and no mesh put on printers; no balls are traced, no parts swept.
    """
    places = (
        (stages, "measure", _corners),
        (prototype_stages.ball_views, "ball_views", _traced),
        (prototype_stages.swing, "axial_solid", _measured),
        (prototype_stages.swing, "sweep", _measured),
    )
    with ExitStack() as stack:
        for module, name, key in places:
            once = _Once(getattr(module, name), key)
            stack.enter_context(mock.patch.object(module, name, once))
        each = _EachOnce(step_file.examine_all)
        stack.enter_context(mock.patch.object(step_file, "examine_all", each))
        yield


class _Once:
    """A function that keeps what it returned, by a key of its first argument, and the others."""

    def __init__(self, work: Callable[..., Any], key: Callable[[Any], str]) -> None:
        self._work, self._key = work, key
        self._found: dict[object, Any] = {}
        self._busy: defaultdict[object, threading.Lock] = defaultdict(threading.Lock)

    def __call__(self, first: Any, *rest: Any) -> Any:
        key = self._key(first), repr([_shown(one) for one in rest])
        with self._busy[key]:
            if key not in self._found:
                self._found[key] = self._work(first, *rest)
            return self._found[key]


class _EachOnce:
    """The readings of several files by one call, each kept by its bytes; what failed is not."""

    def __init__(self, work: Callable[..., list[Any]]) -> None:
        self._work, self._found = work, dict[object, Any]()

    def __call__(self, blobs: list[FileBytes], limits: Limits) -> list[Any]:
        keys = [(blob.sha256, limits.seconds) for blob in blobs]
        new = [k for k, key in enumerate(keys) if key not in self._found]
        answers = dict(zip(new, self._work([blobs[k] for k in new], limits), strict=True))
        self._found |= {
            keys[k]: answer for k, answer in answers.items() if isinstance(answer, StepFile)
        }
        return [answers[k] if k in answers else self._found[key] for k, key in enumerate(keys)]


def _shown(value: Any) -> object:
    """A solid by its corners, limits by their time; all else as it is."""
    if isinstance(value, AxialSolid):
        return value.name, hashlib.sha256(value.profile.tobytes()).hexdigest()
    if isinstance(value, Limits):
        return value.seconds
    if isinstance(value, manifold3d.Manifold):
        return hashlib.sha256(value.to_mesh64().vert_properties.tobytes()).hexdigest()
    return value


def _traced(measured: MeasuredPrototype) -> str:
    """All that the light of the balls depends on."""
    context, found = measured.context, hashlib.sha256()
    arrays = [measured.centre, measured.radius, measured.body, context.angle, context.ball]
    arrays += [
        measured.rotating.owner,
        measured.fixed.owner,
        context.export.mirrors.columns("ux", 15),
    ]
    for array in arrays:
        found.update(np.ascontiguousarray(array).tobytes())
    found.update(
        repr((context.camera, context.export.target_mm, context.export.foot_z_mm)).encode()
    )
    return found.hexdigest()


def _measured(measured: MeasuredPrototype) -> str:
    """The swing; parts are told apart by what follows."""
    return repr((measured.context.prototype.swing, measured.context.frame.tolist()))


def _corners(mesh: Mesh) -> str:
    return hashlib.sha256(mesh.points.tobytes() + mesh.faces.tobytes()).hexdigest()
