"""The demo's pictures, from the same pipeline that the service runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.progress import Progress

from estimators import EstimatorError, fit
from service.demo.inputs import DemoLog
from service.report.page import Picture
from service.report.pictures import posterior, samples_and_model, save, slip_over_time
from slipcore import LOOKAHEAD, FrictionSamples, SlipHistory, collect_samples, detect_slip


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """A demo log with what is detected in it."""

    entry: DemoLog
    history: SlipHistory
    samples: FrictionSamples


def see(logs: Sequence[DemoLog], progress: Progress) -> list[Seen]:
    """Detect slip in every log and collect its samples."""
    seen = []
    for entry in progress.track(logs, description="detect again, for the pictures"):
        history = detect_slip(entry.log, lookahead=LOOKAHEAD)
        seen.append(Seen(entry, history, collect_samples(entry.log, history)))
    return seen


def draw_grasps(seen: Sequence[Seen], folder: Path) -> list[Picture]:
    """Stick-slip maps and stick ratio of every real recording and of one simulated grasp a material."""
    simulated = {grasp.entry.material: grasp for grasp in seen if grasp.entry.truth is not None}
    shown = [*(grasp for grasp in seen if grasp.entry.truth is None), *simulated.values()]
    return [_draw_grasp(grasp, folder) for grasp in shown]


def draw_materials(seen: Sequence[Seen], folder: Path, seed: int, progress: Progress) -> list[Picture]:
    """Samples with the fitted plane, and the posterior, of every material that could be fitted."""
    pictures: list[Picture] = []
    materials = list(dict.fromkeys(grasp.entry.material for grasp in seen))
    for material in progress.track(materials, description="fit again, for the pictures"):
        grasps = [grasp for grasp in seen if grasp.entry.material == material]
        try:
            pictures += _draw_material(material, grasps, folder, seed)
        except EstimatorError:
            continue  # the table says why this material has no model
    return pictures


def _draw_grasp(grasp: Seen, folder: Path) -> Picture:
    name = grasp.entry.name
    path = save(slip_over_time(grasp.entry.log, grasp.history, name), folder / f"slip-{_slug(name)}.png")
    return Picture(f"{name}: contact, stick and slip over time, and the stick ratio.", path)


def _draw_material(material: str, grasps: Sequence[Seen], folder: Path, seed: int) -> list[Picture]:
    slug, truth = _slug(material), grasps[0].entry.truth
    samples = [grasp.samples for grasp in grasps]
    plane = samples_and_model(FrictionSamples.concatenate(samples), fit(samples, method="ols"), material, truth)
    bayes = posterior(fit(samples, method="bayes", seed=seed), f"{material}: posterior", truth)
    return [
        Picture(f"{material}: friction samples, the fitted plane and its band.", save(plane, folder / f"{slug}.png")),
        Picture(f"{material}: posterior (dotted: 95 %).", save(bayes, folder / f"{slug}-posterior.png")),
    ]


def _slug(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name.lower())
