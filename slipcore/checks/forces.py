"""Checks of forces against the markers: their zero, and the frame in which they are given.

Friction takes the ratio of two components of force, so that a zero that is off or a leaning frame changes it wherever
it is measured, and alike: neither force, place nor scatter shows it. The markers do.
"""

from collections.abc import Iterator, Sequence
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipcore.checks.rest import frames_at_rest, touched_elements
from slipcore.checks.subject import Subject
from slipcore.defaults import CheckOptions
from slipcore.finding import Finding
from slipcore.frames import BoolArray, FloatArray, unit

ComplexArray = NDArray[np.complex128]


def zero_offset(seen: Subject) -> Iterator[Finding]:
    """Forces where nothing touches: in the frames in which the markers have not moved yet, or no longer are."""
    force, rest = _measured(seen), frames_at_rest(seen)
    if force is None or not rest.any():
        return
    read, held = np.median(force[rest], axis=0), np.median(seen.pressing[seen.held], axis=0)
    if _likeness(-read[..., 2], held) > seen.limits.contact_likeness:  # markers were zeroed during a touch
        return
    touched = touched_elements(seen)
    noise = (_of_medians(force[rest][:, touched]),)
    off, pressed = _alike(read[touched], noise, seen.limits), float(held[touched].mean())
    if 0.0 < seen.limits.zero_share * pressed < off:
        share = f"{off / pressed:.0%} of their force in the grasp"
        evidence = f"elements read {1e3 * off:.2g} mN in the mean while nothing moves them, {share}"
        yield Finding("zero offset", evidence, "zero the sensor before each grasp, with nothing in touch")


def zero_drift(seen: Subject) -> Iterator[Finding]:
    """A zero that moves while the contact is held: by elements that nothing touches, or by the rest after the grasp."""
    force = _measured(seen)
    if force is None or not seen.held.any():
        return
    touched = touched_elements(seen)
    pressed = float(np.median(seen.pressing[seen.held], axis=0)[touched].mean()) if touched.any() else 0.0
    for elements, early, late, where in (_beside_the_contact(seen), _before_and_after(seen, touched)):
        if min(np.count_nonzero(early), np.count_nonzero(late)) < seen.limits.least_rest or not elements.any():
            continue
        moved = np.median(force[late], axis=0) - np.median(force[early], axis=0)
        noise = tuple(_of_medians(force[when][:, elements]) for when in (early, late))
        off = _alike(moved[elements], noise, seen.limits, may_leak=elements is not touched)
        if 0.0 < seen.limits.zero_share * pressed < off:
            share = f"{off / pressed:.0%} of the force of elements in the grasp"
            evidence = f"elements {where} read {1e3 * off:.2g} mN more at its end than at its begin, {share}"
            yield Finding("zero drift", evidence, "let the sensor warm up, and zero it before each grasp")
            return


def _beside_the_contact(seen: Subject) -> tuple[BoolArray, BoolArray, BoolArray, str]:
    """Elements well away from all that touch more than passingly, in the first and last fifth of the frames held."""
    from scipy.ndimage import maximum_filter

    touching = seen.history.contact.mean(axis=0) > seen.limits.passing_touch
    free = ~maximum_filter(touching, 2 * seen.limits.free_distance + 1, mode="constant")
    free &= np.count_nonzero(free) >= seen.limits.least_free
    order = np.cumsum(seen.held)
    fifth = max(seen.limits.least_rest, int(order[-1]) // 5)
    return free, seen.held & (order <= fifth), seen.held & (order > order[-1] - fifth), "beside the contact"


def _before_and_after(seen: Subject, touched: BoolArray) -> tuple[BoolArray, BoolArray, BoolArray, str]:
    """The elements that touch, at rest before the grasp and after it."""
    rest, moment = frames_at_rest(seen), np.arange(len(seen.held))
    begin, end = np.flatnonzero(seen.held)[[0, -1]]
    return touched, rest & (moment < begin), rest & (moment > end), "that it touches"


def gripper_force(seen: Subject) -> Iterator[Finding]:
    """Normal forces that add up to another sum than the gripper reports, or that part from it during the grasp."""
    force, reported = _measured(seen), seen.log.gripper_force
    if force is None or reported is None:
        return
    most, within = float(reported.max()), seen.limits.gripper_delay * np.abs(np.gradient(reported, seen.log.time))
    is_steady = (reported > seen.limits.gripper_full * most) & (within < seen.limits.gripper_change * most)
    held = np.flatnonzero(seen.held & is_steady)
    if len(held) < seen.limits.least_held:
        return
    ratio, fifth = seen.total[held] / reported[held], max(len(held) // 5, 2)
    unsure = 3.0 * (seen.log.gripper_force_deviation or 0.0) / float(np.median(reported[held]))
    typical, begin, end = (float(np.median(each)) for each in (ratio, ratio[:fifth], ratio[-fifth:]))
    beside = seen.limits.gripper_cropped <= typical < 1.0 and _leaves_the_lattice(seen, held)
    if max(typical, 1.0 / typical) - 1.0 > max(seen.limits.gripper_share, unsure) and not beside:
        evidence = f"the normal forces of all elements add up to {typical:.2g} of what the gripper reports"
        remedy = "make sure of N on all axes (kgf: 0.1; mN: 1000), and that it is this finger's force"
        yield Finding("gripper's force differs", evidence, remedy)
    elif max(end / begin, begin / end) - 1.0 > max(seen.limits.gripper_trend, unsure):
        evidence = (
            f"the normal forces of all elements add up to {begin:.2g} of what the gripper reports as the grasp begins, "
            f"and to {end:.2g} as it ends"
        )
        yield Finding(
            "gripper's force differs", evidence, "the sensor creeps: grasp for a shorter time, or calibrate it"
        )


def _leaves_the_lattice(seen: Subject, held: NDArray[np.intp]) -> bool:
    """Whether outer elements mostly touch in these frames: what lies beside them bears some of the force."""
    touched = seen.history.contact[held].mean(axis=0) > 0.5
    return int(touched.sum()) > int(touched[1:-1, 1:-1].sum())


def leaning_normals(seen: Subject) -> Iterator[Finding]:
    """Normals that lean against the surface that the elements lie on, in all frames: friction splits forces by them."""
    log = seen.log
    if log.normal is None or log.has_reconstructed_force or min(log.grid) < 3:
        return
    idle = np.flatnonzero(~seen.history.contact.any(axis=(1, 2)))
    frames = idle if len(idle) > 1 else np.arange(len(log))
    chosen = np.unique(frames[np.linspace(0, len(frames) - 1, seen.limits.stretch_frames).astype(int)])
    found = (_lean_of_frame(log.normal[k], log.position, log.displacement[k], seen.limits) for k in chosen)
    leans = [each for each in found if each is not None]
    if leans and all(lean > max(seen.limits.normal_lean, seen.limits.lean_errors * error) for lean, error in leans):
        degrees = np.degrees(min(leans)[0])
        evidence = f"normals lean by {degrees:.1f}° against the surface that the elements lie on, in every frame"
        yield Finding("leaning normals", evidence, "give normals in the sensor's frame, or none")


def _lean_of_frame(
    normal: FloatArray, position: FloatArray, displacement: FloatArray, limits: CheckOptions
) -> tuple[float, float] | None:
    """``_lean`` against the surface at rest, or as it is pressed: that to which the normals belong, told better."""
    found = (_lean(normal, place, limits) for place in (position, position + displacement))
    return min((each for each in found if each is not None), key=lambda each: each[1], default=None)


def _lean(normal: FloatArray, place: FloatArray, limits: CheckOptions) -> tuple[float, float] | None:
    """Angle in rad by which normals [n, m, 3] lean alike against the surface through ``place`` [n, m, 3] m, and its
    standard error; None where the places do not show the surface.

    The line to a neighbour is square to the mean of both normals, exactly so on a sphere, a cylinder and a plane,
    however few elements there are. Of large leans the mean normal tells more, against the plane of the mean lines: a
    line along the lean is square to normals however they are turned about it.
    """
    if _is_flat_below(normal, place, limits):
        return None
    upward = unit(normal.mean(axis=(0, 1)))
    turns, gaps, along = list[FloatArray](), list[FloatArray](), list[FloatArray]()
    for axis in (0, 1):
        line = unit(np.diff(place, axis=axis))
        middle = 0.5 * (np.delete(normal, 0, axis) + np.delete(normal, -1, axis))
        turns.append(np.moveaxis(np.cross(middle, line), axis, 0).reshape(-1, 3))
        gaps.append(-np.moveaxis(np.vecdot(middle, line), axis, 0).ravel())
        along.append(line.mean(axis=(0, 1)))
    turn, gap = np.concatenate(turns), np.concatenate(gaps)
    across = turn - np.outer(turn @ upward, upward)  # turned about themselves normals lean nowhere
    inverse = np.linalg.pinv(across, rcond=float(np.sqrt(np.finfo(float).eps)))
    found = inverse @ gap
    weight, left = unit(found) @ inverse, gap - across @ found
    outward = unit(np.cross(along[0], along[1]))
    direct = float(np.arctan2(np.linalg.norm(np.cross(upward, outward)), abs(upward @ outward)))
    if direct > limits.large_lean:
        return direct, float(normal.std(axis=(0, 1)).max() / np.sqrt(normal[..., 0].size))
    return float(np.arctan(np.linalg.norm(found))), _error_of_lean(weight, left, normal.shape[:2])


def _error_of_lean(weight: FloatArray, left: FloatArray, grid: tuple[int, int]) -> float:
    """Standard error of the weighted sum over the lines between neighbours, rows of axis 0 before those of axis 1.

    Of what is ``left`` of each line alone, or of strips of lines that lie side by side, which a rim takes alike. Twice
    the variance: two lines in a row share a normal.
    """
    n, m = grid
    alone = float(left @ left) / (len(left) - 2) * float(weight @ weight)
    rows, columns = np.split(weight * left, [(n - 1) * m])
    sums = [(rows.reshape(n - 1, m).sum(axis=1), n - 1), (columns.reshape(m - 1, n).sum(axis=1), m - 1)]
    strips = sum(float(each @ each) * count / (count - 1) for each, count in sums)
    return float(np.sqrt(2.0 * max(alone, strips)))


def _is_flat_below(normal: FloatArray, place: FloatArray, limits: CheckOptions) -> bool:
    """Whether places [n, m, 3] lie in a plane while normals turn from place to place, as on a curved sensor."""
    around, turned = ((each - each.mean(axis=(0, 1))).reshape(-1, 3) for each in (place, normal))
    within, size, _ = np.linalg.svd(around, full_matrices=False)
    root, spread = np.sqrt(len(turned)), float(np.linalg.norm(within[:, :2].T @ turned))
    noise = np.sqrt(max(float((turned**2).sum()) - spread**2, 0.0))
    turns = spread > max(noise, limits.least_turning * root)
    return bool(turns and size[2] * root < limits.flat_places * spread * float(np.hypot(*size[:2])))


class MedianNoise(NamedTuple):
    """Variance [3] N² of elements' medians by noise, their mean, and by how many ``degrees`` of freedom it is known."""

    variance: FloatArray
    degrees: int


def _of_medians(readings: FloatArray) -> MedianNoise:
    """Of ``readings`` [t, k, 3] N over their frames."""
    frames, count, _ = readings.shape
    return MedianNoise(0.5 * np.pi * readings.var(axis=0, ddof=1).mean(axis=0) / frames, count * (frames - 1))


def _alike(read: FloatArray, medians: Sequence[MedianNoise], limits: CheckOptions, may_leak: bool = False) -> float:
    """What elements read alike, N, beyond noise: of ``read`` [k, 3], by the ``medians`` that it is the difference of.

    What differs from element to element, as noise that outlasts the rest does, moves friction nowhere in the mean. What
    ``may_leak`` to them of a contact that changes falls off with their distance: it differs by as much as its mean.
    Each component is compared with its own noise, by Student's distribution where that is known from few elements or
    frames, so that none hides what another shows.
    """
    from scipy.special import stdtrit

    count, square = len(read), read.mean(axis=0) ** 2
    lasting = read.var(axis=0, ddof=min(count - 1, 1))
    passing = np.sum([each.variance for each in medians], axis=0)
    leak = float(may_leak) * np.maximum(lasting - passing, 0.0)
    between, within = max(count - 1, 1), min(each.degrees for each in medians)
    errors = stdtrit(np.array([between, within]), NormalDist().cdf(limits.zero_errors))
    least = np.maximum(errors[0] ** 2 * lasting, errors[1] ** 2 * passing) / count + limits.leak_variances * leak
    noise = np.maximum(lasting, passing) / count + leak
    return float(np.sqrt(np.where(square > least, square - noise, 0.0).sum()))


def _likeness(read: FloatArray, held: FloatArray) -> float:
    """Correlation of forces [n, m] over the elements with those of the grasp; that of a wrong zero is about 0."""
    if np.ptp(held) == 0.0 or np.ptp(read) == 0.0:
        return 0.0
    return float(np.corrcoef(read.ravel(), held.ravel())[0, 1])


def force_frame(seen: Subject) -> Iterator[Finding]:
    """Forces sideways that do not go with the markers: these say when the contact is pressed, and where it is pulled.

    A gel is elastic: the sum of tangential forces follows that of the markers' displacement, whatever slips above it.
    """
    force = _measured(seen)
    if force is None or np.count_nonzero(seen.held) < seen.limits.least_held:
        return
    moved, ratio = _sideways(seen, seen.log.displacement), _sideways(seen, force)
    largest = float(np.abs(moved).max())
    if largest == 0.0:
        return
    moved = moved / largest
    (follows, alone), left = _line(moved, ratio)
    (mirrored, _), left_mirrored = _line(moved.conj(), ratio)
    turned = float(np.degrees(np.angle(follows)))
    began_bare = not seen.history.contact[0].any()  # markers zeroed under a load stand still where it pulls
    if began_bare and np.abs(moved).min() < seen.limits.least_moved and abs(alone) > max(seen.limits.lean, 2.0 * left):
        evidence = (
            f"{abs(alone):.2f} of the normal force points sideways where no marker moves so: "
            f"forces lean by {np.degrees(np.arctan(abs(alone))):.0f}° against the markers"
        )
        remedy = "give forces in the sensor's frame, z along its outward normal; calibrate crosstalk by a pure press"
        yield Finding("leaning forces", evidence, remedy)
    significant = max(seen.limits.no_load, 2.0 * left)
    if abs(mirrored) > significant and left > 2.0 * left_mirrored + seen.limits.no_load:
        yield _turned("forces go with the markers as in a mirror: two axes are exchanged, or one is reversed")
    elif abs(follows) > significant and abs(turned) > seen.limits.turn:
        yield _turned(f"forces point {abs(turned):.0f}° away from where the markers go")


def _turned(evidence: str) -> Finding:
    return Finding(
        "turned axes", evidence, "give forces and markers in one frame: turn or exchange axes in the mapping"
    )


def _sideways(seen: Subject, field: FloatArray) -> ComplexArray:
    """Sum over the contact of a field's tangential part, x + iy, over the normal force, in frames held.

    Along the normals of a dome forces and markers go by two other ratios.
    """
    assert seen.normal is not None
    normal, touching = seen.normal[seen.held], seen.history.contact[seen.held]
    chosen = np.where(touching[..., None], field[seen.held], 0.0)
    pressed = np.einsum("tnmi,tnmi->tnm", chosen, normal)
    along = chosen[..., :2].sum(axis=(1, 2)) - np.einsum("tnm,tnmi->ti", pressed, normal[..., :2])
    return np.asarray((along[:, 0] + 1j * along[:, 1]) / seen.total[seen.held])


def _line(moved: ComplexArray, ratio: ComplexArray) -> tuple[tuple[complex, complex], float]:
    """Slope and intercept of what goes with ``moved``, and the standard deviation of the rest."""
    terms = np.stack([moved, np.ones_like(moved)], axis=-1)
    found = np.linalg.lstsq(terms, ratio, rcond=None)[0]
    return (complex(found[0]), complex(found[1])), float((ratio - terms @ found).std())


def _measured(seen: Subject) -> FloatArray | None:
    """Forces that a sensor measured; those that follow from the markers contradict them in nothing."""
    return None if seen.log.has_reconstructed_force else seen.log.force
