from typing import Any

import httpx
import pytest

GEL = {"young_modulus": 2.5e5, "poisson_ratio": 0.48, "thickness": 4e-3, "marker_depth": 5e-4}


def test_a_sensor_is_described_before_or_after_its_first_log(client: httpx.Client) -> None:
    path = "/v1/sensors/Gel%20Sight"
    unknown = client.get(path)
    assert (unknown.status_code, unknown.json()["type"]) == (404, "/problems/unknown-sensor")
    thick = client.put(path, json={"young_modulus": 1e6, "poisson_ratio": 0.49})
    assert thick.json()["gel"] == {
        "young_modulus": 1e6,
        "poisson_ratio": 0.49,
        "thickness": None,
        "marker_depth": 0.0,
    }
    assert client.put(path, json=GEL).json() == {"name": "Gel Sight", "gel": GEL}
    assert client.get(path).json()["gel"] == GEL
    assert {"name": "Gel Sight", "gel": GEL} in client.get("/v1/sensors").json()["items"]
    told = client.get("/v1/audit?subject=Gel%20Sight").json()["items"]
    assert [entry["action"] for entry in told] == ["sensor.described"] * 2
    assert told[0]["details"] == GEL


@pytest.mark.parametrize(
    "change",
    [
        {"young_modulus": 0.25},
        {"poisson_ratio": 0.51},
        {"thickness": 0.0},
        {"marker_depth": 4e-3},
        {"marker_depth": -1e-3},
        {"hardness": 20.0},
        {"young_modulus": None},
    ],
)
def test_an_impossible_gel_is_refused(client: httpx.Client, change: dict[str, Any]) -> None:
    refused = client.put("/v1/sensors/other", json=GEL | change)
    assert (refused.status_code, refused.json()["type"]) == (422, "/problems/invalid-request")
