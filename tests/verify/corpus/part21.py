"""STEP files as the text they are: numbered statements that can be changed."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from tests.verify.corpus.copies import change

Entities = dict[int, str]  # number -> what stands right of the equals sign
DATA, ENDSEC = "DATA;\n", "ENDSEC;\nEND-ISO-10303-21;"
STATEMENT = re.compile(r"#(\d+) ?= ?(.*)", re.S)
NUMBER = re.compile(r"-?\d+\.\d*(?:E[-+]?\d+)?")
LENGTHS = ("SPHERICAL_SURFACE(", "CYLINDRICAL_SURFACE(", "CIRCLE(", "ELLIPSE(")


def edit(folder: Path, name: str, how: Callable[[Entities], None]) -> None:
    """Change the entities of a STEP file."""

    def job(data: bytes) -> bytes:
        head, body, tail = split(data.decode())
        entities = parsed(body)
        before = dict(entities)
        how(entities)
        assert entities != before, "nothing was changed"
        return (head + text(entities) + tail).encode()

    change(folder, name, job)


def split(whole: str) -> tuple[str, str, str]:
    """What stands before the statements, the statements, and what stands after them."""
    head, data, rest = whole.partition(DATA)
    body, end, tail = rest.rpartition(ENDSEC)
    return head + data, body, end + tail


def parsed(body: str) -> Entities:
    """Statements by number, each on one line."""
    lines = [re.sub(r"\n *", "", line) for line in re.split(r";\s*\n", body) if line.strip()]
    matches = [STATEMENT.fullmatch(line.strip()) for line in lines]
    return {int(found[1]): found[2] for found in matches if found}


def text(entities: Entities) -> str:
    """One statement a line."""
    return "".join(f"#{number} = {said};\n" for number, said in entities.items())


def all_of(entities: Entities, kind: str) -> list[int]:
    """Numbers of all entities of a kind."""
    return [number for number, said in entities.items() if said.startswith(f"{kind}(")]


def face(entities: Entities, name: str) -> int:
    """The number of the face that bears a name."""
    return next(n for n in all_of(entities, "ADVANCED_FACE") if f"'{name}'" in entities[n])


def references(said: str) -> list[int]:
    """Numbers that a statement refers to, in its order."""
    return [int(number) for number in re.findall(r"#(\d+)", said)]


def down(entities: Entities, number: int, *steps: int) -> int:
    """Follow references: the first, second ... of each statement on the way."""
    for step in steps:
        number = references(entities[number])[step]
    return number


def swap(entities: Entities, number: int, old: str, new: str) -> None:
    """Replace a piece of one statement, which must have it."""
    assert old in entities[number], entities[number]
    entities[number] = entities[number].replace(old, new, 1)


def add(entities: Entities, said: str) -> int:
    """A further statement; its number."""
    number = max(entities) + 1
    entities[number] = said
    return number


def shift(entities: Entities, number: int, by: float, which: int = 0) -> None:
    """Add to one of the numbers in a statement."""
    found = list(NUMBER.finditer(entities[number]))[which]
    said = entities[number]
    value = float(found[0]) + by
    entities[number] = said[: found.start()] + f"{value:.15E}" + said[found.end() :]


def scale(entities: Entities, share: float) -> None:
    """All lengths, and what the file claims of itself, times a share."""
    powers = {"volume measure": 3, "surface area measure": 2}
    for number, said in entities.items():
        if said.startswith("CARTESIAN_POINT(") or said.startswith(LENGTHS):
            entities[number] = scaled(said, share)
        elif said.startswith("MEASURE_REPRESENTATION_ITEM("):
            power = next(power for words, power in powers.items() if words in said)
            entities[number] = scaled(said, share**power)


def scaled(said: str, share: float) -> str:
    """All real numbers of a statement times a share."""
    return NUMBER.sub(lambda found: f"{float(found[0]) * share:.15E}", said)
