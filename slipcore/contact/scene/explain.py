"""What the effects of a scene are there for, what each costs, and what leaving it out would change: measured."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from slipcore.contact.defaults import EXPLAIN
from slipcore.contact.effects.finite_layer import FiniteLayer
from slipcore.contact.effects.sensor_sampling import SensorSampling
from slipcore.contact.errors import ManyRuns
from slipcore.contact.plan.description import SceneDescription
from slipcore.contact.plan.plan import Effect, Observed, Plan, SamplingPlan
from slipcore.contact.progress import Progress, no_progress
from slipcore.contact.scene.simulate import observe
from slipcore.contact.solver.warm_up import load_kernels
from slipcore.contact.tiers.accuracy import Difference, difference
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.contact.tiers.probe import contact_reach
from slipcore.errors import SlipcoreError
from slipcore.frames import GraspLog

COARSE_RUNS = Fidelity(EXPLAIN.cells, tolerance=EXPLAIN.tolerance)


@dataclass(frozen=True, slots=True)
class EffectReport:
    """One effect in play.

    ``seconds`` and ``applications`` of operators that the coarse run takes more with it than without; ``change`` of
    the log without it, None where the two cannot be compared, with a ``note`` that says why.
    """

    name: str
    why: str
    cost: str
    seconds: float
    applications: int
    change: Difference | None
    note: str


@dataclass(frozen=True, slots=True)
class Proposal:
    """Something to ``add`` or ``leave out``: the name of an effect, the reason, and the source of its threshold."""

    action: str
    effect: str
    reason: str
    source: str


@dataclass(frozen=True, slots=True)
class Explanation:
    """A scene explained: ``seconds`` and operator ``applications`` of the coarse run with all its effects."""

    scene: str
    seconds: float
    applications: int
    effects: tuple[EffectReport, ...]
    proposals: tuple[Proposal, ...]

    def __str__(self) -> str:
        """A text for people."""
        lines = [
            f"{self.scene}: {len(self.effects)} effects; a coarse run takes {self.seconds:.2f} s and "
            f"{self.applications} operator applications",
            "",
        ]
        for report in self.effects:
            lines += [
                f"{report.name}: {report.why}",
                f"    costs    {report.applications:+d} applications, {report.seconds:+.2f} s ({report.cost})",
                f"    without  {_changed(report)}",
            ]
        lines += ["", "Proposals:" if self.proposals else "No proposals."]
        for proposal in self.proposals:
            lines.append(f"    {proposal.action} {proposal.effect}: {proposal.reason} [{proposal.source}]")
        return "\n".join(lines)


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """A coarse run of a scene: its log ``seen`` by the sensor and before that, its cost, and the plan."""

    scene: SceneDescription
    plan: Plan
    log: GraspLog
    seen: GraspLog
    seconds: float
    applications: int


def explain(
    scene: SceneDescription, seed: int = 0, progress: Progress = no_progress, *, all_runs: bool = False
) -> Explanation:
    """Run a scene coarsely, with all its effects and without each in turn that is mechanics; what is only observed is
    left out of the first run's log.

    Raises ``ManyRuns``, after the first, where that takes more than ``EXPLAIN.most_runs`` and not ``all_runs`` are
    wanted, and what ``simulate`` raises.
    """
    sampling, effects, reports = _few_frames(scene.plan(seed)), scene.present(), list[EffectReport]()
    load_kernels()
    whole = _measure(scene, sampling, seed)
    runs = 1 + sum(not _only_observed(effect) for effect in effects)
    if runs > EXPLAIN.most_runs and not all_runs:
        raise ManyRuns(runs, runs * whole.seconds)
    done = 1
    for effect in effects:
        progress(done / runs)
        reports.append(_report(whole, effect, sampling, seed))
        done += not _only_observed(effect)
    added = (propose(whole) for propose in PROPOSALS)
    left_out = (_superfluous(report) for report in reports)
    proposals = tuple(proposal for proposal in (*added, *left_out) if proposal is not None)
    return Explanation(scene.name, whole.seconds, whole.applications, tuple(reports), proposals)


def _only_observed(effect: Effect) -> bool:
    """Whether an effect never reaches the mechanics."""
    return isinstance(effect, Observed | SensorSampling)


def _few_frames(plan: Plan) -> SamplingPlan:
    """The plan's sampling at few frames; points over the contact where it has none."""
    rate = EXPLAIN.frames / plan.duration
    if plan.sampling is not None:
        return replace(plan.sampling, frame_rate=rate)
    return SamplingPlan((COARSE_RUNS.cells, COARSE_RUNS.cells), 2.0 * contact_reach(plan) / COARSE_RUNS.cells, rate)


def _measure(scene: SceneDescription, sampling: SamplingPlan, seed: int) -> Measured:
    plan, began = replace(scene.plan(seed), sampling=sampling), time.perf_counter()
    log = run(plan, COARSE_RUNS)
    seconds = time.perf_counter() - began
    return Measured(scene, plan, log, observe(plan, log), seconds, int(log.metadata["applications"]))


def _unobserved(whole: Measured, scene: SceneDescription, sampling: SamplingPlan, seed: int) -> Measured:
    """The run of the whole scene, seen without what is only observed."""
    plan = replace(scene.plan(seed), sampling=sampling)
    return replace(whole, scene=scene, plan=plan, seen=observe(plan, whole.log))


def _report(whole: Measured, effect: Effect, sampling: SamplingPlan, seed: int) -> EffectReport:
    """The scene with and without one effect."""
    kind = type(effect)
    rest = tuple(other for other in whole.scene.effects if other is not effect)
    try:
        scene = replace(whole.scene, effects=rest)
        without = (
            _unobserved(whole, scene, sampling, seed) if _only_observed(effect) else _measure(scene, sampling, seed)
        )
    except SlipcoreError as error:
        return EffectReport(kind.__name__, kind.why, kind.cost, 0.0, 0, None, f"the scene cannot be: {error}")
    change, note = _compared(without, whole)
    return EffectReport(
        name=kind.__name__,
        why=kind.why,
        cost=kind.cost,
        seconds=whole.seconds - without.seconds,
        applications=whole.applications - without.applications,
        change=change,
        note=note,
    )


def _compared(without: Measured, whole: Measured) -> tuple[Difference | None, str]:
    if without.seen.displacement.shape != whole.seen.displacement.shape:
        return None, f"{len(without.seen)} frames in place of {len(whole.seen)}"
    change = difference(without.seen, whole.seen)
    same_plan = without.scene.plan().sampling == whole.scene.plan().sampling
    return (change, "") if same_plan else (None, "every cell is a point, at 60 frames; the mechanics stay")


def _changed(report: EffectReport) -> str:
    if report.change is None:
        return report.note
    change = report.change
    return (
        f"stick ratio {change.stick_ratio:.3f}, displacement {100 * change.displacement:.2g} %, "
        f"force {100 * change.force:.2g} % different"
    )


# Proposals: each looks at one thing.


def _base(whole: Measured) -> Proposal | None:
    """A base under a gel that is not thick against the contact."""
    thickness, radius = whole.scene.finger.thickness, contact_reach(whole.plan)
    if _has_layer(whole) or radius < EXPLAIN.layer_ratio * thickness:
        return None
    chi = radius / thickness
    reason = (
        f"the contact reaches {1e3 * radius:.2g} mm and the gel is {1e3 * thickness:.2g} mm thick (ratio {chi:.2g}); "
        f"from {EXPLAIN.layer_ratio} on its base stiffens it by 10 % and more"
    )
    return Proposal("add", "FiniteLayer", reason, "Garcia & Garcia, Biophys. J. 114 (2018) 2923")


def _coupling(whole: Measured) -> Proposal | None:
    """Normal–tangential coupling where pressing alone would make slip."""
    problem, friction = whole.plan.problem, whole.scene.friction
    if problem.coupled or problem.spread:
        return None
    if _has_layer(whole):
        reason = f"pressing shears a bonded layer at any ν: up to {EXPLAIN.layer_shear} μp₀ on 5 mm of gel at ν = 0.49"
        return Proposal("add", "NormalTangentialCoupling", reason, "boundary elements with and without it")
    ratio = whole.plan.poisson_ratio
    dundurs = (1.0 - 2.0 * ratio) / (2.0 * (1.0 - ratio))
    if friction == 0.0 or dundurs < EXPLAIN.coupling_ratio * friction:
        return None
    reason = f"Dundurs' β = {dundurs:.2g} at ν = {ratio:g} against a rigid object, {dundurs / friction:.2g} of μ"
    return Proposal(
        "add", "NormalTangentialCoupling", reason, f"Spence, J. Elasticity 5 (1975) 297: β/μ ≥ {EXPLAIN.coupling_ratio}"
    )


def _off_centre(whole: Measured) -> Proposal | None:
    """A moment where the pressure's centre is not the sensor's, through which forces go."""
    force = whole.log.force
    assert force is not None  # simulated logs have forces
    normal = np.abs(force[..., 2]).sum(axis=(1, 2))
    k = int(np.argmax(normal))
    driven = whole.plan.drives("moment") or whole.plan.drives("yaw")
    if driven or normal[k] == 0.0 or whole.scene.friction == 0.0:
        return None
    weight = np.abs(force[k, ..., 2])[..., None]
    centre = (weight * whole.log.position[..., :2]).sum(axis=(0, 1)) / normal[k]
    pulled = force[..., :2].sum(axis=(1, 2))
    moment = np.abs(centre[0] * pulled[:, 1] - centre[1] * pulled[:, 0]).max()
    share = moment / (whole.scene.friction * normal[k] * contact_reach(whole.plan))
    if share < EXPLAIN.moment_share:
        return None
    reason = (
        f"the pressure's centre lies {1e3 * np.hypot(*centre):.2g} mm off the sensor's, through which forces go: a "
        f"moment of {share:.2g} μF_N a about the contact that an object held at its own centre does not make"
    )
    return Proposal("add", "Torsion", reason, f"share of the limit moment above {EXPLAIN.moment_share}")


def _velocity(whole: Measured) -> Proposal | None:
    """Velocity-dependent friction where the contact slides as a whole."""
    truth = whole.log.truth
    assert truth is not None  # simulated logs have truth
    slides = bool((truth.stick_ratio == 0.0).any())
    if not slides or whole.plan.problem.velocity_laws:
        return None
    reason = "the contact slides as a whole, and so shows how friction depends on velocity"
    return Proposal(
        "add", "VelocityFriction", reason, "the friction model μ = β₀ + β₁v + β₂f_n that samples are fitted with"
    )


def _resolution(whole: Measured) -> Proposal | None:
    """Finer sampling where few points see the contact."""
    sampling = whole.scene.plan().sampling
    if sampling is None:
        return None
    points = contact_reach(whole.plan) / sampling.pitch
    if points >= EXPLAIN.fewest_points:
        return None
    reason = f"{points:.1f} sensor points along a contact radius: most elements would mix stick and slip"
    return Proposal("add", "SensorSampling", reason, f"fewer than {EXPLAIN.fewest_points}, by area of edge and front")


PROPOSALS: tuple[Callable[[Measured], Proposal | None], ...] = (_base, _coupling, _off_centre, _velocity, _resolution)


def _superfluous(report: EffectReport) -> Proposal | None:
    """An effect whose absence would not be noticed."""
    if report.change is None or report.change.largest >= EXPLAIN.negligible:
        return None
    reason = f"without it nothing changes by more than {100 * report.change.largest:.2g} %"
    source = f"measured on a coarse run, threshold {100 * EXPLAIN.negligible:g} %"
    return Proposal("leave out", report.name, reason, source)


def _has_layer(whole: Measured) -> bool:
    return any(isinstance(effect, FiniteLayer) for effect in whole.scene.present())
