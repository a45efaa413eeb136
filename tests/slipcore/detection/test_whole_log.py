"""What is told of a whole log, from what was found in each of its frames, and how its frames are gone through."""

import numpy as np

from slipcore import GraspLog, detect_slip
from slipcore.detection.fold import FrameResults
from slipcore.detection.methods import METHODS
from slipcore.detection.shared.interface import CompiledMethod
from slipcore.detection.whole_log import _history


def test_a_contact_of_one_element_slips_as_a_whole_or_not_at_all() -> None:
    time, position = np.arange(3) / 30.0, np.array([[[0.0, 0, 0], [1e-3, 0, 0]], [[0, 1e-3, 0], [1e-3, 1e-3, 0]]])
    log = GraspLog(time, position, np.zeros((3, 2, 2, 3)), 1e-6)
    contact, slip = np.zeros((2, 3, 2, 2), bool)
    contact[1:, 0, 1] = slip[2, 0, 1] = True
    counts = (field.sum(axis=(1, 2)) for field in (contact, slip))
    found = FrameResults(contact, slip, slip.astype(float), np.zeros((3, 2, 2, 2)), *counts)
    history = _history(log, "filter", 1e-6, found)
    np.testing.assert_array_equal(history.macro_slip, [False, False, True])
    np.testing.assert_array_equal(history.stick_ratio, [np.nan, 1.0, 0.0])


def test_steps_of_all_compiled_methods_are_of_one_type_as_a_log_calls_them_by_address(short_ramp: GraspLog) -> None:
    methods = {name: method for name, method in METHODS.items() if isinstance(method, CompiledMethod)}
    for name in methods:
        detect_slip(short_ramp, name)
    kinds = [{str(each) for each in method.run.nopython_signatures} for method in methods.values()]  # type: ignore[attr-defined]
    assert len(methods) == 2
    assert kinds[0] & kinds[1]
    assert {str(kind).split(" -> ")[1] for each in kinds for kind in each} == {"Tuple(float64, int64, int64)"}
