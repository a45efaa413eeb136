"""The dashboard for Grafana that is shipped asks for nothing that the service does not tell, and leaves nothing out."""

import json
import re
from itertools import combinations
from pathlib import Path
from typing import Any

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

FILE = Path(__file__).parents[3] / "docs" / "deploy" / "grafana-dashboard.json"
OF_PROMETHEUS = {"instance", "le"}
"""Labels that a scrape adds, and that of a histogram's buckets."""


@pytest.fixture(scope="module")
def dashboard() -> Any:
    return json.loads(FILE.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def queries(dashboard: Any) -> list[str]:
    return [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]


@pytest.fixture
def told(client: httpx.Client, fitted: Any) -> dict[str, set[str]]:
    """Labels of each time series at /metrics, once something was done."""
    client.get(f"/v1/materials/{fitted['material']}")
    found: dict[str, set[str]] = {}
    for family in text_string_to_metric_families(client.get("/metrics").text):
        for sample in family.samples:
            found.setdefault(sample.name, set()).update(sample.labels)
    return found


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_every_metric_that_is_asked_for_exists_with_its_labels(queries: list[str], told: dict[str, set[str]]) -> None:
    for query in queries:
        names = set(re.findall(r"\bstiction_\w+", query))
        assert names, query
        assert names <= told.keys(), query
        grouped = re.findall(r"\bby \(([^)]*)\)", query)
        labels = {label.strip() for group in grouped for label in group.split(",")}
        labels |= set(re.findall(r"(\w+)=~?\"", query))
        assert labels <= OF_PROMETHEUS.union(*(told[name] for name in names)), query


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_every_metric_that_is_told_is_shown(queries: list[str], told: dict[str, set[str]]) -> None:
    asked = " ".join(queries)
    ours = {re.sub(r"_(bucket|count|sum|created)$", "", name) for name in told if name.startswith("stiction_")}
    assert [name for name in ours if name not in asked] == []


@pytest.mark.parametrize("engine_name", ["sqlite"], indirect=True)
def test_routes_that_are_named_are_the_services(queries: list[str], client: httpx.Client) -> None:
    routes = {route for query in queries for route in re.findall(r"route=\"([^\"]+)\"", query)}
    assert routes
    assert routes <= client.get("/openapi.json").json()["paths"].keys()


def test_panels_say_what_they_show_and_overlap_nowhere(dashboard: Any) -> None:
    panels = dashboard["panels"]
    assert len({panel["id"] for panel in panels}) == len(panels)
    assert [panel["title"] for panel in panels if not panel["description"]] == []
    assert {panel["fieldConfig"]["defaults"]["unit"] for panel in panels} <= {
        "short",
        "bytes",
        "Bps",
        "reqps",
        "ops",
        "s",
    }
    for first, second in combinations((panel["gridPos"] for panel in panels), 2):
        apart = [first[a] + first[b] <= second[a] or second[a] + second[b] <= first[a] for a, b in ("xw", "yh")]
        assert any(apart), (first, second)


def test_any_prometheus_and_any_server_may_be_chosen(dashboard: Any, queries: list[str]) -> None:
    variables = {each["name"] for each in dashboard["templating"]["list"]}
    used = set(re.findall(r"\$\{?(\w+)\}?", json.dumps(dashboard)))
    assert used - {"__rate_interval"} == variables == {"source", "instance"}
    assert [query for query in queries if 'instance=~"$instance"' not in query] == []
