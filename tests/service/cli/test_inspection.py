"""Whether a log's own forces are compared with those by its gel."""

from pathlib import Path

import numpy as np
import pytest

from service.cli.inspection import comparison
from slipcore import GraspLog, InvalidInput

PLACE = 1e-3 * np.stack(np.meshgrid(np.arange(3.0), np.arange(3.0), [0.0], indexing="ij"), axis=-1)[:, :, 0]
STILL = np.zeros((2, 3, 3, 3))


def test_forces_are_compared_where_there_are_both(tmp_path: Path) -> None:
    gel = tmp_path / "gel.json"
    gel.write_text("{}", encoding="utf-8")
    plain = GraspLog(np.arange(2.0), PLACE, STILL, 1e-6)
    assert comparison(plain, gel) is None
    assert comparison(GraspLog(np.arange(2.0), PLACE, STILL, 1e-6, force=STILL), None) is None
    alone = GraspLog(np.arange(2.0), PLACE, STILL, 1e-6, force=STILL, metadata={"displacement": "none"})
    with pytest.raises(InvalidInput, match="gel is given for a log of forces alone; allowed: a log with displacement"):
        comparison(alone, gel)
