"""YAML, JSON and XML as mappings, lists and texts: bounded in depth, without references."""

import re
from collections import Counter
from typing import Any, TypeAlias
from xml.etree import ElementTree

import yaml

from tbcad.errors import InputError

Tree: TypeAlias = "dict[str, Tree] | list[Tree] | str"
LOADER = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
MAX_DEPTH = 20  # a list of Kalibr is four deep


def yaml_tree(text: str, name: str) -> Tree:
    """A document of YAML or JSON; every scalar is a text.

    Raises:
        InputError: it is none, is nested too deeply, or has references or a key twice.
    """
    if text.startswith("%YAML"):  # OpenCV writes "%YAML:1.0", which is no directive of YAML
        text = "\n" + text.partition("\n")[2]
    found: list[Tree] = []
    open_nodes: list[list[Tree]] = [found]
    try:
        for event in yaml.parse(text, Loader=LOADER):
            _take(event, open_nodes, name)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise InputError(f"{name}, line {line}: no YAML: {error.problem}: correct it") from None
    except (yaml.YAMLError, ValueError):
        raise InputError(f"{name} is no lens: it has characters that no text has") from None
    found = [document for document in found if document]  # rostopic ends each with ---
    if len(found) > 1:
        raise InputError(f"{name} has {len(found)} documents: keep that of the run's camera")
    return found[0] if found else ""


def _take(event: yaml.Event, open_nodes: list[list[Tree]], name: str) -> None:
    """Add an event of the parser to the node that is open."""
    if isinstance(event, yaml.AliasEvent):
        raise InputError(f"{name} has references (*{event.anchor:.40}): write what they stand for")
    if isinstance(event, yaml.ScalarEvent):
        open_nodes[-1].append(event.value)
    elif isinstance(event, yaml.CollectionStartEvent):
        if len(open_nodes) > MAX_DEPTH:
            raise InputError(f"{name} is nested too deeply for a lens: export it again")
        open_nodes.append([])
    elif isinstance(event, yaml.CollectionEndEvent):
        node = open_nodes.pop()
        mapping = isinstance(event, yaml.MappingEndEvent)
        open_nodes[-1].append(_mapping(node, name) if mapping else node)


def _mapping(node: list[Tree], name: str) -> Tree:
    keys = [key if isinstance(key, str) else "?" for key in node[::2]]
    key, count = next(iter(Counter(keys).most_common(1)), ("", 0))
    if count > 1:
        raise InputError(f"{name} has {key:.40} twice: remove one")
    return dict(zip(keys, node[1::2], strict=True))


def xml_tree(text: str, name: str) -> Tree:
    """A document of XML: elements and attributes by name, several words as a list.

    Raises:
        InputError: it is none, is nested too deeply, or has a document type or an element twice.
    """
    if re.search(r"<!(DOCTYPE|ENTITY)", text):
        raise InputError(f"{name} has a document type, which no lens has: remove it")
    try:
        root = ElementTree.fromstring(text.strip())
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError(f"{name} is no XML: {error}: correct it") from None
    return _element(root, name, 0)


def _element(element: ElementTree.Element, name: str, depth: int) -> Tree:
    if depth > MAX_DEPTH:
        raise InputError(f"{name} is nested too deeply for a lens: export it again")
    items: list[Any] = [(key, value) for key, value in element.items() if key != "type_id"]
    items += [(child.tag, _element(child, name, depth + 1)) for child in element]
    words = (element.text or "").split()
    several = len(words) > 1 or element.tag == "data"
    value: Tree = [*words] if several else " ".join(words)
    if not items:
        return value
    items += [(element.tag, value)] if value else []
    if all(key == "_" for key, _ in items):
        return [value for _, value in items]
    return _mapping([part for item in items for part in item], name)
