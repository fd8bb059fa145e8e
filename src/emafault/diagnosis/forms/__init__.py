"""Described forms: what no catalogue lists, each one file with its scan, its columns and its words.

A form adds to an equation, times one of the equation's drivers, or to a channel of the measuring chain. Its file gives

ALONG : the coordinate, as the verdict names it
CHANNELS : quantities whose channel may have the form, rather than the equation
EACH : whether its coefficients are each recording's own
POSITIVE : names of its shape that are sizes: below zero there is no such form, or one that grows without bound
ENDS : names of its shape of which the second is beyond the first, if any
COEFFICIENTS : a name for each of its columns
columns(coordinates, shape) : (column, row) without the driver, of a shape by name
coarse(left, driver) : a shape by name near which most stands out of what an equation leaves, with its approximate log
    Bayes factor; None where the recordings cannot show the form
fine(left, driver, shape) : shapes near that one with their standard deviations
position(coordinates, shape, coefficients) : (row,) what its picture goes along, and ``AXIS``, that in words
told(coefficients, shape) : what a reader wants of the coefficients: name -> value
"""

from types import ModuleType

from . import bump, frequency, function, memory, order, power, pulse, step_change, travel

FORMS: dict[str, ModuleType] = {
    m.__name__.rsplit(".", 1)[-1]: m
    for m in (order, frequency, bump, step_change, pulse, function, power, memory, travel)
}
