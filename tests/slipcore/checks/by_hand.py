"""Grasps so small that what a check says of them can be reckoned on paper."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from slipcore import FrictionSamples, GraspLog
from slipcore.checks.subject import Subject
from slipcore.defaults import CheckOptions
from slipcore.element_forces import element_forces
from slipcore.finding import Finding

PITCH = 1e-3
RATE = 10.0


def log(
    displacement: Any = 0.0, force: Any = None, frames: int = 20, grid: tuple[int, int] = (4, 3), **more: Any
) -> Any:
    """Of elements of 1 mm², ten frames a second; fields are spread over all frames and elements."""
    row, column = np.mgrid[: grid[0], : grid[1]]
    shape = (frames, *grid, 3)
    fields = {
        "time": np.arange(frames) / RATE,
        "position": PITCH * np.stack([row, column, np.zeros_like(row)], axis=-1),
        "displacement": None if displacement is None else np.broadcast_to(displacement, shape),
        "element_area": PITCH**2,
        "force": None if force is None else np.broadcast_to(force, shape),
    }
    return GraspLog(**{**fields, **more})


def over_time(values: Any, axis: int) -> np.ndarray:
    """A field along one axis, [t, 1, 1, 3], alike on all elements."""
    field = np.zeros((len(values), 1, 1, 3))
    field[:, 0, 0, axis] = values
    return field


def subject(
    log: GraspLog,
    contact: Any = False,
    samples: FrictionSamples | None = None,
    friction: Any = None,
    stick_ratio: Any = 1.0,
    **limits: Any,
) -> Subject:
    """What the checks look at; normals stand upright, and ``contact`` is spread over frames and elements."""
    normal = np.broadcast_to([0.0, 0.0, 1.0], log.displacement.shape)
    forces = None if log.force is None else element_forces(log.force, normal)
    history = SimpleNamespace(
        contact=np.broadcast_to(contact, log.displacement.shape[:3]),
        stick_ratio=np.broadcast_to(stick_ratio, len(log)),
        patches=(),
    )
    pressing = np.zeros(log.displacement.shape[:3]) if forces is None else np.maximum(forces.pressing, 0.0)
    chosen = CheckOptions(**limits)
    return Subject(log, cast("Any", history), forces, normal, pressing, samples, friction, chosen)


def told(found: Iterator[Finding]) -> str:
    """The evidence of the one finding, or nothing."""
    evidence = [each.evidence for each in found]
    assert len(evidence) <= 1
    return "".join(evidence)
