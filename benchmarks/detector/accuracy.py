"""How well detectors find slip on scenes with truth; part of `python -m benchmarks.detector`.

Scored at the measurement points in true contact: F1 against the contact-factor truth (and the kinematic one), error of
the stick ratio, F1 in each loading phase (over the pooled frames of all scenes), and the share of false slip where
nothing slips by loading. Scenes without slip beyond their rim count in the false slip only.
"""

from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np
from cycler import cycler
from matplotlib.figure import Figure

from benchmarks import pages
from benchmarks.detector.scenes import Case, cases, observed
from slipcore import LOOKAHEAD, METHODS, GraspLog, SlipHistory, detect_slip
from slipcore.frames import BoolArray

NOISES = (0.0, 1e-6, 3e-6, 1e-5)
FORCE_NOISE = 2e-3
INPUTS = ("displacement", "force", "motion")
PHASES = ("shear", "unload", "hold", "normal rises", "normal falls")
ONSET_REACH = 5
AHEAD = f"filter, {LOOKAHEAD} frames ahead"
"""The filter as stored logs are judged: each frame in the light of so many after it."""
BEST_OF = [
    {"threshold": threshold, "growth_rate": growth} for threshold in (2.0, 3.0, 5.0) for growth in (0.1, 0.3, 1.0)
]
"""Settings of ``strain_rate``; the row ``strain_rate, best`` takes the best for each scene by its truth."""


@dataclass(frozen=True, slots=True)
class Count:
    """Points that truly slip, that were found to slip, and both."""

    true: int
    found: int
    both: int

    @property
    def f1(self) -> float:
        """F1, NaN where nothing slips and nothing was found."""
        total = self.true + self.found
        return 2.0 * self.both / total if total else float("nan")


@dataclass(frozen=True, slots=True)
class Score:
    """One method on one scene."""

    scene: str
    f1: float
    f1_kinematic: float
    stick_ratio_error: float
    false_slip: float
    onset_error: float
    phases: dict[str, Count]


@dataclass(frozen=True, slots=True)
class Summary:
    """One method over the scenes of a set, at one noise (m) and with one kind of input."""

    scenes: str
    inputs: str
    noise: float
    method: str
    f1: float
    worst: float
    worst_scene: str
    f1_kinematic: float
    stick_ratio_error: float
    false_slip: float
    onset_error: float
    phases: dict[str, float]
    each: dict[str, float]


def count(true: BoolArray, found: BoolArray) -> Count:
    """Points of two masks."""
    return Count(int(true.sum()), int(found.sum()), int((true & found).sum()))


def onset_error(true: BoolArray, found: BoolArray) -> float:
    """Mean distance in frames from each true onset [t, n, m] to the nearest found one of the same element.

    Onsets without any within ``ONSET_REACH`` frames are left to F1; NaN where none is left.
    """
    distances = []
    for element in zip(*np.nonzero(true.any(axis=0)), strict=True):
        was, now = (np.flatnonzero(np.diff(mask[:, *element].astype(int)) > 0) for mask in (true, found))
        if len(now):
            nearest = np.abs(was[:, None] - now).min(axis=1)
            distances += nearest[nearest <= ONSET_REACH].tolist()
    return float(np.mean(distances)) if distances else float("nan")


def reliability(cases_and_histories: Iterable[tuple[Case, SlipHistory]]) -> list[tuple[float, float, int]]:
    """Mean reported probability, share that truly slips, and count, of tenths of the reported probability."""
    predicted, truth = [], []
    for case, history in cases_and_histories:
        known = case.log.truth
        assert known is not None
        judged = known.contact[1:] & history.contact[1:] & history.contact[:-1]
        predicted.append(history.probability[1:][judged])
        truth.append(known.slip_contact_factor[1:][judged])
    probability, slips = np.concatenate(predicted), np.concatenate(truth)
    tenth = np.minimum((10.0 * probability).astype(int), 9)
    return [
        (float(probability[tenth == k].mean()), float(slips[tenth == k].mean()), int((tenth == k).sum()))
        for k in range(10)
        if (tenth == k).any()
    ]


def score(case: Case, log: GraspLog, history: SlipHistory) -> Score:
    """Score a history against the truth of its log."""
    truth = log.truth
    assert truth is not None
    found = history.slip & truth.contact
    true, moving = truth.slip_contact_factor & truth.contact, truth.slip_kinematic & truth.contact
    phase = np.array(case.phase)
    pressing = truth.contact & (phase == "press")[:, None, None]
    return Score(
        scene=case.name,
        f1=count(true, found).f1,
        f1_kinematic=count(moving, found).f1,
        stick_ratio_error=float(np.sqrt(np.nanmean((history.stick_ratio - truth.stick_ratio) ** 2))),
        false_slip=float((found & pressing).sum() / max(1, pressing.sum())),
        onset_error=onset_error(true, found),
        phases={name: count(true[phase == name], found[phase == name]) for name in PHASES},
    )


def mean_known(values: list[float]) -> float:
    """Mean without NaN; NaN where nothing else is left."""
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float("nan")


def summarise(scenes: str, inputs: str, noise: float, method: str, scores: Iterable[Score]) -> Summary:
    """Mean over scenes, the worst of them, and phases pooled."""
    scores = list(scores)
    slipping = [s for s in scores if not s.scene.startswith("press")]
    worst = min(slipping, key=lambda s: s.f1)
    pooled = {
        name: Count(*(sum(getattr(s.phases[name], part) for s in slipping) for part in ("true", "found", "both"))).f1
        for name in PHASES
    }
    return Summary(
        scenes=scenes,
        inputs=inputs,
        noise=noise,
        method=method,
        f1=float(np.mean([s.f1 for s in slipping])),
        worst=worst.f1,
        worst_scene=worst.scene,
        f1_kinematic=float(np.mean([s.f1_kinematic for s in slipping])),
        stick_ratio_error=float(np.mean([s.stick_ratio_error for s in slipping])),
        false_slip=float(np.mean([s.false_slip for s in scores])),
        onset_error=mean_known([s.onset_error for s in slipping]),
        phases=pooled,
        each={s.scene: s.f1 for s in scores},
    )


def measure(scenes: str, inputs: str, noise: float, seed: int = 3) -> list[Summary]:
    """All methods on one set of scenes, and the paper's at its best setting for each scene."""
    logs = [
        (case, observed(case.log, noise, FORCE_NOISE if noise > 0.0 else 0.0, inputs, seed)) for case in cases(scenes)
    ]
    rows = [
        summarise(scenes, inputs, noise, name, [score(case, log, detect_slip(log, name)) for case, log in logs])
        for name in METHODS
    ]
    later = [score(case, log, detect_slip(log, "filter", lookahead=LOOKAHEAD)) for case, log in logs]
    rows.insert(1, summarise(scenes, inputs, noise, AHEAD, later))
    if inputs == "force":
        best = [
            max((score(case, log, detect_slip(log, "strain_rate", **o)) for o in BEST_OF), key=lambda s: s.f1)
            for case, log in logs
        ]
        rows.append(summarise(scenes, inputs, noise, "strain_rate, best", best))
    return rows


def table(rows: list[Summary]) -> str:
    """A table of summaries in Markdown."""
    lines = [
        "| scenes | input | noise, µm | method | F1 | worst | kinematic F1 | stick ratio | onset | false slip | "
        + " | ".join(PHASES)
        + " |",
        "|---" * (10 + len(PHASES)) + "|",
    ]
    lines += [
        f"| {r.scenes} | {r.inputs} | {1e6 * r.noise:.0f} | {r.method} | {r.f1:.3f} | {r.worst:.2f} ({r.worst_scene}) "
        f"| {r.f1_kinematic:.3f} | {r.stick_ratio_error:.3f} | {r.onset_error:.2f} | {r.false_slip:.2%} | "
        + " | ".join(f"{r.phases[name]:.2f}" for name in PHASES)
        + " |"
        for r in rows
    ]
    return "\n".join(lines)


def tables_of_unseen(rows: list[Summary]) -> dict[str, str]:
    """Of the set ``scoring``: F1, stick-ratio error and worst scene over noise, and all methods with forces at 1 µm."""
    unseen = [row for row in rows if row.scenes == "scoring"]
    return {"accuracy": _over_noise(unseen), "methods": _of_methods(unseen)}


def _over_noise(rows: list[Summary]) -> str:
    found = {(row.method, row.inputs, row.noise): row for row in rows}
    kept = [(method, inputs) for method in ("filter", AHEAD) for inputs in ("force", "displacement", "motion")]
    kept.append(("strain_rate, best", "force"))
    names = {"force": "forces", "displacement": "displacement alone", "motion": "forces and object motion"}
    lines = []
    for method, inputs in kept:
        cells = [found[method, inputs, noise] for noise in NOISES]
        lines.append(
            [f"{method}; {names[inputs]}", *(f"{c.f1:.3f} / {c.stick_ratio_error:.3f} ({c.worst:.2f})" for c in cells)]
        )
    return pages.table(("method; input", *(f"{1e6 * noise:.0f} µm" for noise in NOISES)), lines)


def _of_methods(rows: list[Summary]) -> str:
    chosen = sorted((row for row in rows if (row.inputs, row.noise) == ("force", 1e-6)), key=lambda row: -row.f1)
    lines = [
        [
            row.method,
            f"{row.f1:.3f}",
            *(f"{score:.2f}" for score in (row.worst, *(row.phases[name] for name in PHASES))),
            f"{row.onset_error:.1f}",
            f"{row.false_slip:.2%}",
        ]
        for row in chosen
    ]
    return pages.table(("method", "F1", "worst", *PHASES, "onset", "false slip in pressing"), lines)


LOOKS = cycler(marker=["o", "s"]) * cycler(color=[f"C{k}" for k in range(10)])
"""Of 20 methods, each the same in all panels."""


def draw(rows: list[Summary]) -> Figure:
    """F1 over noise, one panel for each kind of input of the unseen scenes."""
    figure = Figure(figsize=(11, 4), layout="constrained")
    panels = figure.subplots(1, len(INPUTS), sharey=True)
    looks = dict(zip(dict.fromkeys(r.method for r in rows), LOOKS, strict=False))
    for axes, inputs in zip(panels, INPUTS, strict=True):
        chosen = [r for r in rows if r.inputs == inputs and r.scenes == "scoring"]
        for method in dict.fromkeys(r.method for r in chosen):
            line = [r for r in chosen if r.method == method]
            axes.plot(
                [str(round(1e6 * r.noise)) for r in line],
                [r.f1 for r in line],
                lw=2.5 if method in ("filter", AHEAD) else 1.0,
                label=method,
                **looks[method],
            )
        axes.set(title=f"input: {inputs}", xlabel="marker noise, µm", ylim=(0.0, 1.0))
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("mean F1 over unseen scenes")
    figure.legend(*panels[1].get_legend_handles_labels(), fontsize=7, loc="outside lower center", ncols=5)
    return figure


def draw_reliability(calibrated: dict[str, list[tuple[float, float, int]]]) -> Figure:
    """Share of points that truly slip over the probability reported, at 1 µm of noise."""
    figure = Figure(figsize=(4.5, 4), layout="constrained")
    axes = figure.subplots()
    axes.plot((0.0, 1.0), (0.0, 1.0), color="0.6", ls=":")
    for inputs, tenths in calibrated.items():
        axes.plot([t[0] for t in tenths], [t[1] for t in tenths], marker="o", label=f"input: {inputs}")
    axes.set(xlabel="reported probability of slip", ylabel="share that slips", xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    axes.legend(fontsize=8)
    return figure


def as_json(rows: list[Summary]) -> list[dict[str, object]]:
    """Summaries for a file."""
    return [asdict(row) for row in rows]
