"""What all methods share of a frame: noise, normals, split forces, contact."""

import math

from slipcore.compilation import compiled, unpack
from slipcore.defaults import NOISE
from slipcore.detection.shared.contact import TOUCH, ContactThreshold, find_contact, spatial_noise
from slipcore.detection.shared.lasting_noise import OF_STEP, step_lasting
from slipcore.detection.shared.records import DetectorSetup, FrameArrays, Memory, Workspace
from slipcore.frames import FloatArray
from slipcore.noise import noise_of_three, recent_median, remember
from slipcore.surface.normals import split_forces, surface_normals

SERIES = NOISE.series


@compiled(inline=True)
def observe(sensor: DetectorSetup, frame: FrameArrays, before: Memory, after: Memory, room: Workspace) -> bool:
    """Fill ``room.surface``, what all methods see of a frame, and in the memory ``after`` contact and the state of the
    noise estimate. Whether there are forces, and they do not pull: an object cannot, and contact is then by shape.
    """
    normal, pressing, tangential, stays, noise = room.surface
    if frame.normal.size:
        normal[:] = frame.normal
    else:
        surface_normals(sensor.rest_steps, sensor.orientation, frame.displacement, normal)
    if frame.force.size:
        split_forces(frame.force, normal, pressing, tangential)
    else:
        indent(frame.displacement, pressing)
        tangential[:] = 0.0
    noise[0], noise[1] = step_noise(before.noise, frame.time, frame.displacement, pressing, after.noise, room.series)
    fresh = after.noise[2, 2] > before.noise[2, 2]
    between, step, step_of_depth = step_lasting(before.noise, frame.displacement, fresh, after.noise, room.series)
    noise[2], noise[3] = between, step
    if not frame.force.size:
        noise[1] = max(noise[1], OF_STEP * step_of_depth)
    contact, was = after.contact, before.contact
    by_force, by_shape = (
        ContactThreshold(*unpack(sensor.touch_by_force, TOUCH)),
        ContactThreshold(*unpack(sensor.touch_by_shape, TOUCH)),
    )
    pulls = frame.force.size > 0 and pulled(pressing, noise[1], by_force)
    if frame.contact.size:
        contact[:] = frame.contact
    elif pulls:
        indent(frame.displacement, room.weight)
        find_contact(room.weight, noise[0], was, by_shape, contact)
    else:
        find_contact(pressing, noise[1], was, by_force if frame.force.size else by_shape, contact)
    n, m = contact.shape
    for i in range(n):
        for j in range(m):
            stays[i, j] = contact[i, j] and was[i, j]
    return frame.force.size > 0 and not pulls


@compiled
def pulled(pressing: FloatArray, sigma: float, touch: ContactThreshold) -> bool:
    """Whether elements pull on the whole, by more than noise ``sigma``, N, and what an element needs to touch."""
    known = spatial_noise(pressing) if math.isnan(sigma) else sigma
    noise = 0.0 if math.isnan(known) else touch.noise * known * math.sqrt(pressing.size)
    return bool(pressing.sum() < -noise - touch.least * pressing.size)


@compiled
def indent(displacement: FloatArray, depth: FloatArray) -> None:
    """Fill the indentation ``depth`` [n, m] m."""
    n, m = depth.shape
    for i in range(n):
        for j in range(m):
            depth[i, j] = -displacement[i, j, 2]


@compiled
def step_noise(
    noise: FloatArray,
    time: float,
    displacement: FloatArray,
    pressing: FloatArray,
    after: FloatArray,
    series: FloatArray,
) -> tuple[float, float]:
    """Learn from one more frame, unless it repeats the last (that would make the noise look smaller); the noise of a
    marker coordinate, m, and of ``pressing``, NaN while unknown. ``series`` [2, k]: room for medians.

    Remembered in the first nine rows of [11, columns]: recent estimates of markers and of pressing; a clock (times of
    the last two frames, and how many there were); then x, y and pressing of evenly chosen elements in each of these.
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
            remember(after[0], noise_of_three(first[:2], middle[:2], last[:2], share, series))
            remember(after[1], noise_of_three(first[2:], middle[2:], last[2:], share, series))
        after[2, 0], after[2, 1], after[2, 2] = clock[1], time, clock[2] + 1.0
    return recent_median(after[0], series[0]), recent_median(after[1], series[0])


@compiled
def same(one: FloatArray, other: FloatArray) -> bool:
    """Whether two fields are the same to the last bit; looks no further than the first difference."""
    for a, b in zip(one.flat, other.flat):  # noqa: B905, SIM110 - compiled
        if a != b:
            return False
    return True
