"""Each public function is given, in the place of each argument, what is of a wrong kind: it is named."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slipcore import GraspLog
from slipcore.errors import InvalidInput
from slipcore.forces import ForceStream, Gel, Reconstruction, calibrate_gel, compare_forces, reconstruct
from slipcore.forces.inverse.kernel import ResolutionKernel

WRONG = ["text", True, ["a", "b"], [[1.0], [1.0, 2.0]], object(), {}, 1j, 10**400, np.ma.masked, np.array("x")]
"""Of these no argument takes any, but that ``True`` chooses ``over_time``."""
GEL = Gel(young_modulus=1e5, poisson_ratio=0.48, thickness=3e-3)
OPTIONAL = {"total_force", "total_force_deviation", "noise", "known_force", "young_modulus", "poisson_ratio"}
OPTIONAL |= {"thickness", "executor", "observed", "gripper_force", "gripper_force_deviation", "relative_thickness"}
"""Which may be None."""


@pytest.fixture(scope="module")
def log() -> GraspLog:
    x, y = np.meshgrid(1e-3 * np.arange(5), 1e-3 * np.arange(5), indexing="ij")
    moved = 1e-7 * np.random.default_rng(3).standard_normal((6, 5, 5, 3))
    moved[3:, 1:4, 1:4] += np.array([1e-5, 0.0, -3e-5])
    position = np.stack((x, y, np.zeros_like(x)), axis=-1)
    return GraspLog(0.01 * np.arange(6), position, moved, 1e-6, force=np.ones((6, 5, 5, 3)))


@pytest.fixture(scope="module")
def found(log: GraspLog) -> Reconstruction:
    return reconstruct(log, GEL)


@pytest.fixture(scope="module")
def kernel(found: Reconstruction) -> ResolutionKernel:
    assert found.kernel is not None
    return found.kernel


def refused(call: Callable[..., object], *names: str, **given: Any) -> None:
    """Asserts that a call with each of the wrong values, and None where it is not allowed, names its argument."""
    for name in names or tuple(given):
        values = WRONG if name in OPTIONAL else [*WRONG, None]
        for value in values:
            if name == "over_time" and value is True:
                continue
            with pytest.raises(InvalidInput) as error:
                call(**{**given, name: value})
            assert error.value.allowed, (name, value)
            assert name in str(error.value) or name == "properties", (name, value)


def test_a_gel_names_them() -> None:
    refused(Gel, young_modulus=1e5, poisson_ratio=0.4, thickness=3e-3, marker_depth=0.0, relative_thickness=None)
    refused(Gel.from_json, properties={})
    refused(GEL.check_beside, pitch=1e-3)


def test_reconstruct_names_them(log: GraspLog) -> None:
    given = {"noise": None, "criterion": "evidence", "total_force_deviation": None, "over_time": False}
    refused(reconstruct, log=log, gel=GEL, total_force=np.ones(6), **given)


def test_what_is_made_of_a_reconstruction_names_them(
    log: GraspLog, found: Reconstruction, kernel: ResolutionKernel
) -> None:
    refused(compare_forces, log=log, reconstruction=found)
    refused(found.apply, log=log)
    refused(found.for_samples, log=log)
    refused(kernel.row, row=0, column=0)


def test_a_calibration_of_the_gel_names_them(log: GraspLog) -> None:
    given = {"young_modulus": None, "poisson_ratio": 0.4, "thickness": 3e-3, "marker_depth": 0.0, "noise": None}
    refused(calibrate_gel, logs=[log], known_force=[1.0], relative_thickness=None, **given)
    with pytest.raises(InvalidInput, match="logs is 'text'; allowed: GraspLog"):
        calibrate_gel(["text"])  # type: ignore[list-item]


def test_a_stream_names_them_and_goes_on(log: GraspLog) -> None:
    refused(ForceStream, position=log.position, element_area=1e-6, gel=GEL, noise=1e-7, executor=None)
    stream = ForceStream(log.position, 1e-6, GEL, 1e-7)
    frame = {"time": 0.0, "displacement": log.displacement[0], "gripper_force": 1.0, "gripper_force_deviation": 0.1}
    refused(stream.step, observed=None, **frame)
    own = ForceStream(log.position, 1e-6, GEL, 1e-7)
    for each in (stream, own):
        each.step(0.0, log.displacement[0])
    after, as_ever = (each.step(0.1, log.displacement[4]) for each in (stream, own))
    assert (after.wait_for, after.age) == (as_ever.wait_for, as_ever.age)
    np.testing.assert_array_equal(after.forces.resultant_deviation, as_ever.forces.resultant_deviation)


def test_forces_for_samples_are_those_of_the_same_log(log: GraspLog, found: Reconstruction) -> None:
    with pytest.raises(InvalidInput, match="log is of shape"):
        found.for_samples(log.take(slice(0, 3)))
