"""What a view can be written as besides its picture: depth, normals and opacity."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from tbcad.app.cli.commands.compared_pictures import compared_files
from tbcad.errors import InputError

if TYPE_CHECKING:
    from tbcad.core.optics.camera import Camera
    from tbcad.light.reconstruction.field import Field
    from tbcad.types import Bytes


class ViewFiles(NamedTuple):
    """Files that are asked for."""

    depth: tuple[Path, ...]  # PNG or PLY
    normals: Path | None = None  # PNG, of a field
    opacity: Path | None = None  # PNG, of a field

    @property
    def of_field(self) -> bool:
        """Whether some are of a field alone."""
        return self.normals is not None or self.opacity is not None

    def named(self) -> Iterator[tuple[str, Path]]:
        """Each with what it shows, which is the name of its option."""
        yield from (("depth", file) for file in self.depth)
        if self.normals is not None:
            yield "normals", self.normals
        if self.opacity is not None:
            yield "opacity", self.opacity

    def check(self, out: Path, method: str, force: bool, inputs: tuple[Path | None, ...]) -> None:
        """Refuse, before any work, what cannot be written or what a method does not give.

        Raises:
            InputError: as said.
        """
        from tbcad.light.simulate.image_files import check_image_path
        from tbcad.output.single_files import check_file

        taken = [out, *compared_files(out)]
        for what, file in self.named():
            if what == "depth" and method not in ("depth", "field"):
                raise InputError(f"--depth {file}: no depth is looked for: add --method depth")
            if what != "depth" and method != "field":
                raise InputError(f"--{what} {file}: only a field has that: add --method field")
            check_image_path(file, force, (".png", ".ply") if what == "depth" else (".png",))
            check_file(file, force, inputs)
            if file in taken:
                raise InputError(
                    f"--{what} {file}: another file of this command: choose another name"
                )
            taken.append(file)

    def tell(self) -> None:
        """Print a line for each."""
        for what, file in self.named():
            typer.echo(f"{file}: {what}")


def write_depth(
    files: tuple[Path, ...], png: Callable[[], bytes], ply: Callable[[], bytes]
) -> None:
    """Write the depth of a view, each file by what makes its kind."""
    from tbcad.common.atomic_files import replace_files

    for file in files:
        content = ply() if file.suffix.lower() == ".ply" else png()
        replace_files(file.parent, {file.name: content})


def field_view(made: "Field", at: "Camera", files: ViewFiles) -> "Bytes":
    """The picture of a field (h, w, 3), and what else is asked for of it."""
    from tbcad.common.atomic_files import replace_files
    from tbcad.light.depth.depth_map import depth_ply, depth_png
    from tbcad.light.reconstruction.picture import (
        field_normals,
        field_picture,
        normals_png,
        opacity_png,
    )

    picture = field_picture(made, at)
    depth = picture.depth(at)
    write_depth(
        files.depth,
        lambda: depth_png(depth, made.grid.width_mm),
        lambda: depth_ply(at, depth, picture.image),
    )
    if files.normals is not None:
        content = normals_png(field_normals(made, at, picture))
        replace_files(files.normals.parent, {files.normals.name: content})
    if files.opacity is not None:
        replace_files(files.opacity.parent, {files.opacity.name: opacity_png(picture)})
    return picture.image
