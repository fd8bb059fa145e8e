"""Fault identification for electromechanical actuators and diagnosis of the sim-to-real gap."""

import importlib
from typing import Any

__version__ = "0.2.0"

#: public name -> module that has it, loaded when the name is first used; __init__.pyi states their types. Texts and no
#: import statements, since what a module imports counts among the sources that the workflow's rules depend on.
_PUBLIC = {
    "Actuator": "api.actuator",
    "Diagnosis": "api.diagnosis",
    "Identification": "api.identification",
    "InputError": "errors",
    "MachineDiagnoses": "api.machine",
    "MachineDiagnosis": "api.machine",
    "Plan": "api.plan",
    "Recording": "io.recording",
    "Recordings": "api.recordings",
    "Table": "api.table",
    "diagnose": "api.diagnosis",
    "example": "api.recordings",
    "identify": "api.identification",
    "plan": "api.plan",
    "read": "api.recordings",
}
__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'emafault' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"emafault.{_PUBLIC[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
