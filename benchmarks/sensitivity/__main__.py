"""What half and one and a half of each default does: `python -m benchmarks.sensitivity [--page docs/sensitivity.md]`.

`--missing` measures what the page has no row of yet, and what has another default since; the other rows stay.

Detectors: change of the mean F1 on scenes that no default was chosen on; those for few elements on the same scenes as
few elements see them. Grip control: change of how many objects are held, and of the force over the least that holds.
Patches: change of the error of a contact's friction, and of the share of frames whose regime is right. Forces: change
of the error of forces from displacement, and of how many intervals hold the truth. Contact: change of the largest
error against a fine solution, and of the operators' applications; change of the error of expected times. Estimators:
change of the error of friction at working points and of its interval's width, over simulated grasps. Each value is
kept in its range.
"""

from collections.abc import Callable
from dataclasses import asdict

from matplotlib.figure import Figure

from benchmarks.pages import options, picture_folder, save, write
from benchmarks.sensitivity import measures, of_markers, of_new_grasps, of_prices, of_samples, of_scenes
from benchmarks.sensitivity.rows import DEAD, Known, Row, rows_on, table_of

PARTS: dict[str, Callable[[Known], list[Row]]] = {
    "detector": measures.of_detectors,
    "few elements": measures.of_few_elements,
    "baselines": measures.of_baselines,
    "samples": of_samples.of_samples,
    "collection": of_samples.of_collection,
    "markers": of_markers.of_markers,
    "control": measures.of_control,
    "patches": measures.of_patches,
    "saturation": of_samples.of_saturation,
    "smoothing": of_samples.of_smoothing,
    "forces": measures.of_presses,
    "contact": measures.of_solver,
    "expected time": of_prices.of_prices,
    "cheap tiers": of_scenes.of_cheap_tiers,
    "explain": of_scenes.of_explanations,
    "estimators": measures.of_fits,
    **{name: of_new_grasps.part_of(name) for name in of_new_grasps.MEASURES},
}


def draw(found: list[Row]) -> Figure:
    """The largest change of each default that changes something, on a logarithmic scale."""
    known = sorted((row for row in found if row.largest >= DEAD), key=lambda row: row.largest)
    figure = Figure(figsize=(7.0, max(2.0, 0.14 * len(known))), layout="constrained")
    axes = figure.subplots()
    axes.barh(range(len(known)), [row.largest for row in known], color="#07a")
    axes.set_yticks(range(len(known)), [f"{row.table} {row.name}" for row in known], fontsize=5)
    axes.set(xscale="log", xlabel="largest change by ±50 %")
    return figure


def main() -> None:
    """Measure, write JSON, a picture and the page's tables."""
    parser = options(__doc__)
    parser.add_argument("--only", choices=tuple(PARTS), nargs="+", help="some parts")
    parser.add_argument("--missing", action="store_true", help="only what the page has no row of")
    arguments = parser.parse_args()
    if arguments.missing and arguments.page is None:
        parser.error("--missing needs a --page")
    for part in arguments.only or PARTS:
        kept = rows_on(arguments.page.read_text(encoding="utf-8"), part) if arguments.missing else []
        found = kept + PARTS[part](frozenset((row.table, row.name) for row in kept))
        name = f"sensitivity-{part.replace(' ', '-')}"
        pictures = picture_folder(arguments)
        if any(row.largest >= DEAD for row in found):
            save(draw(found), pictures / f"{name}.png")
        numbers = [asdict(row) for row in found]
        write(numbers, {part: table_of(found)}, arguments, f"{name}.json")
        print(table_of(found))


if __name__ == "__main__":
    main()
