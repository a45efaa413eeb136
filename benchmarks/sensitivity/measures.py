"""What is measured of detectors, grip control, patches, forces, the simulator and fits; see `__main__`."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np

import estimators
from benchmarks.calibration.patch_grasps import PIVOT, SLIDE, Course, Setting
from benchmarks.calibration.patch_grasps import grasp as moving_grasp
from benchmarks.control.episodes import run as run_task
from benchmarks.control.episodes import world_of
from benchmarks.control.outcomes import outcome_of
from benchmarks.control.strategies import Controlled, model_of, settings_of
from benchmarks.control.tasks import LIFTS, PAPER
from benchmarks.detector.accuracy import FORCE_NOISE, INPUTS, score
from benchmarks.detector.coarse import coarse
from benchmarks.detector.scenes import Case, cases, observed, phases, scoring, simulated
from benchmarks.estimators.scatter import TRUTH, Kind, grasp
from benchmarks.forces import __main__ as of_gels
from benchmarks.sensitivity.rows import Known, Row, of_tables, rows
from estimators import defaults as of_estimators
from slipcore import METHODS, FrictionSamples, GraspLog, PatchOptions, detect_slip
from slipcore import defaults as of_slipcore
from slipcore.contact import defaults as of_contact
from slipcore.contact.effects import FiniteLayer, LoadPath, NormalTangentialCoupling, SensorSampling, VelocityFriction
from slipcore.contact.scene import Scene
from slipcore.contact.tiers.accuracy import difference, simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.forces import defaults as of_forces
from slipcore.frames import BoolArray
from slipcore.patch.following import follow_patches
from slipcore.patch.friction import contact_friction
from stiction_client import ControlSettings, GraspController

MARKER_NOISE = 1e-6
HELD_OUT = ("lift, hold, set down", "grip tightens", "soft fruit", "stage turns and slides", "slow gel, twisted")
"""Of the scenes that detectors are only scored on: holds, a growing grip, motion, creep, an object that gives way."""
FEW = (6, 3)
"""Elements a side of the arrays that have few."""
BASELINES = tuple(name for name in METHODS if name not in {"filter", "strain_rate", "forces_only", "coarse"})
TASKS = (LIFTS[1], LIFTS[6], PAPER[0], PAPER[2])
GRIPS = range(7000, 7003)
"""Tasks of the grip controller, and seeds of no other benchmark."""
SENSOR = SensorSampling((8, 8), 1.5e-3, 4.0)
SCENES = {
    "shear": Scene("shear", (SENSOR, LoadPath((1.0, 1.5, 2.0), force_x=(0.0, 3.2, -1.0)))),
    "layer": Scene(
        "layer", (SENSOR, FiniteLayer(5e-3), NormalTangentialCoupling(), LoadPath((1.0, 2.0), force_x=(0.0, 2.5)))
    ),
    "velocity": Scene("velocity", (SENSOR, VelocityFriction(5.0), LoadPath((1.0, 2.0), force_y=(0.0, 3.0)))),
}
FINE = Fidelity(64, 4, 1e-6)
OF_SOLVER = ("FIDELITY", "LAYER", "INFLUENCE", "NORMAL", "TANGENTIAL", "LIMIT_SURFACE", "STEP", "PROBE")
OF_REQUESTS = ("ACCURACY",)
OF_TIME = ("cost_order", "more_ahead")
"""Of these, numbers that without a budget change no log (`of_prices`)."""
OF_FITS = ("AUTOMATIC", "CLUSTERS", "GRID", "LINEAR", "REFERENCE", "IDENTIFIABILITY", "PRIOR", "ROBUST")
OF_SAMPLED = ("PRIOR", "PROPOSAL", "SAMPLING")
KINDS = (Kind(), Kind(between_grasps=0.1, heavy=True), Kind(between_places=0.05, force_noise=5e-3))
WORKING_POINTS = np.array([[1.0, v, f_n] for v in (5e-4, 4e-3) for f_n in (0.05, 0.2)])
FRICTION = 0.55
COURSES = {
    "slides": SLIDE,
    "pivots": PIVOT,
    "holds": SLIDE._replace(x=np.zeros_like(SLIDE.x), share=0.6 * SLIDE.share),
    "rolls": SLIDE._replace(share=np.full_like(SLIDE.share, 0.05)),
}
"""Ways of a body over markers."""
REGIMES = {"slides": "sliding", "pivots": "pivoting", "holds": "sliding", "rolls": "rolling"}
"""What each does while it goes; the third never does."""
VALUED = ("slides", "pivots")
"""Those whose friction can be told; of the others a bound."""
OF_FORCES = ("NODES", "RESPONSE", "PRIOR", "STRENGTH", "SUPPORT", "FIT", "LATTICE", "RECONSTRUCTION")
LOOPS = ("descents", "settled", "still", "rank", "free_motion", "least_square_arm")
"""Of patches, what compiled loops hold fixed."""
PRESSES = (
    of_gels.Case("", depth_seen=True, noise=3e-6),
    of_gels.Case("", depth_seen=True, contact="tilted edge", marker_depth=5e-4),
    of_gels.Case("", depth_seen=False, lattice="10 × 7"),
    of_gels.Case("", depth_seen=False, gel="half-space", contact="two contacts", given=True),
)
"""Of those that forces are scored on, one of each kind that they differ in."""
LIKELIHOODS = ("student_t", "outlier", "errors_in_variables")


def of_detectors(known: Known) -> list[Row]:
    """Options of the two methods that are not there for comparison."""
    seen = [
        (case, observed(case.log, MARKER_NOISE, FORCE_NOISE, inputs, seed=5))
        for case in held_out()
        for inputs in INPUTS
    ]
    return of_methods(("filter", "strain_rate"), seen, known)


def of_few_elements(known: Known) -> list[Row]:
    """Options of the methods for arrays of few elements."""
    few = [replace(case, log=coarse(case.log, elements)) for case in held_out() for elements in FEW]
    seen = [(case, observed(case.log, MARKER_NOISE, FORCE_NOISE, "force", seed=5)) for case in few]
    return of_methods(("forces_only", "coarse"), seen, known)


def of_baselines(known: Known) -> list[Row]:
    """Options of the methods that others are compared with."""
    seen = [(case, observed(case.log, MARKER_NOISE, FORCE_NOISE, "force", seed=5)) for case in held_out()]
    return of_methods(BASELINES, seen, known)


@cache
def held_out() -> list[Case]:
    """Scenes that detectors are only scored on."""
    ours = [Case(each.name, log := simulated(each), phases(log)) for each in scoring() if each.name in HELD_OUT]
    return [*cases("reference"), *ours]


def of_methods(methods: Sequence[str], seen: list[tuple[Case, GraspLog]], known: Known) -> list[Row]:
    """Options of some methods."""
    found: list[Row] = []
    for method in methods:
        start = f1(seen, method)
        found += rows(
            method, METHODS[method].options, lambda name, value, m=method: f1(seen, m, **{name: value}), start, known
        )
    return found


def f1(seen: list[tuple[Case, GraspLog]], method: str, **chosen: float) -> dict[str, float]:
    """Mean F1 of a method with one option chosen."""
    return {"F1": float(np.mean([score(case, log, detect_slip(log, method, **chosen)).f1 for case, log in seen]))}


def gripped(**chosen: float) -> dict[str, float]:
    """Share of the tasks in which the object is held, with the material's model and without; and of the greatest and
    the last force over the least that holds, in logarithms of their means."""
    done = []
    for task, seed in product(TASKS, GRIPS):
        world = world_of(task, seed)
        settings = settings_of(world, task.limit, **chosen)
        for model in (model_of(task.friction[0], world), None):
            each = Controlled(GraspController.init(settings, model))
            done.append(outcome_of(run_task(task, world, [each], seed, 0.0), "", seed))
    held = [each for each in done if each.held]
    peak, final = (float(np.log(np.mean([getattr(each, name) for each in held]))) for name in ("peak", "final"))
    return {"held": len(held) / len(done), "peak": peak, "final": final}


def of_control(known: Known) -> list[Row]:
    """Settings of the grip controller."""
    return list(
        rows("ControlSettings", ControlSettings, lambda name, value: gripped(**{name: value}), gripped(), known)
    )


@cache
def moving(name: str) -> tuple[GraspLog, BoolArray, BoolArray]:
    """A body that moves over markers, and what the detector says of contact and slip, which no default of patches
    changes."""
    noise = {"marker_noise": 3e-6, "force_noise": 2e-3, "smoothing": 0.7, "crosstalk": 0.1}
    log = moving_grasp(COURSES[name], FRICTION, Setting(half_axes=(6.2e-3, 4e-3), seed=31, **noise))
    found = detect_slip(log)
    return log, found.contact, found.slip


def followed(**chosen: float) -> dict[str, float]:
    """Error of friction, 1 where a bound is told and a value is due or the reverse; share of frames with the regime."""
    errors, right = [], []
    for name, course in COURSES.items():
        log, contact, slip = moving(name)
        patches = follow_patches(log, contact, slip, **chosen)
        found = contact_friction(log.time, patches, **chosen)
        if found is None or found.is_bound is (name in VALUED):
            errors.append(1.0)
        else:
            errors.append(0.0 if found.is_bound else abs(found.coefficient / FRICTION - 1.0))
        right += [np.mean((patch.regime == REGIMES[name]) == goes(course)[patch.frames]) for patch in patches]
    return {"friction error": float(np.mean(errors)), "right regimes": float(np.mean(right))}


def goes(course: Course) -> BoolArray:
    """Frames in which the body travels over the markers."""
    way = np.abs(np.gradient(course.yaw if course.turns else course.x))
    return np.asarray(way > 0.5 * way.max())


def of_patches(known: Known) -> list[Row]:
    """Options of contact patches, and numbers that are none."""
    start = followed()
    chosen = list(rows("PatchOptions", PatchOptions, lambda name, value: followed(**{name: value}), start, known))
    return chosen + of_tables(
        of_slipcore, ("PATCHES",), followed, known | {("slipcore.PATCHES", name) for name in LOOPS}
    )


def pressed() -> dict[str, float]:
    """Of forces from displacement: error of resultants and of the field, in logarithms, and intervals that hold."""
    scores = [of_gels.score(case, *of_gels.shown(case, 1)) for case in PRESSES]
    held = np.sum([pair for each in scores for pair in each.inside.values()], axis=0)
    of_resultants, of_fields = (np.mean([getattr(each, name) for each in scores]) for name in ("resultant", "elements"))
    error_and_cost = {"resultants": np.log(of_resultants), "fields": np.log(of_fields), "intervals": held[0] / held[1]}
    return {name: float(value) for name, value in error_and_cost.items()}


def of_presses(known: Known) -> list[Row]:
    """Numbers of forces from displacement."""
    below = of_tables(of_contact, ("INTERIOR",), pressed, known)  # what markers that lie deep need
    return of_tables(of_forces, OF_FORCES, pressed, known) + below


@cache
def fine(name: str) -> GraspLog:
    """A solution that others are compared with."""
    return run(SCENES[name].plan(), FINE)


def solved() -> dict[str, float]:
    """Largest error over the scenes at the default fidelity, and applications of operators, in logarithms."""
    chosen = of_contact.FIDELITY
    fidelity = Fidelity(chosen.cells, chosen.substeps, chosen.tolerance)
    return error_and_cost({name: run(scene.plan(), fidelity) for name, scene in SCENES.items()})


def asked() -> dict[str, float]:
    """The same of a scene that asks for an accuracy."""
    return error_and_cost({"shear": simulate_to(SCENES["shear"].plan(), accuracy=0.1).log})


def error_and_cost(logs: Mapping[str, GraspLog]) -> dict[str, float]:
    """Error and cost of some logs; changes of logarithms are relative."""
    error = max(difference(log, fine(name)).largest for name, log in logs.items())
    applications = sum(int(log.metadata["applications"]) for log in logs.values())
    return {"error": float(np.log(error)), "applications": float(np.log(applications))}


def of_solver(known: Known) -> list[Row]:
    """Numbers of the contact simulator; those that compiled loops hold fixed stay as they are."""
    of_time = {("slipcore.contact.ACCURACY", name) for name in OF_TIME}
    return of_tables(of_contact, OF_SOLVER, solved, known) + of_tables(of_contact, OF_REQUESTS, asked, known | of_time)


@cache
def grasps() -> tuple[list[FrictionSamples], ...]:
    """Two grasps of each kind."""
    return tuple([grasp(kind, np.random.default_rng([seed, 3])) for seed in range(2)] for kind in KINDS)


def fits() -> dict[str, float]:
    """Of what needs no sampling."""
    methods = ("ols", "robust", "auto")
    return summary(estimators.fit(data, method=method, seed=1) for data in grasps() for method in methods)


def sampled() -> dict[str, float]:
    """Of likelihoods that are sampled, for one grasp."""
    data = grasps()[-1][0]
    return summary(estimators.fit(data, "bayes", likelihood=name, accuracy=0.2, seed=1) for name in LIKELIHOODS)


def summary(models: Iterable[estimators.FrictionModel]) -> dict[str, float]:
    """Error of friction and width of its interval at the working points, in logarithms of their means."""
    errors, widths = [], []
    for model in models:
        errors.append(WORKING_POINTS @ (model.coefficients - TRUTH))
        widths.append(np.sqrt(np.einsum("ki,ij,kj->k", WORKING_POINTS, model.covariance, WORKING_POINTS)))
    return {"error": float(np.log(np.mean(np.square(errors))) / 2), "width": float(np.log(np.mean(widths)))}


def of_fits(known: Known) -> list[Row]:
    """Numbers of the estimators."""
    return of_tables(of_estimators, OF_FITS, fits, known) + of_tables(of_estimators, OF_SAMPLED, sampled, known)
