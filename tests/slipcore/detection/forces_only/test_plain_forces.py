"""Method ``forces_only`` against its equations in numpy, frame by frame."""

import numpy as np
import pytest

from benchmarks.detector.pillars import Grasp, tuning
from slipcore import SlipDetector
from slipcore.defaults import ForcesOnlyOptions
from slipcore.detection.forces_only import method
from slipcore.detection.forces_only.step import ForcesState
from slipcore.detection.methods import METHODS
from slipcore.detection.shared.interface import ObservedFrame
from slipcore.detection.shared.records import Decision
from slipcore.surface.strain import Lattice
from tests.slipcore.detection.forces_only import plain_forces
from tests.slipcore.detection.forces_only.test_forces_only import PRESSED, seen

Step = tuple[ForcesState, Decision]
TIME, DEPTH = (0.0, 0.2, 0.7, 1.5, 1.6, 1.8, 2.2, 2.8), (*PRESSED, -1e-4, -1e-4, 1e-3, 1e-3)
TAKEN_AGAIN = Grasp("taken again", 0.4, TIME, DEPTH, x=(0.0, 0.0, 0.0, 1e-3, 1e-3, 0.0, 0.0, 2e-3), seed=43)
GRASPS = [*(grasp for grasp in tuning() if grasp.name in ("twist", "to and fro", "grip rises")), TAKEN_AGAIN]


@pytest.mark.parametrize("grasp", GRASPS, ids=lambda grasp: grasp.name)
def test_kernels_decide_as_the_equations_do(grasp: Grasp, monkeypatch: pytest.MonkeyPatch) -> None:
    both: list[tuple[Step, Step]] = []

    def step(state: ForcesState, lattice: Lattice, frame: ObservedFrame, options: ForcesOnlyOptions) -> Step:
        both.append((method.step(state, lattice, frame, options), plain_forces.step(state, lattice, frame, options)))
        return both[-1][0]

    monkeypatch.setitem(METHODS, "forces_only", method.METHOD._replace(step=step))
    log = seen(grasp.log().log.take(slice(None, None, 4)))  # 250 frames a second
    detector = SlipDetector(log.position, log.element_area, "forces_only")
    for frame in log.frames():
        detector.step(frame.time, frame.displacement, frame.force, None, frame.normal)
    for (after, decision), (expected, plain) in both:
        np.testing.assert_array_equal(decision.slip, plain.slip)
        np.testing.assert_allclose(decision.probability, plain.probability, rtol=0.0, atol=1e-9)
        for one, other in zip(after, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9)
    assert any(decision.slip.any() for (_, decision), _ in both)
