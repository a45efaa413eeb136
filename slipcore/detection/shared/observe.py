"""What all methods share of a frame: noise, normals, split forces, contact."""

from slipcore.compilation import compiled, unpack
from slipcore.defaults import NOISE
from slipcore.detection.shared.contact import Touch, find_contact
from slipcore.detection.shared.noise import noise_of_three, recent_median, remember
from slipcore.detection.shared.surface import split_forces, surface_normals
from slipcore.frames import BoolArray, FloatArray

SERIES = NOISE.series


@compiled
def observe(
    rest_steps: FloatArray,
    orientation: float,
    touch: FloatArray,
    time: float,
    displacement: FloatArray,
    force: FloatArray,
    given_normal: FloatArray,
    known: BoolArray,
    before: BoolArray,
    noise: FloatArray,
    normal: FloatArray,
    pressing: FloatArray,
    tangential: FloatArray,
    contact: BoolArray,
    stays: BoolArray,
    next_noise: FloatArray,
) -> tuple[float, float]:
    """Fill the last six and return the noise of a marker coordinate, m, and of ``pressing``, N or m; NaN if unknown.

    ``force``, ``given_normal`` and ``known`` contact are empty where there are none; ``before``: contact in the last
    frame. ``stays``: in contact now and before. ``noise`` is ``step_noise``'s.
    """
    n, m = contact.shape
    if given_normal.size:
        normal[:] = given_normal
    else:
        surface_normals(rest_steps, orientation, displacement, normal)
    if force.size:
        split_forces(force, normal, pressing, tangential)
    else:
        pressing[:] = -displacement[..., 2]
    marker_noise, pressing_noise = step_noise(noise, time, displacement, pressing, next_noise)
    if known.size:
        contact[:] = known
    else:
        find_contact(pressing, pressing_noise, before, Touch(*unpack(touch, 6)), contact)
    for i in range(n):
        for j in range(m):
            stays[i, j] = contact[i, j] and before[i, j]
    return marker_noise, pressing_noise


@compiled
def step_noise(
    noise: FloatArray, time: float, displacement: FloatArray, pressing: FloatArray, after: FloatArray
) -> tuple[float, float]:
    """Learn from one more frame, unless it repeats the last (that would make the noise look smaller).

    Remembered in rows of [9, columns]: recent estimates of markers and of pressing; a clock (times of the last two
    frames, and how many there were); then x, y and pressing of evenly chosen elements in each of these two frames.
    """
    n, m = pressing.shape
    k = min(n * m, SERIES)
    after[:3] = noise[:3]
    after[3:6] = noise[6:9]
    first, middle, last = noise[3:6, :k], noise[6:9, :k], after[6:9, :k]
    for s in range(k):
        i, j = divmod(s * n * m // k, m)
        last[0, s], last[1, s], last[2, s] = displacement[i, j, 0], displacement[i, j, 1], pressing[i, j]
    clock = noise[2]
    if clock[2] >= 1.0 and same(middle, last):
        after[3:6] = noise[3:6]
    else:
        if clock[2] >= 2.0:
            share = (clock[1] - clock[0]) / (time - clock[0])
            remember(after[0], noise_of_three(first[:2], middle[:2], last[:2], share))
            remember(after[1], noise_of_three(first[2:], middle[2:], last[2:], share))
        after[2, 0], after[2, 1], after[2, 2] = clock[1], time, clock[2] + 1.0
    return recent_median(after[0]), recent_median(after[1])


@compiled
def same(one: FloatArray, other: FloatArray) -> bool:
    """Whether two fields are the same to the last bit; looks no further than the first difference."""
    for a, b in zip(one.flat, other.flat):  # noqa: B905, SIM110 - compiled
        if a != b:
            return False
    return True
