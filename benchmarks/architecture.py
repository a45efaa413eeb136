"""The picture of ARCHITECTURE.md: the rooms, and which imports which.

    python -m benchmarks.architecture

Read from the source, imports inside of functions and for types included. A room is a folder of modules; an arrow goes
from the room that imports down to the one that is imported. Imports that lead back, in a circle, are red.
"""

import ast
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "images" / "architecture.png"
PACKAGES = {
    "slipcore": ".",
    "estimators": ".",
    "db": ".",
    "migrations": ".",
    "stiction_client": "clients",
    "service": ".",
}
"""Each package with the folder that it stands in."""

COLUMNS = {
    "slipcore": (0.0, 0.32),
    "estimators": (0.33, 0.41),
    "db": (0.42, 0.49),
    "migrations": (0.48, 0.62),
    "stiction_client": (0.6, 0.76),
    "service": (0.76, 1.0),
}
"""From where to where each package is drawn, of the picture's width."""

COLOURS = {
    "slipcore": "#cfe8d5",
    "estimators": "#fde4b8",
    "db": "#e3d5f0",
    "migrations": "#e3d5f0",
    "stiction_client": "#f6cfd0",
    "service": "#cfdff2",
}

Graph = Mapping[str, set[str]]


def modules() -> dict[str, Path]:
    """Every module of the distributions, by dotted name."""
    found = {}
    for package, folder in PACKAGES.items():
        for path in sorted((ROOT / folder / package).rglob("*.py")):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def names(path: Path) -> Iterator[tuple[str, str]]:
    """What a file imports, anywhere in it: name and dotted origin."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((alias.asname or alias.name, f"{node.module}.{alias.name}") for alias in node.names)


def imports() -> dict[str, set[str]]:
    """Each module with those that it takes something from; what a package passes on comes from where it is made."""
    known = modules()
    passed_on = {
        f"{module}.{name}": origin
        for module, path in known.items()
        if path.name == "__init__.py"
        for name, origin in names(path)
    }

    def module_of(origin: str) -> str:
        while origin in passed_on and passed_on[origin] != origin:
            origin = passed_on[origin]
        return origin if origin in known else origin.rpartition(".")[0]

    makers = {module for module, path in known.items() if path.name != "__init__.py"}
    return {module: {module_of(origin) for _, origin in names(known[module])} & makers - {module} for module in makers}


def room_of(module: str, graph: Graph) -> str:
    """The folder that a module is in; of a package's loose modules those above its folders are its front."""
    folder = ".".join(module.split(".")[:-1][:3])
    folders = {other for other in graph if other.startswith(f"{folder}.") and other.count(".") > folder.count(".") + 1}
    if not folders or "." in folder:
        return folder
    return f"{folder}: front" if reached(module, graph) & folders else f"{folder}: base"


def reached(module: str, graph: Graph) -> set[str]:
    """All modules that one needs, directly or not."""
    found, waiting = set[str](), [module]
    while waiting:
        new = graph[waiting.pop()] & graph.keys() - found
        found |= new
        waiting += new
    return found


def rooms() -> Graph:
    """Each room with those that it imports."""
    graph, between = imports(), defaultdict[str, set[str]](set)
    home = {module: room_of(module, graph) for module in graph}
    for module, others in graph.items():
        between[home[module]] |= {home[other] for other in others} - {home[module]}
    return dict(between)


def circles(graph: Graph) -> set[tuple[str, str]]:
    """Every import that leads back to where it comes from."""
    return {(node, other) for node in graph for other in graph[node] if node in reached(other, graph)}


def heights(graph: Graph) -> dict[str, int]:
    """Of each node: one above all that it imports, circles left out."""
    circular, found = circles(graph), dict[str, int]()

    def height(node: str) -> int:
        if node not in found:
            below = [height(other) for other in graph[node] if (node, other) not in circular]
            found[node] = 1 + max(below, default=-1)
        return found[node]

    for node in graph:
        height(node)
    return found


def places(graph: Graph) -> dict[str, tuple[float, float]]:
    """Where each room is drawn: its height up, in the column of its package."""
    rows: dict[tuple[str, int], list[str]] = defaultdict(list)
    for room, height in sorted(heights(graph).items()):
        rows[package_of(room), height].append(room)
    spots = {}
    for (package, height), row in rows.items():
        left, right = COLUMNS[package]
        spots |= {room: (left + (right - left) * (i + 0.5) / len(row), float(height)) for i, room in enumerate(row)}
    return spots


def package_of(room: str) -> str:
    """The package that a room is in."""
    return room.split(":")[0].split(".")[0]


def draw(path: Path = PICTURE) -> None:
    """Write the picture."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    graph = rooms()
    spots, circular = places(graph), circles(graph)
    figure, axes = plt.subplots(figsize=(13.0, 0.85 * (2 + max(y for _, y in spots.values()))))
    for arrow in sorted((room, other) for room in graph for other in graph[room]):
        colour, width = ("#c02020", 1.2) if arrow in circular else ("#8090a0", 0.5)
        style = {"arrowstyle": "-|>", "color": colour, "lw": width, "shrinkB": 9}
        axes.annotate("", spots[arrow[1]], spots[arrow[0]], arrowprops=style)
    for room, (x, y) in spots.items():
        box = {"boxstyle": "round,pad=0.35", "fc": COLOURS[package_of(room)], "ec": "#405060", "lw": 0.8}
        name = room.removeprefix(f"{package_of(room)}.").replace(".", "\n").replace(": ", "\n")
        axes.text(x, y, name, ha="center", va="center", fontsize=8, bbox=box)
    axes.set(xlim=(0.0, 1.0), ylim=(-0.6, max(y for _, y in spots.values()) + 0.6))
    axes.axis("off")
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


if __name__ == "__main__":
    draw()
    print(PICTURE)
