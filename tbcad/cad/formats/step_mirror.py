"""The mirror image in the plane x = 0 of a STEP file with one solid, statement for statement.

Curves keep their parameters, and so edges their ends and directions: the axis about which a circle
turns is turned over. Loops are passed the other way round, since left and right change. Surfaces
keep their normals, but an extrusion's is a product of two vectors, which a reflection turns over.
Numbers keep all their digits.
"""

import re
from collections.abc import Mapping

SOLID = "MANIFOLD_SOLID_BREP"  # what stands before it describes the product
STATEMENT = re.compile(r"#(\d+) = (\w+)\(([^;]*)\);")
REFERENCE = re.compile(r"#(\d+)")
QUOTED = re.compile(r"'([^']*)'")
FIRST_NUMBER = re.compile(r"(?<=\()(\s*)([-\d.][^,]*)")
SECOND_NUMBER = re.compile(r"(?<=,)(\s*)([-\d.][^,]*)(?=,)")
LAST_NUMBER = re.compile(r"(?<=,)(\s*)([-\d.][^,)]*)(?=\s*\)\s*$)")
TURNING = ("CIRCLE", "ELLIPSE")  # curves about the axis of a placement
EXTRUSION = "SURFACE_OF_LINEAR_EXTRUSION"
SENSES = {".T.": ".F.", ".F.": ".T."}
# Geometry whose normals or places depend on more than the points and directions in it.
UNKNOWN = re.compile(r"\b(?:B_SPLINE_SURFACE|OFFSET_|PCURVE|ITEM_DEFINED_TRANSFORMATION)\w*")


class NoMirrorImageError(ValueError):
    """A file has geometry for which there is no rule here."""


def mirrored_step(text: str, names: Mapping[str, str]) -> str:
    """The text of a file, as the kernel writes one solid without pcurves, mirrored.

    Names become those given for them, others stay. NoMirrorImageError if the solid has geometry
    that the rules here do not reflect.
    """
    if unknown := UNKNOWN.search(text):
        raise NoMirrorImageError(f"no rule for the mirror image of {unknown[0]}")
    statements = {m[1]: (m[2], m[3]) for m in STATEMENT.finditer(text)}
    axes = _axes(statements)
    extruded = {number for number, (kind, _) in statements.items() if kind == EXTRUSION}

    def reflected(statement: re.Match[str]) -> str:
        number, kind, inside = statement.groups()
        return f"#{number} = {kind}({_reflected(kind, inside, number in axes, extruded)});"

    start = text.index(f"= {SOLID}(")
    text = text[:start] + STATEMENT.sub(reflected, text[start:])
    return QUOTED.sub(lambda quoted: f"'{names.get(quoted[1], quoted[1])}'", text)


def _axes(statements: Mapping[str, tuple[str, str]]) -> set[str]:
    """Numbers of the directions about which circles and ellipses turn."""
    curves = [inside for kind, inside in statements.values() if kind in TURNING]
    places = [REFERENCE.findall(inside)[0] for inside in curves]
    return {REFERENCE.findall(statements[place][1])[1] for place in places}


def _reflected(kind: str, inside: str, axis: bool, extruded: set[str]) -> str:
    """The parameters of one statement; `axis`: it is the axis of a curve."""
    match kind:
        case "DIRECTION" if axis:
            return LAST_NUMBER.sub(_negative, SECOND_NUMBER.sub(_negative, inside, 1), 1)
        case "CARTESIAN_POINT" | "DIRECTION":
            return FIRST_NUMBER.sub(_negative, inside, 1)
        case "EDGE_LOOP":
            edges = reversed(REFERENCE.findall(inside))
            return REFERENCE.sub(lambda _: f"#{next(edges)}", inside)
        case "ADVANCED_FACE" if REFERENCE.findall(inside)[-1] not in extruded:
            return inside
        case "ORIENTED_EDGE" | "ADVANCED_FACE":
            return _other_sense(inside)
    return inside


def _negative(number: re.Match[str]) -> str:
    blank, digits = number.groups()
    if not float(digits):
        return f"{blank}0."
    return f"{blank}{digits[1:]}" if digits.startswith("-") else f"{blank}-{digits}"


def _other_sense(inside: str) -> str:
    """A sense stands last."""
    head, sense = inside[:-3], inside[-3:]
    return head + SENSES[sense]
