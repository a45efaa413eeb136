"""Displacement by pressure and traction: zero-padded FFT convolution on a box of cells."""

from dataclasses import dataclass, fields, replace

import numpy as np

from slipcore.contact.elasticity.grid import Grid
from slipcore.contact.elasticity.influence import Component, ElasticBody
from slipcore.contact.elasticity.preconditioner import NormalInverse, TangentialInverse
from slipcore.contact.elasticity.transform import Compiled, Convolution, fast_lengths, padded_lengths, single, symbols
from slipcore.frames import FloatArray


@dataclass(slots=True)
class Count:
    """How often the operators of one problem were applied, how many of the tangential ones in ``single`` precision, and
    the approximate ``inverse`` of the tangential one, always in single precision.
    """

    normal: int = 0
    tangential: int = 0
    coupling: int = 0
    single: int = 0
    inverse: int = 0

    def since(self, earlier: "Count") -> "Count":
        """What was added to an earlier count."""
        return Count(*(getattr(self, f.name) - getattr(earlier, f.name) for f in fields(self)))


class ElasticOperator:
    """Compliance of the bodies in contact on one box: pressure and traction [..., ny, nx] Pa to displacement m.

    Symbols are made when first used, so what is never asked for costs nothing. ``count`` may be shared by many boxes;
    ``source``: an operator on a larger grid of the same pitch, whose influences hold this one's.
    """

    __slots__ = (
        "_coarse",
        "_coupling",
        "_kernels",
        "_normal",
        "_normal_inverse",
        "_tangential",
        "_tangential_inverse",
        "_tangential_single",
        "bodies",
        "convolution",
        "count",
        "grid",
        "source",
    )

    def __init__(
        self,
        bodies: tuple[ElasticBody, ...],
        grid: Grid,
        count: Count | None = None,
        source: "ElasticOperator | None" = None,
    ) -> None:
        self.bodies, self.grid, self.source = bodies, replace(grid, centre=(0.0, 0.0)), source
        self.count = Count() if count is None else count
        self.convolution = Convolution(grid.shape, padded_lengths(grid.shape))
        self._kernels: dict[Component, FloatArray | None] = {}
        self._normal: FloatArray | None = None
        self._tangential: FloatArray | None = None
        self._tangential_single: Compiled | None = None
        self._coupling: FloatArray | None = None
        self._coarse: ElasticOperator | None = None
        self._normal_inverse: NormalInverse | None = None
        self._tangential_inverse: TangentialInverse | None = None

    def normal(self, pressure: FloatArray) -> FloatArray:
        """Normal displacement by pressure."""
        self.count.normal += 1
        displacement: FloatArray = self.convolution(pressure[None], self._across())[0]
        return displacement

    @property
    def normal_compiled(self) -> Compiled:
        """``normal`` for compiled code, which does not count itself."""
        return self.convolution.by(self._across())

    def _across(self) -> FloatArray:
        if self._normal is None:
            self._normal = self._symbols([["nn"]])
        return self._normal

    def tangential(self, traction: FloatArray) -> FloatArray:
        """Tangential displacement [2, ny, nx] by traction [2, ny, nx]."""
        self.count.tangential += 1
        return self.convolution(traction, self._along())

    @property
    def tangential_compiled(self) -> Compiled:
        """``tangential`` for compiled code, which does not count itself."""
        return self.convolution.by(self._along())

    @property
    def tangential_single(self) -> Compiled:
        """``tangential`` for compiled code in single precision, in units of ``xx`` of a cell on itself."""
        if self._tangential_single is None:
            own = self._nonzero("xx", self.grid)[0, 0]
            self._tangential_single = self.convolution.by(single(self._along() / own))
        return self._tangential_single

    def _along(self) -> FloatArray:
        if self._tangential is None:
            self._tangential = self._symbols([["xx", "xy"], ["xy", "yy"]])
        return self._tangential

    def normal_by_traction(self, traction: FloatArray) -> FloatArray:
        """Normal displacement [ny, nx] by traction [2, ny, nx]."""
        if self.influence("zx") is None:
            return np.zeros(self.grid.shape)
        self.count.coupling += 1
        lift: FloatArray = self.convolution(traction, self._along_z(), turned=True)[0]
        return lift

    def tangential_by_pressure(self, pressure: FloatArray) -> FloatArray:
        """Tangential displacement [2, ny, nx] by pressure [ny, nx]: the negative of the above's transpose."""
        if self.influence("zx") is None:
            return np.zeros((2, *self.grid.shape))
        self.count.coupling += 1
        along_z = self._along_z()
        return self.convolution(pressure[None], along_z.reshape(2, 1, *along_z.shape[2:]), turned=True, sign=-1.0)

    def _along_z(self) -> FloatArray:
        """Symbols of z displacement by both tractions."""
        if self._coupling is None:
            self._coupling = self._symbols([["zx", "zy"]])
        return self._coupling

    @property
    def normal_inverse(self) -> NormalInverse:
        """Approximate inverse of ``normal``."""
        if self._normal_inverse is None:
            self._normal_inverse = NormalInverse(self.grid.shape, self._nonzero("nn", self._fast_grid))
        return self._normal_inverse

    @property
    def tangential_inverse(self) -> TangentialInverse:
        """Approximate inverse of ``tangential``."""
        if self._tangential_inverse is None:
            xx, yy = (self._nonzero(component, self._fast_grid) for component in ("xx", "yy"))
            xy = self._influence("xy", self._fast_grid)
            self._tangential_inverse = TangentialInverse(self.grid.shape, xx, yy, xy)
        return self._tangential_inverse

    @property
    def coarse(self) -> "ElasticOperator":
        """The same bodies on half as many cells a side, rounded up."""
        if self._coarse is None:
            (ny, nx), (hx, hy) = self.grid.shape, self.grid.pitch
            grid = Grid((-(-ny // 2), -(-nx // 2)), (2.0 * hx, 2.0 * hy))
            self._coarse = ElasticOperator(self.bodies, grid, self.count)
        return self._coarse

    def influence(self, component: Component) -> FloatArray | None:
        """Influence of one cell, summed over the bodies; first quadrant [ny, nx], None where it is zero."""
        if component not in self._kernels:
            self._kernels[component] = self._influence(component, self.grid)
        return self._kernels[component]

    @property
    def _fast_grid(self) -> Grid:
        return replace(self.grid, shape=fast_lengths(self.grid.shape))

    def _influence(self, component: Component, grid: Grid) -> FloatArray | None:
        if self.source is not None:
            whole = self.source.influence(component)
            return None if whole is None else whole[: grid.shape[0], : grid.shape[1]]
        parts = [body.influence(component, grid) for body in self.bodies]
        present = [part for part in parts if part is not None]
        return sum(present[1:], start=present[0]) if present else None

    def _symbols(self, components: list[list[Component]]) -> FloatArray:
        """Symbols of a matrix of components; zero where no body has one."""
        known = {component: self._spectrum(component) for row in components for component in row}
        return symbols([[known[component] for component in row] for row in components])

    def _spectrum(self, component: Component) -> FloatArray:
        quadrant = self.influence(component)
        if quadrant is None:
            quadrant = np.zeros(self.grid.shape)
        return self.convolution.spectrum(quadrant, component in {"xy", "zy"}, component in {"xy", "zx"})

    def _nonzero(self, component: Component, grid: Grid) -> FloatArray:
        kernel = self._influence(component, grid)
        assert kernel is not None  # as above
        return kernel


class Operators:
    """The compliance of the same bodies on boxes of any size; kept, because setting one up costs several
    applications. Boxes within ``whole`` take their influences from it.
    """

    __slots__ = ("_known", "_source", "bodies", "count")

    def __init__(self, bodies: tuple[ElasticBody, ...], count: Count | None = None, whole: Grid | None = None) -> None:
        self.bodies, self.count = bodies, Count() if count is None else count
        self._known: dict[tuple[object, ...], ElasticOperator] = {}
        self._source: ElasticOperator | None = None
        if whole is not None:
            self._source = ElasticOperator(bodies, replace(whole, shape=fast_lengths(whole.shape)))

    def on(self, grid: Grid) -> ElasticOperator:
        """The operator on a grid; where the grid lies does not matter."""
        key = (grid.shape, grid.pitch)
        if key not in self._known:
            self._known[key] = ElasticOperator(self.bodies, grid, self.count, self._holding(grid))
        return self._known[key]

    def _holding(self, grid: Grid) -> ElasticOperator | None:
        """The source of influences, if the grid is a part of its."""
        if self._source is None or self._source.grid.pitch != grid.pitch:
            return None
        fits = all(n <= most for n, most in zip(fast_lengths(grid.shape), self._source.grid.shape, strict=True))
        return self._source if fits else None
