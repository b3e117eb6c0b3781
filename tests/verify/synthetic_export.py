"""A small export made without tbcad: spheres on the two half ellipsoids, cut and meshed by hand.

Every cell is found by brute force (all pairs of cutting planes), so it owes nothing to the code
under test nor to tbcad. Slow and simple on purpose; a few dozen mirrors.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

SAMPLE = Path(__file__).parents[2] / "docs" / "sample" / "design.json"  # as tbcad wrote it
# Of keys whose values tbcad chooses, by section of the prototype.
CHOSEN: dict[str, dict[str, Any]] = {
    "": {
        "k": 4,
        "auto_direction_max_deg": 3.5,
        "auto_direction_median_deg": 1.5,
        "largest_ball_mm": 60.0,
        "ball_wall_mm": 3.0,
        "post_diameter_mm": 20.0,
        "camera_diameter_mm": 60.0,
    },
    "base": {"pad_angle_deg": 50.0, "hold": "magnet", "hub_boss_mm": 20.0},
    "stage": {"top_mm": -20.0, "disc_mm": 17.0, "object_diameter_mm": 40.0, "leds_mm": []},
    "light": {"lamp_z_mm": 0.0, "upper": False, "shroud": False},
    "frame": {
        "floor_mm": -230.0,
        "camera_axis_mm": 30.0,
        "camera_back_mm": 100.0,
        "camera_screw_mm": 50.0,
    },
}
MANIFEST_SCHEMA = "tbcad-manifest/1"
PIN = np.array([100.0, 0.0, -100.0])
B = 100.0
FOOT = -12.0
HEAD = 80  # bytes of an STL before the number of its facets
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
COLUMNS = (
    "id,camera,ux,uy,uz,px,py,pz,nx,ny,nz,cx,cy,cz,radius_mm,size_mm,theta0_deg,theta1_deg,"
    "polar_deg,azimuth_deg,cell_area_mm2,coverage_mm"
)


@dataclass
class Design:
    """What to make; the mesh lacks mirrors with the numbers `without`."""

    n: int = 4
    radius: float = 55.0  # of the nearest mirrors, mm; it grows with the distance squared
    target: float = 40.0
    coating: float = 0.0
    flat: bool = False
    aim: float = 3.0  # of mirrors on the seam, beyond it, mm; planar ones need none
    width: int = 260
    height: int = 194
    hfov: float = 89.0
    arc: int = 12
    rings: int = 4
    strip: float = 3e-3
    without: tuple[int, ...] = ()


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


@cache
def vertices(n: int) -> np.ndarray:
    """Geodesic vertices for n = 1 or a power of two: midpoints, pushed out, again."""
    phi = (1 + 5**0.5) / 2
    ico = [np.roll([0, s, t * phi], k) for k in range(3) for s in (1, -1) for t in (1, -1)]
    faces = [
        tuple(unit(np.array(f)))
        for f in combinations(ico, 3)
        if max(np.linalg.norm(p - q) for p, q in combinations(f, 2)) < 2.1
    ]
    for _ in range(n.bit_length() - 1):
        faces = [t for f in faces for t in quartered(*f)]
    points = np.array(faces).reshape(-1, 3)
    keep = np.unique(np.round(points, 8) + 0.0, axis=0, return_index=True)[1]
    points = points[np.sort(keep)]
    points.flags.writeable = False
    return points


def quartered(a, b, c):
    ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
    return (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)


def poses(design: Design) -> list[dict[str, Any]]:
    """Mirrors of camera a, numbered from 1."""
    c = np.linalg.norm(PIN) / 2
    a = np.hypot(B, c)
    u = vertices(design.n)
    u = u[(u[:, 2] > -1e-9) & (u[:, 0] > -1e-9)]
    u[np.abs(u) < 1e-12] = 0.0
    u = u[np.lexsort((u[:, 1], u[:, 0], -u[:, 2]))]
    rho = B**2 / (a - c * (u @ unit(PIN)))
    apex = rho[:, None] * u
    beyond = np.where((u[:, 0] == 0) & (not design.flat), design.aim, 0.0)
    normal = unit(unit(PIN - apex) + unit(beyond[:, None] * [-1.0, 0, 0] - apex))
    r = design.radius * (rho / rho.min()) ** 2
    return [
        {
            "number": k + 1,
            "u": u[k],
            "p": apex[k],
            "n": normal[k],
            "c": apex[k] - r[k] * normal[k],
            "r": float(r[k]),
            "figures": figures(design, u[k]),
        }
        for k in range(len(u))
    ]


def figures(design: Design, u: np.ndarray) -> dict[str, float]:
    """What DESIGN.md section 2 calls l, theta_0, theta_1, polar angle and azimuth of a direction.

    theta_0 is the least angle at the virtual camera between its axis and a plane through it and
    the line in which the mirror's tangent plane meets that of any other vertex.
    """
    c, every = np.linalg.norm(PIN) / 2, vertices(design.n)
    a, w = np.hypot(B, c), unit(PIN)
    apex = every * (B**2 / (a - c * (every @ w)))[:, None]
    normal = unit(unit(PIN - apex) - every)
    own = int((every @ u).argmax())
    others = every @ u < 1 - 1e-9
    mine, theirs = np.broadcast_to(normal[own], normal[others].shape), normal[others]
    edge = np.cross(mine, theirs)
    heights = np.stack([mine @ apex[own], (theirs * apex[others]).sum(1), 0 * edge[:, 0]], axis=1)
    meet = np.linalg.solve(np.stack([mine, theirs, edge], axis=1), heights[:, :, None])[:, :, 0]
    least = np.arcsin(np.abs(unit(np.cross(meet - 2 * a * u, edge)) @ u)).min()
    rho = np.linalg.norm(apex[own])
    width = (2 * a - rho) * np.tan(least)
    zero = unit(np.array([0, 0, 1.0]) - w[2] * w)
    degrees = np.degrees(
        [
            least,
            np.arctan2(design.target / 2 - width, rho),
            np.arccos(u @ w),
            np.arctan2(u @ np.cross(w, zero), u @ zero),
        ]
    )
    keys = ("theta0_deg", "theta1_deg", "polar_deg", "azimuth_deg")
    return {"size_mm": float(width), **dict(zip(keys, degrees.tolist(), strict=True))}


class Cells:
    """The cells of one camera's mirrors as meshed: modelled surfaces, without the coat."""

    def __init__(self, design: Design, record: list[dict[str, Any]]) -> None:
        self.design = design
        self.mirrors = [m for m in record if m["number"] not in design.without]
        self.spheres = [self._modelled(m) for m in self.mirrors]
        self.points: list[np.ndarray] = []
        self.index: dict[tuple[float, ...], int] = {}
        self.arcs: dict[frozenset[int], list[int]] = {}
        self.faces: list[tuple[int, int, int]] = []
        self.face_mirror: list[int] = []
        self.outlines: dict[int, list[tuple[np.ndarray, int]]] = {}
        for k in range(len(self.mirrors)):
            self._mesh(k)

    def _modelled(self, m):
        coat = self.design.coating
        if self.design.flat:
            return m["p"] - coat * m["n"], None, m["n"]
        return m["c"], m["r"] - coat, m["n"]

    def planes(self, k):
        """Half spaces a.x >= b that bound cell k: neighbours by number, then seam -1, foot -2."""
        centre, radius, _ = self.spheres[k]
        cuts = []
        for j, (c, r, n) in enumerate(self.spheres):
            near = self.mirrors[k]["u"] @ self.mirrors[j]["u"] > np.cos(3.2 / self.design.n)
            if j == k or not near:
                continue
            if radius is None:
                cuts.append((j, n, n @ c))
            else:
                b = centre @ centre - radius**2 - c @ c + r**2
                cuts.append((j, 2 * (centre - c), b))
        cuts.append((-1, np.array([1.0, 0, 0]), 0.0))
        cuts.append((-2, np.array([0, 0, 1.0]), FOOT))
        return cuts

    def corners(self, k):
        cuts = self.planes(k)
        centre, radius, normal = self.spheres[k]
        found: list[np.ndarray] = []
        for (_, a, b), (_, c, d) in combinations(cuts, 2):
            for x in self._meet(centre, radius, normal, a, b, c, d):
                inside = all((x @ p - q) / np.linalg.norm(p) > -1e-7 for _, p, q in cuts)
                new = all(np.linalg.norm(x - y) > 1e-6 for y in found)
                if inside and new:
                    found.append(x)
        return found, cuts

    @staticmethod
    def _meet(centre, radius, normal, a, b, c, d):
        if radius is None:
            matrix = np.array([a, c, normal])
            if abs(np.linalg.det(matrix)) < 1e-9:
                return []
            return [np.linalg.solve(matrix, [b, d, normal @ centre])]
        line = np.cross(a, c)
        if np.linalg.norm(line) < 1e-9:
            return []
        base = np.linalg.lstsq(
            np.array([a, c]), np.array([b, d]) - [a @ centre, c @ centre], rcond=None
        )[0]
        rest = radius**2 - base @ base
        if rest < 0:
            return []
        line = unit(line)
        points = [centre + base + s * np.sqrt(rest) * line for s in (1, -1)]
        return [x for x in points if (x - centre) @ normal > 0.5 * radius]

    def _vertex(self, x):
        key = tuple(np.round(x, 6) + 0.0)
        if key not in self.index:
            self.index[key] = len(self.points)
            self.points.append(x)
        return self.index[key]

    def _arc(self, k, x, y, cut):
        ends = (self._vertex(x), self._vertex(y))
        key = frozenset(ends)
        if key not in self.arcs:
            inner = self._between(k, self.points[ends[0]], self.points[ends[1]], cut)
            self.arcs[key] = [ends[0], *(self._new(p) for p in inner), ends[1]]
        found = self.arcs[key]
        return found if found[0] == ends[0] else found[::-1]

    def _new(self, x):
        self.points.append(x)
        return len(self.points) - 1

    def _between(self, k, x, y, cut):
        centre, radius, _ = self.spheres[k]
        steps = np.arange(1, self.design.arc) / self.design.arc
        if radius is None:
            return [x + t * (y - x) for t in steps]
        _, a, b = cut
        middle = centre + (b - a @ centre) / (a @ a) * a
        p, q = x - middle, y - middle
        angle = np.arccos(np.clip(unit(p) @ unit(q), -1, 1))
        out = [
            middle + (np.sin((1 - t) * angle) * p + np.sin(t * angle) * q) / np.sin(angle)
            for t in steps
        ]
        flat = {-1: 0, -2: 2}.get(cut[0])
        for point in out:
            if flat is not None:
                point[flat] = (0.0, 0.0, FOOT)[flat]
        return out

    def _mesh(self, k):
        corners, cuts = self.corners(k)
        normal = self.spheres[k][2]
        middle = self._onto(k, np.mean(corners, axis=0))
        e = unit(np.cross(normal, [0.3, 0.5, 0.8]))
        f = np.cross(normal, e)
        order = np.argsort([np.arctan2((x - middle) @ f, (x - middle) @ e) for x in corners])
        corners = [corners[j] for j in order]
        loop: list[int] = []
        self.outlines[k] = []
        for x, y in zip(corners, [*corners[1:], corners[0]], strict=True):
            on = [
                c
                for c in cuts
                if max(abs(c[1] @ z - c[2]) / np.linalg.norm(c[1]) for z in (x, y)) < 1e-6
            ]
            arc = self._arc(k, x, y, on[0])
            self.outlines[k] += [(self.points[v], on[0][0]) for v in arc]
            loop += arc[:-1]
        fractions = [self.design.strip, *(np.arange(1, self.design.rings) / self.design.rings)]
        before = loop
        for fraction in fractions:
            steps = [self.points[v] + fraction * (middle - self.points[v]) for v in loop]
            ring = [self._new(self._onto(k, x)) for x in steps]
            for j, m in enumerate([*range(1, len(loop)), 0]):
                self.faces += [(before[j], before[m], ring[m]), (before[j], ring[m], ring[j])]
            before = ring
        hub = self._new(middle)
        self.faces += [(v, w, hub) for v, w in zip(before, [*before[1:], before[0]], strict=True)]
        self.face_mirror += [k] * (len(self.faces) - len(self.face_mirror))

    def _onto(self, k, x):
        centre, radius, normal = self.spheres[k]
        if radius is None:
            return x - ((x - centre) @ normal) * normal
        return centre + radius * unit(x - centre)


def solid(cells: Cells, thickness: float = 1.1) -> np.ndarray:
    """(F, 3, 3) float32 facets: the cells, the same scaled outward and turned, and the walls."""
    front, count = np.array(cells.faces), len(cells.points)
    points = np.array(cells.points)
    hub = np.array([0, 0, FOOT])  # scaling about it leaves the seam and foot walls planar
    points = np.vstack([points, hub + (points - hub) * thickness])
    edges = {(f[i], f[(i + 1) % 3]) for f in front.tolist() for i in range(3)}
    rim = [(a, b) for a, b in edges if (b, a) not in edges]
    walls = [t for a, b in sorted(rim) for t in ((b, a, a + count), (b, a + count, b + count))]
    faces = np.vstack([front, front[:, ::-1] + count, walls])
    return points[faces].astype(np.float32)


def stl(facets: np.ndarray, turn: int = 1) -> bytes:
    """A binary STL; `turn` -1 stores the normals against the corners' order."""
    table = np.zeros(len(facets), FACET)
    table["normal"], table["corners"] = turn * normals(facets), facets
    return bytes(HEAD) + np.uint32(len(facets)).tobytes() + table.tobytes()


def normals(facets: np.ndarray) -> np.ndarray:
    """(F, 3) unit normals; zero where a facet has no area."""
    x = facets.astype(np.float64)
    across = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    length = np.linalg.norm(across, axis=1, keepdims=True)
    return across / np.where(length > 0, length, 1)


def facets_of(path: Path) -> np.ndarray:
    """(F, 3, 3) corners in a binary STL."""
    data = path.read_bytes()[HEAD + 4 :]
    return np.frombuffer(data, FACET)["corners"].copy()


def mirrored(facets: np.ndarray) -> np.ndarray:
    return (facets * np.array([-1, 1, 1], np.float32))[:, ::-1]


def rows(design: Design, record: list[dict[str, Any]]) -> list[dict[str, Any]]:
    out = []
    for camera, sign in (("a", 1.0), ("b", -1.0)):
        for m in record:
            s = np.array([sign, 1, 1])
            flat = design.flat
            vectors = {"u": m["u"], "p": m["p"], "n": m["n"], "c": m["c"]}
            row: dict[str, Any] = {"id": f"{camera}{m['number']:04d}", "camera": camera}
            for name, v in vectors.items():
                for axis, value in zip("xyz", (v * s + 0.0).tolist(), strict=True):
                    row[name + axis] = None if flat and name == "c" else value
            row["radius_mm"] = None if flat else m["r"]
            row |= m["figures"]
            row["azimuth_deg"] *= sign
            row |= {"cell_area_mm2": 1.0, "coverage_mm": 1.0}
            out.append(row)
    return out


def document(design: Design) -> dict[str, Any]:
    sensor = {"width_px": design.width, "height_px": design.height, "hfov_deg": design.hfov}
    cameras = [
        {
            "id": name,
            "pinhole_mm": [s * 100.0, 0.0, -100.0],
            "forward": unit(np.array([-0.19492490142017893 * s, 0.0, 0.980818170104089])).tolist(),
            "right": [0.0, -s, 0.0],
            **sensor,
        }
        for name, s in (("a", 1.0), ("b", -1.0))
    ]
    return {
        "schema": "tbcad-design/2",
        "spec": spec(design, sensor),
        "target_mm": design.target,
        "coating_mm": design.coating,
        "foot_z_mm": FOOT,
        "cameras": cameras,
        "parts": [{"name": f"shell_{c}", "camera": c, "stl": f"shell_{c}.stl"} for c in ("a", "b")],
        "mirrors": "mirrors.csv",
    }


def spec(design: Design, sensor: dict[str, Any]) -> dict[str, Any]:
    """Every key, with the values of the committed sample where this design has none of its own."""
    value: dict[str, Any] = json.loads(SAMPLE.read_text(encoding="utf-8"))["spec"]
    value["optics"] = {
        "n": design.n,
        "capture_diameter_mm": design.target,
        "camera_mm": [100.0, 0.0, -100.0],
        "semi_minor_mm": B,
    }
    value["camera"] = sensor
    value["printer"]["bed_mm"] = [300.0, 300.0, 300.0]
    for section, chosen in CHOSEN.items():
        (value["prototype"][section] if section else value["prototype"]).update(chosen)
    value["mirrors"] |= {"radius_rule": "traced"}
    value["mesh"] |= {"structure_error_mm": 0.02}
    value["mirrors"]["coating_um"] = 1000 * design.coating
    return value


def write(folder: Path, files: dict[str, bytes]) -> Path:
    """Write files and a manifest that lists them."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return sign(folder, list(files))


def sign(folder: Path, names: Iterable[str] | None = None) -> Path:
    """Write a manifest that is right for what is there now."""
    entries = {}
    for name in names or sorted(
        {path.name for path in folder.iterdir()} - {"manifest.json", "verify.json"}
    ):
        data = (folder / name).read_bytes()
        entries[name] = {"sha256": hashlib.sha256(data).hexdigest(), "size": len(data)}
    (folder / "manifest.json").write_text(json.dumps({"schema": MANIFEST_SCHEMA, "files": entries}))
    return folder


def csv_bytes(columns: str, rows: Iterable[Sequence[object]]) -> bytes:
    """A table with its heading; None is an empty cell, floats keep all their digits."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns.split(","))
    writer.writerows(rows)
    return stream.getvalue().encode()


def table(mirrors: list[dict[str, Any]]) -> bytes:
    return csv_bytes(COLUMNS, [[mirror[name] for name in COLUMNS.split(",")] for mirror in mirrors])


def export(folder: Path, design: Design) -> tuple[Path, Cells]:
    """Write a whole export; also the cells of camera a, for oracles."""
    record = poses(design)
    cells = Cells(design, record)
    a = solid(cells)
    mirrors = rows(design, record)
    files = {
        "design.json": json.dumps(document(design), indent=1).encode(),
        "mirrors.csv": table(mirrors),
        "camera.json": b"for people",
        "shell_a.stl": stl(a),
        "shell_b.stl": stl(mirrored(a)),
    }
    return write(folder, files), cells
