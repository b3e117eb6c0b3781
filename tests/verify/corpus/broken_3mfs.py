"""3MF files that are broken while the STL is good."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

from tests.verify.corpus.copies import change, put
from tests.verify.corpus.facets import MODEL, edit_3mf, zipped
from tests.verify.corpus.mutation import Job, Mutation, failing, refusing

NAME = "shell_a.3mf"
PLACE = "built once where it stands"
BOMB = 100_000_000  # bytes of zeros, which pack to a thousandth


def text(how: Callable[[str], str]) -> Job:
    """Change the model's text."""
    return lambda folder: edit_3mf(folder, NAME, how)


def data(how: Callable[[bytes], bytes]) -> Job:
    return lambda folder: change(folder, NAME, how)


def members(how: Callable[[dict[str, bytes]], dict[str, bytes]]) -> Job:
    def job(folder: Path) -> None:
        with zipfile.ZipFile(folder / NAME) as archive:
            found = {item: archive.read(item) for item in archive.namelist()}
        put(folder, NAME, zipped(how(found)))

    return job


def swapped(old: str, new: str) -> Job:
    return text(lambda model: model.replace(old, new, 1))


def placed(transform: str) -> Job:
    """The mesh is right, and put on the bed otherwise."""
    return swapped('<item objectid="1"', f'<item objectid="1" transform="{transform}"')


def first_triangle(how: Callable[[str], str]) -> Job:
    def job(model: str) -> str:
        start = model.index("<triangle ")
        end = model.index("/>", start) + 2
        return model[:start] + how(model[start:end]) + model[end:]

    return text(job)


def further(model: str) -> str:
    """The first vertex moved along x."""
    head, mark, rest = model.partition('x="')
    value, quote, tail = rest.partition('"')
    return f"{head}{mark}{float(value) + 1e-4:.6f}{quote}{tail}"


def nothing(model: str) -> str:
    """A mesh, and an empty list of what to print."""
    start, end = model.index("<item "), model.index("</build>")
    return model[:start] + model[end:]


def bomb(found: dict[str, bytes]) -> dict[str, bytes]:
    return {**found, MODEL: b" " * BOMB}


def liar(folder: Path) -> None:
    """The same, and its directory says that it unpacks to next to nothing."""
    members(bomb)(folder)
    change(folder, NAME, lambda b: b.replace(BOMB.to_bytes(4, "little"), b"\x10\0\0\0"))


def renamed(data: bytes) -> bytes:
    """The directory has the model's name, the member itself another; some programs read that."""
    return data.replace(b"3D/3dmodel.model", b"3D/3dmodel.modem", 1)


THREEMFS: tuple[Mutation, ...] = (
    *failing(
        "3MF",
        ("a vertex moved 0.1 um", text(further), "3MF", "elsewhere in the STL"),
        ("a triangle missing", first_triangle(lambda _: ""), "3MF", "the STL"),
    ),
    *refusing(
        "3MF",
        ("inches", swapped('"millimeter"', '"inch"'), NAME, "millimetres"),
        ("cut short", data(lambda b: b[: len(b) // 2]), NAME, "zip"),
        ("no zip", data(lambda _: b"solid" * 100), NAME, "zip"),
        ("a bomb", members(bomb), NAME, "claim to unpack"),
        ("a bomb that hides it", liar, NAME, "damaged"),
        ("a member's own head broken", data(renamed), NAME, "zip"),
        ("no model", members(lambda _: {"x": b"y"}), NAME, "broken 3MF"),
        ("text that ends early", members(lambda m: {**m, MODEL: m[MODEL][:-5000]}), NAME),
        ("a vertex that is no number", swapped('x="', 'x="nan'), NAME),
        ("no such vertex", first_triangle(lambda t: t.replace('v1="', 'v1="99')), NAME),
        ("placed 10 mm off", placed("1 0 0 0 1 0 0 0 1 10 0 0"), NAME, PLACE),
        ("nothing to print", text(nothing), NAME, PLACE),
        ("a support", swapped('type="model"', 'type="support"'), NAME, 'type="support"'),
        (
            "a second model",
            members(lambda m: {**m, "3D/other.model": m[MODEL]}),
            *(NAME, "3D/other.model"),
        ),
        ("a comment", swapped("<vertices>", "<vertices><!-- -->"), NAME, "comments"),
        (
            "an extension asked for",
            swapped("<model ", '<model requiredextensions="b" '),
            *(NAME, "requiredextensions"),
        ),
        (
            "an object that is not built",
            swapped("</resources>", '<object id="2"><mesh/></object></resources>'),
            *(NAME, "resources must hold object"),
        ),
    ),
)
