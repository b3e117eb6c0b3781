"""The class Design: mirrors of both cameras, and the solids that follow from them."""

from typing import TYPE_CHECKING, Literal

from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.errors import InputError

if TYPE_CHECKING:
    from build123d import Part
    from pandas import DataFrame


class Design(MirrorDesign):
    """The mirrors of both cameras, computed from a spec, and the solids that follow from them.

    Attributes:
        spec: what was asked for.
        arrays: camera a's mirrors and camera b's, as arrays over mirrors.
    """

    def __repr__(self) -> str:
        """Return name, number of mirrors and minimum coverage."""
        first, second = self.arrays
        return (
            f"<Design {self.spec.name!r}: n = {self.spec.optics.n}, "
            f"{len(first)} + {len(second)} mirrors, "
            f"minimum coverage {first.coverage.min():.2f} mm>"
        )

    def _repr_html_(self) -> str:
        """HTML for notebooks: main figures, and the directions of all mirrors from above."""
        from tbcad.core.mirrors.record import hemisphere_map

        radius = [array.mirrors.radius for array in self.arrays]
        span = f"{min(r.min() for r in radius):.1f} to {max(r.max() for r in radius):.1f} mm"
        rows = {
            "subdivision n": self.spec.optics.n,
            "mirrors": " + ".join(str(len(array)) for array in self.arrays),
            "radius": "planar" if "nan" in span else f"{span} (dark: small)",
            "minimum coverage": f"{min(array.coverage.min() for array in self.arrays):.2f} mm",
        }
        cells = "".join(f"<tr><th>{name}</th><td>{value}</td></tr>" for name, value in rows.items())
        table = f"<table><caption>{self.spec.name}</caption>{cells}</table>"
        return f"<div>{table}{hemisphere_map(self.arrays)}</div>"

    def to_dataframe(self) -> "DataFrame":
        """Return a pandas table with a row for each mirror, indexed by id: columns of mirrors.csv.

        Raises:
            InputError: pandas is not installed.
        """
        from tbcad.core.mirrors.record import mirror_rows

        try:
            from pandas import DataFrame
        except ImportError as error:
            raise InputError("a table needs pandas: pip install pandas") from error
        rows = [row for array in self.arrays for row in mirror_rows(array)]
        return DataFrame(rows).set_index("id")

    def shell(self, camera: Literal["a", "b"] = "a") -> "Part":
        """Return one camera's shell as a build123d part: mm, frame of the design, z up.

        Raises:
            SpecError: flanges or holes do not fit; it says what to change.
            InvalidSolidError: the CAD kernel finds the solid invalid, which is a fault of tbcad.
        """
        from tbcad.cad.kernel.solids import as_part, one_solid
        from tbcad.shell.files import camera_solid

        solid = camera_solid(self, self._array(camera))
        return as_part(solid.name, one_solid(solid.name, solid.shape))

    def mandrel(self, camera: Literal["a", "b"] = "a") -> "Part":
        """Return the negative of one camera's shell as a build123d part, in the same frame.

        Raises:
            SpecError: its holes do not fit; it says what to change.
            InvalidSolidError: the CAD kernel finds the solid invalid, which is a fault of tbcad.
        """
        from tbcad.cad.kernel.solids import as_part, one_solid
        from tbcad.shell.files import mandrel_solid

        solid = mandrel_solid(self, self._array(camera))
        return as_part(solid.name, one_solid(solid.name, solid.shape))

    def _array(self, camera: str) -> MirrorArray:
        if camera not in ("a", "b"):
            raise InputError(f"there is no camera {camera!r}: allowed are 'a' and 'b'")
        return self.arrays["ab".index(camera)]

    def printed_parts(self) -> "dict[str, Part]":
        """Return the printed parts of the prototype by name, as they are assembled, base angle 0.

        Raises:
            SpecError: the prototype cannot be laid out; it says what to change.
            InvalidSolidError: the CAD kernel fails, which is a fault of tbcad.
        """
        from tbcad.cad.kernel.solids import as_part
        from tbcad.prototype.arrangement import arrangements
        from tbcad.prototype.model import build_prototype_model

        return {
            printed.name: as_part(printed.name, printed.solid.shape)
            for printed in build_prototype_model(arrangements(self)).printed
        }
