"""The recorded speed is rounded to a step; told by the lattice that its values lie on, not by an equation."""

SENTENCE = "the speed is recorded in steps"
