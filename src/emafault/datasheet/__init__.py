"""One's own actuator: a file of the numbers that a datasheet gives, composed into the parameters of the equations."""
