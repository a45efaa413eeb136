"""What all methods share of a frame: noise, normals, split forces, contact."""

import math

from slipcore.compilation import compiled, unpack
from slipcore.defaults import NOISE, SMOOTHING
from slipcore.detection.shared.contact import TOUCH, ContactThreshold, find_contact, spatial_noise
from slipcore.detection.shared.lasting_noise import OF_STEP, TURNING, step_lasting
from slipcore.detection.shared.records import DetectorSetup, FrameArrays, Memory, Workspace, named
from slipcore.frames import FloatArray
from slipcore.noise import noise_of_three, recent_median, remember
from slipcore.surface.normals import split_forces, surface_normals
from slipcore.surface.turning import SUMS, add_turning, turns

SERIES, _STALE, _MOVED, _LEAST_NOISE = (
    NOISE.series,
    NOISE.stale_time,
    NOISE.stale_deviations,
    SMOOTHING.least_force_noise,
)


@compiled
def observe_frame(
    sensor: DetectorSetup, last: FrameArrays, frame: FrameArrays, before: Memory, after: Memory, room: Workspace
) -> bool:
    """``observe`` with normals; what it is given may be plain tuples of the same entries."""
    sensor, last, frame, before, after, room = named(sensor, last, frame, before, after, room)
    return observe(sensor, last, frame, before, after, room, True)


@compiled(inline=True)
def observe(
    sensor: DetectorSetup,
    last: FrameArrays,
    frame: FrameArrays,
    before: Memory,
    after: Memory,
    room: Workspace,
    needs_normals: bool,
) -> bool:
    """Fill ``room.surface``, what all methods see of a frame, and in the memory ``after`` contact and the state of the
    noise estimate. Whether there are forces to believe: an object cannot pull, nor do forces stand still while markers
    move. Otherwise contact is by shape. Without forces normals are only worked out if the method ``needs_normals``.
    """
    normal, pressing, tangential, stays, noise = room.surface
    learns = frame.force.size > 0 and frame.normal.size == 0
    if frame.normal.size:
        normal[:] = frame.normal
    elif needs_normals or frame.force.size:
        surface_normals(sensor.rest_steps, sensor.orientation, frame.displacement, normal)
    if learns:
        turn_back(sensor.position, sensor.normal, frame.force, before.noise[TURNING], after.noise[TURNING], normal)
    else:
        after.noise[TURNING] = before.noise[TURNING]
    if frame.force.size:
        split_forces(frame.force, normal, pressing, tangential)
    else:
        indent(frame.displacement, pressing)
        tangential[:] = 0.0
    noise[0], noise[1] = step_noise(before.noise, frame.time, frame.displacement, pressing, after.noise, room.series)
    if learns:
        step_turns(noise[1], after.noise[TURNING])
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
    step_standing(sensor.position, last, frame, before.noise[2], noise, after.noise[2])
    believed = after.noise[2, 3] < _STALE and not (frame.force.size > 0 and pulled(pressing, noise[1], by_force))
    if frame.contact.size:
        contact[:] = frame.contact
    elif not believed:
        indent(frame.displacement, room.weight)
        find_contact(room.weight, noise[0], was, by_shape, contact)
    else:
        find_contact(pressing, noise[1], was, by_force if frame.force.size else by_shape, contact)
    n, m = contact.shape
    for i in range(n):
        for j in range(m):
            stays[i, j] = contact[i, j] and was[i, j]
    return frame.force.size > 0 and believed


@compiled
def turn_back(
    position: FloatArray,
    rest: FloatArray,
    force: FloatArray,
    before: FloatArray,
    after: FloatArray,
    normal: FloatArray,
) -> None:
    """Make the ``normal`` [n, m, 3] of the deformed shape that at ``rest``, unless forces [n, m, 3] N turned so far by
    the row ``before``; and keep in the row ``after`` what this frame says of that, too.
    """
    after[:] = before
    add_turning(position, rest, normal, force, after[:SUMS])
    if before[SUMS] == 0.0:
        normal[:] = rest


@compiled
def step_turns(noise: float, after: FloatArray) -> None:
    """Keep in the row ``after`` whether forces turn, by its sums and the ``noise`` of the forces, N."""
    after[SUMS] = turns(after[:SUMS], noise, after[SUMS] > 0.0)


@compiled
def step_standing(
    position: FloatArray,
    last: FrameArrays,
    frame: FrameArrays,
    before: FloatArray,
    noise: FloatArray,
    after: FloatArray,
) -> None:
    """Keep in the clock row ``after`` for how long forces have been the same to the last bit while markers moved, s,
    and the sums of displacement and of its moment when forces last changed.

    Markers have moved once a sum parts from that by ``NOISE.stale_deviations`` of its ``noise``. Those forces may stay
    that are all 0, as a sensor sends them while nothing touches, or that showed no noise before.
    """
    stands = frame.force.size > 0 and last.force.size > 0 and same(last.force, frame.force) and frame.force.any()
    stands = stands and (before[3] > 0.0 or noise[1] > _LEAST_NOISE)
    n, m, _ = frame.displacement.shape
    x = y = z = moment = lever = 0.0
    for i in range(n):
        for j in range(m):
            rx, ry = position[i, j, 0] - position[n // 2, m // 2, 0], position[i, j, 1] - position[n // 2, m // 2, 1]
            x += frame.displacement[i, j, 0]
            y += frame.displacement[i, j, 1]
            z += frame.displacement[i, j, 2]
            moment += rx * frame.displacement[i, j, 1] - ry * frame.displacement[i, j, 0]
            lever += rx * rx + ry * ry
    if not stands:
        after[3], after[4], after[5], after[6], after[7] = 0.0, x, y, z, moment
        return
    after[4:8] = before[4:8]
    moved = max(abs(x - before[4]), abs(y - before[5]), abs(z - before[6])) > _MOVED * noise[0] * math.sqrt(n * m)
    moved = moved or abs(moment - before[7]) > _MOVED * noise[0] * math.sqrt(lever)
    after[3] = before[3] + frame.time - last.time if moved or before[3] > 0.0 else 0.0


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
    the last two frames, how many there were, and for how long forces have stood still); then x, y and pressing of
    evenly chosen elements in each of these.
    """
    n, m = pressing.shape
    k = min(n * m, SERIES)
    after[:3] = noise[:3]
    after[3:6] = noise[6:9]
    first, middle, last = noise[3:6, :k], noise[6:9, :k], after[6:9, :k]
    place, depth = displacement.reshape(n * m, 3), pressing.reshape(n * m)
    for s in range(k):
        e = s * n * m // k
        last[0, s], last[1, s], last[2, s] = place[e, 0], place[e, 1], depth[e]
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
