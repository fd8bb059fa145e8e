"""The report of an experiment, and the one that compares the variants of a study."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..faults import FAULT_NAMES
from ..plain import read_json
from ..reporting import errors as error_figures
from ..reporting import paper as paper_figures
from ..reporting import search as search_figures
from ..reporting.page import Page
from ..reporting.style import named
from .bound import CALIBRATED
from .networks import folders

#: what the paper reports on ten fresh rows
PAPER_DT, PAPER_SHARE, PAPER_SECONDS = 1.8, 0.02, 50.0
BOUND_OF = {
    "plateau": "six features of plateau samples",
    "floating": "six features with floating-phase samples",
    "recording": "all intervals of the recordings",
    "heating": "all intervals of the recordings, the winding warming at an unknown rate",
}
WHOLE = ("recording", "heating")  # bounds of recordings rather than of features
OUTPUTS = {"N": ("N", 1.0, 5), "xi": ("ξ", 1.0, 5), "dT": ("ΔT (K)", 1.0, 3)}
WORSE = 1.2  # times the error over its bound, from which a shift is told
MOVED = " ▲"
CHOICES = (
    "The paper gives no motor, controller or noise figures. Those used here are this project's choices (conf/actuator, "
    "conf/sensors); the paper fixes the faults and their ranges, the copper coefficient, the parabolic command, 600 "
    "runs of 1 s with the first 50 ms dropped, the reconstruction and the network. The paper has none of the further "
    "passes of training.reweight, in which each output counts by its own error. The figures compare methods on equal "
    "terms; they do not reproduce the paper's own data set."
)


def draw_report(
    title: str,
    question: str,
    metrics: str,
    estimates: str,
    histories: Sequence[str],
    examples: str,
    search: Sequence[str],
    configuration: str,
    output: str | Path,
    figures: str | Path,
) -> None:
    """Write the report of one experiment, and its figures as PNG files.

    Parameters
    ----------
    metrics, estimates : what ``evaluate_identification`` wrote
    histories : learning curves of every estimator
    examples : what ``simulate_examples`` wrote
    search : trials and choice of the search, or nothing
    configuration : the resolved configuration

    Raises
    ------
    InputError : a file that cannot be read or written
    """
    import xarray as xr

    table = read_json(metrics, "results", "level", "bound")
    results = table["results"]
    with xr.open_dataset(estimates, engine="netcdf4") as data:
        found = {str(name): data[name].values for name in data.variables if "." in str(name)}
    with xr.open_dataset(examples, engine="netcdf4") as data:
        shown = data.load()
    page = Page(title, figures)
    page.paragraph(question, "lead")
    page.paragraph(_finding(table))
    _beside_the_paper(page, table)
    _errors(page, table, found)
    _paper_figures(page, table, found, shown)
    page.heading("Training and search")
    curves = {}
    for folder in folders(histories):
        history = read_json(folder / "history.json", "curves")
        if history["curves"]:
            curves[named(folder.parent.name, folder.name)] = history["curves"]
    text = "Learning curves of the first pass, which stops after the failed validation checks asked for."
    page.figure(
        "learning_curves", search_figures.learning_curves(curves), text, search_figures.learning_in_words(curves)
    )
    if search:
        trials, chosen = (read_json(path) for path in search)
        text = (
            f"Search over {len(trials)} trials: error on rows neither trained on nor used for stopping, and number of "
            f"parameters. Chosen: {chosen['network']['layers']} hidden layer(s) of {chosen['network']['width']} "
            f"{chosen['network']['activation']} units on {chosen['network']['coordinates']} features, "
            f"{chosen['parameters']} parameters."
        )
        of = trials, chosen["number"]
        page.figure("search", search_figures.search_and_front(*of), text, search_figures.search_in_words(*of))
    best = _best(results)
    key = f"{best['method']}.{best['estimator']}"
    parts = [found[f"{key}.{kind}"] for kind in ("value", "low", "high", "truth")]
    level = table["level"]
    page.heading("Estimates")
    label = named(best["method"], best["estimator"])
    text = f"{label}: estimate minus true value, with {level:.0%} intervals, on 100 fresh runs."
    page.figure("estimates", error_figures.residuals_over_truth(*parts), text, error_figures.residuals_in_words(*parts))
    page.heading("What this rests on")
    page.paragraph(CHOICES)
    page.preformatted(Path(configuration).read_text())
    page.write(output)


def _value(entry: Mapping[str, Any], key: str) -> float:
    return entry[key]["mean"] if key in entry else float("nan")


def _best(results: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The most accurate estimator on all fresh rows."""
    return min(results, key=lambda entry: _value(entry["all"], "errors.mean.over_range"))


def _bound_of(table: Mapping[str, Any], entry: Mapping[str, Any]) -> Mapping[str, float] | None:
    return table["bound"][entry["bound"]]


def _finding(table: Mapping[str, Any]) -> str:
    results = table["results"]
    best = _best(results)
    of = best["all"]
    text = (
        f"On {int(_value(of, 'rows'))} fresh runs the most accurate is {named(best['method'], best['estimator'])}: "
        f"mean absolute errors {_value(of, 'errors.dT.mae'):.3g} K in ΔT, {_value(of, 'errors.N.mae'):.2g} in N and "
        f"{_value(of, 'errors.xi.mae'):.2g} in ξ"
    )
    bound = _bound_of(table, best)
    if bound:
        of_what = "recordings" if best["bound"] in WHOLE else "features"
        text += f"; the Cramér-Rao bound of these {of_what} is {_in_words(bound)}"
    other = table["bound"]["floating" if best["bound"] in WHOLE else "recording"]
    if bound and other:
        of_what = "six features" if best["bound"] in WHOLE else "the recordings themselves"
        text += f", that of {of_what} {_in_words(other)}"
    text += ". "
    own = next((r for r in results if r["method"] == "paper" and r["estimator"] == "network"), None)
    if own:
        text += (
            f"The paper's method with its network reaches {_value(own['few'], 'errors.dT.mae'):.2g} K on ten rows "
            f"({own['few']['errors.dT.mae']['low']:.2g} to {own['few']['errors.dT.mae']['high']:.2g} K over draws of "
            f"ten) and {_value(own['all'], 'errors.dT.mae'):.2g} K on all; the paper reports {PAPER_DT} K. "
        )
    if "all_calibrated" in best:
        best = min(results, key=lambda entry: _value(entry["all_calibrated"], "errors.mean.over_range"))
        calibrated = best["all_calibrated"]
        text += (
            "The units evaluated differ within their specification. Calibrated on healthy recordings of each, "
            f"{named(best['method'], best['estimator'])} errs by {_value(calibrated, 'errors.dT.mae'):.3g} K, "
            f"{_value(calibrated, 'errors.N.mae'):.2g} and {_value(calibrated, 'errors.xi.mae'):.2g}"
        )
        bound = table["bound"].get(best["bound"] + CALIBRATED)
        text += f"; the bound of both recordings is {_in_words(bound)}." if bound else "."
    return text


def _in_words(bound: Mapping[str, float]) -> str:
    return f"{bound['dT']:.3g} K, {bound['N']:.2g} and {bound['xi']:.2g}"


def _beside_the_paper(page: Page, table: Mapping[str, Any]) -> None:
    page.heading("The paper's figures beside ours")
    header = ["", "ΔT error, 10 rows (K)", "over draws of 10", "mean error over range, 10 rows", "rows to train on"]
    rows = [["paper (Aerospace 2022, 9(7), 341)", f"{PAPER_DT}", "", f"about {PAPER_SHARE}", "600, 70/15/15"]]
    for entry in table["results"]:
        few = entry["few"]
        spread = few["errors.dT.mae"]
        rows.append(
            [
                named(entry["method"], entry["estimator"]),
                f"{spread['mean']:.2f}",
                f"{spread['low']:.2f} to {spread['high']:.2f}",
                f"{_value(few, 'errors.mean.over_range'):.4f}",
                "",
            ]
        )
    page.table(header, rows, strong=[0])
    text = (
        "Mean absolute errors on ten fresh rows, averaged over several draws of ten and several seeds of each network."
    )
    page.paragraph(text, "small")


def _errors(page: Page, table: Mapping[str, Any], found: Mapping[str, np.ndarray]) -> None:
    page.heading("Errors beside the bound")
    best = _best(table["results"])
    kinds = {"all": "", "all_calibrated": ", calibrated"}
    header = ["", "parameters"]
    for label, *_ in OUTPUTS.values():
        header += [label, "over bound"]
    header += ["error over range", f"coverage of {table['level']:.0%} intervals"]
    rows, errors = [], {}
    for entry in table["results"]:
        for kind, suffix in kinds.items():
            if kind not in entry:
                continue
            of = entry[kind]
            row = [named(entry["method"], entry["estimator"]) + suffix, str(entry["parameters"])]
            for output, (_, _, digits) in OUTPUTS.items():
                error, ratio = of[f"errors.{output}.mae"], _value(of, f"errors.{output}.ratio")
                spread = f" ± {error['std']:.{digits}f}" if entry["seeds"] > 1 else ""
                row += [f"{error['mean']:.{digits}f}{spread}", f"{ratio:.2f}" if np.isfinite(ratio) else "–"]
            row += [f"{_value(of, 'errors.mean.over_range'):.4f}", f"{_value(of, 'coverage.mean'):.3f}"]
            rows.append(row)
            key = f"{entry['method']}.{entry['estimator']}{kind.removeprefix('all')}"
            errors[(entry["method"], entry["estimator"] + suffix)] = found[f"{key}.value"] - found[f"{key}.truth"]
    for name, bound in table["bound"].items():
        if bound:
            suffix = ", calibrated" if name.endswith(CALIBRATED) else ""
            row = [f"Cramér-Rao bound, {BOUND_OF[name.removesuffix(CALIBRATED)]}{suffix}", ""]
            for output, (_, _, digits) in OUTPUTS.items():
                row += [f"{bound[output]:.{digits}f}", "1"]
            rows.append([*row, "", ""])
    strong = [n for n, row in enumerate(rows) if row[0].startswith("Cram")]
    page.table(header, rows, strong)
    text = (
        "Mean absolute errors on fresh rows; ± is the standard deviation over seeds. Rows named weighted use plateau "
        "samples and stand beside that bound, those named nine beside the recordings' own, nine heating beside that of "
        "a winding that warms at an unknown rate, all others beside the bound with floating-phase samples. The bounds "
        "of six features come from the voltage-current-speed equations with R, k, L and offset of each phase free, "
        "that of the recordings from all intervals, with L a coefficient of the fault. Both count what is known "
        "beforehand of R, k, L and the lag as the configuration says (unit.known, magnet.lag)."
    )
    page.paragraph(text, "small")
    if any(entry.get("unidentified") for entry in table["results"]):
        lost = ", ".join(f"{named(e['method'], e['estimator'])}: {e['unidentified']}" for e in table["results"])
        page.paragraph(f"Runs whose record did not determine all features and which are left out: {lost}.", "small")
    text = (
        "Absolute errors on fresh rows: box from 25 to 75 %, whiskers from 5 to 95 %, diamond the mean, dashed the "
        f"mean absolute error at the Cramér-Rao bound, {BOUND_OF[best['bound']]}."
    )
    of_best = errors, _bound_of(table, best)
    page.figure("errors", error_figures.error_boxes(*of_best), text, error_figures.errors_in_words(*of_best))


def _paper_figures(page: Page, table: Mapping[str, Any], found: Mapping[str, np.ndarray], shown) -> None:
    page.heading("The paper's figures 2, 3, 6, 7 and 9")
    kept = shown["kept"].values.astype(bool)
    angle, ratio, k_prime = (shown[name].values for name in ("angle", "ratio", "k_prime"))
    text = "Figure 2: k_a of the paper's worked example, reconstructed with nominal resistance, over angle and i/ω."
    drawing = paper_figures.coefficient_over_angle(angle, ratio, k_prime, shown.attrs["pole_pairs"])
    line, k0 = (shown.attrs["level"], shown.attrs["slope"]), shown.attrs["nominal_back_emf"]
    result = paper_figures.coefficient_in_words(k_prime, line, kept, k0)
    page.figure("figure_2", drawing, text, result)
    text = (
        "Figure 3: the same over i/ω, not optimised. Right: the samples that are kept, with the straight line whose "
        "slope is the deviation of the resistance from nominal."
    )
    drawing = paper_figures.coefficient_over_ratio(ratio, k_prime, line, kept, k0)
    page.figure("figure_3", drawing, text, result)
    time = shown["time"].values
    end = float(time[-1])
    windows = [(0.0, min(0.12, end)), (max(0.0, end - 0.06), end)]
    labels = [str(name) for name in shown["condition"].values][1:]
    for number, name, unit in ((6, "current", "A"), (7, "voltage", "V")):
        label = f"{name} ({unit})"
        drawing = paper_figures.signal_by_fault(time, shown[name].values[1:], labels, label, windows)
        text = f"Figure {number}: phase {name}s for different faults, at the start and at the end of the record."
        result = paper_figures.signal_in_words(shown[name].values[1:], labels, unit)
        page.figure(f"figure_{number}", drawing, text, result)
    width = np.array([table["width"][name] for name in FAULT_NAMES])
    own = [r for r in table["results"] if r["method"] == "paper" and r["estimator"] == "network"]
    networks = [r for r in table["results"] if r["estimator"] in ("network", "searched")]
    for entry in own[:1] + [r for r in networks if r is _best(networks)]:
        key = f"{entry['method']}.{entry['estimator']}"
        error = (found[f"{key}.value"] - found[f"{key}.truth"])[:10]
        error = error[np.all(np.isfinite(error), axis=1)]
        label = named(entry["method"], entry["estimator"])
        drawing = paper_figures.few_row_errors(error, width, f"{label}: first ten fresh rows")
        text = "Figure 9: error of each variable on ten rows never seen in training, over the variable's range."
        result = paper_figures.few_rows_in_words(error, width)
        page.figure(f"figure_9_{entry['method']}_{entry['estimator']}", drawing, text, result)


def compare_variants(
    title: str,
    question: str,
    names: Sequence[str],
    metrics: Sequence[str],
    output: str | Path,
    figures: str | Path,
    learnt_from: str | None = None,
) -> None:
    """Write the report that compares a study's variants; each has a report of its own beside it.

    Parameters
    ----------
    names : variants, in order
    metrics : their metrics
    learnt_from : the variant whose estimators the others are evaluated with, if they are

    Raises
    ------
    InputError : a file that cannot be read or written
    """
    tables = [read_json(path, "results", "level", "bound") for path in metrics]
    estimators = [(r["method"], r["estimator"]) for r in tables[0]["results"]]
    if any([(r["method"], r["estimator"]) for r in t["results"]] != estimators for t in tables):
        raise InputError(f"{title}: the variants do not have the same estimators, they cannot be compared")
    # nine features reach the recordings' own bound, six that of features with floating-phase samples
    lowest = "recording" if any(r["bound"] == "recording" for r in tables[0]["results"]) else "floating"
    lines: dict[str, dict[str, list[float]]] = {}
    for output_name in OUTPUTS:
        lines[output_name] = {
            named(*key): [_value(t["results"][n]["all"], f"errors.{output_name}.mae") for t in tables]
            for n, key in enumerate(estimators)
        }
        bounds = [t["bound"][lowest] for t in tables]
        if all(bounds):
            lines[output_name]["bound"] = [bound[output_name] for bound in bounds]
    page = Page(title, figures)
    page.paragraph(question, "lead")
    result = _ranking(names, lines)
    page.paragraph(result)
    text = "Mean absolute errors on fresh rows, by variant."
    page.figure("variants", error_figures.variants(names, lines), text, result)
    for output_name, (label, _, digits) in OUTPUTS.items():
        page.heading(f"Mean absolute error of {label}")
        columns = list(lines[output_name])
        rows = [
            [name, *(f"{lines[output_name][column][n]:.{digits}f}" for column in columns)]
            for n, name in enumerate(names)
        ]
        page.table(["variant", *columns], rows)
    if learnt_from is not None:
        _shifts(page, names, tables, learnt_from)
    page.paragraph("The reports of the single variants stand in the folders beside this page.", "small")
    page.paragraph(CHOICES)
    page.write(output)


def _shifts(page: Page, names: Sequence[str], tables: Sequence[Mapping[str, Any]], base: str) -> None:
    """What recordings cost that the estimators were not made for: error over its bound, coverage, runs without one."""
    at = list(names).index(base)
    told = []
    for output, (label, _, _) in OUTPUTS.items():
        page.heading(f"Mean absolute error of {label} over its bound")
        rows = []
        for n, name in enumerate(names):
            row = [name]
            for k, entry in enumerate(tables[n]["results"]):
                ratio = _value(entry["all"], f"errors.{output}.ratio")
                moved = ratio / _value(tables[at]["results"][k]["all"], f"errors.{output}.ratio")
                row.append(f"{ratio:.2f}" + (MOVED if moved > WORSE else ""))
                if moved > WORSE:
                    told.append((moved, label, name, named(entry["method"], entry["estimator"])))
            rows.append(row)
        page.table(["variant", *(named(r["method"], r["estimator"]) for r in tables[0]["results"])], rows)
    page.paragraph(
        f"{MOVED.strip()} marks what is more than {WORSE:g} times that of {base}: the bound is that of a variant's own "
        f"recordings, the estimators are those of {base}.", "small",
    )  # fmt: skip
    most = [f"{o} by {method} under {name} ({x:.1f} times)" for x, o, name, method in sorted(told, reverse=True)[:5]]
    page.paragraph(f"Moved most: {', '.join(most)}." if told else f"Nothing moves by more than {WORSE:g}.")
    page.heading("Intervals and what is left without a result")
    shares = [
        [name, *(f"{_value(r['all'], 'coverage.mean'):.3f} ({r['unidentified']})" for r in tables[n]["results"])]
        for n, name in enumerate(names)
    ]
    page.table(["variant", *(named(r["method"], r["estimator"]) for r in tables[0]["results"])], shares)
    level = f"{tables[0]['level']:.0%}"
    text = f"Coverage of {level} intervals, mean over the outputs; in brackets runs that cannot be identified."
    page.paragraph(text, "small")


def _ranking(names: Sequence[str], lines: Mapping[str, Mapping[str, Sequence[float]]]) -> str:
    """Which variant is best for each output, by the bound where it holds and by the best estimator.

    Variants whose bounds agree are evaluated on the same recordings and differ in what is learnt: networks count alone.
    """
    bounds = [table["bound"] for table in lines.values() if "bound" in table]
    learnt = bool(bounds) and all(np.ptp(bound) < 1e-9 for bound in bounds)
    said = []
    for output, (label, _, digits) in OUTPUTS.items():
        best = np.nanmin(
            [v for key, v in lines[output].items() if key != "bound" and not (learnt and key.endswith("closed form"))],
            axis=0,
        )
        first = int(np.nanargmin(best))
        text = f"{label}: {names[first].replace('_', ' ')} ({best[first]:.{digits}f}"
        if learnt:
            enough = int(np.argmax(best <= 1.05 * best[first]))
            text += f"; the first within 5 % of it is {names[enough].replace('_', ' ')}, {best[enough]:.{digits}f}"
        elif "bound" in lines[output]:
            lowest = int(np.argmin(lines[output]["bound"]))
            least = lines[output]["bound"][lowest]
            text += f"; the bound is lowest for {names[lowest].replace('_', ' ')}, {least:.{digits}f}"
        said.append(text + ")")
    whose = "of any network, all being evaluated on the same recordings" if learnt else "of any estimator"
    return f"Smallest mean absolute error {whose}. " + "; ".join(said) + "."
