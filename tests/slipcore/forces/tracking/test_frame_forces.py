"""Forces of one frame, and how well they are known."""

from dataclasses import replace

import numpy as np

from slipcore.forces.inverse.fit import TractionFit, TractionPrior, fit
from slipcore.forces.inverse.prior import usual
from slipcore.forces.operator.gel import Gel
from slipcore.forces.tracking.frame_forces import Reader
from slipcore.forces.tracking.known import KnownForce
from slipcore.forces.tracking.sensor import SensorResponse
from slipcore.forces.tracking.tracker import Key

PITCH = 1e-3
LINE = PITCH * (np.arange(9) - 4.0)
POSITION = np.stack((*np.meshgrid(LINE, LINE, indexing="ij"), np.zeros((9, 9))), axis=-1)


def test_contacts_that_are_as_probable_widen_what_is_said_by_how_much_forces_differ() -> None:
    sensor = SensorResponse.of(POSITION, PITCH**2, Gel(1e6, 0.49, 5e-3), (0, 1))
    observation = sensor.observation(np.full(len(sensor.response), 3e-6), KnownForce.of(None, None, 1)[0])

    def on(radius: float) -> TractionFit:
        disk = np.hypot(*sensor.nodes.places().T) < radius
        return fit(observation, sensor.nodes, disk, TractionPrior(usual(), 0.1))

    narrow, wide = on(2.1e-3), on(3.1e-3)
    data = observation.response[:, 2, wide.support].sum(axis=1) * 0.05
    alone = Key(observation, data, narrow)
    by_one = Reader.of(sensor, alone).read(data, (9, 9))
    by_both = Reader.of(sensor, replace(alone, others=((0.3, wide),))).read(data, (9, 9))
    np.testing.assert_array_equal(by_both.force, by_one.force)
    apart = sensor.load * (wide.mean(data).sum(axis=1) - narrow.mean(data).sum(axis=1))
    added = by_both.resultant_deviation**2 - by_one.resultant_deviation**2
    np.testing.assert_allclose(added, 0.3 * apart**2, rtol=1e-6, atol=1e-12)
    assert by_both.resultant_deviation[2] > 1.1 * by_one.resultant_deviation[2]
    elements = sensor.elements[:, wide.support] @ wide.mean(data).T - sensor.elements[:, narrow.support] @ (
        narrow.mean(data).T
    )
    added = by_both.deviation**2 - by_one.deviation**2
    np.testing.assert_allclose(added.reshape(-1, 3), 0.3 * elements**2, rtol=1e-6, atol=1e-12)
