import numpy as np
import pytest

import estimators
from estimators import Moments
from service.domain.models.surface_change import MARK, NOTICEABLE, with_change
from slipcore.samples import FrictionSamples
from stiction_client.support import UNNOTICED, notes


def logs(levels: list[float]) -> list[Moments]:
    """A grasp of 20 places for each level of friction."""
    rng, found = np.random.default_rng(5), []
    for level in levels:
        v, f_n = rng.uniform(1e-4, 4e-3, 200), rng.uniform(0.05, 0.2, 200)
        mu = level * (1.0 + 0.02 * rng.standard_normal()) + 0.02 * rng.standard_normal(200)
        parts = (mu, v, f_n, mu * f_n, v, np.arange(200) % 20, np.ones(200))
        found.append(Moments.from_samples(FrictionSamples(*parts, 1e-6)))
    return found


@pytest.mark.parametrize(("new", "told"), [(0.35, "30% lower"), (0.7, "40% higher")])
def test_friction_that_changed_marks_every_model(new: float, told: str) -> None:
    grasps = logs([0.5] * 12 + [new] * 4)
    models = [estimators.fit(grasps, method=method) for method in ("hierarchical", "ols")]
    marked = with_change(models, grasps)
    assert [model.method for model in marked] == ["hierarchical", "ols"]
    for model in marked:
        words = str(model.diagnostics[MARK]).split()
        assert " ".join(words[:5]) == "friction of the newest 4"
        assert abs(float(words[7].rstrip("%")) - float(told.split("%")[0])) < 6.0
        assert words[8] == told.split()[1]
        assert model.support == "stale"


def test_friction_that_stays_says_which_fall_would_be_noticed() -> None:
    grasps = logs([0.5] * 16)
    model = estimators.fit(grasps, method="hierarchical")
    (marked,) = with_change([model], grasps)
    assert marked.diagnostics.keys() - model.diagnostics.keys() == {NOTICEABLE}
    assert 0.03 < float(marked.diagnostics[NOTICEABLE]) < 0.12
    assert notes(marked.diagnostics) == notes(model.diagnostics)


def test_grasps_that_differ_too_much_to_show_a_change_say_so() -> None:
    grasps = logs([0.5, 0.35, 0.62, 0.45, 0.7, 0.4, 0.55, 0.38, 0.66, 0.47, 0.58, 0.41])
    (marked,) = with_change([estimators.fit(grasps, method="hierarchical")], grasps)
    fall = float(marked.diagnostics[NOTICEABLE])
    assert fall > 0.3
    assert f"a fall of its friction by less than {fall:.0%}" in str(marked.diagnostics[UNNOTICED])
    assert marked.diagnostics[UNNOTICED] in notes(marked.diagnostics)


def test_two_grasps_say_nothing_of_changes() -> None:
    grasps = logs([0.5] * 2)
    model = estimators.fit(grasps, method="hierarchical")
    assert with_change([model], grasps) == [model]


def test_without_a_model_of_grasps_nothing_is_told() -> None:
    grasps = logs([0.5] * 12 + [0.2] * 4)
    model = estimators.fit(grasps, method="ols")
    assert with_change([model], grasps) == [model]
