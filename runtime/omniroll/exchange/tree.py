"""A URDF or MJCF file as rigid bodies and hinges at their reference position, read and checked by MuJoCo."""

from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np

from omniroll import extras, validation
from omniroll.errors import InvalidValueError

PURPOSE = "reading URDF and MJCF"
LEVEL = 1e-3  # rad that an axle may be off the horizontal: files have few digits


@dataclass(frozen=True, eq=False)
class Hinge:
    """A revolute joint: a point (3,) in m, a unit vector (3,), whether it has limits, and what resists it."""

    name: str
    place: np.ndarray
    axis: np.ndarray
    armature: float
    damping: float
    friction: float
    has_limits: bool = False

    @property
    def is_horizontal(self) -> bool:
        return abs(float(self.axis[2])) <= LEVEL


@dataclass(frozen=True, eq=False)
class Tree:
    """A file's bodies.

    roots    the ones without a parent
    mass     in kg, of all bodies as MuJoCo has them
    assumed  what was assumed of the file, in words
    """

    roots: "list[Rigid]"
    mass: float
    assumed: list[str]


@dataclass(eq=False)
class Rigid:
    """Bodies that are welded together: masses (k,) with places (k, 3) and inertia matrices (k, 3, 3) about these.

    hinge     what it turns on, if that is all that moves it
    others    names of joints that are no single hinge
    solids    of each sphere, capsule, cylinder or ellipsoid that may touch something: its centre (3,), its frame (3, 3)
              and half-widths (3,)
    children  what is joined to it

    All places are in the frame of the body that has no parent.
    """

    name: str
    masses: list[float] = field(default_factory=list)
    places: list[np.ndarray] = field(default_factory=list)
    inertias: list[np.ndarray] = field(default_factory=list)
    hinge: Hinge | None = None
    others: list[str] = field(default_factory=list)
    solids: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = field(default_factory=list)
    children: "list[Rigid]" = field(default_factory=list)

    def everything(self) -> "list[Rigid]":
        """It and all that hangs on it."""
        return [self, *(part for child in self.children for part in child.everything())]


def mass_of(rigids: list[Rigid]) -> float:
    return float(sum(sum(rigid.masses) for rigid in rigids))


def moment_of(rigids: list[Rigid]) -> np.ndarray:
    """(3,) mass times place."""
    return sum((m * p for rigid in rigids for m, p in zip(rigid.masses, rigid.places, strict=True)), np.zeros(3))


def inertia_about(rigids: list[Rigid], place: np.ndarray, axis: np.ndarray) -> float:
    """The inertia about a line through `place` along the unit vector `axis`."""
    total = 0.0
    for rigid in rigids:
        for mass, center, inertia in zip(rigid.masses, rigid.places, rigid.inertias, strict=True):
            away = np.cross(axis, center - place)
            total += float(axis @ inertia @ axis + mass * (away @ away))
    return total


def radius_about(rigid: Rigid, place: np.ndarray, axis: np.ndarray) -> float | None:
    """How far the solids of a body reach from a line through `place`; None where it has no solid that tells."""
    reaches = []
    for center, frame, sizes in rigid.solids:
        local = frame.T @ axis
        # An ellipsoid's half-width along a unit vector u is |diag(sizes) frame' u|; the widest across the line counts.
        across = (sizes**2)[:, None] * (np.eye(3) - np.outer(local, local))
        width = np.sqrt(np.abs(np.linalg.eigvals((np.eye(3) - np.outer(local, local)) @ across)).max())
        away = np.cross(axis, center - place)
        reaches.append(float(np.sqrt(away @ away) + width))
    return max(reaches, default=None)


def read_tree(path: str | PathLike) -> Tree:
    """The bodies of a file.

    path  of a URDF or MJCF file, str or path

    Meshes and pictures that the file names are not read. Raises InvalidValueError where it is no such file,
    MissingPackageError without the extra `mujoco`.
    """
    mujoco = extras.needed("mujoco", "mujoco", PURPOSE)
    path = validation.file_path("path", path)
    if not path.is_file():
        raise InvalidValueError("path", str(path), "is no file: give a URDF or MJCF file")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        assumed = _without_files(mujoco, spec)
        spec.compiler.fusestatic = False  # the platform of a URDF file would become part of the world, without its mass
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise InvalidValueError("path", str(path), f"must be a file that MuJoCo reads; it says: {error}") from None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    _turn_to_roots(model, data)
    touching = _touching(model)
    if idle := sum(int(model.geom_bodyid[geom]) != 0 for geom in range(model.ngeom)) - len(touching):
        assumed.append(f"{idle} solids touch nothing, such as visual ones: sizes come from the others")
    return Tree(_rigids(mujoco, model, data, touching), float(sum(model.body_mass)), assumed)


def _without_files(mujoco: Any, spec: Any) -> list[str]:
    """Take out of the model what is read from other files; bodies that lose their mass by that are named."""
    meshes = [geom for geom in spec.geoms if geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_SDF)]
    bare = sorted({geom.parent.name for geom in meshes if not geom.parent.explicitinertial})
    for geom in spec.geoms:
        geom.material = ""
    for thing in (*meshes, *spec.meshes, *spec.hfields, *spec.skins, *spec.materials, *spec.textures):
        spec.delete(thing)
    assumed = [f"{len(meshes)} meshes were not read: sizes come from spheres, capsules, cylinders and ellipsoids"]
    assumed = assumed if meshes else []
    return assumed + [f"{name} has its mass from a mesh only, which was not read: it counts without" for name in bare]


def _turn_to_roots(model: Any, data: Any) -> None:
    """Places and frames of all bodies, joints and solids, from the world's frame to that of their root."""
    roots = model.body_rootid
    frames, origins = data.xmat.reshape(-1, 3, 3)[roots].copy(), data.xpos[roots].copy()
    for places, turned, bodies in (
        (data.xipos, data.ximat, np.arange(model.nbody)),
        (data.xanchor, None, model.jnt_bodyid),
        (data.geom_xpos, data.geom_xmat, model.geom_bodyid),
    ):
        places[:] = np.einsum("kji,kj->ki", frames[bodies], places - origins[bodies])
        if turned is not None:
            turned[:] = (np.swapaxes(frames[bodies], 1, 2) @ turned.reshape(-1, 3, 3)).reshape(-1, 9)
    data.xaxis[:] = np.einsum("kji,kj->ki", frames[model.jnt_bodyid], data.xaxis)


def _touching(model: Any) -> list[int]:
    """Solids of bodies that may touch something: by their bits of contact, or as one of an explicit pair."""
    paired = {*model.pair_geom1.tolist(), *model.pair_geom2.tolist()}
    bits = model.geom_contype | model.geom_conaffinity
    return [geom for geom in range(model.ngeom) if model.geom_bodyid[geom] and (bits[geom] or geom in paired)]


def _rigids(mujoco: Any, model: Any, data: Any, touching: list[int]) -> list[Rigid]:
    """The welded groups that have no parent."""
    groups: dict[int, Rigid] = {}
    roots = []
    for body in range(1, model.nbody):
        weld, parent = int(model.body_weldid[body]), int(model.body_parentid[body])
        top = weld or _below_world(
            model, body
        )  # what is welded to the world: one group for each body that stands there
        if top not in groups:
            groups[top] = Rigid(model.body(top).name or f"body {top}")
            upper = groups.get(int(model.body_weldid[parent]) or (_below_world(model, parent) if parent else 0))
            roots.append(groups[top]) if upper is None else upper.children.append(groups[top])
        _add_body(model, data, body, groups[top])
    for joint in range(model.njnt):
        _add_joint(mujoco, model, data, joint, groups[int(model.jnt_bodyid[joint])])
    for geom in touching:
        body = int(model.geom_bodyid[geom])
        _add_solid(mujoco, model, data, geom, groups[int(model.body_weldid[body]) or _below_world(model, body)])
    return roots


def _below_world(model: Any, body: int) -> int:
    """The ancestor of a body that stands in the world."""
    while model.body_parentid[body]:
        body = int(model.body_parentid[body])
    return body


def _add_body(model: Any, data: Any, body: int, group: Rigid) -> None:
    frame = data.ximat[body].reshape(3, 3)
    group.masses.append(float(model.body_mass[body]))
    group.places.append(data.xipos[body].copy())
    group.inertias.append(frame @ np.diag(model.body_inertia[body]) @ frame.T)


def _add_joint(mujoco: Any, model: Any, data: Any, joint: int, group: Rigid) -> None:
    kind, name = model.jnt_type[joint], model.joint(joint).name or f"joint {joint}"
    if kind == mujoco.mjtJoint.mjJNT_FREE:
        return
    if kind != mujoco.mjtJoint.mjJNT_HINGE or group.hinge is not None or group.others:
        group.others += [name] if group.hinge is None else [group.hinge.name, name]
        group.hinge = None
        return
    dof = int(model.jnt_dofadr[joint])
    resisting = (model.dof_armature[dof], np.ravel(model.dof_damping[dof])[0], model.dof_frictionloss[dof])
    place, axis = data.xanchor[joint].copy(), data.xaxis[joint].copy()
    group.hinge = Hinge(name, place, axis, *map(float, resisting), bool(model.jnt_limited[joint]))


def _add_solid(mujoco: Any, model: Any, data: Any, geom: int, group: Rigid) -> None:
    kinds, size = mujoco.mjtGeom, model.geom_size[geom]
    half_widths = {
        kinds.mjGEOM_SPHERE: (size[0], size[0], size[0]),
        kinds.mjGEOM_CAPSULE: (size[0], size[0], size[0] + size[1]),
        kinds.mjGEOM_CYLINDER: (size[0], size[0], size[1]),
        kinds.mjGEOM_ELLIPSOID: tuple(size),
    }.get(kinds(model.geom_type[geom]))
    if half_widths is not None:
        frame = data.geom_xmat[geom].reshape(3, 3).copy()
        group.solids.append((data.geom_xpos[geom].copy(), frame, np.array(half_widths)))
