"""Two geoms of a scene alone: pressed together as in the scene, and pulled along each other until they slip."""

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from stiction_client.errors import InvalidArgument
from stiction_client.mujoco_scene.rule import geom_name
from stiction_client.mujoco_scene.touching import FloatArray, Touch

PRESS_TIME, PULL_TIME, LOOK_TIME = 0.3, 0.2, 0.1
"""s pressed, pulled, and looked at thereafter: several time constants of a contact, 20 ms by default."""

SLIP_SPEED = 0.01
"""m/s from which on a contact is said to slip: a held object is out of the fingers within two seconds."""

STILL_ACCELERATES = 0.01
"""Share of the pull that accelerates; a contact that only creeps does not."""

RESOLUTION, MOST = 1e-3, 100.0
"""Of the load that is expected to make it slip: how closely it is found, and up to where it is looked for."""

SHAPES = ("PLANE", "SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX", "MESH")
"""Of geoms that can be taken out of their scene."""


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """The first geom at rest, the second free to move but not to turn, with the scene's contact and solver settings.

    ``normal_force`` N presses them together; ``frame`` as ``Touch`` has it.
    """

    model: Any
    frame: FloatArray
    normal_force: float

    def speed(self, load: float, angle: float) -> float:
        """m/s along a pull of ``load`` N at ``angle`` rad to the first tangent; infinite while it goes faster."""
        direction = math.cos(angle) * self.frame[1] + math.sin(angle) * self.frame[2]
        data = mujoco.MjData(self.model)
        data.qfrc_applied[:] = -self.normal_force * self.frame[0]
        mujoco.mj_step(self.model, data, self._steps(PRESS_TIME))
        data.qfrc_applied[:] += load * direction
        mujoco.mj_step(self.model, data, self._steps(PULL_TIME))
        before, fast = data.qpos @ direction, data.qvel @ direction
        mujoco.mj_step(self.model, data, self._steps(LOOK_TIME))
        time = self._steps(LOOK_TIME) * self.model.opt.timestep
        accelerates = float(self.model.body_mass[1] * (data.qvel @ direction - fast) / time)
        return math.inf if accelerates > STILL_ACCELERATES * load else float(data.qpos @ direction - before) / time

    def slip_load(self, angle: float, expected: float) -> float:
        """Least pull, N, that makes it slip, by bisection; ``expected``: where to look first, N.

        Infinite where a hundred times of that does not: geoms that interlock.
        """
        low, high = 0.0, expected
        while self.speed(high, angle) <= SLIP_SPEED:
            if high == MOST * expected:
                return math.inf
            low, high = high, min(1.5 * high, MOST * expected)
        while high - low > RESOLUTION * expected:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.speed(middle, angle) > SLIP_SPEED else (middle, high)
        return 0.5 * (low + high)

    def _steps(self, time: float) -> int:
        return max(math.ceil(time / float(self.model.opt.timestep)), 1)


def bench(model: Any, data: Any, touch: Touch) -> Bench:
    """The two geoms of ``touch`` where they are in ``data``. Raises ``InvalidArgument`` for a shape that can't be
    taken out of its scene.
    """
    spec = mujoco.MjSpec()
    _add_geom(spec, spec.worldbody, model, data, touch.first, data.geom_xpos[touch.first])
    body = spec.worldbody.add_body(pos=data.geom_xpos[touch.second], mass=_moving_mass(model, touch))
    body.explicitinertial, body.inertia = True, [1.0, 1.0, 1.0]  # it does not turn
    for axis in np.eye(3):
        body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    _add_geom(spec, body, model, data, touch.second, np.zeros(3))
    _add_pair(spec, touch)
    made = spec.compile()
    _copy_options(model, made)
    return Bench(made, touch.frame, touch.normal_force)


def _moving_mass(model: Any, touch: Touch) -> float:
    """The mass, kg, whose inverse is the sum of those of both bodies: on it depends how soft the contact is."""
    bodies = [int(model.geom_bodyid[geom]) for geom in (touch.first, touch.second)]
    inverse = float(sum(model.body_invweight0[body, 0] for body in bodies))
    return 1.0 / inverse if inverse > 0.0 else 1.0


def _add_geom(spec: Any, body: Any, model: Any, data: Any, geom: int, place: FloatArray) -> None:
    shape = mujoco.mjtGeom(int(model.geom_type[geom])).name.removeprefix("mjGEOM_")
    if shape not in SHAPES:
        raise InvalidArgument(f"the shape of {geom_name(model, geom)}", shape.lower(), ", ".join(SHAPES).lower())
    turn = np.zeros(4)
    mujoco.mju_mat2Quat(turn, data.geom_xmat[geom])
    made = body.add_geom(name=f"geom{geom}", type=model.geom_type[geom], pos=place, quat=turn, contype=0, conaffinity=0)
    if shape == "MESH":
        made.meshname = _add_mesh(spec, model, int(model.geom_dataid[geom]))
    else:
        made.size = model.geom_size[geom]


def _add_mesh(spec: Any, model: Any, mesh: int) -> str:
    """The mesh's name; two geoms may have the same."""
    name = f"mesh{mesh}"
    if spec.mesh(name) is None:
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        made = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
        made.uservert = model.mesh_vert[first : first + count].ravel()
        made.userface = model.mesh_face[face : face + faces].ravel()
    return name


def _add_pair(spec: Any, touch: Touch) -> None:
    """What the engine decided for the contact, as a pair, which no rule changes."""
    contact = touch.contact
    spec.add_pair(
        geomname1=f"geom{touch.first}",
        geomname2=f"geom{touch.second}",
        condim=contact.dim,
        friction=contact.friction,
        solref=contact.solref,
        solreffriction=contact.solreffriction,
        solimp=contact.solimp,
        margin=contact.includemargin,
        adhesion=contact.adhesion,
    )


def _copy_options(model: Any, made: Any) -> None:
    """The scene's solver, without its gravity, wind and fluid."""
    for name in dir(model.opt):
        value = getattr(model.opt, name)
        if name.startswith("_") or callable(value):
            continue
        if isinstance(value, np.ndarray):
            getattr(made.opt, name)[:] = value
        else:
            setattr(made.opt, name, value)
    made.opt.gravity[:] = 0.0
    made.opt.wind[:] = 0.0
    made.opt.density = made.opt.viscosity = 0.0
