"""The paper's experiments on simulated scenes: `python -m benchmarks.paper [--output FOLDER] [--page docs/paper.md]`.

One module a figure. Prints a table a figure, writes paper.json and a PNG a picture; with ``--page`` the tables and
pictures of that page are made anew. Simulated scenes are kept under .cache, so a second run takes a minute.
"""

import importlib
import time
from pathlib import Path

from benchmarks.pages import options, picture_folder, save, write
from benchmarks.paper.common import Finding

FIGURES = ("02", "03", "06", "07", "08", "09", "10", "13", "14", "15", "16")


def make(figure: str, pictures: Path) -> Finding:
    """Do one figure's experiment, print its table and write its pictures."""
    began = time.perf_counter()
    module = importlib.import_module(f"benchmarks.paper.figure_{figure}")
    print(f"\n{module.__doc__.splitlines()[0]}", flush=True)
    finding: Finding = module.find()
    for name, picture in finding.pictures.items():
        save(picture, pictures / f"paper-{name}.png")
    print(f"\n{finding.table}\n\n({time.perf_counter() - began:.1f} s)", flush=True)
    return finding


def main() -> None:
    """Run, print, write."""
    parser = options(__doc__)
    parser.add_argument("--only", nargs="+", choices=FIGURES, default=FIGURES, help="these figures alone")
    arguments = parser.parse_args()
    pictures = picture_folder(arguments)
    findings = {figure: make(figure, pictures) for figure in arguments.only}
    numbers = {figure: finding.numbers for figure, finding in findings.items()}
    tables = {figure: finding.table for figure, finding in findings.items()}
    write(numbers, tables, arguments, "paper.json")


if __name__ == "__main__":
    main()
