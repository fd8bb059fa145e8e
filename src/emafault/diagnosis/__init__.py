"""The diagnosis of the sim-to-real gap; it knows no machine."""
