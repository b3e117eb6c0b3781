"""Lines whose words are in TOML: tables with a text, and where wanted a head, when and each."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any


def told(
    lines: Iterable[Mapping[str, Any]], values: Mapping[str, Any]
) -> Iterator[tuple[str, str]]:
    """Heads and texts of lines, with values in their places {name}.

    A line with `when` is left out where that value is false, empty or None. With `each`, there is a
    line for each item of that list of mappings, whose values count too; the first has the head.
    """
    for line in lines:
        if "when" in line and not values[line["when"]]:
            continue
        for k, item in enumerate(values[line["each"]] if "each" in line else [{}]):
            yield "" if k else line.get("head", ""), line["text"].format(**{**values, **item})
