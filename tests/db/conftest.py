import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy import event

from db.database import Database
from db.records import Detection, NewGraspLog, NewModel, SampleSummary, Scale, Scales

HASH = "{:064x}"


@pytest.fixture
def empty_database(new_url: Callable[..., str], tmp_path: Path) -> Iterator[Database]:
    database = Database(new_url(tmp_path, empty=True), lock_timeout=0.2)
    yield database
    database.close()


@pytest.fixture
def database(new_url: Callable[..., str], tmp_path: Path) -> Iterator[Database]:
    database = Database(new_url(tmp_path), lock_timeout=0.2)
    yield database
    database.close()


@pytest.fixture
def without_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    """None between two looks at a file and its log: nobody else writes meanwhile, and a refusal takes 0.4 s of them."""
    monkeypatch.setattr("db.sqlite_file.BETWEEN_LOOKS", 1e-5)


@pytest.fixture
def new_log() -> Callable[..., NewGraspLog]:
    numbers = itertools.count(1)

    def make(material_id: int | None = None, sha256: str | None = None, detector: str = "strain_rate") -> NewGraspLog:
        content = HASH.format(next(numbers)) if sha256 is None else sha256
        return NewGraspLog(content, 10, "npz", detector, material_id, "sensor", 250, 8.3, (20, 20))

    return make


@pytest.fixture
def new_model() -> Callable[..., NewModel]:
    def make(method: str = "ols", mean: float = 0.4, scales: Scales | None = None) -> NewModel:
        return NewModel(
            method=method,
            coefficients=(mean, 0.1 + 0.2, -1e-17),
            covariance=((1e-4, 0.0, 0.0), (0.0, 1e-2, 0.0), (0.0, 0.0, 1.0)),
            scale=0.02,
            n=1000,
            degrees_of_freedom=997.0,
            scatter_degrees_of_freedom=None,
            tangential_velocity=(0.0, 0.01),
            normal_force=(0.01, 0.09),
            identifiable=(True, True, False),
            element_area=1e-6,
            diagnostics={"r_squared": 0.5, "covariance": "clustered", "condition_number": None},
            cost_seconds=0.01,
            monte_carlo_error=0.0,
            scales=scales,
        )

    return make


@pytest.fixture
def scales() -> Scales:
    return Scales(Scale(0.1 + 0.2, 4.5), Scale(1e-17, None), Scale(0.03, 1e4))


@pytest.fixture
def detection() -> Detection:
    return Detection("strain_rate", 1e-6, 0.1, 200, 3, 40, 39, 400, 400, 0.05, HASH.format(1001))


@pytest.fixture
def samples() -> SampleSummary:
    return SampleSummary(120, None, 1e-6, 0.41, (0.0, 0.01), (0.01, 0.09), HASH.format(1002), b"moments")


@pytest.fixture
def statements(database: Database) -> Iterator[list[str]]:
    """Every SELECT that reaches the database."""
    seen: list[str] = []

    def note(_connection: object, _cursor: object, statement: str, *_rest: object) -> None:
        if statement.startswith("SELECT"):
            seen.append(statement)

    event.listen(database.engine, "before_cursor_execute", note)
    yield seen
    event.remove(database.engine, "before_cursor_execute", note)
