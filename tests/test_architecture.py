"""The shape of the house: which package may import which, and who owns each."""

import ast
import importlib
import importlib.metadata
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CLIENT = "clients/stiction_client"

ALLOWED = {
    "slipcore": {"slipcore", "numpy", "scipy", "numba"},
    "estimators": {
        "estimators",
        "slipcore",
        "stiction_client",
        "numpy",
        "scipy",
        "numba",
        "statsmodels",
        "emcee",
        "pandas",
    },
    "db": {"db", "migrations", "sqlalchemy", "alembic", "obstore"},
    "migrations": {"migrations", "sqlalchemy", "alembic"},
    CLIENT: {"stiction_client", "httpx", "numpy", "scipy"},
}

OPTIONAL = {
    f"{CLIENT}/stream.py": {"websockets", "msgspec"},
    f"{CLIENT}/labelled.py": {"pandas", "xarray"},
    "slipcore/labelled.py": {"pandas", "xarray"},
    **{f"{CLIENT}/mujoco_scene/{name}.py": {"mujoco"} for name in ("bench", "check", "holding", "rule", "touching")},
}
"""What a module needs that nothing else imports: an extra brings it."""


NUMERICS = {"numba", "scipy", "statsmodels", "emcee", "pandas"}
"""What the server process does without until a request needs it: half of its memory, and half of its start."""


@dataclass
class Nodes:
    """What the rules here look at in a file, wherever in it."""

    imports: list[ast.Import | ast.ImportFrom]
    classes: list[tuple[str, int]]
    """Each with its line."""
    functions: dict[str, list[ast.arg]]
    """What each is given, by line and name."""
    attributes: set[tuple[str, str]]
    """Of names."""


@cache
def nodes_of(path: Path) -> Nodes:
    """Read once, for all rules: the trees of all files together would be too large to keep."""
    found = Nodes([], [], {}, set())
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Import() | ast.ImportFrom():
                found.imports.append(node)
            case ast.ClassDef():
                found.classes.append((node.name, node.lineno))
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                given = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
                found.functions[f"{node.lineno} {node.name}"] = [*given]
            case ast.Attribute(value=ast.Name()):
                found.attributes.add((node.value.id, node.attr))
    return found


def import_statements(path: Path) -> list[ast.Import | ast.ImportFrom]:
    """At the top of a file, inside of functions, and for types only."""
    return nodes_of(path).imports


def imported_modules(path: Path) -> set[str]:
    """Every module that a file imports, lazily or not, with its dotted name."""
    names: set[str] = set()
    for node in import_statements(path):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        else:
            assert node.level == 0, f"{path}: relative imports hide where a name comes from"
            names.add(node.module or "")
            names.update(f"{node.module}.{alias.name}" for alias in node.names)
    return names


def imported_here(path: Path, known: Collection[str]) -> set[str]:
    """Which of the ``known`` modules a file imports: at its top, inside of functions, and for types only."""
    found: set[str] = set()
    for node in import_statements(path):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names if alias.name in known)
        else:
            full = {alias.name: f"{node.module}.{alias.name}" for alias in node.names}
            found.update(name if name in known else str(node.module) for name in full.values())
    return found & set(known)


def modules_of(folder: Path, package: str) -> dict[str, Path]:
    """Every module of a package, by dotted name; a package's own names stand for its ``__init__``."""
    files = sorted((folder / package).rglob("*.py"))
    parts = {path: path.relative_to(folder).with_suffix("").parts for path in files}
    return {".".join(name[:-1] if name[-1] == "__init__" else name): path for path, name in parts.items()}


def graph_of(modules: Mapping[str, Path]) -> dict[str, set[str]]:
    """Each module with those that it imports."""
    return {name: imported_here(path, modules) - {name} for name, path in modules.items()}


def within(graph: Mapping[str, Collection[str]], folder: str) -> dict[str, set[str]]:
    """The files and folders in a folder with those beside them that anything in them imports."""
    depth = folder.count(".") + 2
    parts = defaultdict[str, set[str]](set)
    for name, others in graph.items():
        if name.startswith(f"{folder}."):
            part = ".".join(name.split(".")[:depth])
            beside = {".".join(other.split(".")[:depth]) for other in others if other.startswith(f"{folder}.")}
            parts[part] |= beside - {part}
    return parts


def circle(graph: Mapping[str, Collection[str]]) -> list[str]:
    """Names that lead to one another in a circle, if there are such."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


@cache
def third_party(path: Path) -> set[str]:
    return {name.split(".")[0] for name in imported_modules(path)} - set(sys.stdlib_module_names)


def not_allowed(root: Path, package: str) -> dict[str, set[str]]:
    """The files of a package that import what it may not, each with that."""
    files = {str(path.relative_to(root)): path for path in sorted((root / package).rglob("*.py"))}
    assert files
    found = {name: third_party(path) - ALLOWED[package] - OPTIONAL.get(name, set()) for name, path in files.items()}
    return {name: extra for name, extra in found.items() if extra}


@pytest.mark.parametrize("package", ALLOWED)
def test_imports_run_one_way(package: str) -> None:
    assert not_allowed(ROOT, package) == {}


@pytest.mark.parametrize(
    ("package", "text"),
    [
        ("slipcore", "import estimators.fitting"),
        ("slipcore", "def lazily():\n    from db import records"),
        ("estimators", "if TYPE_CHECKING:\n    from service.domain import fit"),
        ("db", "import numpy as np"),
        (CLIENT, "from slipcore.samples import FrictionSamples"),
        (CLIENT, "import websockets"),
    ],
)
def test_an_import_that_runs_back_is_found(tmp_path: Path, package: str, text: str) -> None:
    path = tmp_path / package / "room.py"
    path.parent.mkdir(parents=True)
    (path.parent / "plain.py").write_text("import json")
    path.write_text(text)
    assert set(not_allowed(tmp_path, package)) == {f"{package}/room.py"}


def test_estimators_know_of_slipcore_only_its_samples_and_what_has_nothing_to_do_with_frames() -> None:
    plain = "arguments", "errors", "compilation", "medians", "options", "references"
    known = tuple(f"slipcore.{name}" for name in ("samples", *plain))
    for path in sorted((ROOT / "estimators").rglob("*.py")):
        modules = {name for name in imported_modules(path) if name.split(".")[0] == "slipcore"}
        assert all(name.startswith(known) for name in modules), path


MODEL, CONTAINER = {"linear_friction", "model"}, {"container"}
PLANNER = {"contacts", "planner", "errors"}

CLIENT_PARTS = {
    "slipcore": set[str](),
    "db": set[str](),
    "migrations": set[str](),
    "estimators": MODEL | {"support"},
    "service/domain": MODEL | CONTAINER | PLANNER | {"support"},
    "service/exports": CONTAINER,
    "service/formats": CONTAINER,
    "service/http": set[str](),
    "service/jobs": CONTAINER,
    "service/observability": set[str](),
    "service/processes": set[str](),
    "service/report": MODEL | {"records", "support"},
    "service/slip_benchmark": CONTAINER,
    "service/stream": MODEL | CONTAINER | {"arguments", "contacts", "controller", "errors"},
    "service/web": {"records", "support"},
}
"""Which modules of the client each package or room may use: one model, one container and one planner for both sides.
Commands and the demo are clients of the service, and may use all.
"""


def client_parts(path: Path) -> set[str]:
    """The modules of the client that a file uses, by the names of the package as well."""
    import stiction_client

    nodes = [node for node in import_statements(path) if isinstance(node, ast.ImportFrom)]
    names = {alias.name for node in nodes if node.module == "stiction_client" for alias in node.names}
    names |= {name for owner, name in nodes_of(path).attributes if owner == "stiction_client"}
    submodules = {module.stem for module in (ROOT / CLIENT).iterdir()}
    homes = {name if name in submodules else getattr(stiction_client, name).__module__.split(".")[1] for name in names}
    return (
        homes | {name.split(".")[1] for name in imported_modules(path) if name.startswith("stiction_client.")} - names
    )


@pytest.mark.parametrize("room", CLIENT_PARTS)
def test_each_room_knows_of_the_client_only_what_both_sides_share(room: str) -> None:
    found = {path: client_parts(path) - CLIENT_PARTS[room] for path in sorted((ROOT / room).rglob("*.py"))}
    assert found
    assert {path: parts for path, parts in found.items() if parts} == {}


def test_every_room_of_the_service_has_its_rule_of_the_client() -> None:
    rooms = {f"service/{path.name}" for path in (ROOT / "service").iterdir() if (path / "__init__.py").exists()}
    assert rooms - set(CLIENT_PARTS) == {"service/cli", "service/demo"}
    assert {path.name for path in (ROOT / "service").glob("*.py") if client_parts(path)} == set()


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("from stiction_client import FrictionClient", {"client"}),
        ("def lazily():\n    import stiction_client\n    stiction_client.required_normal_force()", {"planner"}),
        ("from stiction_client.support import Kind", {"support"}),
        ("from stiction_client import container", {"container"}),
        ("import stiction_client.stream", {"stream"}),
    ],
)
def test_a_part_of_the_client_is_found_however_it_is_named(tmp_path: Path, text: str, parts: set[str]) -> None:
    (tmp_path / "room.py").write_text(text)
    assert client_parts(tmp_path / "room.py") == parts


def test_one_module_decides_how_kernels_are_compiled_and_kept() -> None:
    """The other one adds what values compiled code may have."""
    paths = (path for package in ALLOWED for path in (ROOT / package).rglob("*.py"))
    known = {ROOT / "slipcore/compilation.py", ROOT / "slipcore/lanes.py"}
    assert {path for path in paths if "numba" in third_party(path)} == known


@pytest.mark.parametrize("package", [*ALLOWED, "service", "benchmarks"])
def test_no_modules_import_one_another_in_a_circle(package: str) -> None:
    folder = ROOT / package
    modules = modules_of(folder.parent, folder.name)
    assert modules
    assert circle(graph_of(modules)) == []


@pytest.mark.parametrize("package", [*ALLOWED, "service", "benchmarks"])
def test_no_folders_import_one_another_in_a_circle(package: str) -> None:
    folder = ROOT / package
    modules = modules_of(folder.parent, folder.name)
    graph = graph_of(modules)
    assert {name: found for name in modules if (found := circle(within(graph, name)))} == {}


def test_a_circle_of_folders_is_found_though_none_of_their_modules_is_in_one(tmp_path: Path) -> None:
    files = {"hall/door": "import house.stairs.step", "hall/floor": "", "stairs/step": "", "stairs/rail": ""}
    files["stairs/rail"] = "def lazily():\n    from house.hall import floor"
    for name, text in files.items():
        path = tmp_path / "house" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    graph = graph_of(modules_of(tmp_path, "house"))
    assert circle(graph) == []
    assert set(circle(within(graph, "house"))) == {"house.hall", "house.stairs"}


@pytest.mark.parametrize(
    "back",
    [
        "import house.hall",
        "def lazily():\n    from house import hall",
        "if TYPE_CHECKING:\n    from house.hall import x",
    ],
)
def test_a_circle_is_found_however_it_is_closed(tmp_path: Path, back: str) -> None:
    (tmp_path / "house").mkdir()
    for name, text in {"__init__": "", "hall": "from house.stairs import up", "stairs": back}.items():
        (tmp_path / "house" / f"{name}.py").write_text(text)
    assert set(circle(graph_of(modules_of(tmp_path, "house")))) == {"house.hall", "house.stairs"}


OWN = ("slipcore", "estimators", "db", "migrations", "service", CLIENT, "benchmarks", "tests")


def gone(path: Path, modules: Collection[str]) -> set[str]:
    """The modules of this project that a file imports from and that are not there."""
    packages = {Path(package).name for package in OWN}
    named = [node.module or "" for node in import_statements(path) if isinstance(node, ast.ImportFrom)]
    return {name for name in named if name.split(".")[0] in packages and name not in modules}


def test_every_import_from_this_project_leads_to_a_module() -> None:
    """In tests, benchmarks and examples, too, which no type checker reads."""
    modules = {name for package in OWN for name in modules_of((ROOT / package).parent, Path(package).name)}
    modules |= {".".join(parts[:-1]) for name in modules for parts in [name.split(".")] if len(parts) > 1}
    paths = [path for folder in (*OWN, "examples") for path in sorted((ROOT / folder).rglob("*.py"))]
    assert {path: names for path in paths if (names := gone(path, modules))} == {}


def test_an_import_from_a_module_that_is_gone_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("from slipcore.gone import x\nfrom slipcore.frames import GraspLog")
    assert gone(tmp_path / "a.py", {"slipcore.frames"}) == {"slipcore.gone"}


ESTIMATOR_ROOMS = ("linear", "sampling", "likelihoods", "methods")
"""From the ground up: each may import those before it."""


def imports_upward(folder: Path, rooms: Sequence[str], above: Collection[str] = ()) -> dict[str, set[str]]:
    """The files of a folder's rooms that import a room after their own or what stands ``above`` all, with that."""
    name, found = folder.name if folder.parent == ROOT else f"{folder.parent.name}.{folder.name}", {}
    for position, room in enumerate(rooms):
        barred = tuple(f"{name}.{other}" for other in (*rooms[position + 1 :], *above))
        files = sorted((folder / room).rglob("*.py"))
        assert files, room
        found |= {f"{room}/{path.name}": {n for n in imported_modules(path) if n.startswith(barred)} for path in files}
    return {path: names for path, names in found.items() if names}


def test_the_rooms_of_estimators_import_one_way() -> None:
    assert imports_upward(ROOT / "estimators", ESTIMATOR_ROOMS, ("fitting", "moments")) == {}


DOMAIN_ROOMS = ("models", "access", "resources", "jobs", "sensors", "materials", "logs", "uploads", "planning")
"""The use cases by what they are about, from the ground up: each may import those before it; errors are for all."""


def test_the_rooms_of_use_cases_import_one_way() -> None:
    folder = ROOT / "service" / "domain"
    assert {path.parent.name for path in folder.glob("*/__init__.py")} == set(DOMAIN_ROOMS)
    assert {path.name for path in folder.glob("*.py")} == {"__init__.py", "errors.py"}
    assert imports_upward(folder, DOMAIN_ROOMS) == {}


def test_a_room_that_imports_one_above_it_is_found(tmp_path: Path) -> None:
    for room, text in {"cellar": "def lazily():\n    from service.house.roof import tiles", "roof": ""}.items():
        path = tmp_path / "service" / "house" / room / "beams.py"
        path.parent.mkdir(parents=True)
        path.write_text(text)
    found = imports_upward(tmp_path / "service" / "house", ("cellar", "roof"))
    assert set(found) == {"cellar/beams.py"}
    assert imports_upward(tmp_path / "service" / "house", ("roof", "cellar")) == {}


def test_only_the_application_knows_the_pages_and_these_ask_no_tables() -> None:
    """A page asks use cases and repositories, as a REST route does, and nothing depends on how it looks."""
    for path in sorted((ROOT / "service").rglob("*.py")):
        modules = imported_modules(path)
        if ROOT / "service" / "web" in path.parents:
            assert not {name for name in modules if name.startswith(("sqlalchemy", "db.tables", "db.database"))}, path
        elif path.name != "app.py":
            assert not {name for name in modules if name.startswith("service.web")}, path


SERVES = ("service.http", "service.web", "service.app", "service.serving")
"""What speaks HTTP."""

WITHOUT_HTTP = (
    "domain",
    "formats",
    "jobs",
    "observability",
    "processes",
    "report",
    "settings",
    "slip_benchmark",
    "stream",
)
"""What does not, in ``service``, nor imports what does; ``cli`` and ``demo`` start it."""

SOCKETS = {
    "service.stream.connection",
    "service.stream.sockets",
    "service.stream.watching",
    "service.observability.metrics",
}
"""Modules that serve a socket or measure who does: they know the framework's types, and no more."""


def speaks_http(modules: Mapping[str, Path], name: str) -> set[str]:
    """What a module knows of HTTP: modules of the service, by way of others too, and web frameworks by itself."""
    known, found, todo = set(modules), set[str](), [name]
    while todo:
        new = imported_here(modules[todo.pop()], known) - found
        found |= new
        todo += new
    frameworks = third_party(modules[name]) & {"fastapi", "starlette", "uvicorn"}
    return {each for each in found if each.startswith(SERVES)} | (set() if name in SOCKETS else frameworks)


def test_use_cases_jobs_and_formats_know_no_http() -> None:
    modules = modules_of(ROOT, "service")
    inside = [name for name in modules if name.split(".")[1:2] and name.split(".")[1] in WITHOUT_HTTP]
    assert {name.split(".")[1] for name in inside} == set(WITHOUT_HTTP)
    assert {name: found for name in inside if (found := speaks_http(modules, name))} == {}


STARTERS = {"service.cli.running"}
"""Commands that start the server; all others work on files or tables, or ask a service."""


def server_imports(modules: Mapping[str, Path]) -> dict[str, set[str]]:
    """The commands that import what speaks HTTP without starting it, each with what it imports."""
    commands = {name: path for name, path in modules.items() if name.startswith(("service.cli", "service.demo"))}
    found = {name: imported_here(path, modules) for name, path in commands.items() if name not in STARTERS}
    return {name: serving for name, all_ in found.items() if (serving := {s for s in all_ if s.startswith(SERVES)})}


def test_commands_import_nothing_of_the_server() -> None:
    modules = modules_of(ROOT, "service")
    assert set(modules) >= STARTERS
    assert server_imports(modules) == {}


@pytest.mark.parametrize("text", ["from service.http import access", "def lazily():\n    import service.app"])
def test_a_command_that_imports_the_server_is_found(tmp_path: Path, text: str) -> None:
    modules = {}
    for name in ("service.app", "service.http.access", "service.cli.keys", "service.cli.running"):
        modules[name] = tmp_path / f"{name}.py"
        modules[name].write_text(text if name.startswith("service.cli") else "")
    assert set(server_imports(modules)) == {"service.cli.keys"}


def test_use_cases_take_plain_arguments() -> None:
    for path in sorted((ROOT / "service" / "domain").rglob("*.py")):
        assert not third_party(path) & {"fastapi", "starlette", "pydantic"}, path


@pytest.mark.parametrize(
    "text", ["from service.helper import x", "def lazily():\n    import service.http.routes", "import fastapi"]
)
def test_a_use_case_that_speaks_http_is_found(tmp_path: Path, text: str) -> None:
    files = {"domain/fit": text, "helper": "from service.http.problems import Problem"}
    for name in ("__init__", "domain/__init__", "domain/fit", "helper", "http/__init__", "http/problems"):
        path = tmp_path / "service" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(files.get(name, ""))
    modules = modules_of(tmp_path, "service") | {"service.http.routes": tmp_path / "service/http/__init__.py"}
    assert speaks_http(modules, "service.domain.fit")
    assert not speaks_http(modules, "service.domain")


def calls(modules: Mapping[str, Path]) -> dict[str, set[str]]:
    """What each function or class of some modules names of the others': by its own name or by its module's."""
    graph: dict[str, set[str]] = {}
    for module, path in modules.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
        parts = {node.name: node for node in tree.body if isinstance(node, kinds)}
        names = {name: f"{module}.{name}" for name in parts} | {
            alias.asname or alias.name: f"{node.module}.{alias.name}"
            for node in tree.body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        names |= {alias.name: alias.name for node in tree.body if isinstance(node, ast.Import) for alias in node.names}
        for name, part in parts.items():
            inside = list(ast.walk(part))
            found = {names[node.id] for node in inside if isinstance(node, ast.Name) and node.id in names}
            found |= {
                f"{names[node.value.id]}.{node.attr}"
                for node in inside
                if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in names
            }
            graph[f"{module}.{name}"] = found
    return graph


@cache
def calls_in_the_service() -> dict[str, set[str]]:
    return calls(modules_of(ROOT, "service"))


def hops(graph: Mapping[str, Collection[str]], start: str, end: str) -> int:
    """Fewest calls from one function to another; raises ``AssertionError`` where there is no way."""
    count, reached, found = 0, {start}, {start}
    while end not in found and reached:
        reached = {other for name in reached for other in graph.get(name, ())} - found
        found |= reached
        count += 1
    assert end in found, f"no way from {start} to {end}"
    return count


@pytest.mark.parametrize(
    ("route", "end"),
    [
        ("http.routes.grasp_logs.create_grasp_log", "db.repositories.grasp_logs.add"),
        ("web.routes.uploads.receive_upload", "db.repositories.grasp_logs.add"),
        ("http.routes.materials.create_fit", "db.repositories.materials.hold"),
        ("http.routes.materials.read_friction", "service.domain.planning.look_up.look_up"),
        ("http.routes.planning.recognise_material", "estimators.recognise"),
        ("http.routes.stream.live_stream", "service.stream.detectors.step"),
        ("http.routes.stream.live_stream", "db.repositories.grasp_logs.add"),
    ],
)
def test_from_a_route_to_repository_or_numerics_there_are_three_calls_at_most(route: str, end: str) -> None:
    assert hops(calls_in_the_service(), f"service.{route}", end) <= 3


def test_a_route_with_more_calls_on_its_way_is_seen(tmp_path: Path) -> None:
    chain = {"route": "middle", "middle": "inner", "inner": "inmost", "inmost": "end", "end": ""}
    for name, other in chain.items():
        call = f"from {other} import {other}\ndef {name}(): {other}()" if other else f"def {name}(): ..."
        (tmp_path / f"{name}.py").write_text(call)
    graph = calls({name: tmp_path / f"{name}.py" for name in chain})
    assert hops(graph, "route.route", "end.end") == 4
    assert hops(graph, "middle.middle", "end.end") == 3
    with pytest.raises(AssertionError, match="no way"):
        hops(graph, "end.end", "route.route")


def test_nothing_but_the_service_knows_a_web_framework() -> None:
    for package in ("slipcore", "estimators", "db", "migrations"):
        for path in (ROOT / package).rglob("*.py"):
            assert not third_party(path) & {"fastapi", "starlette", "pydantic", "uvicorn"}, path


def test_nothing_shipped_imports_benchmarks_or_tests() -> None:
    for package in (*ALLOWED, "service"):
        for path in (ROOT / package).rglob("*.py"):
            assert not third_party(path) & {"benchmarks", "tests"}, path


def test_each_import_package_has_one_owner() -> None:
    owners = importlib.metadata.packages_distributions()
    expected = {package: {"stiction"} for package in ("slipcore", "estimators", "db", "migrations", "service")}
    expected["stiction_client"] = {"stiction-client"}
    assert {package: set(owners.get(package, [])) for package in expected} == expected


def test_the_server_starts_without_the_numerics() -> None:
    script = (
        "import sys; from service.app import create_app; create_app();"
        f"print({NUMERICS} & {{name.split('.')[0] for name in sys.modules}},"
        "[name for name in sys.modules if name.startswith(('slipcore.compilation', 'slipcore.contact'))])"
    )
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT)
    assert answer.stdout == "set() []\n"


@pytest.mark.parametrize(("package", "most"), [("service.cli", 200), ("stiction_client", 100)])
def test_the_help_of_commands_and_the_client_load_little(package: str, most: int) -> None:
    """0.3 s and 0.07 s of CPU; either loads the rest when it is first needed."""
    heavy = NUMERICS | {"numpy", "httpx", "sqlalchemy", "fastapi", "pydantic", "rich"}
    script = (
        f"import sys; before = set(sys.modules); import {package}; loaded = set(sys.modules) - before;"
        f"print(len(loaded), sorted({heavy} & loaded))"
    )
    answer = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT)
    count, _, found = answer.stdout.strip().partition(" ")
    assert found == "[]"
    assert int(count) <= most


@pytest.mark.parametrize("package", ["slipcore", "estimators", "stiction_client"])
def test_every_public_name_is_there(package: str) -> None:
    module = importlib.import_module(package)
    assert all(getattr(module, name) is not None for name in module.__all__)
    assert set(module.__all__) <= set(dir(module))
    with pytest.raises(AttributeError, match="'unheard_of'"):
        module.unheard_of  # noqa: B018


CONTRACT = {
    "slipcore": "GraspLog GroundTruth detect_slip SlipHistory SlipDetector SlipState collect_samples FrictionSamples"
    " check_log Finding SensorModel calibrate_sensor",
    "slipcore.contact": "Scene simulate",
    "slipcore.contact.reduced": "init step",
    "slipcore.forces": "Gel reconstruct Reconstruction",
    "estimators": "fit FrictionModel Moments recognise next_grasp ChangeAlarm",
    "stiction_client": "FrictionClient AsyncFrictionClient FrictionModel GraspController required_normal_force"
    " mujoco_pair drake_friction physx_material friction_cone",
}
"""Names that users and checks call: they stay importable from these modules."""


@pytest.mark.parametrize(
    ("module", "name"), [(module, name) for module, all_ in CONTRACT.items() for name in all_.split()]
)
def test_each_name_of_the_contract_is_importable(module: str, name: str) -> None:
    assert callable(getattr(importlib.import_module(module), name))


MEMBERS = {
    "slipcore.GraspLog": "time position normal element_area displacement force object_pose sensor metadata truth",
    "slipcore.GroundTruth": "contact slip_kinematic slip_contact_factor stick_ratio friction",
    "slipcore.SlipHistory": "contact slip probability stick_ratio velocity macro_slip events noise patches findings",
    "slipcore.SlipDetector": "step",
    "slipcore.FrictionSamples": "friction_coefficient tangential_velocity normal_force tangential_force time element"
    " weight element_area kind",
    "slipcore.Finding": "code severity evidence remedy",
    "slipcore.contact.Scene": "explain from_toml",
    "slipcore.forces.Gel": "young_modulus poisson_ratio thickness marker_depth",
    "slipcore.forces.Reconstruction": "force deviation resultant resultant_deviation contact kernel_width information"
    " apply",
    "estimators.FrictionModel": "coefficients covariance scale n domain identifiable diagnostics cost draws predict"
    " scales support advice",
    "estimators.Moments": "from_samples merge fit",
    "estimators.ChangeAlarm": "init step",
    "stiction_client.FrictionClient": "upload material friction recognise wait",
    "stiction_client.AsyncFrictionClient": "upload material friction recognise wait",
    "stiction_client.GraspController": "init step",
    "stiction_client.FrictionModel": "save load",
}


@pytest.mark.parametrize("record", MEMBERS)
def test_each_record_of_the_contract_has_its_members(record: str) -> None:
    module, _, name = record.rpartition(".")
    kind = getattr(importlib.import_module(module), name)
    assert [member for member in MEMBERS[record].split() if not hasattr(kind, member)] == []


def test_each_method_of_the_contract_is_offered() -> None:
    from estimators.method_names import METHODS as ESTIMATORS
    from slipcore import METHODS as DETECTORS

    detectors = "filter strain_rate strain_rate_literal rigid_fit local_deformation deformation_gradient force_ratio"
    assert set(DETECTORS) >= {*detectors.split(), "forces_only"}
    assert set(ESTIMATORS) >= {"ols", "robust", "conjugate", "bayes", "auto"}


def test_no_file_names_a_package_registry_or_this_machine() -> None:
    tracked = [p for p in ROOT.glob("*") if p.is_file() and p.suffix in {".toml", ".txt", ".md"}] + [ROOT / "Makefile"]
    for path in tracked:
        text = path.read_text(encoding="utf-8")
        assert "--index-url" not in text, path
        assert "://pypi" not in text, path


IN_TWO_PACKAGES = {
    "a record as computed or stored, and the client's of the same": "AuditEntry ContactFriction Detection Finding"
    " FrictionModel Gel Job Material NextGrasp Recognition Scale Scales Withdrawal",
    "an error inside the service, and the client's when it is answered": "FileDeleted InsufficientScope InvalidGraspLog"
    " InvalidSamples JobEnded NoFeasibleForce NoModel NotOwner QuotaExceeded StorageQuotaExceeded StorageUnavailable"
    " UnknownOwner UnsupportedFormat UploadInterrupted",
    "public in either: an iteration that did not converge": "NotConverged",
}
"""Public classes of one name, with the reason: each names the same thing wherever it stands."""


def classes_of_one_name(paths: Collection[Path]) -> dict[str, list[str]]:
    """The public classes that some files define more than once between them, each with where."""
    found = defaultdict[str, list[str]](list)
    for path in paths:
        for name, line in nodes_of(path).classes:
            if not name.startswith("_"):
                found[name].append(f"{path}:{line}")
    return {name: places for name, places in found.items() if len(places) > 1}


def test_a_name_of_a_class_means_one_thing() -> None:
    packages = ("slipcore", "estimators", "db", "service", CLIENT)
    found = classes_of_one_name([path for package in packages for path in sorted((ROOT / package).rglob("*.py"))])
    defended = {name for names in IN_TWO_PACKAGES.values() for name in names.split()}
    assert {name: places for name, places in found.items() if name not in defended} == {}
    assert defended <= set(found)


def test_a_class_that_stands_twice_is_seen(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.py").write_text(f"class Twice: ...\nclass _Own: ...\nclass Of{name}: ...")
    paths = sorted(tmp_path.glob("*.py"))
    assert classes_of_one_name(paths) == {"Twice": [f"{path}:1" for path in paths]}


MOST_PARAMETERS = 8


def parameters(path: Path) -> dict[str, list[ast.arg]]:
    """What each function of a file is given, but for the object or class that it belongs to."""
    own = {"self", "cls"}
    functions = nodes_of(path).functions.items()
    return {f"{path}:{name}": [each for each in given if each.arg not in own] for name, given in functions}


WIDE = {
    f"{CLIENT}/planner.py required_normal_force": "the contract's, all of its options by keyword",
    f"{CLIENT}/client.py friction": "public, and all but five by keyword",
    f"{CLIENT}/client.py next_grasp": "public, and all but five by keyword",
    f"{CLIENT}/stream.py __init__": "public, and all but three by keyword",
}
"""Functions that take more, with the reason. A command has a parameter for each of its options."""


@pytest.mark.parametrize("package", [*ALLOWED, "service", "benchmarks"])
def test_no_function_takes_more_than_eight_parameters_and_all_are_typed(package: str) -> None:
    files = [path for path in (ROOT / package).rglob("*.py") if ROOT / "service" / "cli" not in path.parents]
    found = {name: given for path in files for name, given in parameters(path).items()}
    assert found
    wide = {re.sub(r":\d+", "", name.removeprefix(f"{ROOT}/")) for name, g in found.items() if len(g) > MOST_PARAMETERS}
    assert wide == {name for name in WIDE if name.startswith(f"{package}/")}
    assert [name for name, given in found.items() if any(argument.annotation is None for argument in given)] == []


def test_a_wide_function_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "wide.py"
    path.write_text("class A:\n    def f(self, a, b, c, d, e, *, f, g, h, i): ...")
    (given,) = parameters(path).values()
    assert len(given) == 9
