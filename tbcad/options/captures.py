"""Calls about light fields: simulated, reconstructed, written for other programs."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Literal, get_args

import typer

from tbcad.errors import InputError
from tbcad.options.call import Call
from tbcad.options.shared import (
    AnyPath,
    Capture,
    Exports,
    Force,
    ForceFile,
    ObjectFile,
    OutReplaced,
    PaintOption,
    UnitOption,
    UpOption,
)

Target = Literal["nerfstudio", "colmap", "ngp-rays", "rays", "mitsuba"]
Geometry = Literal["spheres", "mesh", "prototype"]
Optics = Literal["ideal", "real"]
AS_CAPTURED: tuple[Target, ...] = ("ngp-rays", "rays")
SIZES_PX = (8, 4096)


@dataclass(frozen=True)
class DatasetOptions(Call):
    """A capture, for which program it is written, and what of it."""

    capture: Capture[AnyPath]
    to: Target | None = None
    """nerfstudio, colmap: virtual cameras as pinholes, with masks; ngp-rays: crops with the ray of
    every pixel for instant-ngp; rays: all rays as numpy arrays and HDF5; mitsuba: the machine
    itself as scenes for Mitsuba and Blender."""
    _: KW_ONLY
    out: OutReplaced[AnyPath] = Path("data")
    every: Annotated[int, typer.Option(min=1, metavar="N")] = 1
    """One virtual camera of N, spread evenly."""
    size: Annotated[int | None, typer.Option(metavar="PIXELS")] = None
    """Width and height of the pictures; by default as fine as the finest tenth of the virtual
    cameras."""
    cameras: Annotated[str | None, typer.Option(metavar="NAMES")] = None
    """a, b, or mirrors by name, as a0001,b0007; by default all."""
    exports: Annotated[AnyPath | None, typer.Option(metavar="FOLDER")] = None
    """Folder written by tbcad build, with the shells; for --to mitsuba."""
    force: Force = False

    def check(self) -> Target:
        """Refuse options that exclude each other; the program.

        InputError: there is none, an option is not for it, or a number is out of range.
        """
        if self.to is None:
            allowed = ", ".join(get_args(Target))
            raise InputError(f"--to is missing, allowed is one of {allowed}: add it")
        if (self.to == "mitsuba") != (self.exports is not None):
            raise InputError(
                "--to mitsuba shows the shells of a build: give its folder by --exports"
                if self.exports is None
                else f"--exports {self.exports} is for --to mitsuba: leave it out"
            )
        if self.to == "mitsuba" and (self.size, self.cameras, self.every) != (None, None, 1):
            raise InputError(
                "--to mitsuba writes the whole machine: leave out --size, --cameras and --every"
            )
        if self.size is not None and self.to in AS_CAPTURED:
            raise InputError(
                f"--size {self.size}: {self.to} keeps every pixel as it was captured: "
                "leave it out, or choose --to nerfstudio or colmap"
            )
        low, high = SIZES_PX
        if self.size is not None and not low <= self.size <= high:
            raise InputError(f"--size {self.size} is not allowed: from {low} to {high} pixels")
        return self.to


@dataclass(frozen=True)
class ReconstructOptions(Call):
    """A light field, how one object is fitted to it, and the files to write."""

    capture: Annotated[AnyPath, typer.Argument(metavar="FOLDER")]
    """Folder written by tbcad capture or merge, or its lightfield.h5."""
    _: KW_ONLY
    out: Annotated[AnyPath | None, typer.Option("--out", "-o", metavar="FILE")] = None
    """The field to write (.npz); by default field.npz beside the light field, which view, show and
    turntables then show."""
    nodes: Annotated[int, typer.Option(min=16, max=512, metavar="N")] = 144
    """Nodes along each edge of the finest grid."""
    epochs: Annotated[int, typer.Option(min=1, max=100, metavar="N")] = 5
    """How often each ray is used on the finest grid; on the coarser grids in proportion."""
    order: Literal["0", "1", "auto"] = "auto"
    """How colours depend on the direction they are seen from: 0: not; 1: linearly, for gloss; auto:
    by which of both mirrors that are left out are shown better."""
    rays: Annotated[int, typer.Option(min=1, max=64, metavar="K")] = 1
    """Rays of a pixel on the finest grid: 1, its central ray, or 12 and more, which take its area
    and the lens' spread into account, in K times the time."""
    blur_px: Annotated[float | None, typer.Option("--blur", min=0, max=5, metavar="PX")] = None
    """With --rays: standard deviation of the lens' spread, pixels of the photograph, besides the
    pixel's own area; by default what the light field says, else 0."""
    frame: Annotated[int | Literal["all"] | None, typer.Option(min=0, metavar="K")] = None
    """Frame of tbcad capture --frames to show, from 0 on."""
    meshes: Annotated[Sequence[AnyPath], typer.Option("--mesh", metavar="FILE")] = ()
    """Also write the surface with its colours (.glb, .ply) or without (.stl); repeatable."""
    volume: Annotated[AnyPath | None, typer.Option(metavar="FILE")] = None
    """Also write density and colours on the whole lattice, for ParaView and PyVista (.vti)."""
    preview: Annotated[AnyPath | None, typer.Option(metavar="FILE")] = None
    """A picture (.png) that is written after each epoch."""
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1)] = 0
    """Of all that is random."""
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS")] = None
    """Dask scheduler, such as tcp://host:8786: its workers try weights and view dependence at the
    same time. The fit runs on this machine: each of its steps changes the whole field, which would
    take longer to send than to work out."""
    resume: bool = False
    """Go on with what was interrupted; with a field, make what is missing."""
    force: ForceFile = False


@dataclass(frozen=True)
class CaptureOptions(Call):
    """A build, an object before it, and how its photographs are traced."""

    exports: Exports[AnyPath]
    object_file: ObjectFile[AnyPath] = None
    _: KW_ONLY
    up: UpOption = None
    unit: UnitOption = None
    out: Annotated[AnyPath | None, typer.Option("--out", "-o")] = None
    """Folder for all files; replaced atomically. By default captures/ with the name
    of the object, such as captures/knot; from Python none."""
    fit: bool = False
    """Move and scale the object into the capture sphere."""
    paint: PaintOption = "own"
    samples: Annotated[int, typer.Option(min=1, max=8)] = 1
    """Anti-aliasing: a pixel is the mean of N x N rays."""
    geometry: Annotated[
        Geometry,
        "Mirrors of the record (spheres), of the meshes, or the balls of the prototype, "
        "stop by stop.",
    ] = "spheres"
    optics: Optics = "ideal"
    """ideal: a pinhole, without cast shadow and noise. real: the lens and pupil of camera.json
    (defocus, astigmatism, diffraction, pixels that show two mirrors), shadows of the lamps, what
    mirrors scatter, noise and steps of the sensor; without light that meets two mirrors."""
    gloss: Annotated[float | None, typer.Option(min=0.05, max=1, metavar="ROUGHNESS")] = None
    """With --optics real: the object's roughness, from 0.05 (polished) to 1, in place of that of
    its materials (glTF; MTL by Pr and Pm, or Ns and Ks); by default as these say, else matt."""
    own_light: bool = False
    """Light the object by the shell's own lamps and through its mirrors, in place of the built-in
    light; the prototype's balls are always lit by its lamps."""
    lights: Annotated[AnyPath | None, typer.Option(metavar="FILE")] = None
    """Also write a reflectance field, a photograph for each lamp: FILE is a table with the columns
    x_mm,y_mm,z_mm; the word mirrors is a lamp in the place of each virtual camera, projectors what
    each mirror throws of a projector in its camera's place."""
    every: Annotated[int, typer.Option(min=1, metavar="N")] = 1
    """One lamp of N, of --lights mirrors or projectors."""
    frames: Annotated[int | None, typer.Option(min=1, max=10_000, metavar="N")] = None
    """Also photograph the object N times while it turns about z, as one file."""
    turn: float = 360.0
    """How far the object turns during all frames, degrees."""
    force: Force = False

    def check(self) -> None:
        """Refuse options that exclude each other."""
        lights, single = str(self.lights), self.samples == 1
        self._check_optics()
        if self.own_light and self.geometry == "prototype":
            raise InputError("--own-light is that of shells: leave out --prototype")
        if self.lights is not None and not single:
            raise InputError("--lights follows one ray a pixel: leave out --samples")
        if self.every > 1 and lights not in ("mirrors", "projectors"):
            raise InputError(
                "--every chooses among the lamps of --lights mirrors or projectors: leave it out"
            )
        if lights == "projectors" and self.geometry == "prototype":
            raise InputError(
                "--lights projectors is light from the mirrors of shells: leave out --prototype"
            )
        if self.frames is not None and (not single or self.geometry == "prototype"):
            raise InputError(
                "--frames follows one ray a pixel: leave out --samples and --prototype"
            )
        if self.out is None and (self.lights, self.frames) != (None, None):
            raise InputError("lamps and frames are written beside the light field: give out")

    def _check_optics(self) -> None:
        if self.optics == "ideal":
            if self.gloss is not None:
                raise InputError("--gloss is of --optics real: add that, or leave it out")
            return
        not_with = {
            "--mesh": self.geometry == "mesh",
            "--samples": self.samples > 1,
            "--lights": self.lights is not None,
            "--frames": self.frames is not None,
        }
        for option, given in not_with.items():
            if given:
                raise InputError(f"--optics real is not for {option}: leave one of both out")
