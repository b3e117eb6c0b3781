"""What a verification derives from the same bytes or numbers, shared by many verifications.

A mutation changes what it breaks: only what does not depend on that is taken from before.
"""

from __future__ import annotations

import hashlib
import io
import pickle
import stat
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest import mock

import manifold3d
from tbcad_verify.mesh.rays import ImagePairScene, RayScene
from tbcad_verify.prototype.bodies import Bodies, MeasuredPrototype
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.light.lamp_light import EdgedBodies
from tbcad_verify.prototype.light.pinhole_cells import mirror_spheres
from tbcad_verify.prototype.light.windows import ray_transfer
from tbcad_verify.prototype.swing import AxialSolid
from tbcad_verify.record.export import Export
from tbcad_verify.record.files import FileBytes
from tbcad_verify.record.prototype import Lamps
from tbcad_verify.run.processes import Processes
from tbcad_verify.run.verify import STAGE_LIMIT_S
from tbcad_verify.shell import lamps
from tbcad_verify.step import step_file
from tbcad_verify.step.step_file import StepFile
from tbcad_verify.types import Floats

# Light of the shell's lamps is followed by a fifth of the bundles, on 48 rows.
COARSER = {"BUNDLES": 30_000, "ROWS": 48}
MAX_BYTES = 1 << 26  # of a file that is read to know whether it was read before
# Of an export, what no result depends on that is kept by the export.
NOT_DERIVED_FROM = {"folder", "manifest", "digests"}
# Functions of their arguments alone, by module of the verification.
PURE: dict[str, tuple[str, ...]] = {
    "run.stages": ("same_check", "measure", "assess", "_set_up", "casing_checks"),
    "shell.measured_shell": (
        *("mesh_from_facets", "examine_topology", "mass_properties", "measure_edges", "recover"),
    ),
    "shell.coverage": ("measure",),
    "shell.pixels": ("checks",),
    "shell.lamps": ("object_light", "glare"),
    "shell.mirrors_found": ("checks",),
    "run.verify": ("area_checks",),
    "step.front_checks": ("cells_of_export",),
    "step.shell_checks": ("wall",),
    "prototype.stages": ("measure_part", "join_meshes"),
    "prototype.bodies_apart": ("shared_rooms",),
    "prototype.measured_parts": ("manifold",),
    "prototype.assembly": ("manifold", "read_solids"),
    "prototype.bodies": ("indexed_mesh", "join_meshes", "build_scene"),
    "prototype.caps": ("fit_sphere",),
    "prototype.cut_checks": ("read_dxf",),
    "prototype.fastener_checks": ("_hole_spans",),
    "prototype.control.homing_checks": ("run_program",),
    "prototype.control.program_checks": ("run_klipper", "run_program"),
    "prototype.sag_checks": ("_moved",),
    "prototype.seats": ("_facets_near", "_pad", "distance_to_facets"),
}


@contextmanager
def remembered() -> Iterator[None]:
    """Within, nothing slow is done twice on the same input; what fails is.

    No file is read twice and no mesh put on printers; no balls are traced, no parts swept.
    """
    keyed: tuple[tuple[str, str, Callable[..., object]], ...] = (
        ("run.stages", "read_facets", _file_key),
        ("run.stages", "read_3mf", _file_key),
        ("prototype.stages", "assembly_meshes", _drawn_key),
        ("prototype.stages", "ball_views", _traced_key),
        ("prototype.swing", "axial_solid", _solid_key),
        ("prototype.swing", "sweep", _given),
        ("prototype.stages", "pixel_rays", _rays_key),
        ("prototype.light.lamp_light", "irradiance", _light_key),
        ("prototype.light.upper_lamps", "irradiance", _light_key),
        *((module, name, _given) for module, names in PURE.items() for name in names),
    )
    with ExitStack() as stack:
        for path, name, key in keyed:
            module = import_module(f"tbcad_verify.{path}")
            once = _Once(getattr(module, name), key)
            stack.enter_context(mock.patch.object(module, name, once))
        stack.callback(DIGESTS.clear)
        for name, value in COARSER.items():
            stack.enter_context(mock.patch.object(lamps, name, value))
        standing = stack.enter_context(Processes(step_file.PROCESSES, STAGE_LIMIT_S))
        each = _EachOnce(step_file.examine_all, standing)
        stack.enter_context(mock.patch.object(step_file, "examine_all", each))
        yield


def _of_export(export: Export) -> object:
    names = {field.name for field in fields(export)} - NOT_DERIVED_FROM
    return [getattr(export, name) for name in sorted(names)]


def _of_solid(solid: manifold3d.Manifold) -> object:
    mesh = solid.to_mesh64()
    return mesh.vert_properties, mesh.tri_verts


# What stands for an object that nothing changes, by its type.
CONTENT: dict[type, Callable[[Any], object]] = {
    Export: _of_export,
    manifold3d.Manifold: _of_solid,
    RayScene: lambda scene: scene.planes,
    ImagePairScene: lambda pair: (pair.planes, pair.side),
    AxialSolid: lambda one: (one.name, one.solid, one.frame),
}
# Their digests by identity, beside the objects, whose identity nothing else may get.
DIGESTS: dict[int, tuple[object, bytes]] = {}


class _Pickler(pickle.Pickler):
    def reducer_override(self, one: object) -> Any:
        if type(one) not in CONTENT:
            return NotImplemented
        if id(one) not in DIGESTS:
            DIGESTS[id(one)] = one, _digest(CONTENT[type(one)](one))
        return bytes, (DIGESTS[id(one)][1],)


def _digest(value: object) -> bytes:
    stream = io.BytesIO()
    _Pickler(stream, pickle.HIGHEST_PROTOCOL).dump(value)
    return hashlib.sha256(stream.getbuffer()).digest()


class _Once:
    """A function that keeps what it returned, by a key of its arguments; None: it is called."""

    def __init__(self, work: Callable[..., Any], key: Callable[..., object]) -> None:
        self._work, self._key = work, key
        self._found: dict[bytes, Any] = {}

    def __call__(self, *given: Any, **named: Any) -> Any:
        value = self._key(*given, **named)
        if value is None:
            return self._work(*given, **named)
        key = _digest(value)
        if key not in self._found:
            self._found[key] = self._work(*given, **named)
        return self._found[key]


class _EachOnce:
    """The readings of several files by one call, each kept by its bytes; what failed is not.

    `standing`: processes that all verifications use which have no time limit of their own.
    """

    def __init__(self, work: Callable[..., list[Any]], standing: Processes) -> None:
        self._work, self._standing, self._found = work, standing, dict[object, Any]()

    def __call__(self, blobs: list[FileBytes], processes: Processes) -> list[Any]:
        keys = [(blob.sha256, processes.seconds) for blob in blobs]
        new = [k for k, key in enumerate(keys) if key not in self._found]
        own = self._standing if processes.seconds == self._standing.seconds else processes
        answers = dict(zip(new, self._work([blobs[k] for k in new], own), strict=True))
        self._found |= {
            keys[k]: answer for k, answer in answers.items() if isinstance(answer, StepFile)
        }
        return [answers[k] if k in answers else self._found[key] for k, key in enumerate(keys)]


def _given(*values: object, **named: object) -> object:
    return values, named


def _file_key(folder: Path, name: str) -> object:
    """None for what may be refused without being read."""
    path = folder / name
    try:
        found = path.lstat()
    except OSError:
        return None
    if not stat.S_ISREG(found.st_mode) or found.st_size > MAX_BYTES:
        return None
    return name, path.read_bytes()


def _drawn_key(context: PrototypeContext) -> object:
    """The file of the assembly's shapes."""
    return _file_key(context.export.folder, context.prototype.assembly.glb)


def _solid_key(measured: MeasuredPrototype, name: str, solid: manifold3d.Manifold) -> object:
    return measured.context.frame, name, solid


def _traced_key(measured: MeasuredPrototype, *_: object) -> object:
    """All that the light of the balls depends on."""
    context = measured.context
    return (
        *(measured.centre, measured.radius, measured.seated, context.angle, context.ball),
        *(context.stop, context.sag_at_stops, context.told_sag),
        *(measured.rotating.scene, measured.fixed.scene),
        *(context.export.mirrors.columns("ux", 15), context.camera),
        *(context.export.target_mm, context.export.foot_z_mm),
    )


def _rays_key(measured: MeasuredPrototype) -> object:
    transfer = ray_transfer(measured)
    arrays = transfer.merged, transfer.held, transfer.ball
    return _traced_key(measured), arrays, mirror_spheres(measured.context)


def _light_key(
    leds: Lamps, points: Floats, normals: Floats, some: Bodies | EdgedBodies, angle: float
) -> object:
    edges, all_of = (some.grazing, some.bodies) if isinstance(some, EdgedBodies) else (None, some)
    bodies = [(one.scene, one.names) for one in (all_of.turning, all_of.still)]
    return leds, points, normals, edges, bodies, all_of.context.frame, angle
