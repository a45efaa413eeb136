"""Scenes that are drawn: results of one version of the benchmark can be compared only if their scenes are the same."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, is_dataclass

import numpy as np
import pytest

from service.slip_benchmark.kinds import KINDS
from service.slip_benchmark.scenes import _FAMILIES, VERSION, _body, _pillars, _variety

SEEDS = range(60)
DIGITS = "{:.6g}"
"""Of each number: the last ones differ between mathematical libraries."""


def told(drawn: object) -> object:
    """A record as text and lists, with its numbers to a few digits."""
    if is_dataclass(drawn) and not isinstance(drawn, type):
        return [type(drawn).__name__, told(asdict(drawn))]
    if isinstance(drawn, dict):
        return {name: told(value) for name, value in drawn.items()}
    if isinstance(drawn, (tuple, list, np.ndarray)):
        return [told(value) for value in drawn]
    return DIGITS.format(drawn) if isinstance(drawn, (float, np.floating)) else str(drawn)


def gels() -> list[object]:
    """What each family of loads is drawn as, for each body; no scene is simulated."""
    drawn: list[object] = []
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        body = _body(rng)
        effects, carried = _variety(rng, next(iter(KINDS.values())), body)
        drawn += [told(body), told(effects), [told(family(rng, body, carried * share)) for family, share in _FAMILIES]]
    return drawn


def pillars() -> list[object]:
    logs = [_pillars(np.random.default_rng(seed)) for seed in SEEDS[:10]]
    return [[told(np.abs(array).mean()) for array in (log.time, log.displacement, log.force)] for log in logs]


@pytest.mark.parametrize(("draw", "digest"), [(gels, "afd5b8703a92f34e"), (pillars, "3eb210ebd0ddf8e3")])
def test_scenes_of_this_version_are_drawn_as_ever(draw: Callable[[], list[object]], digest: str) -> None:
    """Whoever draws others on purpose raises ``VERSION``, and takes the new digest."""
    assert VERSION == 1
    assert hashlib.sha256(json.dumps(draw()).encode()).hexdigest()[:16] == digest
