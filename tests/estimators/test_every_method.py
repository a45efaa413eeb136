"""What every method of estimation keeps to; a new one comes under these checks by being in ``METHODS``, a likelihood by
being in ``LIKELIHOODS``.
"""

import pickle
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest

from estimators import FrictionModel, InvalidSamples, Moments, TooFewSamples, fit, needs_samples
from estimators.fitting import METHODS
from estimators.methods.bayes import LIKELIHOODS
from slipcore.samples import FrictionSamples

Make = Callable[..., FrictionSamples]


class Way(NamedTuple):
    """A method with what keeps it quick here, and its name: that of its likelihood, if this is chosen."""

    name: str
    method: str
    options: dict[str, Any]


Kept = Callable[[Make, Way], FrictionModel]

WAYS = [Way(name, name, {"accuracy": 0.1} if name == "bayes" else {}) for name in METHODS]
WAYS += [Way(name, "bayes", {"likelihood": name, "accuracy": 0.1}) for name in LIKELIHOODS]
SAMPLE_BY_SAMPLE = {"student_t", "outlier", "errors_in_variables"}
"""Likelihoods that no moments stand for."""

pytestmark = pytest.mark.parametrize("way", [pytest.param(way, id=f"{way.method} {way.name}") for way in WAYS])

ROUNDING = 1e-6
TOLERANCE = {
    "robust": 1e-3,  # its iteration starts from subsets drawn by place in the list, and ends within its own tolerance
    "bayes": 0.5,  # a chain that takes one step differently goes on as another chain; each errs by 0.1
}  # by method
"""Standard errors by which a model may move when nothing but the order of sums or a unit has changed."""


def grasps_of(samples: Make) -> list[FrictionSamples]:
    """Four grasps that differ a little, of different length."""
    return [samples(120 + 20 * k, seed=k, offset=0.01 * (k - 1.5)) for k in range(4)]


def fitted(data: Sequence[FrictionSamples | Moments], way: Way, seed: int = 3) -> FrictionModel:
    return fit(data, method=way.method, seed=seed, **way.options)


@pytest.fixture(scope="module")
def kept() -> Kept:
    """The model of the grasps as they are, which most checks compare another one with: fitted once for all of them."""
    models: dict[str, FrictionModel] = {}

    def model(samples: Make, way: Way) -> FrictionModel:
        if (name := f"{way.method} {way.name}") not in models:
            models[name] = fitted(grasps_of(samples), way)
        return models[name]

    return model


def distance(one: FrictionModel, other: FrictionModel, units: Sequence[float] = (1.0, 1.0, 1.0)) -> float:
    """Largest distance of coefficients in standard errors, and of the errors and the scatter in parts of themselves;
    ``units``: what the other's coefficients have to be multiplied by.
    """
    moved = (other.coefficients * units - one.coefficients) / one.standard_errors
    widths = np.log(other.standard_errors * units / one.standard_errors)
    return float(max(np.abs([*moved, *widths, np.log(other.scale / one.scale)])))


def test_a_seed_repeats_a_fit_to_the_last_bit_and_its_data_stay(samples: Make, way: Way, kept: Kept) -> None:
    grasps = grasps_of(samples)
    before = pickle.dumps(grasps)
    one, other = kept(samples, way), fitted(grasps, way)
    np.testing.assert_array_equal(one.coefficients, other.coefficients)
    np.testing.assert_array_equal(one.covariance, other.covariance)
    assert (one.scale, one.scales) == (other.scale, other.scales)
    assert pickle.dumps(grasps) == before


def test_a_model_survives_pickling(samples: Make, way: Way, kept: Kept) -> None:
    model = kept(samples, way)
    read = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(read.predict(2e-3, 0.05, 0.05), model.predict(2e-3, 0.05, 0.05))
    assert (read.method, read.n, read.domain, read.scales) == (model.method, model.n, model.domain, model.scales)


def test_the_order_of_samples_and_of_grasps_says_nothing(samples: Make, way: Way, kept: Kept) -> None:
    rng = np.random.default_rng(5)
    mixed = [shuffled(grasp, rng) for grasp in grasps_of(samples)[::-1]]
    assert distance(kept(samples, way), fitted(mixed, way)) < TOLERANCE.get(way.method, ROUNDING)


def shuffled(grasp: FrictionSamples, rng: np.random.Generator) -> FrictionSamples:
    order = rng.permutation(len(grasp))
    return replace(grasp, **{name: getattr(grasp, name)[order] for name in FrictionSamples.arrays()})


@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_elements_of_another_area_have_the_same_friction(samples: Make, way: Way, kept: Kept, factor: float) -> None:
    """The same pressures: forces scale with the area, and with them the slope over force and its prior."""
    scaled = [grasp.at_element_area(factor * grasp.element_area) for grasp in grasps_of(samples)]
    moved = distance(kept(samples, way), fitted(scaled, way), (1.0, 1.0, factor))
    assert moved < TOLERANCE.get(way.method, ROUNDING)


def test_what_merges_is_fitted_as_if_it_had_come_together(samples: Make, way: Way, kept: Kept) -> None:
    grasps = grasps_of(samples)
    stored = [Moments.from_bytes(Moments.from_samples(grasp).to_bytes()) for grasp in grasps]
    if way.name in SAMPLE_BY_SAMPLE:
        with pytest.raises(InvalidSamples, match="moments"):
            fitted(stored, way)
        return
    if needs_samples(way.method, len(grasps)):
        pytest.skip(f"{way.method} looks at samples, which moments do not hold")
    assert distance(kept(samples, way), fitted(stored, way)) < ROUNDING


def test_too_few_samples_are_refused_as_such(samples: Make, way: Way) -> None:
    for data in ([], [samples(0)], [samples(1)], samples(3)):
        with pytest.raises(TooFewSamples):
            fit(data, method=way.method, **way.options)


@pytest.mark.parametrize("name", ["friction_coefficient", "tangential_velocity", "normal_force", "weight"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_no_number_is_refused_by_name(samples: Make, way: Way, name: str, value: float) -> None:
    grasp = samples(100)
    column = getattr(grasp, name).copy()
    column[7] = value
    with pytest.raises(InvalidSamples, match=name):
        fit(replace(grasp, **{name: column}), method=way.method, **way.options)
