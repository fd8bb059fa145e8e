"""The file of one's own actuator as an override of the configuration."""

from ..errors import InputError, shown


def override_of(path: str) -> str:
    """The override of a file, refused here if it is not YAML, which an override would take for the name of an option.

    Raises
    ------
    InputError : a name that does not end as YAML's do
    """
    if not path.endswith((".yaml", ".yml")):
        raise InputError(f"--actuator: got '{shown(path)}', accepted is the path of a .yaml file")
    return f"actuator={path}"
