"""3MF files that are broken while the STL is good."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.verify.corpus.copies import change, put
from tests.verify.corpus.facets import MODEL, edit_3mf, zipped
from tests.verify.corpus.mutation import Job, Mutation, fails, refused

NAME = "shell_a.3mf"
PLACE = "built once where it stands"
BOMB = 100_000_000  # bytes of zeros, which pack to a thousandth


def text(how: Callable[[str], str]) -> Job:
    """Change the model's text."""
    return lambda folder: edit_3mf(folder, NAME, how) or ()


def data(how: Callable[[bytes], bytes]) -> Job:
    return lambda folder: change(folder, NAME, how) or ()


def members(how: Callable[[dict[str, bytes]], dict[str, bytes]]) -> Job:
    def job(folder: Path) -> Sequence[str]:
        with zipfile.ZipFile(folder / NAME) as archive:
            found = {item: archive.read(item) for item in archive.namelist()}
        put(folder, NAME, zipped(how(found)))
        return ()

    return job


def vertex(by: float) -> Callable[[str], str]:
    """The first vertex moved along x."""

    def how(model: str) -> str:
        head, mark, rest = model.partition('x="')
        value, quote, tail = rest.partition('"')
        return f"{head}{mark}{float(value) + by:.6f}{quote}{tail}"

    return how


def swapped(old: str, new: str) -> Callable[[str], str]:
    return lambda model: model.replace(old, new, 1)


def placed(transform: str) -> Callable[[str], str]:
    """The mesh is right, and put on the bed otherwise."""
    return swapped('<item objectid="1"', f'<item objectid="1" transform="{transform}"')


def nothing(model: str) -> str:
    """A mesh, and an empty list of what to print."""
    start, end = model.index("<item "), model.index("</build>")
    return model[:start] + model[end:]


def twice(model: str) -> str:
    start, end = model.index("<item "), model.index("</build>")
    other = model[start:end].replace("p:UUID=", "partnumber=")
    return model[:end] + other + model[end:]


def first_triangle(how: Callable[[str], str]) -> Callable[[str], str]:
    def job(model: str) -> str:
        start = model.index("<triangle ")
        end = model.index("/>", start) + 2
        return model[:start] + how(model[start:end]) + model[end:]

    return job


def bomb(found: dict[str, bytes]) -> dict[str, bytes]:
    return {**found, MODEL: b" " * BOMB}


def liar(folder: Path) -> Sequence[str]:
    """The same, and its directory says that it unpacks to next to nothing."""
    members(bomb)(folder)
    change(folder, NAME, lambda b: b.replace(BOMB.to_bytes(4, "little"), b"\x10\0\0\0"))
    return ()


def assembled(transform: str, copies: int = 1) -> Callable[[str], str]:
    """The mesh is right; what is built is another object, which places it."""
    component = f'<component objectid="1" transform="{transform}"/>' * copies

    def how(model: str) -> str:
        whole = f'<object id="2" type="model"><components>{component}</components></object>'
        model = model.replace("</resources>", whole + "</resources>")
        return model.replace('<item objectid="1"', '<item objectid="2"')

    return how


def lattice(model: str) -> str:
    """Beams between the mesh's corners, which slicers that know them print."""
    beams = (
        '<b:beamlattice minlength="0.1" radius="1" clippingmode="none"><b:beams>'
        '<b:beam v1="0" v2="1"/></b:beams></b:beamlattice>'
    )
    return model.replace("</mesh>", f"{beams}</mesh>")


def typed(kind: str) -> Callable[[str], str]:
    return swapped('type="model"', f'type="{kind}"')


def second(found: dict[str, bytes]) -> dict[str, bytes]:
    """Another model beside the first."""
    return {**found, "3D/other.model": found[MODEL]}


def renamed(data: bytes) -> bytes:
    """The directory has the model's name, the member itself another; some programs read that."""
    return data.replace(b"3D/3dmodel.model", b"3D/3dmodel.modem", 1)


THREEMFS: tuple[Mutation, ...] = (
    fails("3MF: a vertex moved 0.1 mm", "3MF", text(vertex(0.1)), "3MF", "elsewhere in the STL"),
    fails("3MF: a vertex moved 0.1 um", "3MF", text(vertex(1e-4)), "3MF"),
    fails("3MF: a triangle missing", "3MF", text(first_triangle(lambda _: "")), "3MF", "the STL"),
    refused("3MF in inches", "3MF", text(swapped('"millimeter"', '"inch"')), NAME, "millimetres"),
    refused("3MF cut short", "3MF", data(lambda b: b[: len(b) // 2]), NAME, "zip"),
    refused("3MF that is no zip", "3MF", data(lambda b: b"solid" * 100), NAME, "zip"),
    refused("3MF that is empty", "3MF", data(lambda _: b""), NAME, "zip"),
    refused("3MF that is a bomb", "3MF", members(bomb), NAME, "claim to unpack"),
    refused("3MF that is a bomb and hides it", "3MF", liar, NAME, "damaged"),
    refused("3MF with a member's own head broken", "3MF", data(renamed), NAME, "zip"),
    refused("3MF without a model", "3MF", members(lambda m: {"x": b"y"}), NAME, "broken 3MF"),
    refused(
        "3MF whose text ends early",
        "3MF",
        members(lambda m: {**m, MODEL: m[MODEL][: len(m[MODEL]) // 2]}),
        NAME,
    ),
    refused("3MF with a vertex that is no number", "3MF", text(swapped('x="', 'x="nan')), NAME),
    refused(
        "3MF with a vertex that is not there",
        "3MF",
        text(first_triangle(lambda t: t.replace('v1="', 'v1="99'))),
        NAME,
    ),
    refused("3MF placed 10 mm off", "3MF", text(placed("1 0 0 0 1 0 0 0 1 10 0 0")), NAME, PLACE),
    refused("3MF placed in inches", "3MF", text(placed("25.4 0 0 0 25.4 0 0 0 25.4 0 0 0")), PLACE),
    refused("3MF placed mirrored", "3MF", text(placed("-1 0 0 0 1 0 0 0 1 0 0 0")), NAME, PLACE),
    refused("3MF with nothing to print", "3MF", text(nothing), NAME, PLACE),
    refused("3MF printed twice", "3MF", text(twice), NAME, PLACE),
    *(
        refused(f"3MF of a component {what}", "3MF", text(assembled(move, copies)), NAME, "object")
        for what, move, copies in (
            ("as it is", "1 0 0 0 1 0 0 0 1 0 0 0", 1),
            ("in inches", "25.4 0 0 0 25.4 0 0 0 25.4 0 0 0", 1),
            ("mirrored", "-1 0 0 0 1 0 0 0 1 0 0 0", 1),
            ("moved", "1 0 0 0 1 0 0 0 1 10 0 0", 1),
            ("twice", "1 0 0 0 1 0 0 0 1 0 0 0", 2),
        )
    ),
    *(
        refused(f"3MF of type {kind}", "3MF", text(typed(kind)), NAME, f'type="{kind}"')
        for kind in ("support", "surface", "solidsupport", "other")
    ),
    refused("3MF with a beam lattice", "3MF", text(lattice), NAME, "beamlattice"),
    refused("3MF with a second model", "3MF", members(second), NAME, "3D/other.model"),
    refused(
        "3MF with a colour on a facet",
        "3MF",
        text(first_triangle(lambda t: t.replace("/>", 'pid="1"/>'))),
        NAME,
        "with v1, v2, v3 only",
    ),
    refused(
        "3MF with a comment",
        "3MF",
        text(swapped("<vertices>", "<vertices><!-- -->")),
        NAME,
        "comments",
    ),
    refused(
        "3MF that asks for an extension",
        "3MF",
        text(swapped("<model ", '<model requiredextensions="b" ')),
        NAME,
        "requiredextensions",
    ),
    refused(
        "3MF with an object that is not built",
        "3MF",
        text(swapped("</resources>", '<object id="2"><mesh/></object></resources>')),
        NAME,
        "resources must hold object",
    ),
)
