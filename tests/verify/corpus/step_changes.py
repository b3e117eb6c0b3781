"""Changes to the text of a STEP file."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.verify.corpus import part21
from tests.verify.corpus.copies import change, put
from tests.verify.corpus.mutation import Job, Mutation
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
from tests.verify.corpus.patches import balls

NAME = "shell_a.step"
MILLIMETRE = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )"
KIND = "STEP"


def step(how: Callable[[Entities, str], None]) -> Job:
    """Change the statements, told a mirror's id, which must be named."""

    def job(folder: Path) -> Sequence[str]:
        name = balls(folder, "a")[0].id
        part21.edit(folder, NAME, lambda entities: how(entities, name))
        return [name]

    return job


def whole(how: Callable[[Entities], None]) -> Job:
    """Change the statements; no mirror is concerned."""
    return lambda folder: part21.edit(folder, NAME, how) or ()


def surface(entities: Entities, name: str) -> int:
    return references(entities[face(entities, name)])[-1]


def edge(entities: Entities, name: str) -> int:
    """The first edge of a face: two corners and a circle."""
    return down(entities, face(entities, name), 0, 0, 0, 0)


def circle(entities: Entities, name: str) -> int:
    return references(entities[edge(entities, name)])[2]


def point(entities: Entities, name: str) -> int:
    """The first corner's place."""
    return down(entities, edge(entities, name), 0, 0)


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


def other_half(folder: Path) -> Sequence[str]:
    put(folder, NAME, (folder / "shell_b.step").read_bytes())
    return ["a0001"]


def inches(entities: Entities) -> None:
    """The same numbers, said to be inches."""
    unit = next(n for n, said in entities.items() if said == MILLIMETRE)
    mm = add(entities, MILLIMETRE)
    measure = add(entities, f"LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#{mm})")
    size = add(entities, "DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)")
    entities[unit] = (
        f"( CONVERSION_BASED_UNIT('INCH',#{measure}) LENGTH_UNIT() NAMED_UNIT(#{size}) )"
    )


def vague(entities: Entities) -> None:
    """An uncertainty of a millimetre: readers may join whatever is nearer."""
    swap(entities, all_of(entities, "UNCERTAINTY_MEASURE_WITH_UNIT")[0], "1.E-06", "1.")


def complement(entities: Entities, name: str) -> None:
    """Bounded the other way round: all of the sphere but the mirror, which kernels call valid."""
    swap(entities, down(entities, face(entities, name), 0), ".T.", ".F.")


def dropped(entities: Entities, name: str) -> None:
    """The face is there, but not in the shell."""
    number, shell = face(entities, name), all_of(entities, "CLOSED_SHELL")[0]
    entities[shell] = re.sub(rf"#{number}\b,?", "", entities[shell]).replace(",))", "))")


def opened(folder: Path) -> Sequence[str]:
    step(dropped)(folder)
    return ()


def solid_twice(entities: Entities) -> None:
    solid = all_of(entities, "MANIFOLD_SOLID_BREP")[0]
    shape = all_of(entities, "ADVANCED_BREP_SHAPE_REPRESENTATION")[0]
    again = add(entities, entities[solid])
    swap(entities, shape, f"#{solid})", f"#{solid},#{again})")


def turned(entities: Entities, name: str) -> None:
    """Both the face's sense and its bound: readers that do not repair see it inside out."""
    complement(entities, name)
    swap(entities, face(entities, name), ".T.", ".F.")


def two_volumes(entities: Entities) -> None:
    """A wrong claim before the right one."""
    number = next(n for n, said in entities.items() if "'volume measure'" in said)
    wrong = add(entities, entities[number])
    shift(entities, wrong, 1000.0)
    shape = next(n for n, said in entities.items() if said.startswith("REPRESENTATION('volume'"))
    swap(entities, shape, f"(#{number})", f"(#{wrong},#{number})")


def misnamed(entities: Entities) -> None:
    swap(entities, all_of(entities, "MANIFOLD_SOLID_BREP")[0], "'shell_a'", "'shell_b'")


def claim(words: str, by: float) -> Callable[[Entities], None]:
    def how(entities: Entities) -> None:
        shift(entities, next(n for n, said in entities.items() if f"'{words}'" in said), by)

    return how


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
        if (
            len(found := NUMBER.findall(entities[number])) == 3
            and abs(float(found[2]) - foot) < 1e-9
        ):
            shift(entities, number, -0.05, 2)


def back(entities: Entities) -> None:
    """The back 5 micrometres too far out."""
    shift(entities, down(entities, all_of(entities, "SURFACE_OF_REVOLUTION")[0], 0), 0.005)


def cut(data: bytes) -> bytes:
    return data[: len(data) // 2]


def cut_with_end(data: bytes) -> bytes:
    half = cut(data)
    return half[: half.rindex(b";\n") + 2] + part21.ENDSEC.encode() + b"\n"


def middle(old: bytes, new: bytes) -> Callable[[bytes], bytes]:
    """Replace the first of its kind in the second half of the file."""

    def how(data: bytes) -> bytes:
        at = data.index(old, len(data) // 2)
        return data[:at] + new + data[at + len(old) :]

    return how


def raw(how: Callable[[bytes], bytes]) -> Job:
    return lambda folder: change(folder, NAME, how) or ()


def unknown(name: str, job: Job, *words: str) -> Mutation:
    """A STEP file that cannot be measured: unknown, and no pass."""
    return Mutation(name, KIND, job, 1, ("step solid",), words, unknown=True)
