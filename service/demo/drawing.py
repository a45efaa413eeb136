"""The demo's pictures, from the same pipeline that the service runs."""

from collections.abc import Sequence
from dataclasses import dataclass

from rich.progress import Progress

from service.demo.inputs import DemoLog
from service.demo.tables import METHODS, Answer
from service.report.page import Picture
from service.report.pictures import friction_sections, marginals, slip_over_time
from slipcore import LOOKAHEAD, FrictionSamples, SlipHistory, collect_samples, detect_slip
from stiction_client import FrictionModel


@dataclass(frozen=True, slots=True, eq=False)
class DetectedGrasp:
    """A demo log with what is detected in it."""

    entry: DemoLog
    history: SlipHistory
    samples: FrictionSamples


def detect_all(logs: Sequence[DemoLog], progress: Progress) -> list[DetectedGrasp]:
    """Detect slip in every log and collect its samples."""
    seen = []
    for entry in progress.track(logs, description="detect again, for the pictures"):
        history = detect_slip(entry.log, lookahead=LOOKAHEAD)
        seen.append(DetectedGrasp(entry, history, collect_samples(entry.log, history)))
    return seen


def draw_grasps(seen: Sequence[DetectedGrasp]) -> list[Picture]:
    """Stick-slip maps and stick ratio of every real recording and of one simulated grasp a material."""
    simulated = {grasp.entry.material: grasp for grasp in seen if grasp.entry.truth is not None}
    shown = [*(grasp for grasp in seen if grasp.entry.truth is None), *simulated.values()]
    return [_draw_grasp(grasp) for grasp in shown]


def draw_models(answers: Sequence[Answer], seen: Sequence[DetectedGrasp]) -> list[Picture]:
    """The models that the tables show: by the first method over the samples, by the last one as what it believes."""
    pictures = []
    for answer in answers:
        if answer.model is not None:
            grasps = [grasp for grasp in seen if grasp.entry.material == answer.material]
            pictures.append(_draw_model(answer.method, answer.model, grasps))
    return pictures


def _draw_grasp(grasp: DetectedGrasp) -> Picture:
    figure = slip_over_time(grasp.entry.log, grasp.history, "")
    return Picture(f"{grasp.entry.name}: contact, stick and slip over time, and the stick ratio.", figure)


def _draw_model(method: str, model: FrictionModel, grasps: Sequence[DetectedGrasp]) -> Picture:
    material, truth = grasps[0].entry.material, grasps[0].entry.truth
    if method == METHODS[0]:
        samples = FrictionSamples.concatenate([grasp.samples for grasp in grasps])
        caption = f"{material}: friction samples, and the plane and band fitted by {method}."
        return Picture(caption, friction_sections(model, samples, truth=truth))
    return Picture(f"{material}: posterior by {method}; dotted: its 95 % interval.", marginals(model, truth=truth))
