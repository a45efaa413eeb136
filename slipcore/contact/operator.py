"""Displacement by pressure and traction: zero-padded FFT convolution on a box of cells."""

from dataclasses import dataclass, fields, replace

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from slipcore.contact.grid import Grid
from slipcore.contact.kernels import Component, ElasticBody
from slipcore.contact.preconditioner import NormalInverse, TangentialInverse
from slipcore.frames import FloatArray

ComplexArray = NDArray[np.complex128]


@dataclass(slots=True)
class Count:
    """How often the operators of one problem were applied."""

    normal: int = 0
    tangential: int = 0
    coupling: int = 0

    def since(self, earlier: "Count") -> "Count":
        """What was added to an earlier count."""
        return Count(*(getattr(self, f.name) - getattr(earlier, f.name) for f in fields(self)))


class PaddedTransform:
    """Real FFT of fields [..., ny, nx] padded with zeros, so that a circular convolution does not wrap.

    Rows that hold only padding are skipped on the way in and on the way out, a quarter of the work.
    """

    __slots__ = ("padded", "shape")

    def __init__(self, shape: tuple[int, int]) -> None:
        self.shape = shape
        ny, nx = (int(scipy.fft.next_fast_len(2 * size - 1, real=True)) for size in shape)
        self.padded = (ny, nx)

    def forward(self, field: FloatArray) -> ComplexArray:
        """Spectrum [..., Ny, Nx // 2 + 1] of a field."""
        rows = scipy.fft.rfft(field, self.padded[1], axis=-1)
        return scipy.fft.fft(rows, self.padded[0], axis=-2, overwrite_x=True)

    def backward(self, spectrum: ComplexArray) -> FloatArray:
        """The field of a spectrum, which is overwritten."""
        ny, nx = self.shape
        rows = scipy.fft.ifft(spectrum, axis=-2, overwrite_x=True)[..., :ny, :]
        return scipy.fft.irfft(rows, self.padded[1], axis=-1)[..., :nx]

    def symbol(self, quadrant: FloatArray, odd_y: bool = False, odd_x: bool = False) -> FloatArray:
        """Spectrum of a kernel given in its first quadrant: real, or its imaginary part if odd in one direction."""
        ny, nx = self.shape
        whole = np.zeros(self.padded)
        whole[:ny, :nx] = quadrant
        whole[self.padded[0] - ny + 1 :, :nx] = (-1.0 if odd_y else 1.0) * quadrant[:0:-1]
        mirrored = whole[:, nx - 1 : 0 : -1]
        whole[:, self.padded[1] - nx + 1 :] = -mirrored if odd_x else mirrored
        spectrum = scipy.fft.rfft2(whole)
        return np.ascontiguousarray(spectrum.imag if odd_y != odd_x else spectrum.real)


class ElasticOperator:
    """Compliance of the bodies in contact on one box: pressure and traction [..., ny, nx] Pa to displacement m.

    Symbols are made when first used, so what is never asked for costs nothing. ``count`` may be shared by many boxes.
    """

    __slots__ = (
        "_coarse",
        "_kernels",
        "_normal_inverse",
        "_symbols",
        "_tangential_inverse",
        "bodies",
        "count",
        "grid",
        "transform",
    )

    def __init__(self, bodies: tuple[ElasticBody, ...], grid: Grid, count: Count | None = None) -> None:
        self.bodies, self.grid = bodies, replace(grid, centre=(0.0, 0.0))
        self.count = Count() if count is None else count
        self.transform = PaddedTransform(grid.shape)
        self._kernels: dict[Component, FloatArray | None] = {}
        self._symbols: dict[Component, FloatArray | None] = {}
        self._coarse: ElasticOperator | None = None
        self._normal_inverse: NormalInverse | None = None
        self._tangential_inverse: TangentialInverse | None = None

    def normal(self, pressure: FloatArray) -> FloatArray:
        """Normal displacement by pressure."""
        self.count.normal += 1
        spectrum = self.transform.forward(pressure)
        spectrum *= self._known("nn")
        return self.transform.backward(spectrum)

    def tangential(self, traction: FloatArray) -> FloatArray:
        """Tangential displacement [2, ny, nx] by traction [2, ny, nx]."""
        self.count.tangential += 1
        force = self.transform.forward(traction)
        result = np.empty_like(force)
        np.multiply(self._known("xx"), force[0], out=result[0])
        np.multiply(self._known("yy"), force[1], out=result[1])
        cross = self._symbol("xy")
        if cross is not None:
            result[0] += cross * force[1]
            result[1] += cross * force[0]
        return self.transform.backward(result)

    def normal_by_traction(self, traction: FloatArray) -> FloatArray:
        """Normal displacement [ny, nx] by traction [2, ny, nx]."""
        along_x, along_y = self._symbol("zx"), self._symbol("zy")
        if along_x is None or along_y is None:
            return np.zeros(self.grid.shape)
        self.count.coupling += 1
        force = self.transform.forward(traction)
        return self.transform.backward(1j * (along_x * force[0] + along_y * force[1]))

    def tangential_by_pressure(self, pressure: FloatArray) -> FloatArray:
        """Tangential displacement [2, ny, nx] by pressure [ny, nx]: the negative of the above's transpose."""
        along_x, along_y = self._symbol("zx"), self._symbol("zy")
        if along_x is None or along_y is None:
            return np.zeros((2, *self.grid.shape))
        self.count.coupling += 1
        force = -1j * self.transform.forward(pressure)
        return self.transform.backward(np.stack((along_x * force, along_y * force)))

    @property
    def normal_inverse(self) -> NormalInverse:
        """Approximate inverse of ``normal``."""
        if self._normal_inverse is None:
            self._normal_inverse = NormalInverse(self._nonzero("nn"))
        return self._normal_inverse

    @property
    def tangential_inverse(self) -> TangentialInverse:
        """Approximate inverse of ``tangential``."""
        if self._tangential_inverse is None:
            self._tangential_inverse = TangentialInverse(self._nonzero("xx"), self._nonzero("yy"), self.kernel("xy"))
        return self._tangential_inverse

    @property
    def coarse(self) -> "ElasticOperator":
        """The same bodies on half as many cells a side, rounded up."""
        if self._coarse is None:
            (ny, nx), (hx, hy) = self.grid.shape, self.grid.pitch
            grid = Grid((-(-ny // 2), -(-nx // 2)), (2.0 * hx, 2.0 * hy))
            self._coarse = ElasticOperator(self.bodies, grid, self.count)
        return self._coarse

    def kernel(self, component: Component) -> FloatArray | None:
        """Influence of one cell, summed over the bodies; first quadrant [ny, nx], None where it is zero."""
        if component not in self._kernels:
            parts = [body.influence(component, self.grid) for body in self.bodies]
            present = [part for part in parts if part is not None]
            self._kernels[component] = sum(present[1:], start=present[0]) if present else None
        return self._kernels[component]

    def _symbol(self, component: Component) -> FloatArray | None:
        if component not in self._symbols:
            quadrant = self.kernel(component)
            odd_y, odd_x = component in {"xy", "zy"}, component in {"xy", "zx"}
            self._symbols[component] = None if quadrant is None else self.transform.symbol(quadrant, odd_y, odd_x)
        return self._symbols[component]

    def _known(self, component: Component) -> FloatArray:
        symbol = self._symbol(component)
        assert symbol is not None  # no body is rigid in nn, xx and yy
        return symbol

    def _nonzero(self, component: Component) -> FloatArray:
        kernel = self.kernel(component)
        assert kernel is not None  # as above
        return kernel


class Operators:
    """The compliance of the same bodies on boxes of any size; kept, because setting one up costs several
    applications.
    """

    __slots__ = ("_known", "bodies", "count")

    def __init__(self, bodies: tuple[ElasticBody, ...], count: Count | None = None) -> None:
        self.bodies, self.count = bodies, Count() if count is None else count
        self._known: dict[tuple[object, ...], ElasticOperator] = {}

    def on(self, grid: Grid) -> ElasticOperator:
        """The operator on a grid; where the grid lies does not matter."""
        key = (grid.shape, grid.pitch)
        if key not in self._known:
            self._known[key] = ElasticOperator(self.bodies, grid, self.count)
        return self._known[key]
