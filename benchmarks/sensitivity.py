"""What half and one and a half of each default does: `python -m benchmarks.sensitivity [--page docs/sensitivity.md]`.

Detectors: change of the mean F1 on scenes that no default was chosen on; those for few elements on the same scenes as
few elements see them. Grip control: change of how many objects are held, and of the force over the least that holds.
Patches: change of the error of a contact's friction, and of the share of frames whose regime is right. Forces: change
of the error of forces from displacement, and of how many intervals hold the truth. Contact: change of the largest error
against a fine solution, and of the operators' applications. Estimators: change of the error of friction at working
points and of its interval's width, over simulated grasps. Each value is kept in its range.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, asdict, dataclass, fields, replace
from functools import cache
from itertools import product

import numpy as np
from matplotlib.figure import Figure

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
from benchmarks.pages import options, picture_folder, save, write
from estimators import defaults as of_estimators
from slipcore import METHODS, FrictionSamples, GraspLog, PatchOptions, detect_slip
from slipcore import defaults as of_slipcore
from slipcore.contact import defaults as of_contact
from slipcore.contact.effects import FiniteLayer, LoadPath, NormalTangentialCoupling, SensorSampling, VelocityFriction
from slipcore.contact.elasticity import bonded_layer
from slipcore.contact.scene import Scene
from slipcore.contact.tiers.accuracy import difference, simulate_to
from slipcore.contact.tiers.boundary_elements import Fidelity, run
from slipcore.errors import SlipcoreError
from slipcore.forces import defaults as of_forces
from slipcore.frames import BoolArray
from slipcore.options import Option, Options, describe_options
from slipcore.patch.following import follow_patches
from slipcore.patch.friction import contact_friction
from stiction_client import ControlSettings, GraspController, InvalidArgument
from stiction_client.controller.settings import Gain, gains

MARKER_NOISE = 1e-6
FACTORS = (0.5, 1.5)
HELD_OUT = ("lift, hold, set down", "grip tightens", "soft fruit", "stage turns and slides", "slow gel, twisted")
"""Of the scenes that detectors are only scored on: holds, a growing grip, motion, creep, an object that gives way."""
FEW = (6, 3)
"""Elements a side of the arrays that have few."""
TASKS = (LIFTS[1], LIFTS[6], PAPER[0], PAPER[2])
GRIPS = range(7000, 7003)
"""Tasks of the grip controller, and seeds of no other benchmark."""
REFUSALS = (SlipcoreError, estimators.EstimatorError, estimators.NotConverged, InvalidArgument)
DEAD = 1e-3
"""Relative change below which a default has no effect to speak of."""
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


@dataclass(frozen=True, slots=True)
class Row:
    """One default: ``changes`` of each measure at half of its value and at one and a half of it; or why none."""

    table: str
    name: str
    default: float
    unit: str
    changes: dict[str, tuple[float, float]]
    failed: str = ""

    @property
    def largest(self) -> float:
        """Largest change of any measure."""
        return max((abs(value) for pair in self.changes.values() for value in pair), default=float("nan"))


def neighbours(value: float, option: Option | Gain) -> Iterator[float]:
    """Half and one and a half of a value, in its range; a whole number moves by one at least."""
    for factor in FACTORS:
        moved: float = factor * value
        if isinstance(value, int):
            moved = min(round(moved), value - 1) if factor < 1.0 else max(round(moved), value + 1)
        bounded = min(max(moved, option.low), option.high)
        yield int(bounded) if isinstance(value, int) else bounded


def rows(
    label: str,
    kind: type[Options] | type[ControlSettings],
    measure: Callable[[str, float], Mapping[str, float]],
    start: Mapping[str, float],
) -> Iterator[Row]:
    """A row for each default of a table; ``measure`` takes a name and a value."""
    ranges = gains() if kind is ControlSettings else describe_options(kind)
    for entry in (entry for entry in fields(kind) if entry.default is not MISSING):
        option, found, failed = ranges[entry.name], [], ""
        for value in neighbours(entry.default, option):
            try:
                found.append(measure(entry.name, value))
            except REFUSALS as error:
                failed = f"{value:g}: {type(error).__name__}"
        changes = {key: tuple(each[key] - start[key] for each in found) for key in start} if len(found) == 2 else {}
        yield Row(label, entry.name, entry.default, option.unit, changes, failed)


@contextmanager
def changed(table: Options, name: str, value: float) -> Iterator[None]:
    """One entry of a table with another value; tables are frozen so that nothing but this changes them."""
    before = getattr(table, name)
    object.__setattr__(table, name, value)
    try:
        yield
    finally:
        object.__setattr__(table, name, before)
        bonded_layer._influence.cache_clear()
        bonded_layer.radial_functions.cache_clear()


def of_detectors() -> list[Row]:
    """Options of the two methods that are not there for comparison."""
    seen = [
        (case, observed(case.log, MARKER_NOISE, FORCE_NOISE, inputs, seed=5))
        for case in held_out()
        for inputs in INPUTS
    ]
    return of_methods(("filter", "strain_rate"), seen)


def of_few_elements() -> list[Row]:
    """Options of the methods for arrays of few elements."""
    few = [replace(case, log=coarse(case.log, elements)) for case in held_out() for elements in FEW]
    seen = [(case, observed(case.log, MARKER_NOISE, FORCE_NOISE, "force", seed=5)) for case in few]
    return of_methods(("forces_only", "coarse"), seen)


@cache
def held_out() -> list[Case]:
    """Scenes that detectors are only scored on."""
    ours = [Case(each.name, log := simulated(each), phases(log)) for each in scoring() if each.name in HELD_OUT]
    return [*cases("reference"), *ours]


def of_methods(methods: Sequence[str], seen: list[tuple[Case, GraspLog]]) -> list[Row]:
    """Options of some methods."""
    found: list[Row] = []
    for method in methods:
        start = f1(seen, method)
        found += rows(
            method, METHODS[method].options, lambda name, value, m=method: f1(seen, m, **{name: value}), start
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


def of_control() -> list[Row]:
    """Settings of the grip controller."""
    return list(rows("settings", ControlSettings, lambda name, value: gripped(**{name: value}), gripped()))


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


def of_patches() -> list[Row]:
    """Options of contact patches, and numbers that are none."""
    start = followed()
    chosen = list(rows("options", PatchOptions, lambda name, value: followed(**{name: value}), start))
    return chosen + [row for row in of_tables(of_slipcore, ("PATCHES",), followed) if row.name not in LOOPS]


def pressed() -> dict[str, float]:
    """Of forces from displacement: error of resultants and of the field, in logarithms, and intervals that hold."""
    scores = [of_gels.score(case, 1) for case in PRESSES]
    held = np.sum([pair for each in scores for pair in each.inside.values()], axis=0)
    of_resultants, of_fields = (np.mean([getattr(each, name) for each in scores]) for name in ("resultant", "elements"))
    error_and_cost = {"resultants": np.log(of_resultants), "fields": np.log(of_fields), "intervals": held[0] / held[1]}
    return {name: float(value) for name, value in error_and_cost.items()}


def of_presses() -> list[Row]:
    """Numbers of forces from displacement."""
    return of_tables(of_forces, OF_FORCES, pressed)


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


def of_solver() -> list[Row]:
    """Numbers of the contact simulator; those that compiled loops hold fixed stay as they are."""
    return of_tables(of_contact, OF_SOLVER, solved) + of_tables(of_contact, OF_REQUESTS, asked)


def of_tables(module: object, names: Sequence[str], measure: Callable[[], dict[str, float]]) -> list[Row]:
    """Rows of all entries of some tables."""
    found: list[Row] = []
    start = measure()
    for label in names:
        table = getattr(module, label)

        def with_value(name: str, value: float, table: Options = table) -> dict[str, float]:
            with changed(table, name, value):
                return measure()

        found += rows(label, type(table), with_value, start)
    return found


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


def of_fits() -> list[Row]:
    """Numbers of the estimators."""
    return of_tables(of_estimators, OF_FITS, fits) + of_tables(of_estimators, OF_SAMPLED, sampled)


PARTS = {
    "detector": of_detectors,
    "few elements": of_few_elements,
    "control": of_control,
    "patches": of_patches,
    "forces": of_presses,
    "contact": of_solver,
    "estimators": of_fits,
}


def table_of(found: list[Row]) -> str:
    """A Markdown table of what counts, the most sensitive first, and below it the names of the rest."""
    measures = next((list(row.changes) for row in found if row.changes), [])
    lines = [
        "| of | default | value | " + " | ".join(f"{name}, half | {name}, one and a half" for name in measures) + " |",
        "|---|---|---|" + "---|---|" * len(measures),
    ]
    ordered = sorted(found, key=lambda row: -np.nan_to_num(row.largest, nan=np.inf))
    for row in (row for row in ordered if not row.largest < DEAD):
        cells = [f"{value:+.3f}" for name in measures for value in row.changes.get(name, ())]
        cells = cells or [row.failed] + [""] * (2 * len(measures) - 1)
        lines.append(f"| {row.table} | `{row.name}` | {row.default:g} {row.unit} | " + " | ".join(cells) + " |")
    quiet = [f"`{row.name}` of {row.table}" for row in found if row.largest < DEAD]
    return "\n".join(lines) + (f"\n\nLess than {DEAD:g} by either: {', '.join(quiet)}." if quiet else "")


def draw(found: list[Row]) -> Figure:
    """The largest change of each default, on a logarithmic scale."""
    known = sorted((row for row in found if row.changes), key=lambda row: row.largest)
    figure = Figure(figsize=(7.0, max(2.0, 0.14 * len(known))), layout="constrained")
    axes = figure.subplots()
    size = [max(row.largest, 1e-6) for row in known]
    axes.barh(range(len(known)), size, color=["#888" if value < DEAD else "#07a" for value in size])
    axes.set_yticks(range(len(known)), [f"{row.table} {row.name}" for row in known], fontsize=5)
    axes.set(xscale="log", xlabel="largest change by ±50 %")
    return figure


def main() -> None:
    """Measure, write JSON, a picture and the page's tables."""
    parser = options(__doc__)
    parser.add_argument("--only", choices=tuple(PARTS), help="one part")
    arguments = parser.parse_args()
    for part in [arguments.only] if arguments.only else PARTS:
        found = PARTS[part]()
        name = f"sensitivity-{part.replace(' ', '-')}"
        save(draw(found), picture_folder(arguments) / f"{name}.png")
        numbers = [asdict(row) for row in found]
        write(numbers, {part: table_of(found)}, arguments, f"{name}.json")
        print(table_of(found))


if __name__ == "__main__":
    main()
