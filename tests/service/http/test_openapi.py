import importlib
import json
import pkgutil
import re
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from service.app import create_app
from service.http import schemas
from service.settings import Settings

DESCRIPTION = create_app(Settings()).openapi()
OPERATIONS = {
    f"{method.upper()} {path}": operation
    for path, operations in DESCRIPTION["paths"].items()
    for method, operation in operations.items()
}


def test_each_route_is_documented_for_people_and_nothing_else_is() -> None:
    page = (Path(__file__).parents[3] / "docs/api.md").read_text()
    assert set(re.findall(r"`((?:GET|POST|PUT|PATCH|DELETE) /[^`?]+)`", page)) == set(OPERATIONS)


def test_operations_have_names_of_their_own() -> None:
    names = [operation["operationId"] for operation in OPERATIONS.values()]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS)
def test_each_route_is_described_with_its_errors(operation: dict[str, Any]) -> None:
    assert operation["summary"]
    assert operation["description"]
    for status, response in operation["responses"].items():
        media_type = "application/json" if int(status) < 400 else "application/problem+json"
        content = response.get("content", {})
        if any(kind.get("schema", {}).get("format") == "binary" for kind in content.values()):
            assert operation["operationId"] == "read_file"
            continue
        if "text/plain" in content:
            assert operation["operationId"] == "read_metrics"
            continue
        assert list(content) == ([] if status in {"204", "304"} else [media_type])
        if int(status) >= 400:
            assert response["content"][media_type]["schema"] == {"$ref": "#/components/schemas/ProblemOut"}
            assert "/problems/" in response["description"]


@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS)
def test_each_parameter_is_described(operation: dict[str, Any]) -> None:
    for parameter in operation.get("parameters", []):
        assert parameter["in"] == "path" or parameter["description"], parameter["name"]


SCHEMAS = {
    name: schema
    for module in pkgutil.iter_modules(schemas.__path__, f"{schemas.__name__}.")
    for name, schema in vars(importlib.import_module(module.name)).items()
}
EXAMPLES = [
    (SCHEMAS[name], example)
    for name in DESCRIPTION["components"]["schemas"]
    for example in SCHEMAS[name].model_json_schema().get("examples", [])
]


@pytest.mark.parametrize(("schema", "example"), EXAMPLES, ids=lambda value: getattr(value, "__name__", ""))
def test_each_example_is_valid(schema: type[BaseModel], example: dict[str, Any]) -> None:
    assert schema.model_validate(example).model_dump(mode="json", exclude_unset=True) == example


def test_what_goes_over_the_wire_has_an_example() -> None:
    without = {
        "FrictionModelsOut",
        "AuditOut",
        "JobsOut",
        "MaterialsOut",
        "CandidateOut",
        "GraspLogsOut",
        "DomainOut",
        "CostOut",
        "ScaleOut",
        "ScalesOut",
        "SensorFrictionOut",
        "SensorScaleOut",
        "RecommendedOut",
        "WithdrawalOut",
        "EventCounts",
        "EventsOfOneKind",
    }
    without |= {"HealthOut", "ReadyOut", "WrongValue"}
    assert {schema.__name__ for schema, _ in EXAMPLES} == set(DESCRIPTION["components"]["schemas"]) - without


def test_the_description_is_written_once() -> None:
    """Anybody may ask for it, and it is long."""
    app = create_app(Settings())
    assert app._written is app._written  # type: ignore[attr-defined]
    assert json.loads(app._written) == DESCRIPTION  # type: ignore[attr-defined]
