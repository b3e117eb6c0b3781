"""What the paper states, as far as it is known to us: data in paper.csv, beside this module."""

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files


@dataclass(frozen=True)
class Claim:
    """A figure of the paper.

    Attributes:
        where: figure, table or section.
        text: what is claimed.
        value: the figure.
    """

    where: str
    text: str
    value: float


@cache
def claims() -> dict[str, Claim]:
    """All claims known, by their key."""
    text = (files("tbcad.simulate.study") / "paper.csv").read_text(encoding="utf-8")
    return {
        row["key"]: Claim(row["where"], row["claim"], float(row["value"]))
        for row in csv.DictReader(text.splitlines())
    }


def claimed(key: str) -> float:
    """The paper's figure of one claim."""
    return claims()[key].value
