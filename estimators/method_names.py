"""The names of the methods, for who offers them without loading the numerics behind."""

from typing import Literal, get_args

ModelMethod = Literal["ols", "robust", "conjugate", "hierarchical", "bayes"]
"""What a fitted model may be fitted by."""

FitMethod = Literal[ModelMethod, "auto"]
"""What a fit may be asked for; "auto" takes the method that the data call for."""

METHODS: tuple[FitMethod, ...] = get_args(FitMethod)

PLANNING_METHODS = tuple(method for method in METHODS if method != "conjugate")
"""Those whose models a planner is offered: "conjugate" takes all samples for independent."""

SCATTER_METHODS = ("hierarchical", "bayes", "auto")
"""Those whose model has the scatter between grasps, of which there is a prior."""
