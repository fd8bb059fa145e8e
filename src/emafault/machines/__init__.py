"""Measured machines: what each states of itself, and their diagnosis."""
