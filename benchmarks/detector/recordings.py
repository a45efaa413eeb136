"""What is found in the real Tac3D recordings: `python -m benchmarks.detector.recordings [--page docs/recordings.md]`.

They carry no truth. Reported are the gaps met, the marker noise estimated, events, and two shares of slip that is most
likely false: in frames of mere pressing (by Mindlin and Deresiewicz all sticks), and where the force ratio is below
half of the median at which elements slip; where in the contact slip is found while less than half of its friction is
needed; and how the sensors' own forces agree with those that follow from
displacement by gels of some thicknesses, for theirs is not known. Writes recordings.json and pictures; says so where
they are not there.
"""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.pages import options, picture_folder, save, table, write
from service.formats import tac3d
from service.report.pictures import slip_over_time
from slipcore import GraspLog, SlipHistory, contact_friction, detect_slip, element_forces
from slipcore.forces import Agreement, ForceComparison, Gel, compare_forces, reconstruct
from slipcore.frames import BoolArray, FloatArray
from slipcore.patch_record import frames_of, joined
from slipcore.surface.log_normals import normals_of

RECORDINGS = Path(".cache/tac3d/PyTac3D/example_data")
NAMES = ("example_1/AD2-0065L", "example_2/HDL1-GWH0021", "example_2/HDL1-GWH0022")
METHODS = ("filter", "strain_rate", "strain_rate_literal")
PRESSES = 0.01
"""Of the largest normal force: growth in a frame that counts as pressing, if the tangential force grows far less."""
STEADY = 0.2
GAP = 0.1
"""s; longer intervals are shaded in the pictures."""

YOUNG_MODULUS, POISSON_RATIO = 2e5, 0.48
"""Pa, as silicones are; the first only scales forces."""
BANDS = (0.0, 0.2, 0.4, 1.0)
"""Of the frame's largest normal force on an element."""
THICKNESSES = (2e-3, 4e-3, 8e-3, math.inf)
"""m."""


@dataclass(frozen=True, slots=True)
class Met:
    """What a recording holds, gaps and all."""

    recording: str
    frames: int
    seconds: float
    dropped: int
    largest_gap: float
    gated: int
    normal_force: float


@dataclass(frozen=True, slots=True)
class Found:
    """What a method says of a recording; shares are of point-frames, in contact or slipping."""

    recording: str
    method: str
    noise: float
    stick_ratio_mean: float
    stick_ratio_min: float
    onsets: int
    ends: int
    macro_slip_frames: int
    slipping: float
    pressing: int
    false_in_pressing: float
    false_by_ratio: float


@dataclass(frozen=True, slots=True)
class Held:
    """Slip while the load ratio is below half of the contact's friction: of all elements, and by what share of the
    frame's largest normal force they bear, how many these are and how many of them are said to slip.
    """

    recording: str
    frames: int
    slipping: float
    elements: tuple[float, ...]
    slipping_of: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ThicknessComparison:
    """How forces agree by a gel of some thickness, m; ``totals`` [2, t] N: own normal force and that by the gel."""

    recording: str
    thickness: float
    agreement: ForceComparison
    totals: FloatArray


def recordings(folder: Path) -> Iterator[tuple[str, GraspLog]]:
    """Those that are there."""
    for name in NAMES:
        if (folder / name).is_dir():
            yield name, tac3d.read(folder / name)


def meet(name: str, log: GraspLog) -> Met:
    """Frames, gaps and load of a recording."""
    assert log.force is not None
    return Met(
        recording=name,
        frames=len(log),
        seconds=float(np.ptp(log.time)),
        dropped=int(log.metadata["dropped_frames"]),
        largest_gap=float(np.diff(log.time).max()),
        gated=int(log.metadata["gated_frames"]),
        normal_force=float(-log.force[..., 2].sum(axis=(1, 2)).min()),
    )


def pressing(log: GraspLog) -> BoolArray:
    """Frames [t] in which the normal force grows while the tangential one hardly changes."""
    assert log.force is not None
    total = log.force.sum(axis=(1, 2))
    normal = np.diff(-total[:, 2], prepend=-total[0, 2])
    sideways = np.hypot(*np.diff(total[:, :2], axis=0, prepend=total[:1, :2]).T)
    mere: BoolArray = (normal > PRESSES * -total[:, 2].min()) & (sideways < STEADY * normal)
    return mere


def find(name: str, log: GraspLog, history: SlipHistory) -> Found:
    """What a history amounts to."""
    assert log.force is not None
    forces = element_forces(log.force, normals_of(log))
    slips = history.slip & forces.compressive
    ratio = forces.tangential[slips] / forces.normal[slips]
    press, touching = pressing(log), max(int(history.contact.sum()), 1)
    in_pressing = int(history.contact[press].sum())
    return Found(
        recording=name,
        method=history.method,
        noise=history.noise,
        stick_ratio_mean=float(np.nanmean(history.stick_ratio)),
        stick_ratio_min=float(np.nanmin(history.stick_ratio)),
        onsets=len(history.events.onset),
        ends=len(history.events.end),
        macro_slip_frames=int(history.macro_slip.sum()),
        slipping=float(history.slip.sum() / touching),
        pressing=in_pressing,
        false_in_pressing=float(history.slip[press].sum() / in_pressing) if in_pressing else float("nan"),
        false_by_ratio=float((ratio < 0.5 * np.median(ratio)).mean()) if len(ratio) else float("nan"),
    )


def held(name: str, log: GraspLog, history: SlipHistory) -> Held | None:
    """What slips while the contact is loaded to less than half of its friction; None where that is not known."""
    friction, patches = contact_friction(log.time, history.patches), history.patches
    if friction is None or friction.is_bound:
        return None
    assert log.force is not None
    frames = frames_of(patches)[joined(patches, "load_ratio") < 0.5 * friction.coefficient]
    normal = element_forces(log.force[frames], normals_of(log)[frames]).normal
    share, contact, slip = (
        normal / normal.max(axis=(1, 2), keepdims=True),
        history.contact[frames],
        history.slip[frames],
    )
    bands = [contact & (share > low) & (share <= high) for low, high in pairwise(BANDS)]
    return Held(
        recording=name,
        frames=len(frames),
        slipping=float(slip.sum() / contact.sum()),
        elements=tuple(float(band.sum() / contact.sum()) for band in bands),
        slipping_of=tuple(float(slip[band].mean()) for band in bands),
    )


def compare(name: str, log: GraspLog, thickness: float) -> ThicknessComparison:
    """A sensor's own forces beside those by a gel of some thickness."""
    assert log.force is not None
    found = reconstruct(log, Gel(YOUNG_MODULUS, POISSON_RATIO, thickness))
    totals = np.stack([-force[..., 2].sum(axis=(1, 2)) for force in (log.force, found.force)])
    return ThicknessComparison(name, thickness, compare_forces(log, found), totals)


def draw_totals(compared: list[ThicknessComparison]) -> Figure:
    """Normal force over frames: the sensor's own, and by the gel that agrees best, to the same scale."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    names = list(dict.fromkeys(each.recording for each in compared))
    for axes, name in zip(figure.subplots(1, len(names), squeeze=False)[0], names, strict=True):
        best = max((c for c in compared if c.recording == name), key=lambda c: c.agreement.normal.correlation)
        own, found = best.totals
        axes.plot(own, color="0.2", label="the sensor's own")
        axes.plot(best.agreement.total_normal.ratio * found, ls="--", label=f"by {gel_name(best.thickness)}, scaled")
        axes.set(title=name.rpartition("/")[2], xlabel="frame", ylabel="normal force, N")
        axes.set_ylim(bottom=0.0)
        axes.legend(frameon=False, fontsize=8)
    return figure


def gel_name(thickness: float) -> str:
    """A gel as tables tell it."""
    return "half-space" if math.isinf(thickness) else f"{1e3 * thickness:g} mm"


def draw(name: str, log: GraspLog, histories: dict[str, SlipHistory]) -> Figure:
    """Maps and stick ratio of the filter, that of the strain rate beside it, and gaps shaded."""
    figure = slip_over_time(log, histories["filter"], f"{name}: filter (dashed: strain_rate; grey: gaps)")
    axes = next(each for each in figure.axes if each.get_xlabel())  # the maps above have none
    since = log.time - log.time[0]
    axes.plot(since, histories["strain_rate"].stick_ratio, color="0.35", ls="--", lw=1.0)
    for before in np.flatnonzero(np.diff(since) > GAP):
        axes.axvspan(since[before], since[before + 1], color="0.85", lw=0, zorder=0)
    return figure


def share(value: float) -> str:
    """A share in percent."""
    return "–" if np.isnan(value) else f"{value:.1%}"


def tables(
    met: list[Met], found: list[Found], still: list[Held], compared: list[ThicknessComparison]
) -> dict[str, str]:
    """What was met, what was found, what slips where little loads the contact, and how forces agree, in Markdown."""
    columns = ("recording", "frames", "seconds", "dropped", "largest gap, s", "gated frames", "largest normal force, N")
    rows = [list(asdict(entry).values()) for entry in met]
    heads = ("recording", "method", "noise, µm", "stick ratio, mean", "smallest", "onsets", "ends",
             "frames of macro slip", "slipping", "false: in mere pressing", "false: by force ratio")  # fmt: skip
    cells = [
        (f.recording, f.method, 1e6 * f.noise, f.stick_ratio_mean, f.stick_ratio_min, f.onsets, f.ends,
         f.macro_slip_frames, share(f.slipping), f"{share(f.false_in_pressing)} of {f.pressing}",
         share(f.false_by_ratio))
        for f in found
    ]  # fmt: skip
    parts = ("normal", "tangential", "total_normal", "total_tangential")
    agreements = [
        (c.recording, gel_name(c.thickness), *(cell(getattr(c.agreement, part)) for part in parts)) for c in compared
    ]
    wholes = ("recording", "gel", "normal, elements", "tangential, elements", "normal, contact", "tangential, contact")
    bands = [f"bear {low:.0%} to {high:.0%}" for low, high in pairwise(BANDS)]
    of_held = [
        (
            h.recording,
            h.frames,
            share(h.slipping),
            *(f"{share(s)} of {share(e)}" for s, e in zip(h.slipping_of, h.elements, strict=True)),
        )
        for h in still
    ]
    made = {"held": table(("recording", "frames", "slipping", *bands), of_held)}
    return made | {"met": table(columns, rows), "found": table(heads, cells), "forces": table(wholes, agreements)}


def cell(agreement: Agreement) -> str:
    """Correlation, and the sensor's own force over that by the gel."""
    return f"{agreement.correlation:.2f} (× {agreement.ratio:.2f})"


def main() -> None:
    """Detect, print and write."""
    parser = options(__doc__)
    parser.add_argument("--recordings", type=Path, default=RECORDINGS, help="folder of Tac3D recordings")
    arguments = parser.parse_args()
    logs = dict(recordings(arguments.recordings))
    if not logs:
        raise SystemExit(f"no recordings in {arguments.recordings}: `make recordings` fetches them where it can")
    pictures = picture_folder(arguments)
    met, found, still = [meet(name, log) for name, log in logs.items()], [], []
    for name, log in logs.items():
        histories = {method: detect_slip(log, method) for method in METHODS}
        found += [find(name, log, history) for history in histories.values()]
        still += [each] if (each := held(name, log, histories["filter"])) else []
        save(draw(name, log, histories), pictures / f"recording-{name.rpartition('/')[2]}.png")
    compared = [compare(name, log, thickness) for name, log in logs.items() for thickness in THICKNESSES]
    save(draw_totals(compared), pictures / "recording-forces.png")
    made = tables(met, found, still, compared)
    print("\n\n".join(made.values()))
    numbers = {"met": [asdict(entry) for entry in met], "found": [asdict(entry) for entry in found]}
    numbers["held"] = [asdict(entry) for entry in still]
    numbers["forces"] = [{"recording": c.recording, "thickness": c.thickness, **asdict(c.agreement)} for c in compared]
    write(numbers, made, arguments, "recordings.json")


if __name__ == "__main__":
    main()
