"""Work and precision: what each way to simulate a scene, detect slip in a log or fit friction costs, and misses."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from estimators import FrictionModel
    from slipcore import FrictionSamples, GraspLog, SlipHistory
    from slipcore.contact import Scene
    from slipcore.contact.progress import Progress
    from stiction_client import FrictionModel as ClientModel
    from stiction_client.linear_friction import LinearFriction

MONTE_CARLO = (0.2, 0.1, 0.05, 0.025)
"""Accuracies that the sampled method is asked for, in posterior standard deviations."""

COMPARED = "what the others are compared with"

REFERENCE_METHOD = "hierarchical"
"""Whose posterior is exact."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One way to have an answer: what to ``ask`` for, the ``seconds`` that it takes and its ``error``, NaN for what the
    others are compared with; ``told``: more of it.
    """

    ask: str
    seconds: float
    error: float
    told: str = ""


@dataclass(frozen=True, slots=True)
class WorkPrecision:
    """All settings for one ``subject``; ``measure`` says what their errors are."""

    subject: str
    measure: str
    settings: tuple[Setting, ...]

    def worth_asking(self) -> tuple[bool, ...]:
        """Which settings no other beats in both time and error; what others are compared with always is."""
        return tuple(not any(_beats(other, each) for other in self.settings) for each in self.settings)


class Unfinished(KeyboardInterrupt):
    """Ctrl-C once there is something to tell: ``found`` until then."""

    def __init__(self, found: WorkPrecision) -> None:
        self.found = found
        KeyboardInterrupt.__init__(self, "interrupted")


def _beats(one: Setting, other: Setting) -> bool:
    """Whether ``one`` errs less for no more time, or takes less for no more error."""
    no_worse = one.seconds <= other.seconds and one.error <= other.error
    return no_worse and (one.seconds < other.seconds or one.error < other.error)


def of_scene(scene: "Scene", seconds: float, seed: int, progress: "Progress") -> WorkPrecision:
    """The tiers that know a scene, and ever finer grids for as long as the next one fits into about ``seconds``.

    Raises ``Unfinished``, with the settings until then, where Ctrl-C comes after the first.
    """
    measure = "largest of the errors of stick ratio, displacement and force, estimated"
    found = list[Setting]()
    try:
        for setting in _ever_finer(scene, seconds, seed, progress):
            found.append(setting)
    except KeyboardInterrupt as stopped:
        if not found:
            raise
        raise Unfinished(WorkPrecision(scene.name, measure, tuple(found))) from stopped
    return WorkPrecision(scene.name, measure, tuple(found))


def _ever_finer(scene: "Scene", seconds: float, seed: int, progress: "Progress") -> Iterator[Setting]:
    """Each tier that knows a scene, then each grid, as they are run."""
    from slipcore.contact.errors import rounded_up
    from slipcore.contact.tiers.accuracy import refinements
    from slipcore.contact.tiers.choice import TIERS

    plan = scene.plan(seed)
    for tier in TIERS:
        known = tier.accuracy(scene, plan)
        if known is not None:
            began = perf_counter()
            tier.run(scene, plan)
            yield Setting(f'--tier "{tier.NAME}"', perf_counter() - began, known, "known of the tier")
    for made in refinements(plan, seconds, progress):
        error, grid = made.error.largest, f"{made.fidelity.cells} cells, steps a frame: {made.fidelity.substeps}"
        yield Setting(f"--accuracy {rounded_up(error):g}", made.seconds, error, grid)


def of_detection(log: "GraspLog", name: str, progress: "Progress") -> WorkPrecision:
    """Every detector on a log: against its truth, or without one against the detector that suits it."""
    from slipcore.detection.methods import METHODS
    from slipcore.method_choice import recommended_method

    contact, slip = (None, None) if log.truth is None else (log.truth.contact, log.truth.slip_contact_factor)
    found, first = [], recommended_method(log)
    for count, method in enumerate(sorted(METHODS, key=lambda method: method != first)):
        progress(count / len(METHODS))
        history, seconds = _detected(log, method)
        if contact is None or slip is None:  # there is no truth, and this is the first
            contact, slip = history.contact, history.slip
            found.append(Setting(f"--method {method}", seconds, math.nan, COMPARED))
        else:
            wrong = (history.slip != slip)[contact]
            found.append(Setting(f"--method {method}", seconds, float(wrong.mean()) if wrong.size else 0.0))
    against = "the first of them" if log.truth is None else "truth"
    return WorkPrecision(
        name, f"share of touching elements and frames answered otherwise than by {against}", tuple(found)
    )


def _detected(log: "GraspLog", method: str) -> "tuple[SlipHistory, float]":
    """The slip, and the seconds that it took without the loading of kernels."""
    from slipcore import LOOKAHEAD, detect_slip
    from slipcore.warm_up import warm_up_detectors

    warm_up_detectors(method)
    began = process_time()
    return detect_slip(log, method, lookahead=LOOKAHEAD), process_time() - began


def of_fits(grasps: "Sequence[FrictionSamples]", name: str, progress: "Progress") -> WorkPrecision:
    """Every method that fits friction, the sampled one to several accuracies."""
    from estimators import NotConverged, fit
    from estimators.method_names import METHODS
    from estimators.warm_up import warm_up

    warm_up()
    asked: list[tuple[str, float | None]] = [(method, None) for method in METHODS if method != "bayes"]
    asked += [("bayes", accuracy) for accuracy in MONTE_CARLO]
    models: dict[str, tuple[LinearFriction, float]] = {}
    for count, (method, accuracy) in enumerate(asked, 1):
        began = process_time()
        try:
            model = fit(grasps, method=method, accuracy=accuracy)
        except NotConverged as stopped:
            model = stopped.model
        ask = f"--method {method}" if accuracy is None else f'fit(method="{method}", accuracy={accuracy:g})'
        models[ask] = model, process_time() - began
        progress(count / len(asked))
    return _of_models(name, models, f"--method {REFERENCE_METHOD}")


def of_models(name: str, models: "Sequence[FrictionModel | ClientModel]") -> WorkPrecision:
    """The models that a service keeps of a material, which say themselves what they took."""
    timed = {f"--method {model.method}": (model, model.cost.seconds) for model in models}
    reference = f"--method {REFERENCE_METHOD}"
    return _of_models(name, timed, reference if reference in timed else next(iter(timed)))


def _of_models(name: str, models: "Mapping[str, tuple[LinearFriction, float]]", reference: str) -> WorkPrecision:
    exact = _friction(models[reference][0])
    found = []
    for ask, (model, seconds) in models.items():
        mean, half = _friction(model)
        error = math.nan if ask == reference else abs(mean - exact[0]) + abs(half - exact[1])  # of the farther end
        compared = f"; {COMPARED}" if ask == reference else ""
        found.append(Setting(ask, seconds, error / exact[1], f"μ = {mean:.4f} ± {half:.4f}{compared}"))
    measure = f"an end of the 95 % interval of μ against that by {reference.removeprefix('--method ')}, in half-widths"
    return WorkPrecision(name, measure, tuple(found))


def _friction(model: "LinearFriction") -> tuple[float, float]:
    """Mean friction in the middle of the data, and half of its 95 % interval."""
    from scipy import special

    middle = [1.0, *(0.5 * sum(ends) for ends in (model.domain.tangential_velocity, model.domain.normal_force))]
    deviation = math.sqrt(max(float(middle @ model.covariance @ middle), 0.0))
    return float(np.dot(middle, model.coefficients)), float(
        special.stdtrit(model.degrees_of_freedom, 0.975)
    ) * deviation


def draw(found: Sequence[WorkPrecision]) -> "Figure":
    """Error over seconds, a panel for each subject; what is worth asking for is joined by a line."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0 * len(found), 5.0), layout="constrained")
    for axes, each in zip(figure.subplots(1, len(found), squeeze=False)[0], found, strict=True):
        _draw(axes, each)
    return figure


def _draw(axes: "Axes", found: WorkPrecision) -> None:
    from service.report.colours import FAINT, STICK

    both = zip(found.settings, found.worth_asking(), strict=True)
    shown = [(each, is_worth) for each, is_worth in both if each.error > 0.0]
    best = sorted((each for each, is_worth in shown if is_worth), key=lambda each: each.seconds)
    axes.plot([each.seconds for each in best], [each.error for each in best], color=STICK, linewidth=1.0)
    for count, (each, is_worth) in enumerate(shown, 1):
        colour = STICK if is_worth else FAINT
        axes.plot(each.seconds, each.error, "o", color=colour, label=f"{count}: {each.ask}")
        axes.annotate(str(count), (each.seconds, each.error), xytext=(5, 4), textcoords="offset points", color=colour)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)
    axes.set(xscale="log", yscale="log", xlabel="seconds", ylabel="error")
    axes.set_title(f"{found.subject}\nerror: {found.measure}", fontsize=9)
    axes.margins(0.2)
