"""Compile or load the solver's kernels before a run is timed."""

from functools import cache

import numpy as np

from slipcore.contact.defaults import EXPLAIN
from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import HalfSpace
from slipcore.contact.solver.problem import ContactProblem, StepLoad
from slipcore.contact.solver.quasi_static import QuasiStatic


@cache
def load_kernels() -> None:
    """Load the solver's kernels, once a process, which its first run would else pay for: a fraction of a second, or
    more than a minute where they must be compiled. A smallest contact is pressed, and pulled until some of it slips.
    """
    loads = [StepLoad(1.0), *(StepLoad(1.0, tangential=np.array([pull, 0.0, 0.0])) for pull in (0.25, 0.75))]
    problem = ContactProblem((HalfSpace.from_young(1.0, 0.25),), 1.0, heights=(lambda x, y: x**2 + y**2,))
    for _ in QuasiStatic(problem, Grid.square(8, 2.25), EXPLAIN.tolerance, EXPLAIN.tolerance).run(loads):
        pass
