"""STEP files that are broken while the meshes and the record are good."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.verify.corpus import part21
from tests.verify.corpus.copies import change, put
from tests.verify.corpus.facets import balls
from tests.verify.corpus.mutation import Job, Mutation, failing, refusing
from tests.verify.corpus.part21 import (
    NUMBER,
    Entities,
    add,
    all_of,
    down,
    face,
    references,
    shift,
    swap,
)

NAME = "shell_a.step"
MILLIMETRE = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"


def step(how: Callable[[Entities, str], object]) -> Job:
    """Change the statements, told a mirror's id, which must be named."""

    def job(folder: Path) -> Sequence[str]:
        name = balls(folder, "a")[0].id
        part21.edit(folder, NAME, lambda entities: how(entities, name))
        return [name]

    return job


def whole(how: Callable[[Entities], object]) -> Job:
    """Change the statements; no mirror is concerned."""
    return lambda folder: part21.edit(folder, NAME, how)


def first(kind: str, old: str, new: str) -> Job:
    """Change the first statement of a kind."""
    return whole(lambda entities: swap(entities, all_of(entities, kind)[0], old, new))


def raw(how: Callable[[bytes], bytes]) -> Job:
    return lambda folder: change(folder, NAME, how)


def surface(entities: Entities, name: str) -> int:
    return references(entities[face(entities, name)])[-1]


def edge(entities: Entities, name: str, *steps: int) -> int:
    """The first edge of a face: two corners and a circle; or what it refers to."""
    return down(entities, face(entities, name), 0, 0, 0, 0, *steps)


def swap_names(folder: Path) -> Sequence[str]:
    one, two = (ball.id for ball in balls(folder, "a")[:2])

    def how(entities: Entities) -> None:
        first, second = face(entities, one), face(entities, two)
        swap(entities, first, one, two)
        swap(entities, second, two, one)

    part21.edit(folder, NAME, how)
    return one, two


def no_names(entities: Entities) -> None:
    for number in all_of(entities, "ADVANCED_FACE"):
        entities[number] = re.sub(r"'[^']*'", "''", entities[number], count=1)


def inches(entities: Entities) -> None:
    """The same numbers, said to be inches."""
    unit = next(n for n, said in entities.items() if said == MILLIMETRE)
    mm = add(entities, MILLIMETRE)
    measure = add(entities, f"LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#{mm})")
    size = add(entities, "DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)")
    entities[unit] = (
        f"( CONVERSION_BASED_UNIT('INCH',#{measure}) LENGTH_UNIT() NAMED_UNIT(#{size}) )"
    )


def complement(entities: Entities, name: str) -> None:
    """Bounded the other way round: all of the sphere but the mirror, which kernels call valid."""
    swap(entities, down(entities, face(entities, name), 0), ".T.", ".F.")


def turned(entities: Entities, name: str) -> None:
    """Both the face's sense and its bound: readers that do not repair see it inside out."""
    complement(entities, name)
    swap(entities, face(entities, name), ".T.", ".F.")


def dropped(entities: Entities, name: str) -> None:
    """The face is there, but not in the shell."""
    number, shell = face(entities, name), all_of(entities, "CLOSED_SHELL")[0]
    entities[shell] = re.sub(rf"#{number}\b,?", "", entities[shell]).replace(",))", "))")


def solid_twice(entities: Entities) -> None:
    solid = all_of(entities, "MANIFOLD_SOLID_BREP")[0]
    shape = all_of(entities, "ADVANCED_BREP_SHAPE_REPRESENTATION")[0]
    again = add(entities, entities[solid])
    swap(entities, shape, f"#{solid})", f"#{solid},#{again})")


def two_volumes(entities: Entities) -> None:
    """A wrong claim before the right one."""
    number = next(n for n, said in entities.items() if "'volume measure'" in said)
    wrong = add(entities, entities[number])
    shift(entities, wrong, 1000.0)
    shape = next(n for n, said in entities.items() if said.startswith("REPRESENTATION('volume'"))
    swap(entities, shape, f"(#{number})", f"(#{wrong},#{number})")


def claim(words: str, by: float) -> Job:
    def how(entities: Entities) -> None:
        shift(entities, next(n for n, said in entities.items() if f"'{words}'" in said), by)

    return whole(how)


def no_claims(entities: Entities) -> None:
    for number in [n for n, said in entities.items() if "geometric validation property" in said]:
        swap(entities, number, "geometric validation property", "a property")


def crooked(entities: Entities) -> None:
    """A straight edge a millimetre beside its corners, which readers widen until they meet."""
    point, vector = references(entities[all_of(entities, "LINE")[0]])
    way = [abs(float(x)) for x in NUMBER.findall(entities[down(entities, vector, 0)])]
    shift(entities, point, 1.0, way.index(min(way)))


def hole(entities: Entities) -> None:
    """One hole 0.02 mm too wide, its edges with it."""
    number = all_of(entities, "CYLINDRICAL_SURFACE")[0]
    radius = entities[number].rpartition(",")[2]
    for one in {number, *below(entities, _owner(entities, number), "CIRCLE")}:
        if entities[one].endswith(f",{radius}"):
            shift(entities, one, 0.01)


def hole_aside(entities: Entities) -> None:
    """One hole 0.05 mm along its flange: its points belong to it alone."""
    owner = _owner(entities, all_of(entities, "CYLINDRICAL_SURFACE")[0])
    for point in below(entities, owner, "CARTESIAN_POINT"):
        shift(entities, point, 0.05, 1)


def _owner(entities: Entities, surface: int) -> int:
    return next(n for n in all_of(entities, "ADVANCED_FACE") if f"#{surface}," in entities[n])


def below(entities: Entities, owner: int, kind: str) -> set[int]:
    """All entities of a kind that a face consists of."""
    found: set[int] = set()
    rest = [owner]
    while rest:
        parts = references(entities[rest.pop()])
        found |= {n for n in parts if entities[n].startswith(f"{kind}(")}
        rest += [n for n in parts if not entities[n].startswith("APPLICATION")]
    return found


def foot_low(entities: Entities) -> None:
    """All points of the foot 50 micrometres lower."""
    plane = references(entities[face(entities, "foot")])[-1]
    foot = float(NUMBER.findall(entities[down(entities, plane, 0, 0)])[2])
    for number in all_of(entities, "CARTESIAN_POINT"):
        found = NUMBER.findall(entities[number])
        if len(found) == 3 and abs(float(found[2]) - foot) < 1e-9:
            shift(entities, number, -0.05, 2)


def back(entities: Entities) -> None:
    """The back 5 micrometres too far out."""
    shift(entities, down(entities, all_of(entities, "SURFACE_OF_REVOLUTION")[0], 0), 0.005)


def cut_with_end(data: bytes) -> bytes:
    half = data[: len(data) // 2]
    return half[: half.rindex(b";\n") + 2] + part21.ENDSEC.encode() + b"\n"


def middle(old: bytes, new: bytes) -> Job:
    """Replace the first of its kind in the second half of the file."""

    def how(data: bytes) -> bytes:
        at = data.index(old, len(data) // 2)
        return data[:at] + new + data[at + len(old) :]

    return raw(how)


MISNAMED = first("MANIFOLD_SOLID_BREP", "'shell_a'", "'shell_b'")
# An uncertainty of a millimetre: readers may join whatever is nearer.
VAGUE = first("UNCERTAINTY_MEASURE_WITH_UNIT", "1.E-06", "1.")
CELLS, CLAIMS = "step cells", "step properties"
STEPS: tuple[Mutation, ...] = (
    *failing(
        "STEP",
        (
            "a radius 1 nm too large",
            step(lambda e, m: shift(e, surface(e, m), 1e-6)),
            *("step surfaces", "1e-06 mm"),
        ),
        (
            "a centre 1 nm off",
            step(lambda e, m: shift(e, down(e, surface(e, m), 0, 0), 1e-6)),
            *("step surfaces", "1e-06 mm"),
        ),
        ("two names swapped", swap_names, "step surfaces"),
        ("all names lost", whole(no_names), "step names", "a0001"),
        ("one name lost", step(lambda e, m: swap(e, face(e, m), m, "")), "step names", "(empty)"),
        (
            "a wall with a mirror's name",
            step(lambda e, m: swap(e, face(e, "back"), "back", m)),
            "step names",
        ),
        (
            "the other half",
            lambda folder: put(folder, NAME, (folder / "shell_b.step").read_bytes()),
            *("step names", "a0001"),
        ),
        ("a face its complement", step(complement), CELLS),
        ("a face inside out", step(lambda e, m: swap(e, face(e, m), ".T.", ".F.")), "step outward"),
        ("a face not in the shell", step(dropped), CELLS, "inf"),
        (
            "the shell not closed",
            lambda folder: step(dropped)(folder) and None,
            *("step solid", "0 solids", "open edges"),
        ),
        ("a face twice", step(lambda e, m: add(e, e[face(e, m)])), "step names"),
        (
            "a corner 10 um off",
            step(lambda e, m: [shift(e, edge(e, m, 0, 0), 0.01, k) for k in range(3)]),
            CELLS,
        ),
        (
            "an edge's radius 10 um too large",
            step(lambda e, m: shift(e, edge(e, m, 2), 0.01)),
            CELLS,
        ),
        (
            "an edge's centre 10 um off",
            step(lambda e, m: shift(e, edge(e, m, 2, 0, 0), 0.01)),
            CELLS,
        ),
        ("an edge 1 mm beside its corners", whole(crooked), "step gaps"),
        ("a hole 20 um too wide", whole(hole), CLAIMS, "volume"),
        ("a hole 50 um aside", whole(hole_aside), "step holes", "0.05 mm from its"),
        ("the foot 50 um low", whole(foot_low), "step seam and foot", "beyond the foot"),
        ("the back 5 um off", whole(back), CLAIMS, "volume"),
        ("another volume claimed", claim("volume measure", 10.0), CLAIMS, "volume"),
        ("another area claimed", claim("surface area measure", 1.0), CLAIMS, "area"),
        ("another centroid claimed", claim("centre point", 0.01), CLAIMS, "centroid"),
        ("a face and its bound turned", step(turned), "step outward"),
        ("the solid misnamed", MISNAMED, "step solid", "shell_b"),
    ),
    *refusing(
        "STEP",
        ("cut short", raw(lambda b: b[: len(b) // 2]), NAME, "truncated"),
        ("empty", raw(lambda _: b""), NAME, "no STEP file"),
        ("an STL", raw(lambda b: b"solid x" + b), NAME, "no STEP file"),
    ),
    *failing(
        "STEP",
        ("cut short, with an end", raw(cut_with_end), "step solid"),
        ("a bracket lost", middle(b"(", b" "), "step solid", "broken STEP text"),
        (
            "a reference to nowhere",
            middle(b"VERTEX_POINT('',#", b"VERTEX_POINT('',#9"),
            "step solid",
        ),
        ("a keyword misspelt", middle(b"CARTESIAN_POINT", b"CARTESIAN_PAINT"), "step solid"),
        ("zeros in the middle", middle(b"CIRCLE", bytes(6)), "step solid"),
        ("two volumes claimed", whole(two_volumes), "step solid", "allowed is"),
        ("inches", whole(inches), "step solid", "LENGTH"),
        ("true to a millimetre", VAGUE, "step solid", "LENGTH_MEASURE"),
        ("nothing claimed", whole(no_claims), "step solid", "geometricvalidationproperty"),
        ("the solid twice", whole(solid_twice), "step solid", "#AXIS2_PLACEMENT_3D"),
        unknown=True,
    ),
)
