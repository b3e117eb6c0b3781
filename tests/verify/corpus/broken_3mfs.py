"""3MF files that are broken while the STL is good."""

from __future__ import annotations

from collections.abc import Callable

from tests.verify.corpus.facets import MODEL, edit_3mf, edit_members
from tests.verify.corpus.mutation import Job, Mutation, as_bytes, failing, refusing, together

NAME = "shell_a.3mf"
PLACE = "built once where it stands"
# Beams between the mesh's corners, which slicers that know them print.
BEAMS = (
    '<b:beamlattice minlength="0.1" radius="1" clippingmode="none"><b:beams>'
    '<b:beam v1="0" v2="1"/></b:beams></b:beamlattice>'
)
TITLE = '<metadata name="Title">in inches</metadata>'
MATERIAL = '<basematerials id="2"><base name="x" displaycolor="#FFFFFF"/></basematerials>'
RELATIONS = "_rels/.rels"
BOMB = 100_000_000  # bytes of zeros, which pack to a thousandth


def text(how: Callable[[str], str]) -> Job:
    """Change the model's text."""
    return lambda folder: edit_3mf(folder, NAME, how)


def members(how: Callable[[dict[str, bytes]], dict[str, bytes]]) -> Job:
    return lambda folder: edit_members(folder, NAME, how)


def swapped(old: str, new: str) -> Job:
    return text(lambda model: model.replace(old, new, 1))


def placed(transform: str) -> Job:
    """The mesh is right, and put on the bed otherwise."""
    return swapped('<item objectid="1"', f'<item objectid="1" transform="{transform}"')


def assembled(transform: str, copies: int = 1) -> Job:
    """The mesh is right; what is built is another object, which places it."""
    component = f'<component objectid="1" transform="{transform}"/>' * copies
    whole = f'<object id="2" type="model"><components>{component}</components></object>'
    return text(
        lambda model: model.replace("</resources>", whole + "</resources>").replace(
            '<item objectid="1"', '<item objectid="2"'
        )
    )


def first_triangle(how: Callable[[str], str]) -> Job:
    def job(model: str) -> str:
        start = model.index("<triangle ")
        end = model.index("/>", start) + 2
        return model[:start] + how(model[start:end]) + model[end:]

    return text(job)


def vertex(by: float) -> Callable[[str], str]:
    """The first vertex moved along x."""

    def how(model: str) -> str:
        head, mark, rest = model.partition('x="')
        value, quote, tail = rest.partition('"')
        return f"{head}{mark}{float(value) + by:.6f}{quote}{tail}"

    return how


def nothing(model: str) -> str:
    """A mesh, and an empty list of what to print."""
    start, end = model.index("<item "), model.index("</build>")
    return model[:start] + model[end:]


def twice(model: str) -> str:
    start, end = model.index("<item "), model.index("</build>")
    other = model[start:end].replace("p:UUID=", "partnumber=")
    return model[:end] + other + model[end:]


def bomb(found: dict[str, bytes]) -> dict[str, bytes]:
    return {**found, MODEL: b" " * BOMB}


def renamed(data: bytes) -> bytes:
    """The directory has the model's name, the member itself another; some programs read that."""
    return data.replace(b"3D/3dmodel.model", b"3D/3dmodel.modem", 1)


# A bomb whose directory says that it unpacks to next to nothing.
LIAR = together(
    members(bomb), as_bytes(NAME, lambda b: b.replace(BOMB.to_bytes(4, "little"), b"\x10\0\0\0"))
)
AS_IS, INCHES = "1 0 0 0 1 0 0 0 1 0 0 0", "25.4 0 0 0 25.4 0 0 0 25.4 0 0 0"
ASIDE, MIRRORED = "1 0 0 0 1 0 0 0 1 10 0 0", "-1 0 0 0 1 0 0 0 1 0 0 0"
THREEMFS: tuple[Mutation, ...] = (
    *failing(
        "3MF",
        ("a vertex moved 0.1 mm", text(vertex(0.1)), "3MF", "elsewhere in the STL"),
        ("a vertex moved 0.1 um", text(vertex(1e-4)), "3MF"),
        ("a triangle missing", first_triangle(lambda _: ""), "3MF", "the STL"),
    ),
    *refusing(
        "3MF",
        ("inches", swapped('"millimeter"', '"inch"'), NAME, "millimetres"),
        ("cut short", as_bytes(NAME, lambda b: b[: len(b) // 2]), NAME, "zip"),
        ("no zip", as_bytes(NAME, lambda _: b"solid" * 100), NAME, "zip"),
        ("empty", as_bytes(NAME, lambda _: b""), NAME, "zip"),
        ("a bomb", members(bomb), NAME, "claim to unpack"),
        ("a bomb that hides it", LIAR, NAME, "CRC"),
        ("a member's own head broken", as_bytes(NAME, renamed), NAME, "zip"),
        ("no model", members(lambda _: {"x": b"y"}), NAME, "broken 3MF"),
        ("text that ends early", members(lambda m: {**m, MODEL: m[MODEL][:-5000]}), NAME),
        ("a vertex that is no number", swapped('x="', 'x="nan'), NAME),
        ("no such vertex", first_triangle(lambda t: t.replace('v1="', 'v1="99')), NAME),
        ("placed 10 mm off", placed(ASIDE), NAME, PLACE),
        ("placed in inches", placed(INCHES), NAME, PLACE),
        ("placed mirrored", placed(MIRRORED), NAME, PLACE),
        ("nothing to print", text(nothing), NAME, PLACE),
        ("printed twice", text(twice), NAME, PLACE),
        ("a component as it is", assembled(AS_IS), NAME, "object"),
        ("a component in inches", assembled(INCHES), NAME, "object"),
        ("a component mirrored", assembled(MIRRORED), NAME, "object"),
        ("a component moved", assembled(ASIDE), NAME, "object"),
        ("a component twice", assembled(AS_IS, 2), NAME, "object"),
        *(
            (f"type {kind}", swapped('type="model"', f'type="{kind}"'), NAME, f'type="{kind}"')
            for kind in ("support", "surface", "solidsupport", "other")
        ),
        ("a beam lattice", swapped("</mesh>", f"{BEAMS}</mesh>"), NAME, "beamlattice"),
        (
            "a second model",
            members(lambda m: {**m, "3D/other.model": m[MODEL]}),
            *(NAME, "3D/other.model"),
        ),
        (
            "a colour on a facet",
            first_triangle(lambda t: t.replace("/>", 'pid="1"/>')),
            *(NAME, "in a list of triangles"),
        ),
        ("a comment", swapped("<vertices>", "<vertices><!-- -->"), NAME, "list of vertices"),
        ("another name", swapped('name="shell_a"', 'name="shell_b"'), NAME, "shell_b"),
        ("a title", swapped("<resources>", TITLE + "<resources>"), NAME, "<metadata"),
        ("a material", swapped("<resources>", "<resources>" + MATERIAL), NAME, "<basematerials"),
        ("an entity", swapped("<model ", "<!DOCTYPE x><model "), NAME, "<!DOCTYPE"),
        (
            "another relation",
            members(lambda m: {**m, RELATIONS: m[RELATIONS].replace(b"3dmodel", b"thumbnail", 1)}),
            *(NAME, "<Relationship "),
        ),
        (
            "an extension asked for",
            swapped("<model ", '<model requiredextensions="b" '),
            *(NAME, "requiredextensions"),
        ),
        (
            "an object that is not built",
            swapped("</resources>", '<object id="2"><mesh/></object></resources>'),
            *(NAME, '<object id="2"> is not allowed'),
        ),
    ),
)
