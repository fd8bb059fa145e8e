"""``emafault runs``: MLflow's pages on what was logged."""

import argparse
import os
import sys


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("overrides", nargs="*", metavar="OVERRIDE", help="such as tracking.uri=sqlite:///mine.db")
    parser.add_argument("--port", type=int, default=5000, help="of the pages (5000)")
    parser.add_argument("--no-pages", action="store_true", help="only set paths right and name the addresses")


def run(args: argparse.Namespace) -> None:
    """Set the paths of artifacts right, name each experiment's address and start MLflow's pages.

    Raises
    ------
    InputError : nothing was logged there, or MLflow is not installed
    """
    from .. import config
    from ..errors import InputError

    config.refuse_unread(args.overrides, ("tracking",), "runs")
    tracking = config.compose(overrides=args.overrides)["tracking"]
    try:
        from ..tracking.experiments import pages
        from ..tracking.store import address, connected, local_file

        uri = address(tracking["uri"])
        path = local_file(uri)
        if path is not None and not path.is_file():
            raise InputError(f"{path}: nothing was logged there, accepted is tracking.uri=ADDRESS of what was")
        with connected(uri) as client:
            found = [e for e in client.search_experiments() if "mlflow.experimentKind" in e.tags]
    except ImportError:
        raise InputError('needs MLflow: pip install "emafault[study]"') from None
    server = f"http://127.0.0.1:{args.port}" if path is not None else uri
    for experiment in sorted(found, key=lambda e: e.name):
        print(f"{experiment.name}: {server}/{pages(experiment.experiment_id)}")
    if path is None or args.no_pages:
        return
    sys.stdout.flush()
    words = ["-m", "mlflow", "ui", "--workers", "1", "--backend-store-uri", uri, "--port", str(args.port)]
    os.execv(sys.executable, [sys.executable, *words])
