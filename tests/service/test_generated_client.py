import importlib
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import httpx
import pytest

CONFIGURATION = "post_hooks: []\nproject_name_override: generated\npackage_name_override: generated_stiction_client\n"


@pytest.fixture
def generated(client: httpx.Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Import the client that openapi-python-client makes of the service's own description."""
    (tmp_path / "openapi.json").write_bytes(client.get("/openapi.json").content)
    (tmp_path / "configuration.yaml").write_text(CONFIGURATION)
    package = tmp_path / "made" / "generated_stiction_client"
    command = [sys.executable, "-m", "openapi_python_client", "generate", "--path", "openapi.json", "--meta", "none"]
    command += ["--config", "configuration.yaml", "--output-path", str(package)]
    (tmp_path / "made").mkdir()
    made = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert made.returncode == 0, made.stdout + made.stderr
    monkeypatch.syspath_prepend(package.parent)

    def module(name: str) -> Any:
        return importlib.import_module(f"{package.name}.{name}")

    return module


def test_a_generated_client_works(client: httpx.Client, fitted: dict[str, Any], content: bytes, generated: Any) -> None:
    models = generated("models")
    with generated("client").AuthenticatedClient(str(client.base_url), token="") as made:
        made.get_httpx_client().headers.pop("Authorization")
        found = generated("api.materials.list_materials").sync(client=made, search="fitted", limit=1000)
        assert isinstance(found, models.MaterialsOut)
        assert "fitted" in [item.name for item in found.items]
        answer = generated("api.materials.read_friction").sync("fitted", client=made, fn=0.05, quantile=0.05)
        expected = client.get("/v1/materials/fitted/friction", params={"fn": 0.05, "quantile": 0.05}).json()
        assert isinstance(answer, models.FrictionOut)
        assert answer.to_dict() == expected
        body = generated("types").File(BytesIO(content))
        log = generated("api.grasp_logs.create_grasp_log").sync(client=made, body=body, material="fitted")
        assert (log.id, log.job.status) == (fitted["id"], models.JobOutStatus.DONE)
        wish = models.NewGraspForce(material="fitted", tangential_load=0.5, contact_area=1e-4)
        assert generated("api.planning.find_grasp_force").sync(client=made, body=wish).normal_force > 0.5
        refused = generated("api.materials.read_material").sync("felt", client=made)
        assert isinstance(refused, models.ProblemOut)
        assert refused.type_ == "/problems/unknown-material"
