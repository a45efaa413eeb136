import numpy as np

from slipcore import GraspLog, detect_slip
from slipcore.surface.strain import (
    Lattice,
    displacement_gradient,
    green_lagrange,
    lattice_steps,
    literal_rate,
    principal_strains,
)


def as_printed(log: GraspLog, element: tuple[int, int], lag: int, threshold: float, influence: float) -> list[bool]:
    """The paper's section II-D for one element, written out with lists."""
    lattice, flat = Lattice.at_rest(log.position), log.displacement
    strains = [
        principal_strains(green_lagrange(displacement_gradient(lattice, lattice_steps(u))))[(slice(None), *element)]
        for u in flat
    ]
    filtered, slips, slip = [], [False], False
    for k in range(1, len(log)):
        interval = log.time[k] - log.time[k - 1]
        delta = float(literal_rate(strains[k - 1], strains[k], interval))
        event = 0
        if len(filtered) >= lag:
            mean, std = np.mean(filtered[-lag:]), np.std(filtered[-lag:])
            if abs(delta - mean) > threshold * std:
                event = 1 if delta > mean else -1
        filtered.append(influence * delta + (1.0 - influence) * filtered[-1] if event else delta)
        if event == 1 and delta > 0.1 * np.hypot(*strains[k]) / interval:
            slip = True
        slip = slip and event != -1
        slips.append(slip)
    return slips


def test_the_literal_method_is_the_papers_text_for_each_element(short_ramp: GraspLog) -> None:
    pressed = np.zeros(short_ramp.displacement.shape)
    pressed[..., 2] = -0.1
    log = GraspLog(
        short_ramp.time, short_ramp.position, short_ramp.displacement, 1e-6, pressed, normal=short_ramp.normal
    )
    history = detect_slip(log, "strain_rate_literal")
    assert history.contact.all()
    for element in ((6, 6), (3, 5), (9, 8), (0, 0)):
        expected = as_printed(log, element, lag=10, threshold=3.5, influence=0.5)
        assert list(history.slip[:, element[0], element[1]]) == expected
    assert history.slip.any()


def test_growth_below_a_tenth_of_the_strain_a_frame_is_not_slip() -> None:
    def slips(stretch: float) -> bool:
        i, j = np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij")
        position = 1e-3 * np.stack([i, j, 0 * i], axis=-1)
        strain = np.r_[0.2 * np.ones(20), stretch * np.ones(5)]
        displacement = strain[:, None, None, None] * position * [1.0, 0.0, 0.0]
        force = np.broadcast_to([0.0, 0.0, -0.1], displacement.shape)
        log = GraspLog(np.arange(25) / 30.0, position, displacement, 1e-6, force)
        return bool(detect_slip(log, "strain_rate_literal").slip.any())

    # Green–Lagrange strain of a stretch s: s + s²/2; from 0.22 it grows by 10 % of its new value to 0.2444.
    assert not slips(0.220)
    assert slips(0.224)


def test_the_window_must_fill_before_any_event(short_ramp: GraspLog) -> None:
    assert not detect_slip(short_ramp, "strain_rate_literal", lag=1000).slip.any()
