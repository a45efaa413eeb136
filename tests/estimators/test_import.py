"""``import estimators`` must stay light: a planner's process pays for it."""

import subprocess
import sys

HEAVY = {"statsmodels", "emcee", "pandas", "matplotlib", "numba", "slipcore", "sqlalchemy", "fastapi"}


def test_import_loads_nothing_heavy() -> None:
    code = "import sys, estimators; print(*{name.split('.')[0] for name in sys.modules})"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not set(loaded) & HEAVY
    code = "import sys, estimators; print(*sys.modules)"
    modules = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "scipy.stats" not in modules  # takes longer than all the rest together
    assert "scipy.optimize" not in modules
