"""``emafault demo``: the bench in the box -> a verdict and its page."""

import argparse
import os
import sys
from pathlib import Path


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("--out", metavar="DIR", help="folder to write to (results/diagnoses/example)")
    parser.add_argument("--no-browser", action="store_true", help="name the page, and do not open it")
    parser.add_argument("--force", action="store_true", help="replace files that are not of this bench's diagnosis")


def run(args: argparse.Namespace) -> None:
    """Diagnose the example, print what was found, and write and open its page.

    Raises
    ------
    InputError : a folder that cannot be written
    """
    from ..api.diagnosis import diagnose
    from ..api.recordings import example
    from ..equations.run import folder_of
    from ..reporting.written import refuse_foreign

    recordings = example()
    folder = Path(args.out) if args.out else folder_of(recordings.name)
    refuse_foreign(folder, [recordings.name], ["actuator"], args.force)  # before the work, not after it
    print(f"{recordings!r}\n", flush=True)
    found = diagnose(recordings)
    print("\n".join(found.sentences), flush=True)
    page = found.write(folder, args.force)
    print(f"written to {page.parent}; the page is {page.absolute().as_uri()}")
    if not args.no_browser and _desktop():
        import webbrowser

        webbrowser.open(page.absolute().as_uri())


def _desktop() -> bool:
    """Whether someone sits before a screen that a page can be opened on."""
    if not sys.stdout.isatty():
        return False
    return sys.platform in ("darwin", "win32") or any(os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY"))
