"""What those who watch are sent of a frame, read back."""

import json
import math
import struct
from typing import Any

import numpy as np
import pytest

from service.stream.live_frame import pack_end, pack_frame
from slipcore import SlipState

CONTACT = np.array([[True, True, False], [True, False, False]])
SLIP = np.array([[True, False, True], [False, False, False]])


def state(ratio: float = 0.75, *, macro: bool = False) -> SlipState:
    return SlipState(1.5, CONTACT, SLIP, np.zeros((2, 3)), ratio, np.zeros((2, 3, 2)), macro)


def read(message: bytes) -> tuple[dict[str, Any], bytes]:
    (length,) = struct.unpack_from("<I", message)
    return json.loads(message[4 : 4 + length]), message[4 + length :]


@pytest.mark.parametrize("macro", [True, False])
def test_a_frame_has_each_element_s_state_row_by_row(macro: bool) -> None:
    header, content = read(pack_frame(7, state(macro=macro), None, None, None))
    assert header.pop("arrays") == [{"name": "state", "type": "Uint8Array", "offset": 0, "length": 6}]
    assert list(content[:6]) == [2, 1, 0, 1, 0, 0]
    assert header == {
        "rows": 2,
        "columns": 3,
        "number": 7,
        "time": 1.5,
        "stick_ratio": 0.75,
        "macro_slip": macro,
        "command": None,
        "friction": None,
    }


def test_a_stick_ratio_of_no_contact_is_none() -> None:
    assert read(pack_frame(0, state(math.nan), None, None, None))[0]["stick_ratio"] is None


def test_of_forces_only_their_resultants_are_sent() -> None:
    force = np.zeros((2, 3, 3))
    force[0, 0], force[1, 2], force[1, 1] = (0.3, 0.1, -2.0), (0.0, 0.3, -3.0), np.nan
    header, _ = read(pack_frame(0, state(), force, 6.5, {"mean": 0.4}))
    assert header["normal_force"] == 5.0
    assert header["tangential_force"] == pytest.approx(0.5)
    assert (header["command"], header["friction"]) == (6.5, {"mean": 0.4})


@pytest.mark.parametrize("log", ["abc", None])
def test_the_last_that_is_sent_is_why_it_ended_and_what_became_of_it(log: str | None) -> None:
    assert read(pack_end("finished", log)) == ({"ended": "finished", "grasp_log": log, "arrays": []}, b"")
