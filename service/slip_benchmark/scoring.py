"""Score all that methods said of a benchmark, by sensor and by fault."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from service import formats
from service.slip_benchmark import folder as files
from service.slip_benchmark.folder import Manifest, SceneEntry, input_path, prediction_path, read_prediction
from service.slip_benchmark.measures import Measures, measure
from slipcore.errors import InvalidInput

SCORE, PAGE = "score.json", "score.html"


@dataclass(frozen=True, slots=True)
class SceneScore:
    """A method on a scene: its ``measures``, or why there is no prediction (``missing``) or a ``wrong`` one."""

    method: str
    scene: SceneEntry
    measures: Measures | None
    missing: str | None = None
    wrong: str | None = None


@dataclass(frozen=True, slots=True)
class ScoreSummary:
    """Means over the ``scored`` of so many ``scenes``; those without a meaning are left out of each."""

    scenes: int
    scored: int
    means: Measures


@dataclass(frozen=True, slots=True)
class Scores:
    """All scores of a benchmark."""

    manifest: Manifest
    each: tuple[SceneScore, ...]

    @property
    def methods(self) -> list[str]:
        """By name, the best F1 first."""
        names = list(dict.fromkeys(score.method for score in self.each))
        return sorted(names, key=lambda name: (-np.nan_to_num(self.of(name).means.f1), name))

    @property
    def kinds(self) -> list[str]:
        """Sensors in the order of the manifest."""
        return list(self.manifest.kinds)

    @property
    def faults(self) -> list[str]:
        """Faults in the order in which scenes have them."""
        return list(dict.fromkeys(scene.fault for scene in self.manifest.scenes))

    @property
    def wrong(self) -> list[SceneScore]:
        """Predictions that cannot be scored."""
        return [score for score in self.each if score.wrong]

    def of(self, method: str, kind: str | None = None, fault: str | None = None) -> ScoreSummary:
        """A method's means, over all scenes or those of a kind or fault."""
        return _summary(
            score
            for score in self.each
            if score.method == method and kind in (None, score.scene.kind) and fault in (None, score.scene.fault)
        )

    def as_json(self) -> dict[str, Any]:
        """For a file or a program; scores that have no meaning are None by ``plain``."""
        return {
            "benchmark": {name: value for name, value in asdict(self.manifest).items() if name != "scenes"},
            "scenes": len(self.manifest.scenes),
            "methods": {
                method: {
                    **_record(self.of(method)),
                    "kinds": {
                        kind: {
                            **_record(self.of(method, kind)),
                            "faults": {fault: _record(self.of(method, kind, fault)) for fault in self.faults},
                        }
                        for kind in self.kinds
                    },
                }
                for method in self.methods
            },
            "scores": [
                {
                    "method": score.method,
                    "scene": score.scene.name,
                    **(asdict(score.measures) if score.measures else {"missing": score.missing, "wrong": score.wrong}),
                }
                for score in self.each
            ],
        }


def _record(summary: ScoreSummary) -> dict[str, Any]:
    return {"scenes": summary.scenes, "scored": summary.scored, **asdict(summary.means)}


def score(folder: Path, count: Callable[[float, str], None] = lambda _, __: None) -> Scores:
    """Score each method that has results; ``count`` is given the part that is done.

    Raises ``InvalidInput`` for a folder that holds no whole benchmark, a changed one, or no results.
    """
    manifest, methods = files.read_whole_benchmark(folder), files.methods_of(folder)
    if not methods:
        raise InvalidInput(f"results in {folder}", "none", "those of `stiction benchmark run`")
    refused = {method: _refused(folder, method) for method in methods}
    each: list[SceneScore] = []
    for number, scene in enumerate(manifest.scenes, 1):
        each += _scene_scores(folder, scene, refused)
        count(number / len(manifest.scenes), f"{number} of {len(manifest.scenes)} scenes scored")
    return Scores(manifest, tuple(each))


def _refused(folder: Path, method: str) -> dict[str, str]:
    """Why a method has no prediction, by scene, as its run states it; nothing where there was none."""
    path = folder / files.RESULTS / method / files.RUN
    try:
        return {str(name): str(why) for name, why in json.loads(path.read_text(encoding="utf-8"))["refused"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def _scene_scores(folder: Path, scene: SceneEntry, refused: dict[str, dict[str, str]]) -> Iterator[SceneScore]:
    files.check_unchanged(folder, scene)
    truth = files.read_truth(files.truth_path(folder, scene.name))
    observed = formats.read(input_path(folder, scene.name)).observed
    for method, why in refused.items():
        path = prediction_path(folder, method, scene.name)
        if not path.is_file():
            yield SceneScore(method, scene, None, missing=why.get(scene.name, "no file"))
            continue
        try:
            prediction = read_prediction(path, truth.slip.shape)
        except InvalidInput as error:
            yield SceneScore(method, scene, None, wrong=f"prediction of {method} for scene {scene.name}: {error}")
        else:
            yield SceneScore(method, scene, measure(truth, prediction, observed))


def _summary(scores: Iterator[SceneScore]) -> ScoreSummary:
    all_ = list(scores)
    known = [score.measures for score in all_ if score.measures is not None]
    means = {entry.name: _mean([getattr(each, entry.name) for each in known]) for entry in fields(Measures)}
    return ScoreSummary(len(all_), len(known), Measures(**means))


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float("nan")
