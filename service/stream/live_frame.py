"""What those who watch a stream see of one of its frames."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.packed_arrays import Arrays, pack_arrays
from slipcore import SlipState
from slipcore.slip_state import element_states


def pack_frame(
    number: int,
    state: SlipState,
    force: NDArray[np.float64] | None,
    command: float | None,
    friction: dict[str, float] | None,
) -> bytes:
    """One frame (``service.packed_arrays``): ``state`` of each element (0 no contact, 1 sticks, 2 slips), and numbers.

    ``force`` [n, m, 3] N, of which only the resultants are sent; ``command`` N, what the gripper was told to press
    with; ``friction``: what is expected of new observations by now.
    """
    rows, columns = state.contact.shape
    header: dict[str, Any] = {"rows": rows, "columns": columns, "number": number, "time": state.time}
    header["stick_ratio"] = None if math.isnan(state.stick_ratio) else float(state.stick_ratio)
    header |= {"macro_slip": bool(state.macro_slip), "command": command, "friction": friction}
    if force is not None:
        x, y, z = np.nansum(force, axis=(0, 1)).tolist()
        header |= {"normal_force": abs(z), "tangential_force": math.hypot(x, y)}
    arrays: Arrays = {"state": element_states(state.contact, state.slip).ravel()}
    return pack_arrays(header, arrays)


def pack_end(because: str, grasp_log: str | None) -> bytes:
    """The last that they are sent: why it ended, and the id of the log that it became, if it became one."""
    return pack_arrays({"ended": because, "grasp_log": grasp_log}, {})
