"""Ray casting: Embree finds the facet that a ray meets first; colour and light are ours."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import dot, facet_vectors, unit
from tbcad.core.optics.reflection import reflect
from tbcad.light.simulate.parallel import over_chunks
from tbcad.light.simulate.scene.highlights import Gloss
from tbcad.light.simulate.scene.lamps import PointLights, Spots, lamp_light
from tbcad.light.simulate.scene.object import SceneObject, pattern
from tbcad.light.simulate.scene.rays import meets_sphere
from tbcad.types import Bools, Bytes, Colours, Floats, Ints

# Matt surfaces under two lamps and a bright sky, fixed to the object: light that leaves a point is
# the same in all directions, as light-field rendering assumes. No cast shadows.
LAMPS = np.array([[0.48, 0.36, 0.8], [-0.6, 0.64, 0.48]])
LAMP_LIGHT = np.array([0.55, 0.2])
SKY_LIGHT = 0.35
BACKGROUND = 0
# Of glossy surfaces: Phong's exponent, half the highlight's light within 11 degrees of its middle.
GLOSS_EXPONENT = 40
RAYS_PER_CHUNK = 1 << 15


@dataclass(frozen=True)
class Scene:
    """An object ready for ray casting from several threads."""

    subject: SceneObject  # the object
    embree: Any  # its facets, committed; queries release the interpreter's lock
    shade: Floats  # light at each corner, 0 to 1, on the side of its normal and behind it, (v, 2)
    radius: float  # of the sphere about the origin that holds it, mm
    # share of the lamps' light in highlights, which move with the viewpoint; 0: matt
    gloss: float = 0.0
    # in place of all that light, with cast shadows; None: as `shade` says
    lamps: PointLights | None = None
    # how its microfacets reflect lamps; None: it is matt
    microfacets: Gloss | None = None
    # facets of black bodies before it, as an Embree scene; None: nothing is before it
    screen: Any | None = None


@dataclass(frozen=True)
class RayHits:
    """Points that n rays see."""

    colour: Colours  # red, green, blue, 0 to 255, (n, 3), float32; the background where nothing is
    depth: Floats  # mm along the ray, infinite where nothing is, (n,)


def embree_scene(points: NDArray[Any], faces: NDArray[Any] | None = None) -> Any:
    """A scene of facets, ready for queries from several threads, which release the lock.

    Of corners (v, 3), mm, and faces (f, 3); or, without faces, of facets' corners (f, 3, 3).
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    corners = points.astype(np.float32)
    if faces is None:
        TriangleMesh(scene, corners)
    else:
        TriangleMesh(scene, corners, faces.astype(np.int32))
    one = np.ones((1, 3), dtype=np.float32)
    scene.run(one, one)  # the first call commits
    return scene


def prepared_scene(subject: SceneObject) -> Scene:
    """Put an object into Embree and light it, unless it brings its own light."""
    embree = embree_scene(subject.points, subject.faces)
    if subject.light is not None:
        return Scene(subject, embree, subject.light, subject.radius)
    return Scene(subject, embree, both_sides(built_in_shade, subject.normals), subject.radius)


def both_sides(light: Callable[[Floats], Floats], normals: Floats) -> Floats:
    """Light on surfaces with unit normals (v, 3), and on their backs, (v, 2)."""
    return np.column_stack([light(normals), light(-normals)])


def built_in_shade(normals: Floats) -> Floats:
    """The built-in light on surfaces with unit normals (v, 3), 0 to 1, (v,)."""
    lit = np.maximum(normals @ LAMPS.T, 0) @ LAMP_LIGHT
    return np.asarray(np.minimum(lit + sky_light(normals), 1.0))


def sky_light(normals: Floats) -> Floats:
    """The part of it that has no lamp, (v,)."""
    return np.asarray(SKY_LIGHT * (0.75 + 0.25 * normals[:, 2]))


@dataclass(frozen=True)
class SurfaceHits:
    """Where rays meet the object first."""

    rows: Ints  # numbers of the rays that do, ascending, (k,)
    depth: Floats  # mm along them, (k,)
    facet: Ints  # (k,)
    weight: Floats  # barycentric, of the facet's corners, (k, 3)
    direction: Floats  # unit vectors of the rays: light is that of the side that they meet, (k, 3)

    def albedo(self, subject: SceneObject) -> Floats:
        """Colours (k, 3), 0 to 1."""
        return _albedo(subject, self.facet, self.weight)

    def facet_normals(self, subject: SceneObject) -> Floats:
        """Unit normals (k, 3) of the facets, on the side that the rays meet."""
        across = unit(facet_vectors(subject.points[subject.faces[self.facet]]))
        return np.where(dot(across, self.direction)[:, None] > 0, -across, across)

    def behind(self, subject: SceneObject, facet_normals: Floats) -> Bools:
        """Which normals of the facets' corners (k, 3) are behind the side that the rays meet."""
        corners = subject.normals[subject.faces[self.facet]]
        return np.asarray(np.einsum("nkx,nx->nk", corners, facet_normals) < 0)

    def normals(self, subject: SceneObject) -> Floats:
        """Unit normals (k, 3) of the smooth surface, on the side that the rays meet."""
        return self._smooth(subject, self.facet_normals(subject))

    def _smooth(self, subject: SceneObject, facet_normals: Floats) -> Floats:
        weight = np.where(self.behind(subject, facet_normals), -self.weight, self.weight)
        return unit(np.einsum("nk,nkx->nx", weight, subject.normals[subject.faces[self.facet]]))

    def spots(self, subject: SceneObject) -> Spots:
        """Places and normals of the surface."""
        corners, facet = subject.points[subject.faces[self.facet]], self.facet_normals(subject)
        place = np.einsum("nk,nkx->nx", self.weight, corners)
        return Spots(place, self._smooth(subject, facet), facet)

    def light(self, subject: SceneObject, shade: Floats) -> Floats:
        """Light (k,) of corners' light on both sides (v, 2)."""
        corners = shade[subject.faces[self.facet]]
        behind = self.behind(subject, self.facet_normals(subject))
        met: Floats = np.where(behind, corners[..., 1], corners[..., 0])
        return np.asarray((met * self.weight).sum(axis=1))

    def glossy(self, subject: SceneObject, shade: Floats, gloss: Gloss) -> Floats:
        """Light (k, 3) that goes back along the rays, also off microfacets.

        Metals reflect lamps in highlights alone, and light of no lamp as if they were matt.
        """
        albedo, light = self.albedo(subject), self.light(subject, shade)[:, None]
        metal, f0 = gloss.finish.metal[self.facet, None], gloss.finish.f0[self.facet]
        if metal.any():
            light = light - metal * (light - self.light(subject, gloss.light.rest)[:, None])
        spots = self.spots(subject)
        behind = self.behind(subject, spots.facet_normal)
        at = self.weight, spots.place, spots.normal, self.direction
        corners = subject.faces[self.facet]
        f0 = f0 + metal * (albedo - f0)
        return np.asarray(albedo * light + gloss.highlights(self.facet, corners, behind, at, f0))


def surface_hits(scene: Scene, origin: Floats, direction: Floats) -> SurfaceHits:
    """Where rays from origins (n, 3) along unit directions (n, 3) meet the object."""
    near = np.flatnonzero(meets_sphere(origin, direction, scene.radius))
    if len(near) == 0:
        return SurfaceHits(near, np.zeros(0), near, np.zeros((0, 3)), np.zeros((0, 3)))
    hits = scene.embree.run(
        origin[near].astype(np.float32), direction[near].astype(np.float32), output=1
    )
    hit = hits["primID"] >= 0
    u, v = hits["u"][hit], hits["v"][hit]
    weight = np.column_stack([1 - u - v, u, v]).astype(np.float64)
    facet, rows = hits["primID"][hit].astype(np.int64), near[hit]
    return SurfaceHits(rows, hits["tfar"][hit], facet, weight, direction[rows])


def cast_rays(scene: Scene, origin: Floats, direction: Floats) -> RayHits:
    """Points seen by rays from origins (n, 3) along unit directions (n, 3)."""
    colour = np.full((len(origin), 3), BACKGROUND, dtype=np.float32)
    depth = np.full(len(origin), np.inf)
    hits = surface_hits(scene, origin, direction)
    depth[hits.rows] = hits.depth
    colour[hits.rows] = 255 * _reflected(scene, hits)
    if scene.gloss and scene.lamps is None:
        # Source: B. T. Phong, Communications of the ACM 18(6), 1975.
        mirrored = reflect(hits.direction, hits.normals(scene.subject))
        glint = scene.gloss * (np.maximum(mirrored @ LAMPS.T, 0) ** GLOSS_EXPONENT @ LAMP_LIGHT)
        colour[hits.rows] = np.minimum(colour[hits.rows] + 255 * glint[:, None], 255)
    if scene.screen is not None and len(origin):
        _put_before(scene.screen, origin, direction, colour, depth)
    return RayHits(colour, depth)


def _put_before(
    screen: Any, origin: Floats, direction: Floats, colour: Colours, depth: Floats
) -> None:
    """Make rays black, and as long, as the bodies that they meet before the object."""
    distance = distances_to(screen, origin, direction)
    nearer = distance < depth
    colour[nearer], depth[nearer] = BACKGROUND, distance[nearer]


def distances_to(embree: Any, origin: Floats, direction: Floats) -> Floats:
    """Distances (n,) along rays (n, 3) to the facets of an Embree scene; infinite without one."""
    hits = embree.run(origin.astype(np.float32), direction.astype(np.float32), output=1)
    return np.where(hits["primID"] >= 0, hits["tfar"].astype(np.float64), np.inf)


def _reflected(scene: Scene, hits: SurfaceHits) -> Floats:
    """Light (k, 3) that goes back along the rays."""
    if scene.microfacets is not None:
        return hits.glossy(scene.subject, scene.shade, scene.microfacets)
    return hits.albedo(scene.subject) * _light(scene, hits)


def _light(scene: Scene, hits: SurfaceHits) -> Floats:
    """Light on what is hit, (k, 1) or by colours (k, 3)."""
    if scene.lamps is not None:
        return lamp_light(scene.embree, hits.spots(scene.subject), scene.lamps)
    return hits.light(scene.subject, scene.shade)[:, None]


def colours_along(scene: Scene, origin: Floats, direction: Floats) -> Colours:
    """Colours (n, 3), 0 to 255, along rays (n, 3), in threads."""

    def colours(part: slice) -> Colours:
        return cast_rays(scene, origin[part], direction[part]).colour

    return over_chunks(colours, len(origin), RAYS_PER_CHUNK)


def object_in_front(
    scene: Scene, pinhole: Floats, direction: Floats, distance: Floats
) -> tuple[Bools, Colours]:
    """Where (n,) the object is nearer than a distance (n,), mm, and its colours there (n, 3)."""
    direct = cast_rays(scene, np.broadcast_to(pinhole, direction.shape), direction)
    return np.isfinite(direct.depth) & (direct.depth < distance), direct.colour


def depth_along_rays(scene: Scene) -> Callable[[Floats, Floats], Floats]:
    """A function that gives the distance (n,) along rays to the object, mm; infinite beside it."""

    def depth(origin: Floats, direction: Floats) -> Floats:
        return cast_rays(scene, origin, direction).depth

    return depth


def _albedo(subject: SceneObject, facet: Ints, weight: Floats) -> Floats:
    """Colours (n, 3), 0 to 1, at barycentric weights (n, 3) on facets (n,)."""
    if subject.patterned:
        corners = subject.points[subject.faces[facet]]
        return pattern(np.einsum("nk,nkx->nx", weight, corners))
    albedo = np.einsum("nk,nkx->nx", weight, subject.albedo[facet])
    if subject.texture is None or subject.uv is None or subject.tiles is None:
        return np.asarray(albedo)
    uv = np.einsum("nk,nkx->nx", weight, subject.uv[facet])
    tiles = subject.tiles[facet]
    on = tiles[:, 1] > 0
    albedo[on] *= _texels(subject.texture, uv[on], tiles[on])
    return np.asarray(albedo)


def _texels(texture: Bytes, uv: Floats, tiles: Ints) -> Floats:
    """Colours (n, 3) of pictures that repeat, between their four nearest texels."""
    first, height, width = tiles.T
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    column, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    across, down = (x - column)[:, None], (y - row)[:, None]
    rows = (first + row % height, first + (row + 1) % height)
    columns = (column % width, (column + 1) % width)
    upper, lower = (
        texture[which, columns[0]] * (1 - across) + texture[which, columns[1]] * across
        for which in rows
    )
    return np.asarray((upper * (1 - down) + lower * down) / 255)
