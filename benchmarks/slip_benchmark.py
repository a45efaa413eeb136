"""Tables of a scored slip benchmark: `python -m benchmarks.slip_benchmark FOLDER --page docs/slip-benchmark.md`.

FOLDER was made and run by `stiction benchmark make` and `stiction benchmark run`. Prints all tables, and writes
slip_benchmark.json and slip-benchmark.png.
"""

from pathlib import Path

from benchmarks.pages import options, picture_folder, save, table, write
from service.cli.output import plain
from service.slip_benchmark import page
from service.slip_benchmark.scoring import score


def main() -> None:
    """Score, print and write."""
    parser = options(__doc__)
    parser.add_argument("folder", type=Path, help="the benchmark")
    arguments = parser.parse_args()
    pictures, scores = picture_folder(arguments), score(arguments.folder)
    tables = {
        "scores": table(page.COLUMNS, page.overall(scores)),
        "kinds": table(("method", *scores.kinds), page.f1_by_kind(scores)),
        **{kind: table(*page.f1_by_fault(scores, kind)) for kind in scores.kinds},
    }
    print("\n\n".join(tables.values()))
    save(page.draw(scores), pictures / "slip-benchmark.png")
    write(plain(scores.as_json()), tables, arguments, "slip_benchmark.json")


if __name__ == "__main__":
    main()
