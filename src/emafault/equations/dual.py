"""Forward-mode differentiation: a value with its derivatives by named parameters.

An equation is written once, as a sum of terms; its columns in the linear model follow by the chain rule. Values are
scalars or arrays over the samples of one recording; a derivative is a scalar where it is the same for all samples.
"""

from collections.abc import Callable, Mapping

import numpy as np

Number = float | np.ndarray


class Dual:
    """A value (scalar or (sample,)) and its derivatives: parameter name -> scalar or (sample,)."""

    __array_ufunc__ = None  # an array on the left of an operator leaves it to this class
    __slots__ = ("slopes", "value")

    def __init__(self, value: Number, slopes: Mapping[str, Number] | None = None):
        self.value = value
        self.slopes: dict[str, Number] = dict(slopes or {})

    def __add__(self, other):
        if not isinstance(other, Dual):
            return Dual(self.value + other, self.slopes)
        out = dict(self.slopes)
        for name, slope in other.slopes.items():
            out[name] = out[name] + slope if name in out else slope
        return Dual(self.value + other.value, out)

    __radd__ = __add__

    def __neg__(self):
        return Dual(-self.value, {n: -s for n, s in self.slopes.items()})

    def __sub__(self, other):
        return self + (-other)

    def __rsub__(self, other):
        return (-self) + other

    def __mul__(self, other):
        if not isinstance(other, Dual):
            return Dual(self.value * other, {n: s * other for n, s in self.slopes.items()})
        out = {n: s * other.value for n, s in self.slopes.items()}
        for name, slope in other.slopes.items():
            term = slope * self.value
            out[name] = out[name] + term if name in out else term
        return Dual(self.value * other.value, out)

    __rmul__ = __mul__

    def __truediv__(self, other):
        if not isinstance(other, Dual):
            return self * (1.0 / other)
        return self * other.reciprocal()

    def __rtruediv__(self, other):
        return self.reciprocal() * other

    def reciprocal(self) -> "Dual":
        """1 / self."""
        return self.through(1.0 / self.value, -1.0 / np.square(self.value))

    def through(self, value: Number, slope: Number) -> "Dual":
        """A function of this one: its value and its derivative by this one's value."""
        return Dual(value, {n: s * slope for n, s in self.slopes.items()})

    def linear(self, operate: Callable[[np.ndarray], np.ndarray], size: int) -> "Dual":
        """A linear operator on arrays of ``size`` samples, a shift or a filter."""

        def full(x: Number) -> np.ndarray:
            return operate(np.asarray(x) if np.ndim(x) else np.full(size, float(x)))

        return Dual(full(self.value), {n: full(s) for n, s in self.slopes.items()})

    def kept(self, mask: np.ndarray) -> "Dual":
        """Zero where the mask is not."""
        return Dual(np.where(mask, self.value, 0.0), {n: np.where(mask, s, 0.0) for n, s in self.slopes.items()})


def value_of(x: "Dual | Number") -> Number:
    """The value alone."""
    return x.value if isinstance(x, Dual) else x


def exp(x: Dual) -> Dual:
    """e to the power of x."""
    value = np.exp(x.value)
    return x.through(value, value)


def clip(x: Dual, limit: "Dual | float") -> Dual:
    """x between -limit and limit."""
    bound = limit if isinstance(limit, Dual) else Dual(limit)
    inside = np.abs(x.value) < bound.value
    return x.kept(inside) + (bound * np.where(inside, 0.0, np.sign(x.value)))
