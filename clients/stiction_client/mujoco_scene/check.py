"""Check a scene: load it, let it come to rest, and measure each pair of geoms that touches."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from stiction_client.arguments import within
from stiction_client.errors import InvalidArgument
from stiction_client.mujoco_scene.advice import Written, advice
from stiction_client.mujoco_scene.bench import bench
from stiction_client.mujoco_scene.holding import Held, advised, held
from stiction_client.mujoco_scene.rule import Rule, explanation, geom_name, rule_of
from stiction_client.mujoco_scene.touching import Touch, touching

LOOKED_AT = 0.1
"""s at the end over which forces and speeds are averaged."""

DIVERGED = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
"""MuJoCo's warnings after which it begins anew."""


@dataclass(frozen=True, slots=True)
class PairCheck:
    """Two geoms that touch. ``friction``: the sliding friction that the engine goes by, the smaller of its two;
    ``rule`` and ``explanation``: why that one; ``normal_force`` N, ``tangential_force`` N and ``speed`` m/s along the
    surface as they are in the scene; ``held``: what the pair holds in MuJoCo; ``advised``: what it would hold with
    ``HOLDING_OPTION``, None where the scene has that; ``advice``: what to change.
    """

    geoms: tuple[str, str]
    rule: Rule
    explanation: str
    friction: float
    normal_force: float
    tangential_force: float
    speed: float
    held: Held
    advised: Held | None
    advice: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SceneCheck:
    """The ``pairs`` of a scene ``seconds`` after its start, and ``left_out``: what else may touch, and why it is."""

    seconds: float
    pairs: tuple[PairCheck, ...]
    left_out: tuple[str, ...]


def check_scene(
    path: Path | str, *, keyframe: str | None = None, seconds: float = 1.0, friction: float | None = None
) -> SceneCheck:
    """Run the MJCF at ``path`` for ``seconds`` from a ``keyframe`` (by default as it is compiled), and measure what
    each pair of geoms holds that touches then.

    Each pair is taken out of the scene with its contact and solver settings, pressed as it is there, and pulled until
    it slips faster than 10 mm/s. ``friction``: what it is to be, if the advice shall say so. Raises ``InvalidArgument``
    for a model that MuJoCo refuses, for a keyframe that it hasn't, and where nothing touches.
    """
    span = float(within("seconds", seconds, LOOKED_AT, 1000.0, "s"))
    wanted = None if friction is None else float(within("friction", friction, 1e-5, 100.0))
    with _silent():
        return _check(Path(path), keyframe, span, wanted)


def _check(path: Path, keyframe: str | None, span: float, wanted: float | None) -> SceneCheck:
    model = _load(path)
    data = _start(model, keyframe)
    steps = math.ceil(LOOKED_AT / model.opt.timestep)
    mujoco.mj_step(model, data, max(math.ceil(span / model.opt.timestep) - steps, 0))
    found = touching(model, data, steps)
    if any(data.warning[kind].number for kind in DIVERGED):
        raise InvalidArgument("the scene", "unstable", "one whose simulation does not diverge: try a smaller timestep")
    if not found:
        allowed = "geoms that press on each other: name a keyframe in which the gripper is closed, or give it more time"
        raise InvalidArgument(f"what touches after {span:g} s", "nothing", allowed)
    return _checked(model, data, found, span, wanted)


@contextmanager
def _silent() -> Iterator[None]:
    """Without MuJoCo's warnings, of which it writes one a step to the terminal and into a file where the user is."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _checked(model: Any, data: Any, found: list[Touch], seconds: float, wanted: float | None) -> SceneCheck:
    flexible = (mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_FLEX, k) or f"flex {k}" for k in range(model.nflex))
    pairs, left_out = [], [f"{name} is a flexible body" for name in flexible]
    for touch in found:
        try:
            pairs.append(_pair(model, data, touch, wanted))
        except InvalidArgument as error:
            left_out.append(str(error))
    return SceneCheck(seconds, tuple(pairs), tuple(left_out))


def _pair(model: Any, data: Any, touch: Touch, wanted: float | None) -> PairCheck:
    written = _written(model, touch)
    capacity = written.sliding * (touch.normal_force + touch.points * float(touch.contact.adhesion))
    alone = bench(model, data, touch)
    better = advised(alone)
    now = held(alone, capacity)
    then = None if better is None else held(better, capacity)
    return PairCheck(
        (geom_name(model, touch.first), geom_name(model, touch.second)),
        written.rule,
        explanation(model, touch.first, touch.second),
        written.sliding,
        touch.normal_force,
        float(np.linalg.norm(touch.tangential_force)),
        touch.speed,
        now,
        then,
        advice(written, now, then, wanted),
    )


def _written(model: Any, touch: Touch) -> Written:
    geoms = touch.first, touch.second
    return Written(
        (model.geom(geoms[0]).name, model.geom(geoms[1]).name),
        (float(model.geom_friction[geoms[0], 0]), float(model.geom_friction[geoms[1], 0])),
        rule_of(model, *geoms),
        int(touch.contact.dim),
        tuple(map(float, touch.contact.friction)),
        touch.points,
    )


def _load(path: Path) -> Any:
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        why = f"refused: {str(error).strip()}"
        raise InvalidArgument(f"model {path.name}", why, "MJCF that MuJoCo loads") from error


def _start(model: Any, keyframe: str | None) -> Any:
    data = mujoco.MjData(model)
    if keyframe is not None:
        names = [model.key(index).name for index in range(model.nkey)]
        if keyframe not in names:
            allowed = ", ".join(filter(None, names)) or "none: the model has no named keyframe"
            raise InvalidArgument("keyframe", repr(keyframe), allowed)
        mujoco.mj_resetDataKeyframe(model, data, names.index(keyframe))
    return data
