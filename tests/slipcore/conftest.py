"""Lattices, logs and recordings that several tests of slipcore share."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from slipcore import FrictionLaw, GraspLog, GroundTruth, SlipHistory
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.surface.strain import Lattice

RECORDINGS = Path(".cache/tac3d/PyTac3D/example_data")
RECORDED = ("example_1/AD2-0065L", "example_2/HDL1-GWH0021", "example_2/HDL1-GWH0022")
REFERENCE_SCENES = Path("../shared/data/contact")
PITCH = 1e-3


def grid(rows: int = 7, columns: int = 5) -> np.ndarray:
    i, j = np.meshgrid(np.arange(rows) - (rows - 1) / 2, np.arange(columns) - (columns - 1) / 2, indexing="ij")
    return PITCH * np.stack([i, j, np.zeros_like(i)], axis=-1)


def turned(position: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return position @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def uneven(position: np.ndarray) -> np.ndarray:
    x, y = position[..., 0] / PITCH, position[..., 1] / PITCH
    return PITCH * np.stack([x + 0.08 * x**2 + 0.1 * y, y - 0.1 * np.sin(x), 0.3 * x**2], axis=-1)


LATTICES = {
    "regular": grid(),
    "smallest": grid(2, 2),
    "flipped": grid()[::-1],
    "transposed": grid().transpose(1, 0, 2),
    "rotated": turned(grid(), 0.7),
    "non-uniform": uneven(grid()),
}


@pytest.fixture(params=LATTICES)
def lattice(request: pytest.FixtureRequest) -> Lattice:
    return Lattice.at_rest(LATTICES[request.param])


@pytest.fixture(scope="session")
def short_ramp() -> GraspLog:
    """Touch, press, shear to near sliding and hold, in 60 frames with noise."""
    schedule = RampSchedule(rest=0.2, press=0.4, settle=0.2, shear=1.0, hold=0.2)
    return tangential_ramp(points=12, pitch=1.2e-3, schedule=schedule, marker_noise=1e-6, force_noise=2e-3, seed=7)


def read_recording(folder: Path) -> GraspLog:
    if not folder.is_dir():
        pytest.skip(f"{folder} is absent: `make recordings` fetches it")
    displacement, force, position, time = (
        np.load(folder / f"{name}.npy") for name in ("3D_Displacements", "3D_Forces", "3D_Positions", "sendTimestamp")
    )
    lattice = (20, 20, 3)
    return GraspLog(
        time=time,
        position=1e-3 * (position - displacement)[0].reshape(lattice),
        displacement=1e-3 * displacement.reshape(-1, *lattice),
        element_area=1e-6,
        force=force.reshape(-1, *lattice),
    )


@pytest.fixture(params=RECORDED)
def recording(request: pytest.FixtureRequest) -> GraspLog:
    return read_recording(RECORDINGS / request.param)


def read_scene(name: str, marker_noise: float = 0.0, force_noise: float = 0.0, seed: int = 0) -> GraspLog:
    """A scene of the independent solver at 30 fps; its z points into the finger, so it is turned by π about x."""
    path = REFERENCE_SCENES / f"{name}.npz"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    with np.load(path) as scene:
        turn = np.array([1.0, -1.0, -1.0])
        x, y = np.meshgrid(scene["x"], scene["y"])
        rng = np.random.default_rng(seed)
        shape = scene["u"].shape
        return GraspLog(
            time=np.arange(shape[0]) / 30.0,
            position=1e-3 * turn * np.stack([x, y, np.zeros_like(x)], axis=-1),
            displacement=1e-3 * turn * scene["u"] + marker_noise * rng.standard_normal(shape),
            element_area=(0.75e-3) ** 2,
            force=turn * scene["f"] + force_noise * rng.standard_normal(shape),
            normal=np.broadcast_to([0.0, 0.0, 1.0], shape),
            truth=GroundTruth(
                scene["contact"] > 0,
                scene["slip_kinematic"] > 0,
                scene["slip_contact_factor"] > 0,
                scene["stick_ratio"],
                FrictionLaw((float(scene["mu"]), 0.0, 0.0)),
            ),
        )


@pytest.fixture(scope="session")
def scene() -> Callable[..., GraspLog]:
    return read_scene


@pytest.fixture(scope="session")
def f1_score() -> Callable[[GraspLog, SlipHistory], float]:
    """F1 of slip at the contact's points against the contact-factor truth."""

    def score(log: GraspLog, history: SlipHistory) -> float:
        assert log.truth is not None
        true = log.truth.slip_contact_factor & log.truth.contact
        found = history.slip & log.truth.contact
        return 2.0 * np.count_nonzero(true & found) / (np.count_nonzero(true) + np.count_nonzero(found))

    return score


@pytest.fixture(scope="session")
def stick_ratio_error() -> Callable[[GraspLog, SlipHistory], float]:
    """Root mean square error of the stick ratio over the frames in contact."""

    def error(log: GraspLog, history: SlipHistory) -> float:
        assert log.truth is not None
        difference = history.stick_ratio - log.truth.stick_ratio
        return float(np.sqrt(np.nanmean(difference**2)))

    return error


@pytest.fixture(scope="session")
def same_history() -> Callable[[SlipHistory, SlipHistory], None]:
    """Assert that two histories agree to the last bit."""

    def check(one: SlipHistory, other: SlipHistory) -> None:
        for name in ("time", "contact", "slip", "probability", "stick_ratio", "velocity", "macro_slip"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
        for kind in ("onset", "end", "touch", "release"):
            first, second = getattr(one.events, kind), getattr(other.events, kind)
            np.testing.assert_array_equal(first.element, second.element)
            np.testing.assert_array_equal(first.time, second.time)
        np.testing.assert_array_equal(one.noise, other.noise)
        assert one.method == other.method

    return check
