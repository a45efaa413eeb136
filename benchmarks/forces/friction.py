"""Friction and slip from displacement and the gripper's force: grasps whose friction is known, seen without forces.

A sphere presses on a bonded gel of 5 mm and is drawn aside until all of it slides. Boundary elements of constant
traction on cells of 0.15 mm are the truth, with normal and tangential directions coupled; a reconstruction has bilinear
tractions one to a marker, 0.75 mm apart. Twenty grasps differ in load, radius and direction, and their friction
scatters by 5 % about that of the material, the median of the prior of scatter. Each seed is one of them with noise of
its own, and a gripper whose force is off by 1 % (standard deviation). Materials are five seeds each, drawn from all.
"""

import base64
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.special import ndtri, stdtrit

from benchmarks.detector.accuracy import count
from benchmarks.detector.scenes import PITCH, simulated
from benchmarks.pages import table
from estimators import EstimatorError, FrictionModel, Moments, fit
from slipcore import LOOKAHEAD, FrictionSamples, GraspLog, SlipHistory, collect_friction, detect_slip
from slipcore.contact.effects import FiniteLayer, NormalTangentialCoupling, ObjectMotion, SensorSampling
from slipcore.contact.scene import Finger, Press, Scene
from slipcore.contact.tiers.boundary_elements import Fidelity
from slipcore.forces import Gel, reconstruct
from slipcore.frames import BoolArray, FloatArray

GEL = Gel(1e6, 0.49, 5e-3)
FRICTION, SCATTER, GRASPS = 0.4, 0.05, 20
GRIPPER_ERROR = 0.01
NOISES = (1e-6, 3e-6)
WITH_DEPTH, IN_PLANE = "with z", "in the plane"
FIDELITY = Fidelity(cells=40, substeps=1, tolerance=1e-5)
PRESS, STILL, TRAVEL = 0.25, 0.1, 1.6e-3
"""s of pressing and of rest after it, and m by which the object is then drawn aside within 1.2 s."""
OF_A_MATERIAL, MATERIALS = 5, 200
SLACK = 0.005
"""F1 by which two detections may differ without one being worse."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One seed, seen with depth or not, with the object's motion known or not; NaN for what does not come of it.

    ``truth``: friction of this grasp. By the model of its samples β₀ is the ``intercept``, and ``level`` is friction in
    the middle of them; ``moments``: what other fits need of them (base64). ``contact``: friction of the contact as a
    whole with its interval, where it slid; ``slip``: F1 by reconstructed forces, by displacement alone, and by true
    forces.
    """

    seen: str
    motion: bool
    noise: float
    seed: int
    truth: float
    samples: int
    intercept: float
    level: float
    moments: str
    contact: float
    contact_interval: tuple[float, float]
    slip: tuple[float, float, float]


def grasp(number: int) -> tuple[Scene, float]:
    """One of the grasps, and its friction."""
    rng = np.random.default_rng([20, number])
    friction = FRICTION * (1.0 + SCATTER * float(ndtri((number + 0.5) / GRASPS)))
    angle, begin = rng.uniform(0.0, 2.0 * np.pi), PRESS + STILL
    way = TRAVEL * np.array([np.cos(angle), np.sin(angle)])
    motion = ObjectMotion((begin, begin + 1.2), x=(0.0, float(way[0])), y=(0.0, float(way[1])))
    sampling = SensorSampling((20, 20), PITCH, 30.0)
    effects = (sampling, FiniteLayer(GEL.thickness), NormalTangentialCoupling(), motion)
    finger = Finger(float(rng.uniform(12e-3, 20e-3)), GEL.young_modulus, GEL.poisson_ratio)
    press = Press(float(rng.uniform(7.0, 12.0)), PRESS)
    return Scene(f"grasp {number}", effects, finger, friction, press, begin + 1.2), friction


def outcomes(seen: str, noise: float, seed: int) -> Iterator[Outcome]:
    """Of one seed, with the object's motion known and not."""
    scene, friction = grasp(seed % GRASPS)
    log = simulated(scene, FIDELITY)
    blind = without_forces(log, seen, noise, np.random.default_rng([seed, round(1e6 * noise)]))
    found = reconstruct(blind, GEL)
    for motion in (False, True):
        alone = replace(blind, object_pose=log.object_pose if motion else None)
        by_forces, by_truth = found.apply(alone), replace(alone, force=log.force, normal=log.normal)
        history = detect_slip(by_forces, lookahead=LOOKAHEAD)
        others = (detect_slip(each, lookahead=LOOKAHEAD) for each in (touching(alone), by_truth))
        collected = collect_friction(found.for_samples(by_forces), history, **found.of_samples)
        contact = collected.contact
        slid = None if contact is None or contact.is_bound else contact
        yield Outcome(
            seen, motion, noise, seed, friction, len(collected.samples), *by_model(collected.samples),
            np.nan if slid is None else slid.coefficient,
            (np.nan, np.nan) if slid is None else (slid.low, slid.high),
            (f1(log, history), *(f1(log, other) for other in others)),
        )  # fmt: skip


def without_forces(log: GraspLog, seen: str, noise: float, rng: np.random.Generator) -> GraspLog:
    """What is left to a sensor that sees its markers move, in a gripper that tells its force."""
    assert log.force is not None
    displacement = log.displacement + noise * rng.standard_normal(log.displacement.shape)
    if seen == IN_PLANE:
        displacement[..., 2] = 0.0
    gripper = -log.force[..., 2].sum(axis=(1, 2)) * (1.0 + GRIPPER_ERROR * rng.standard_normal())
    return GraspLog(log.time, log.position, displacement, log.element_area, gripper_force=gripper)


def touching(log: GraspLog) -> GraspLog:
    """What a reader of markers in the plane makes of them: all are taken to touch."""
    if log.displacement[..., 2].any():
        return log
    return replace(log, contact=np.ones(log.displacement.shape[:3], dtype=bool))


def by_model(samples: FrictionSamples) -> tuple[float, float, str]:
    """β₀ and the level of these samples, NaN where no model comes of them, and their moments."""
    moments = base64.b64encode(Moments.from_samples(samples).to_bytes()).decode() if len(samples) else ""
    try:
        model = fit([samples], method="hierarchical")
    except EstimatorError:
        return np.nan, np.nan, moments
    level = model.predict(np.median(samples.tangential_velocity), np.median(samples.normal_force))
    return float(model.coefficients[0]), float(level), moments


def f1(log: GraspLog, history: SlipHistory) -> float:
    """Of slip in true contact."""
    assert log.truth is not None
    true, found = log.truth.slip_contact_factor & log.truth.contact, history.slip & log.truth.contact
    return count(true, found).f1


def campaign(path: Path, seeds: Mapping[str, int]) -> list[Outcome]:
    """Outcomes of so many seeds, one a line of a file; those that are in it are not made again."""
    known = [Outcome(**json.loads(line)) for line in path.read_text().splitlines()] if path.is_file() else []
    done = {(each.seen, each.noise, each.seed) for each in known}
    for seed in range(max(seeds.values())):
        for seen, noise in product(seeds, NOISES):
            if seed < seeds[seen] and (seen, noise, seed) not in done:
                found = list(outcomes(seen, noise, seed))
                with path.open("a") as file:
                    file.writelines(f"{json.dumps(asdict(each))}\n" for each in found)
                known += found
    return [each for each in known if each.seed < seeds.get(each.seen, 0)]


def materials(own: Sequence[Outcome]) -> tuple[FloatArray, BoolArray]:
    """β₀ and the level [k, 2] of materials of a few of these grasps each, where they have samples, and whether their
    intervals of 95 % hold the true friction.
    """
    told = [each for each in own if each.moments]
    if len(told) < OF_A_MATERIAL:
        return np.empty((0, 2)), np.empty((0, 2), dtype=bool)
    rng, models = np.random.default_rng(95), []
    for _ in range(MATERIALS):
        chosen = rng.choice(len(told), OF_A_MATERIAL, replace=False)
        frictions = FRICTION * (1.0 + SCATTER * rng.standard_normal(OF_A_MATERIAL))
        grasps = [with_friction(told[k], friction) for k, friction in zip(chosen, frictions, strict=True)]
        models.append(intercept_and_level(fit(grasps, method="hierarchical")))
    found, half = np.array(models).swapaxes(0, 1)
    return found, np.abs(found - FRICTION) <= half


def with_friction(outcome: Outcome, friction: float) -> Moments:
    """What would be known of a grasp of another friction: all ratios of forces are so many times as large."""
    own, factor = Moments.from_bytes(base64.b64decode(outcome.moments)), np.array([1.0, 1.0, friction / outcome.truth])
    whole = replace(own.factor, mean=own.factor.mean * factor, triangle=own.factor.triangle * factor)
    grasps = [
        replace(
            each, mean=each.mean * factor, spread=each.spread * factor, within=each.within * factor,
            alone=None if each.alone is None else each.alone * factor,
        )
        for each in own.grasps
    ]  # fmt: skip
    return replace(own, factor=whole, grasps=tuple(grasps))


def intercept_and_level(model: FrictionModel) -> tuple[FloatArray, FloatArray]:
    """β₀, and friction in the middle of the velocities and loads that were seen; and half their intervals of 95 %."""
    middle = [0.5 * sum(of) for of in (model.domain.tangential_velocity, model.domain.normal_force)]
    at = np.array([[1.0, 0.0, 0.0], [1.0, *middle]])
    error = np.sqrt(np.einsum("ki,ij,kj->k", at, model.covariance, at))
    return at @ model.coefficients, stdtrit(model.degrees_of_freedom, 0.975) * error


def groups(found: Sequence[Outcome]) -> dict[tuple[str, float, bool], list[Outcome]]:
    """By what is seen, noise, and whether the object's motion is known."""
    keys = sorted({(each.seen, each.noise, each.motion) for each in found}, key=lambda key: (key[0] == IN_PLANE, *key))
    return {key: [each for each in found if (each.seen, each.noise, each.motion) == key] for key in keys}


def friction_table(found: Sequence[Outcome]) -> str:
    """A row a group; errors in percent of the grasp's own friction, and for materials of theirs."""
    columns = ("seen, and F_z given", "noise, µm", "object's motion", "seeds", "samples", "level", "β₀",
               "β₀ within 5 / 10 %", "level of 5 grasps", "inside", "β₀ of 5 grasps", "inside", "contact slid",
               "friction of the contact", "inside",
               )  # fmt: skip
    return table(columns, [_friction_row(*key, each) for key, each in groups(found).items()])


def _friction_row(seen: str, noise: float, motion: bool, own: list[Outcome]) -> tuple[object, ...]:
    intercept, level, contact = (errors(own, name) for name in ("intercept", "level", "contact"))
    several, inside = materials(own)
    of_materials = [cell for k in (1, 0) for cell in (percent(several[:, k] / FRICTION - 1.0), share(inside[:, k]))]
    slid = [each for each in own if np.isfinite(each.contact)]
    holds = np.array([each.contact_interval[0] <= each.truth <= each.contact_interval[1] for each in slid])
    return (
        seen, f"{1e6 * noise:g}", "known" if motion else "–", len(own), f"{np.median([e.samples for e in own]):.0f}",
        percent(level), percent(intercept),
        " / ".join(f"{np.mean(np.abs(intercept) <= limit):.0%}" for limit in (0.05, 0.1)),
        *of_materials, f"{len(slid) / len(own):.0%}", percent(contact), share(holds),
    )  # fmt: skip


def errors(own: Sequence[Outcome], name: str) -> FloatArray:
    """Of what is named, relative to the grasp's own friction."""
    return np.array([getattr(each, name) / each.truth - 1.0 for each in own])


def percent(error: FloatArray) -> str:
    """Mean and standard deviation in percent, of those that are known."""
    known = error[np.isfinite(error)]
    return f"{100.0 * known.mean():+.1f} ± {100.0 * known.std():.1f}" if known.size else "–"


def share(held: BoolArray) -> str:
    """Of those that are true."""
    return f"{held.mean():.0%}" if held.size else "–"


def slip_table(found: Sequence[Outcome]) -> str:
    """F1 of slip by what is known, in the mean, and how often reconstructed forces make it worse."""
    columns = ("seen, and F_z given", "noise, µm", "object's motion", "seeds", "displacement alone",
               "reconstructed forces", "true forces", f"worse by over {SLACK}", "largest loss")  # fmt: skip
    rows = []
    for (seen, noise, motion), own in groups(found).items():
        slip = np.array([each.slip for each in own])
        loss, mean = slip[:, 1] - slip[:, 0], slip.mean(axis=0)
        rows.append((
            seen, f"{1e6 * noise:g}", "known" if motion else "–", len(own), *(f"{mean[k]:.3f}" for k in (1, 0, 2)),
            f"{np.mean(loss > SLACK):.0%}", f"{max(loss.max(), 0.0):.3f}",
        ))  # fmt: skip
    return table(columns, rows)


def picture(found: Sequence[Outcome]) -> Figure:
    """Errors of β₀ and of the level seed by seed, and slip with forces against without."""
    figure = Figure(figsize=(13, 4.5), layout="constrained")
    left, middle, slip = figure.subplots(1, 3)
    names = []
    for place, (key, own) in enumerate(groups(found).items()):
        seen, noise, motion = key
        names.append(f"{seen}, {1e6 * noise:g} µm" + (", motion known" if motion else ""))
        beside = place + np.linspace(-0.3, 0.3, len(own))
        for axes, name in ((left, "intercept"), (middle, "level")):
            axes.plot(100.0 * errors(own, name), beside, f"C{place}.", markersize=3)
        with_forces, alone, _ = np.transpose([each.slip for each in own])
        slip.plot(alone, with_forces, f"C{place}.", markersize=3)
    for axes, title in ((left, "β₀"), (middle, "friction in the middle of the samples")):
        axes.axvline(0.0, color="black", linewidth=0.8)
        axes.set(title=title, xlabel="error [% of the grasp's friction]", yticks=range(len(names)), xlim=(-30, 30))
        axes.grid(alpha=0.3)
    left.set_yticklabels(names, fontsize=8)
    middle.set_yticklabels([])
    slip.plot([0.6, 1.0], [0.6, 1.0], color="black", linewidth=0.8)
    slip.set(title="F1 of slip", xlabel="displacement alone", ylabel="with reconstructed forces")
    slip.grid(alpha=0.3)
    return figure
