"""Every result names the papers behind it, and a page lists them."""

from pathlib import Path

import numpy as np
import pytest

import estimators
from estimators.fitting import METHODS as ESTIMATORS
from estimators.methods.bayes import LIKELIHOODS as FITTED
from slipcore import METHODS, FrictionSamples, detect_slip
from slipcore.contact import Scene, tangential_ramp
from slipcore.contact.effects import EFFECTS as ADDED
from slipcore.references import DETECTION, EFFECTS, ESTIMATION, LIKELIHOODS, PAPERS, cited

PAGE = Path(__file__).parents[2] / "docs" / "references.md"
LISTS = {"detection": DETECTION, "estimation": ESTIMATION, "likelihoods": LIKELIHOODS, "effects": EFFECTS}


def test_every_method_likelihood_and_effect_has_a_paper() -> None:
    assert set(DETECTION) == set(METHODS)
    assert set(ESTIMATION) == set(ESTIMATORS)
    assert set(LIKELIHOODS) == set(FITTED)
    assert set(EFFECTS) == set(ADDED)
    assert all(names for table in LISTS.values() for names in table.values())


def test_every_paper_is_behind_something_and_stands_on_the_page() -> None:
    used = {name for table in LISTS.values() for names in table.values() for name in names}
    assert used == set(PAPERS)
    page = PAGE.read_text(encoding="utf-8")
    assert [paper for paper in PAPERS.values() if f"- {paper}\n" not in page] == []
    assert page.count("\n- ") == len(PAPERS)


@pytest.mark.parametrize("method", ["filter", "rigid_fit"])
def test_a_history_names_the_papers_of_its_method(method: str) -> None:
    log = tangential_ramp(points=4, pitch=3e-3)
    assert detect_slip(log, method).references == cited(DETECTION[method])


def test_a_model_names_the_papers_of_its_method() -> None:
    rng = np.random.default_rng(0)
    v, f_n = rng.uniform(1e-3, 5e-3, 50), rng.uniform(0.05, 0.3, 50)
    mu = 0.5 + 0.02 * rng.standard_normal(50)
    samples = FrictionSamples(mu, v, f_n, mu * f_n, np.arange(50) / 30.0, np.arange(50) % 7, np.ones(50), 1e-6)
    assert estimators.fit(samples, method="ols").references == cited(ESTIMATION["ols"])
    model = estimators.fit(samples, method="bayes", likelihood="gaussian", accuracy=0.2)
    assert model.references == cited(ESTIMATION["bayes"], LIKELIHOODS["gaussian"])


def test_a_scene_names_the_papers_of_its_effects_each_once() -> None:
    scene = Scene.from_toml("table1_condition1")
    assert len(scene.references) == len(set(scene.references)) > 0
    assert PAPERS["paper"] in scene.references  # of the sensor
