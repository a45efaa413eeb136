from dataclasses import replace

import numpy as np

from slipcore import SlipDetector, collect_samples, detect_slip, warm_up
from slipcore.contact import RampSchedule, tangential_ramp
from slipcore.detection.filter.backward_pass import step_back
from slipcore.detection.filter.run import run_filter
from slipcore.detection.filter.step import decide
from slipcore.detection.shared.decision import apply_decision
from slipcore.noise import noise_of_series
from slipcore.patch import local_rates, motion

KERNELS = (run_filter, step_back, decide, apply_decision)
OF_SAMPLES = (motion._fill_fits, local_rates._fill_means, noise_of_series)


def test_after_warming_up_no_first_frame_compiles() -> None:
    assert warm_up() >= 0.0
    compiled = [len(kernel.signatures) for kernel in KERNELS]
    log = tangential_ramp(points=6, pitch=2e-3, schedule=RampSchedule(0.1, 0.1, 0.1, 0.1, 0.1))
    for force, pose in ((True, True), (True, False), (False, True), (False, False)):
        detector = SlipDetector(log.position, log.element_area, "filter")
        for frame in log.frames():
            detector.step(
                frame.time, frame.displacement, frame.force if force else None, frame.object_pose if pose else None
            )
        detect_slip(log, lookahead=2)
    by_columns = np.asfortranarray(np.ones(log.grid, bool))  # as a lattice of markers has it
    SlipDetector(log.position, log.element_area, "filter").step(0.0, log.displacement[0], contact=by_columns)
    detect_slip(replace(log, contact=np.repeat(by_columns.T[None], len(log), axis=0).transpose(0, 2, 1)))
    assert [len(kernel.signatures) for kernel in KERNELS] == compiled


def test_after_warming_up_no_samples_compile() -> None:
    warm_up()
    compiled = [len(kernel.signatures) for kernel in OF_SAMPLES]
    log = tangential_ramp(points=9, friction=0.3, normal_force=4.0, marker_noise=1e-6, force_noise=2e-3, seed=1)
    assert len(collect_samples(log, detect_slip(log)))
    assert [len(kernel.signatures) for kernel in OF_SAMPLES] == compiled
    assert all(compiled)
