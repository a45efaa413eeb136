"""A model's way from a fit through the tables and over the network to a planner, and back."""

from dataclasses import fields
from datetime import UTC, datetime
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import stiction_client
from db.records import NewModel, Scale, Scales, StoredModel
from estimators import FrictionModel
from service.domain.models.stored_results import to_client_model, to_friction_model, to_new_model
from service.http.schemas.models import FrictionModelOut

NUMBERS = st.floats(-1e3, 1e3)
POSITIVE = st.floats(1e-9, 1e3)
FREEDOM = st.none() | st.floats(1.0, 1e9)
RANGE = st.tuples(st.floats(0.0, 1.0), st.floats(1.0, 10.0))
SCALE = st.builds(Scale, POSITIVE, FREEDOM)
TEXT = st.text(max_size=20)
THREE = st.lists(NUMBERS, min_size=3, max_size=3)


@st.composite
def covariances(draw: st.DrawFn) -> list[list[float]]:
    """Any that could be one: symmetric, with no negative variance in any direction."""
    millionths = st.integers(-(10**6), 10**6)  # whose squares do not vanish
    root = 1e-6 * np.array(draw(st.lists(millionths, min_size=9, max_size=9))).reshape(3, 3)
    found: list[list[float]] = (root @ root.T).tolist()
    return found


SENSOR = st.fixed_dictionaries(
    {
        "gain": NUMBERS,
        "standard_error": POSITIVE,
        "coefficients": THREE,
        "covariance": covariances(),
        "degrees_of_freedom": FREEDOM,
        "scale": POSITIVE,
        "scatter_degrees_of_freedom": FREEDOM,
    }
)
SENSORS = st.fixed_dictionaries(
    {"value": POSITIVE, "degrees_of_freedom": FREEDOM, "sensors": st.dictionaries(TEXT, SENSOR, max_size=2)}
)


@st.composite
def new_models(draw: st.DrawFn) -> NewModel:
    """Any model that could be stored."""
    return NewModel(
        method=draw(st.sampled_from(["ols", "robust", "hierarchical", "bayes"])),
        coefficients=draw(st.tuples(NUMBERS, NUMBERS, NUMBERS)),
        covariance=tuple(map(tuple, draw(covariances()))),
        scale=draw(POSITIVE),
        n=draw(st.integers(1, 10**9)),
        degrees_of_freedom=draw(FREEDOM),
        scatter_degrees_of_freedom=draw(FREEDOM),
        tangential_velocity=draw(RANGE),
        normal_force=draw(RANGE),
        identifiable=draw(st.tuples(st.booleans(), st.booleans(), st.booleans())),
        element_area=draw(POSITIVE),
        diagnostics=draw(st.dictionaries(TEXT, st.none() | NUMBERS | TEXT, max_size=3)),
        cost_seconds=draw(POSITIVE),
        monte_carlo_error=draw(POSITIVE),
        scales=draw(st.none() | st.builds(Scales, SCALE, SCALE, SCALE, st.none() | SENSORS)),
    )


MOMENTS = st.datetimes(datetime(2000, 1, 1), datetime(2100, 1, 1), timezones=st.just(UTC))
STORED = st.builds(
    StoredModel, st.integers(1), TEXT, st.integers(1, 10**6), st.booleans(), st.booleans(), MOMENTS, new_models()
)


@given(new_models())
@settings(deadline=None, max_examples=50)
def test_a_stored_model_is_the_same_after_it_predicted(stored: NewModel) -> None:
    assert to_new_model(to_friction_model(stored)) == stored


@given(STORED)
@settings(deadline=None, max_examples=50)
def test_a_planner_gets_over_the_network_the_model_that_is_stored(stored: StoredModel) -> None:
    answer: dict[str, Any] = FrictionModelOut.of(stored).model_dump(mode="json")
    received = stiction_client.FrictionModel.from_json(answer)
    told = to_client_model(stored).to_json()
    moments = datetime.fromisoformat(received.created_at), datetime.fromisoformat(told.pop("created_at"))
    assert moments == (stored.created_at, stored.created_at)
    assert {name: value for name, value in received.to_json().items() if name != "created_at"} == told
    assert stiction_client.FrictionModel.from_json(received.to_json()).to_json() == received.to_json()


def test_the_client_has_every_number_of_a_fit() -> None:
    """All but the sampler's draws, which are neither kept nor sent."""
    client = {each.name for each in fields(stiction_client.FrictionModel)}
    assert {each.name for each in fields(FrictionModel)} - client == {"draws"}
