"""What the sheet of an order says in words and figures, by the record of the order."""

from collections import Counter
from collections.abc import Iterator, Sequence
from importlib.resources import files
from typing import Any

from tbcad.cad.drafting.sheet import TitleBlock
from tbcad.cad.formats.pdf import drawable
from tbcad.core.spec.csv_rows import read_toml
from tbcad.core.spec.design import Spec
from tbcad.mirror_limits.held import IN_STATISTICS, UNCERTAINTY_SHARE

FIGURE_HEAD = ("figure", "limit", "limit of 2 sigma", "chain, 2 sigma", "verdict")
ANY, WORDS = "any", "order_page.toml"


def title_block(record: dict[str, Any], spec: Spec) -> TitleBlock:
    """What the title block says."""
    named = [step["material"]["value"] for step in record["chain"]["steps"] if "material" in step]
    return TitleBlock(
        title=f"Order: shells by {record['chain']['name']}",
        design=f"{spec.name}, n = {spec.optics.n}",
        item="shell_a as drawn; shell_b mirrored at x = 0",
        quantity=len(record["samples"]["mirrors"]),
        material=named[-1] if named else "as agreed with the workshop",
        tolerances="of *_tolerances.step",
    )


def figure_rows(record: dict[str, Any]) -> list[tuple[str, ...]]:
    """Each figure with its limits and what the chain holds."""
    return [
        (
            f"{one['name']}, {one['unit']}",
            *(ANY if one[key] is None else f"{one[key]:.3g}" for key in ("limit", "statistics")),
            f"{one['chain']:.3g}",
            one["verdict"],
        )
        for one in record["chain"]["figures"]
    ]


def lines(
    record: dict[str, Any], spec: Spec, holes: Sequence[tuple[str, ...]]
) -> Iterator[tuple[str, str]]:
    """All that is told in words, heads and texts, from order_page.toml; holes are rows."""
    chain, ids = record["chain"], record["samples"]["mirrors"][0]
    fillet, mandrel = chain["figures"][-1], chain["mandrel_cutter_mm"] is not None
    in_statistics = any(one["verdict"] == IN_STATISTICS for one in chain["figures"])
    true = {"mandrel": mandrel, "no mandrel": not mandrel, "statistics": in_statistics}
    values = record | {
        "spec": spec,
        "allowed": ANY if fillet["limit"] is None else f"{fillet['limit']:.3g} {fillet['unit']}",
        "rounded": f"{fillet['chain']:.3g} {fillet['unit']}",
        "steps": [_step(k, step) for k, step in enumerate(chain["steps"], 1)],
        "rq_uncertainty": UNCERTAINTY_SHARE * record["finish"]["rq_nm"],
        "seat_uncertainty": UNCERTAINTY_SHARE * record["limits"]["seat_um"],
        "holes": ", ".join(
            f"{n} x Ø {size}" for size, n in Counter(row[1] for row in holes).items()
        ),
        "ids": " ".join(ids),
        "count": len(ids),
        "both": 2 * len(ids),
    }
    for line in read_toml(files("tbcad.drawings").joinpath(WORDS), WORDS, "words")["line"]:
        if true.get(line.get("when"), True):
            for k, item in enumerate(values[line["each"]] if "each" in line else [{}]):
                head = "" if k else line.get("head", "")
                yield head, drawable(line["text"].format(**(values | item)))


def _step(number: int, step: dict[str, Any]) -> dict[str, Any]:
    facts = [step[key]["value"] for key in ("material", "treatment") if key in step]
    return {"number": number, "words": ": ".join(filter(None, (step["title"], "; ".join(facts))))}
