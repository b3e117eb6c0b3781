"""The optical setup: all parts' meshes, recovered mirrors and rays, ready to be measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mesh import Mesh, join_meshes
from tbcad_verify.mesh.rays import ImagePairScene, RayScene, build_scene, first_hits, with_image
from tbcad_verify.mesh.surfaces import PreparedSurfaces, Surfaces, prepare_for_rays
from tbcad_verify.record.export import Camera, Export, Part
from tbcad_verify.record.poses import VirtualCameras, virtual_cameras
from tbcad_verify.shell.match import Match, match, owners
from tbcad_verify.shell.recover import Recovery, join_recoveries
from tbcad_verify.types import Floats, Ints

# The apex of a halved mirror is on the cut; this much beside it only one half is seen.
ASIDE_MM = 0.01
FLIP = np.array([-1.0, 1.0, 1.0])


@dataclass(frozen=True)
class OpticalSetup:
    """Everything that the optical checks need."""

    export: Export  # requirements and poses
    mesh: Mesh  # all parts
    recovery: Recovery  # all parts' patches, K
    part: NDArray[np.intp]  # (K,) number of each patch's part
    match: Match  # recorded mirrors against patches
    virtual: VirtualCameras  # recorded mirrors as virtual cameras
    scene: RayScene  # for rays
    # (M,) reflecting surfaces as recovered, coat included; those of missing ones must not be used
    mirrors: Surfaces
    # whether camera b, its mesh and the matches of its mirrors are camera a's, reflected in the
    # plane x = 0
    symmetric: bool = False

    @property
    def radius(self) -> float:
        """Of the capture sphere, mm."""
        return self.export.target_mm / 2

    @property
    def cameras(self) -> list[Camera]:
        """By id."""
        return [self.export.cameras[key] for key in sorted(self.export.cameras)]

    @property
    def u(self) -> Floats:
        """(3, M) directions of the virtual cameras."""
        return self.export.mirrors.columns("ux", 3)

    @property
    def virtual_ids(self) -> list[str]:
        """Names of the V virtual cameras: of their first mirror."""
        first = np.unique(self.virtual.index, return_index=True)[1]
        return [self.export.mirrors.ids[k] for k in first.tolist()]

    def mine(self, camera: Camera) -> NDArray[np.bool_]:
        """(M,) recorded for this camera and found."""
        return np.asarray((self.export.mirrors.camera == camera.id) & (self.match.segment >= 0))

    def seen(self, camera: Camera) -> PreparedSurfaces:
        """All mirrors from this camera's pinhole."""
        return prepare_for_rays(camera.pinhole, self.mirrors)

    def images(self, mirrors: NDArray[np.integer]) -> NDArray[np.intp]:
        """The mirrors (N,) that are these mirrors' images, where the setup is symmetric."""
        one, other = (np.flatnonzero(self.export.mirrors.camera == c.id) for c in self.cameras)
        image = np.arange(len(self.export.mirrors))
        image[other], image[one] = one, other
        return np.asarray(image[mirrors])

    def image_facets(self, facets: NDArray[np.integer]) -> NDArray[np.int64]:
        """The same of facets (N,); -1 stays."""
        half = len(self.mesh.faces) // 2
        return np.where(facets < 0, -1, (facets.astype(np.int64) + half) % (2 * half))

    def owner(self) -> NDArray[np.intp]:
        """(K,) recorded mirror of each patch; -1 for none."""
        return owners(self.match.segment, self.recovery.segments.count)

    def sensor_scene(self, camera: Camera) -> SensorScene:
        """Surfaces that light meets, for one camera."""
        owner, mine = self.owner(), self.mine(camera)
        owner = np.where((owner >= 0) & mine[owner], owner, -1)
        label = self.recovery.segments.label
        facets = np.append(owner[label], -1).astype(np.int32)
        mirror, own = np.append(self.recovery.mirror[label], False), self._own_scene(camera, facets)
        return SensorScene(self, camera, own, facets, mirror, self.seen(camera))

    def _own_scene(self, camera: Camera, owner: NDArray[np.int32]) -> RayScene:
        """The scene without an image that hides none of a camera's mirrors and has none of them."""
        pair = self.scene
        if not isinstance(pair, ImagePairScene) or pair.side * camera.pinhole[0] < 0:
            return pair
        has_none = (owner[len(pair.planes) :] < 0).all()
        return pair.mesh if has_none else pair

    def names(self, facets: NDArray[np.integer]) -> list[str]:
        """The mirrors and parts that facets belong to, each once; facet -1 is none."""
        patches = np.unique(self.recovery.segments.label[facets[facets >= 0]])
        owner, ids, parts = self.owner(), self.export.mirrors.ids, self.export.parts
        matches = {
            ids[owner[k]] if owner[k] >= 0 else f"{parts[self.part[k]].name} (no mirror)"
            for k in patches.tolist()
        }
        return sorted(matches | ({"nothing"} if (facets < 0).any() else set()))


@dataclass(frozen=True)
class SensorScene:
    """Surfaces that light meets, for one camera."""

    setup: OpticalSetup  # all parts
    camera: Camera  # the real camera
    # as much of all facets as tells which of this camera's mirrors rays from the pinhole meet first
    own: RayScene
    # (F + 1,) mirror of each facet that belongs to this camera's mirrors, else -1; the last entry
    # stands for a ray that hits nothing
    owner: NDArray[np.int32]
    other: NDArray[np.bool_]  # (F + 1,) true for facets of any mirror
    seen: PreparedSurfaces  # from the pinhole, one a recorded mirror


def set_up(
    export: Export,
    meshes: list[Mesh],
    recoveries: list[Recovery],
    second_is_image: bool = False,
    first: RayScene | None = None,
) -> OpticalSetup:
    """Join all parts, match their mirrors with the record, and get ready for rays.

    `first`: of the first part's mesh; None: the second is put into Embree too.
    """
    pair = with_image(first, meshes[0]) if first and second_is_image else None
    mesh, recovery = join_meshes(meshes), join_recoveries(recoveries)
    del meshes  # half of the memory, where the caller keeps none
    counts = [item.segments.count for item in recoveries]
    part = np.repeat(np.arange(len(counts)), counts)
    camera = np.array([item.camera for item in export.parts])[part]
    scene = pair or build_scene(mesh)
    seen = _patches_at_apices(export, scene, recovery, camera)
    matches = match(export.mirrors, recovery, mesh, camera, seen, export.coating_mm)
    mirrors = recovery.fits.surfaces.take(matches.segment).coated(export.coating_mm)
    return OpticalSetup(
        export,
        mesh,
        recovery,
        part,
        matches,
        virtual_cameras(export.mirrors),
        scene,
        mirrors,
        second_is_image and _symmetric(export, matches, counts[0]),
    )


def _symmetric(export: Export, matches: Match, patches: int) -> bool:
    """Whether two cameras see mirror images, given as many patches in each half."""
    if len(export.cameras) != 2:
        return False
    (name, one), (other_name, other) = sorted(export.cameras.items())
    own, others = (matches.segment[export.mirrors.camera == key] for key in (name, other_name))
    return is_image_of_camera(other, one) and np.array_equal(
        np.where(own < 0, own, own + patches), others
    )


def is_image_of_camera(other: Camera, one: Camera) -> bool:
    """Whether one camera's pixels see along the mirror images of the other's, in any order."""
    across = one.right * FLIP
    same = [(one.pinhole * FLIP, other.pinhole), (one.forward * FLIP, other.forward)]
    return (
        (one.width, one.height, one.hfov_deg) == (other.width, other.height, other.hfov_deg)
        and all(np.array_equal(*pair) for pair in same)
        and (np.array_equal(across, other.right) or np.array_equal(-across, other.right))
    )


def _patches_at_apices(
    export: Export, scene: RayScene, recovery: Recovery, camera: NDArray[np.str_]
) -> Ints:
    """(M,) the patch that each mirror's own camera sees in line with its apex; -1 for none."""
    names, apex = export.mirrors.camera, export.mirrors.columns("px", 3)
    patches = np.full(len(names), -1)
    for key, one in export.cameras.items():
        mine = np.flatnonzero(names == key)
        target = apex[:, mine] + [[np.sign(one.pinhole[0]) * ASIDE_MM], [0], [0]]
        facet = first_hits(scene, one.pinhole[:, None], target - one.pinhole[:, None])
        patch = np.where(facet >= 0, recovery.segments.label[facet], -1)
        patches[mine] = np.where((facet >= 0) & (camera[patch] == key), patch, -1)
    return patches


def pinhole_of(export: Export, part: Part) -> Floats | None:
    """(3,) mm of the camera that a part's mirrors are for; None for parts without mirrors."""
    camera = export.cameras.get(part.camera)
    return None if camera is None else camera.pinhole
