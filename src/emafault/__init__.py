"""Fault identification for electromechanical actuators and diagnosis of the sim-to-real gap."""

__version__ = "0.1.0"
