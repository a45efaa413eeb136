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


@pytest.fixture(scope="module")
def description() -> dict[str, Any]:
    """Made once and not when this file is read, which takes a second in each process of the tests."""
    return create_app(Settings()).openapi()


@pytest.fixture(scope="module")
def operations(description: dict[str, Any]) -> dict[str, Any]:
    """By method and path."""
    return {
        f"{method.upper()} {path}": operation
        for path, of_path in description["paths"].items()
        for method, operation in of_path.items()
    }


def test_each_route_is_documented_for_people_and_nothing_else_is(operations: dict[str, Any]) -> None:
    page = (Path(__file__).parents[3] / "docs/api.md").read_text()
    assert set(re.findall(r"`((?:GET|POST|PUT|PATCH|DELETE) /[^`?]+)`", page)) == set(operations)


def test_operations_have_names_of_their_own(operations: dict[str, Any]) -> None:
    names = [operation["operationId"] for operation in operations.values()]
    assert len(set(names)) == len(names)


def test_each_route_is_described_with_its_errors(operations: dict[str, Any]) -> None:
    for name, operation in operations.items():
        assert operation["summary"], name
        assert operation["description"], name
        check_responses(name, operation)


def check_responses(name: str, operation: dict[str, Any]) -> None:
    for status, response in operation["responses"].items():
        media_type = "application/json" if int(status) < 400 else "application/problem+json"
        content = response.get("content", {})
        if any(kind.get("schema", {}).get("format") == "binary" for kind in content.values()):
            assert operation["operationId"] == "read_file"
            continue
        if "text/plain" in content:
            assert operation["operationId"] == "read_metrics"
            continue
        assert list(content) == ([] if status in {"204", "304"} else [media_type]), name
        if int(status) >= 400:
            assert response["content"][media_type]["schema"] == {"$ref": "#/components/schemas/ProblemOut"}, name
            assert "/problems/" in response["description"], name


def test_each_parameter_is_described(operations: dict[str, Any]) -> None:
    for name, operation in operations.items():
        for parameter in operation.get("parameters", []):
            assert parameter["in"] == "path" or parameter["description"], (name, parameter["name"])


Examples = list[tuple[type[BaseModel], dict[str, Any]]]

SCHEMAS = {
    name: schema
    for module in pkgutil.iter_modules(schemas.__path__, f"{schemas.__name__}.")
    for name, schema in vars(importlib.import_module(module.name)).items()
}


@pytest.fixture(scope="module")
def examples(description: dict[str, Any]) -> Examples:
    """Each with its schema."""
    names = description["components"]["schemas"]
    return [(SCHEMAS[name], each) for name in names for each in SCHEMAS[name].model_json_schema().get("examples", [])]


def test_each_example_is_valid(examples: Examples) -> None:
    for schema, example in examples:
        assert schema.model_validate(example).model_dump(mode="json", exclude_unset=True) == example, schema.__name__


def test_what_goes_over_the_wire_has_an_example(description: dict[str, Any], examples: Examples) -> None:
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
    assert {schema.__name__ for schema, _ in examples} == set(description["components"]["schemas"]) - without


def test_the_description_is_written_once(description: dict[str, Any]) -> None:
    """Anybody may ask for it, and it is long."""
    app = create_app(Settings())
    assert app._written is app._written  # type: ignore[attr-defined]
    assert json.loads(app._written) == description  # type: ignore[attr-defined]
