"""Equation errors of the reference actuator at the measured signals, one file an equation."""
