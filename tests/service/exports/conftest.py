import pytest

import slipcore
from service.exports import DetectedLog
from slipcore import GraspLog


@pytest.fixture(scope="session")
def recording(ramp: GraspLog) -> DetectedLog:
    """A simulated grasp and the slip in it."""
    return DetectedLog(ramp, slipcore.detect_slip(ramp), "ramp.npz")
