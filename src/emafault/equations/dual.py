"""Forward-mode differentiation: a value with its derivatives by named parameters.

An equation is written once, as a sum of terms; its columns in the linear model follow by the chain rule. Values are
scalars or arrays over the samples of one recording; a derivative is a scalar where it is the same for all samples, and
absent where it is none. What is multiplied by a scalar 0 is not computed.
"""

from collections.abc import Callable

import numpy as np

Number = float | np.ndarray


class Dual:
    """A value (scalar or (sample,)) and its derivatives: parameter name -> scalar or (sample,)."""

    __array_ufunc__ = None  # an array on the left of an operator leaves it to this class
    __slots__ = ("slopes", "value")

    def __init__(self, value: Number, slopes: dict[str, Number] | None = None):
        self.value = value
        self.slopes: dict[str, Number] = {} if slopes is None else slopes  # never changed, for others may have it too

    def __add__(self, other):
        if not isinstance(other, Dual):
            return self if _is(other, 0.0) else Dual(self.value + other, self.slopes)
        if not other.slopes:
            return self if _is(other.value, 0.0) else Dual(self.value + other.value, self.slopes)
        out = dict(self.slopes)
        for name, slope in other.slopes.items():
            out[name] = out[name] + slope if name in out else slope
        return Dual(_plus(self.value, other.value), out)

    __radd__ = __add__

    def __neg__(self):
        return Dual(-self.value, {n: -s for n, s in self.slopes.items()})

    def __sub__(self, other):
        if not isinstance(other, Dual):
            return self if _is(other, 0.0) else Dual(self.value - other, self.slopes)
        if not other.slopes:
            return self if _is(other.value, 0.0) else Dual(self.value - other.value, self.slopes)
        out = dict(self.slopes)
        for name, slope in other.slopes.items():
            out[name] = out[name] - slope if name in out else -slope
        return Dual(self.value if _is(other.value, 0.0) else self.value - other.value, out)

    def __rsub__(self, other):
        return Dual(other - self.value, {n: -s for n, s in self.slopes.items()})

    def __mul__(self, other):
        if not isinstance(other, Dual):
            return self.through(_times(self.value, other), other)
        if not other.slopes:
            return self.through(_times(self.value, other.value), other.value)
        out = _all_times(self.slopes, other.value)
        if not _is(self.value, 0.0):
            for name, term in _all_times(other.slopes, self.value).items():
                out[name] = out[name] + term if name in out else term
        return Dual(_times(self.value, other.value), out)

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
        if not self.slopes or _is(slope, 1.0):
            return Dual(value, self.slopes)
        if _is(slope, 0.0):
            return Dual(value)
        return Dual(value, _all_times(self.slopes, slope))

    def linear(self, operate: Callable[[np.ndarray], np.ndarray], size: int) -> "Dual":
        """A linear operator on arrays of ``size`` samples, a shift or a filter."""

        def full(x: Number) -> np.ndarray:
            return operate(np.asarray(x) if np.ndim(x) else np.full(size, float(x)))

        return Dual(full(self.value), {n: full(s) for n, s in self.slopes.items()})

    def kept(self, mask: np.ndarray) -> "Dual":
        """Zero where the mask is not."""
        return Dual(np.where(mask, self.value, 0.0), {n: np.where(mask, s, 0.0) for n, s in self.slopes.items()})


def _is(x: Number, number: float) -> bool:
    return isinstance(x, float) and x == number


def _plus(x: Number, y: Number) -> Number:
    return y if _is(x, 0.0) else x if _is(y, 0.0) else x + y


def _times(x: Number, y: Number) -> Number:
    """Product; none of a scalar 0 is computed, nor of a scalar 1."""
    if isinstance(x, float) and (x == 1.0 or x == 0.0):
        return y if x == 1.0 else 0.0
    if isinstance(y, float) and (y == 1.0 or y == 0.0):
        return x if y == 1.0 else 0.0
    return x * y


def _all_times(slopes: dict[str, Number], x: Number) -> dict[str, Number]:
    """All of them times x, as ``_times`` has it; none where x is a scalar 0."""
    if isinstance(x, float):
        if x == 1.0 or x == 0.0:
            return dict(slopes) if x == 1.0 else {}
        return {n: s * x for n, s in slopes.items()}
    return {n: _times(s, x) if isinstance(s, float) else s * x for n, s in slopes.items()}


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
