"""The world whose grasps are drawn with known and unknown motion follows the law that it is given."""

import numpy as np
import pytest

from benchmarks.end_to_end.unknown_motion import LEVEL, SAMPLING, SLOPE, STEPS, Law, collected, grasp_log
from slipcore.samples import FrictionSamples


@pytest.mark.parametrize(("normal_force", "speed"), [(9.0, 0.5), (7.0, 3.0)])
def test_what_slides_shows_the_friction_of_its_own_speed(normal_force: float, speed: float) -> None:
    """Were it to stick in between, its force would be below the law, and the more so the faster it is."""
    speeds = []

    class Told(Law):
        def __call__(self, speed: np.ndarray, normal_force: np.ndarray) -> np.ndarray:
            speeds.append(speed.ravel().copy())
            return Law.__call__(self, speed, normal_force)

    law = Told(np.array([LEVEL, 9.0, SLOPE]), np.zeros(SAMPLING.points))
    samples = collected(grasp_log(law, normal_force, 1e-3 * speed), known=True)
    samples = samples.take(samples.element < law.scatter.size)  # of elements, not of the whole contact
    step = np.rint(samples.time * STEPS).astype(int) - 1
    seen = samples.friction_coefficient - SLOPE * samples.normal_force
    assert slope(samples, np.stack(speeds)[step, samples.element], seen) == pytest.approx(9.0, rel=0.02)


def slope(samples: FrictionSamples, x: np.ndarray, y: np.ndarray) -> float:
    """Of y over x within elements."""
    _, place = np.unique(samples.element, return_inverse=True)
    x, y = (each - (np.bincount(place, each) / np.bincount(place))[place] for each in (x, y))
    return float(x @ y / (x @ x))
