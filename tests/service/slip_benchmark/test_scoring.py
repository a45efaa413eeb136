"""How scores of scenes are summed up, of scores that are made up."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from service.slip_benchmark import folder as files
from service.slip_benchmark.folder import Manifest, SceneEntry
from service.slip_benchmark.measures import Measures
from service.slip_benchmark.scoring import SceneScore, Scores, _refused

ENTRY = SceneEntry("0000", "a", "no noise", 0.0, 0.0, 90, (20, 20), "1", "2")
SCENES = (
    ENTRY,
    replace(ENTRY, name="0001", kind="b"),
    replace(ENTRY, name="0002", fault="shake"),
    replace(ENTRY, name="0003", kind="b", fault="shake"),
)
MANIFEST = Manifest("5ea1", ("b", "a"), "MIT", "stiction 9", SCENES)


def of_method(name: str, *f1: float | None) -> list[SceneScore]:
    """A score of each scene, missing where it is None."""
    return [
        SceneScore(
            name, scene, None if value is None else Measures(f1=value), missing="no file" if value is None else None
        )
        for scene, value in zip(SCENES, f1, strict=True)
    ]


def test_means_are_over_what_was_scored_and_has_a_meaning() -> None:
    scores = Scores(MANIFEST, tuple(of_method("m", 0.2, None, math.nan, 0.8)))
    found = scores.of("m")
    assert (found.scenes, found.scored, found.means.f1) == (4, 3, pytest.approx(0.5))
    assert math.isnan(found.means.brier)
    assert (scores.of("m", "b").scenes, scores.of("m", "b").means.f1) == (2, 0.8)
    assert scores.of("m", fault="shake").means.f1 == 0.8
    assert math.isnan(scores.of("m", "a", "shake").means.f1)
    assert scores.of("m", "a", "no noise").means.f1 == 0.2
    assert scores.of("another").scenes == 0


def test_sensors_are_in_the_order_of_the_manifest_and_faults_in_that_of_the_scenes() -> None:
    scores = Scores(MANIFEST, ())
    assert (scores.kinds, scores.faults, scores.methods) == (["b", "a"], ["no noise", "shake"], [])


def test_a_program_is_told_means_and_each_score_or_why_there_is_none() -> None:
    wrong = SceneScore("m", SCENES[3], None, wrong="of another shape")
    scores = Scores(MANIFEST, (*of_method("m", 0.2, None, 0.4, None)[:3], wrong))
    assert scores.wrong == [wrong]
    told = scores.as_json()
    assert told["benchmark"] == {"seal": "5ea1", "kinds": ("b", "a"), "licence": "MIT", "made_by": "stiction 9"}
    assert told["scenes"] == 4
    method = told["methods"]["m"]
    assert (method["scenes"], method["scored"], method["f1"]) == (4, 2, pytest.approx(0.3))
    assert list(method["kinds"]) == ["b", "a"]
    assert (method["kinds"]["a"]["f1"], method["kinds"]["b"]["scored"]) == (pytest.approx(0.3), 0)
    assert method["kinds"]["a"]["faults"]["shake"]["f1"] == 0.4
    first, missing, _, last = told["scores"]
    assert (first["method"], first["scene"], first["f1"]) == ("m", "0000", 0.2)
    assert missing == {"method": "m", "scene": "0001", "missing": "no file", "wrong": None}
    assert last == {"method": "m", "scene": "0003", "missing": None, "wrong": "of another shape"}
    assert np.isnan(first["brier"])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (json.dumps({"refused": {"0001": "no forces", "2": 3}}), {"0001": "no forces", "2": "3"}),
        ("{}", {}),
        ('{"refused": []}', {}),
        ("[]", {}),
        ("{", {}),
        (None, {}),
    ],
)
def test_why_a_run_refused_a_scene_is_told_where_it_says_so(
    tmp_path: Path, text: str | None, told: dict[str, str]
) -> None:
    if text is not None:
        path = tmp_path / files.RESULTS / "m" / files.RUN
        path.parent.mkdir(parents=True)
        path.write_text(text, encoding="utf-8")
    assert _refused(tmp_path, "m") == told
