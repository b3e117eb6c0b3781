"""What the stages of a proof hand over, in one process or from another as lines of JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Protocol, TextIO

import numpy as np

from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.report.checks import Check
from tbcad_verify.types import Floats

Row = dict[str, Any]
PER_MIRROR = (
    "coverage_facet_mm",
    "coverage_fitted_mm",
    "centre_error_mm",
    "radius_error_mm",
    "pixels",
)


class ResultSink(Protocol):
    """Takes what the stages find, as they find it."""

    def stage(self, title: str) -> None:
        """A stage begins."""

    def checks(self, checks: Sequence[Check]) -> None:
        """What a stage measured."""

    def mirrors(self, columns: Mapping[str, Floats]) -> None:
        """Figures of every recorded mirror, columns of `PER_MIRROR`."""

    def bulk(self, part: str, bulk: MassProperties) -> None:
        """Volume, area, middle and box of one part's mesh."""

    def prints(self, rows: Sequence[Row]) -> None:
        """What making one part on several machines comes to."""

    def prototype(self, found: Row) -> None:
        """What is found of the prototype, ball by ball and stop by stop."""


@dataclass
class Results:
    """Keeps everything, and tells of each stage."""

    progress: Callable[[str], None]
    found: list[Check] = field(default_factory=list)
    columns: dict[str, Floats] = field(default_factory=dict)
    bulks: dict[str, MassProperties] = field(default_factory=dict)
    printing: list[Row] = field(default_factory=list)
    machine: Row | None = None
    stages: list[str] = field(default_factory=list)

    def stage(self, title: str) -> None:
        """Note and tell the stage."""
        self.stages.append(title)
        self.progress(title)

    def checks(self, checks: Sequence[Check]) -> None:
        """Keep checks in their order."""
        self.found.extend(checks)

    def mirrors(self, columns: Mapping[str, Floats]) -> None:
        """Keep the columns that came."""
        self.columns.update(columns)

    def bulk(self, part: str, bulk: MassProperties) -> None:
        """Keep one part's figures."""
        self.bulks[part] = bulk

    def prints(self, rows: Sequence[Row]) -> None:
        """Keep rows in their order."""
        self.printing.extend(rows)

    def prototype(self, found: Row) -> None:
        """Keep it."""
        self.machine = found


class JsonLinesSink:
    """Writes everything as one JSON object a line, for `replay` in another process."""

    def __init__(self, stream: TextIO) -> None:
        """Write to a stream that nobody else writes to."""
        self._stream = stream

    def stage(self, title: str) -> None:
        """Send it."""
        self.send({"stage": title})

    def checks(self, checks: Sequence[Check]) -> None:
        """Send them."""
        self.send({"checks": [asdict(check) for check in checks]})

    def mirrors(self, columns: Mapping[str, Floats]) -> None:
        """Send them; NaN is JSON that Python understands."""
        self.send({"mirrors": {name: values.tolist() for name, values in columns.items()}})

    def bulk(self, part: str, bulk: MassProperties) -> None:
        """Send it."""
        self.send({"part": part, "bulk": asdict(bulk)})

    def prints(self, rows: Sequence[Row]) -> None:
        """Send them."""
        self.send({"prints": list(rows)})

    def prototype(self, found: Row) -> None:
        """Send it."""
        self.send({"prototype": found})

    def send(self, message: Mapping[str, Any]) -> None:
        """One line, at once."""
        self._stream.write(json.dumps(message) + "\n")
        self._stream.flush()


def replay(line: str, taker: ResultSink) -> bool:
    """Hand one line on; whether it was the last.

    Raises:
        BadExport: the other process refused the export.
    """
    message = json.loads(line)
    if "refused" in message:
        raise BadExport(message["refused"])
    if "stage" in message:
        taker.stage(message["stage"])
    elif "checks" in message:
        taker.checks([Check(**row) for row in message["checks"]])
    elif "mirrors" in message:
        taker.mirrors({name: np.array(rows) for name, rows in message["mirrors"].items()})
    elif "bulk" in message:
        taker.bulk(message["part"], MassProperties(**message["bulk"]))
    elif "prints" in message:
        taker.prints(message["prints"])
    elif "prototype" in message:
        taker.prototype(message["prototype"])
    return "done" in message
