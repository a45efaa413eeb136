"""The scoring page of a benchmark: who finds slip how well, by sensor and by fault."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from service.formatting import NOTHING, number
from service.report.page import Fact, Picture, Report, Section, Table
from service.slip_benchmark.measures import Measures
from service.slip_benchmark.scoring import Scores, ScoreSummary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = (
    "method",
    "scenes",
    "F1",
    "false slip",
    "onset delay [ms]",
    "onsets missed",
    "stick ratio",
    "gross slip F1",
    "μ",
    "force",
    "Brier",
)
MEANING = (
    "F1 of slip over elements and frames in contact; false slip: share of sticking elements that are said to slip; "
    "delay of onsets that were found (median, below 0: early) and share of those that were missed; root mean square "
    "error of the stick ratio; F1 of frames of gross slip; relative error of friction and of forces where a method "
    "gives them; Brier score of its probability. Means over scenes, without those for which a score has no meaning."
)
SIMULATION = (
    "All of this is simulation: it ranks methods by mechanics and faults that were put in, not on a real sensor."
)


def cells(summary: ScoreSummary) -> list[str]:
    """A row of a table, but for its name."""
    means = summary.means
    return [f"{summary.scored} of {summary.scenes}", *_numbers(means)]


def _numbers(means: Measures) -> list[str]:
    delay = NOTHING if means.onset_delay != means.onset_delay else f"{1e3 * means.onset_delay:+.0f}"
    return [
        _share(means.f1), _share(means.false_slip), delay, *map(_share, (
            means.missed_onsets, means.stick_ratio_error, means.macro_f1, means.friction_error, means.force_error,
            means.brier,
        )),
    ]  # fmt: skip


def _share(value: float) -> str:
    return number(value) if value != value else f"{value:.3f}"


def overall(scores: Scores, kind: str | None = None) -> list[list[str]]:
    """Rows of all methods over all scenes, or those of a kind."""
    return [[method, *cells(scores.of(method, kind))] for method in scores.methods]


def f1_by_fault(scores: Scores, kind: str) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of the F1 of each method under each fault of a kind."""
    faults = [fault for fault in scores.faults if scores.of(scores.methods[0], kind, fault).scenes]
    rows = [
        [method, *(_share(scores.of(method, kind, fault).means.f1) for fault in faults)] for method in scores.methods
    ]
    return ["method", *faults], rows


def f1_by_kind(scores: Scores) -> list[list[str]]:
    """Rows of the F1 of each method for each kind."""
    return [[m, *(_share(scores.of(m, kind).means.f1) for kind in scores.kinds)] for m in scores.methods]


def page(scores: Scores) -> Report:
    """The page, its pictures inside."""
    best = scores.methods[0]
    means = scores.of(best).means
    facts = [
        Fact("Scenes", str(len(scores.manifest.scenes))),
        Fact("Methods", str(len(scores.methods))),
        Fact("Best F1", f"{_share(means.f1)} by {best}"),
        Fact("Licence", scores.manifest.licence),
        Fact("Seal (SHA-256 of the phrase)", scores.manifest.seal),
    ]
    return Report(
        "Slip benchmark", SIMULATION, facts, _steps(scores), [_summary(scores), *_kinds(scores), *_gaps(scores)]
    )


def _steps(scores: Scores) -> list[str]:
    wrong = scores.wrong
    return [f"Mend {len(wrong)} predictions that cannot be scored: they are listed below."] if wrong else []


def _summary(scores: Scores) -> Section:
    table = Table("Means over all scenes", COLUMNS, overall(scores))
    picture = Picture("F1 of each method, by sensor and by fault.", draw(scores))
    return Section("Methods", MEANING, [table], [picture])


def _kinds(scores: Scores) -> list[Section]:
    return [
        Section(
            kind,
            tables=[
                Table("All scores", COLUMNS, overall(scores, kind)),
                Table("F1 by fault", *f1_by_fault(scores, kind)),
            ],
            folded=True,
        )
        for kind in scores.kinds
    ]


def _gaps(scores: Scores) -> list[Section]:
    """What could not be scored."""
    rows = [[s.method, s.scene.name, s.wrong or s.missing or ""] for s in scores.each if s.measures is None]
    table = Table("Missing and wrong predictions", ("method", "scene", "why"), rows)
    return [Section("What could not be scored", tables=[table], folded=not scores.wrong)] if rows else []


def draw(scores: Scores) -> "Figure":
    """F1 of each method over faults, one panel a sensor."""
    from matplotlib.figure import Figure

    kinds = scores.kinds
    figure = Figure(figsize=(11, 3.4 * ((len(kinds) + 1) // 2)), layout="constrained")
    panels = figure.subplots((len(kinds) + 1) // 2, 2, squeeze=False, sharey=True).ravel()
    for axes, kind in zip(panels, kinds, strict=False):
        faults = [fault for fault in scores.faults if scores.of(scores.methods[0], kind, fault).scenes]
        for place, method in enumerate(scores.methods):
            values = [scores.of(method, kind, fault).means.f1 for fault in faults]
            axes.plot(
                faults, values, _MARKS[place % len(_MARKS)], label=method, linestyle="-", linewidth=0.8, markersize=4
            )
        axes.set(title=kind, ylim=(-0.03, 1.03), ylabel="F1 [-]")
        axes.tick_params(axis="x", rotation=40, labelsize=7)
        for label in axes.get_xticklabels():
            label.set_ha("right")
        axes.grid(visible=True, alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    for axes in panels[len(kinds) :]:
        axes.set_axis_off()
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False, fontsize=8
    )
    return figure


_MARKS: Sequence[str] = ("o", "s", "^", "v", "D", "P", "X", "<", ">", "*", "h", "p")
