import pytest

import slipcore
from service.exports import Recording
from slipcore import GraspLog


@pytest.fixture(scope="session")
def recording(ramp: GraspLog) -> Recording:
    """A simulated grasp and the slip in it."""
    return Recording(ramp, slipcore.detect_slip(ramp), "ramp.npz")
