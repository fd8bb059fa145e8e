"""Pictures of errors over the number of recordings of one fault."""

from collections.abc import Mapping, Sequence
from typing import Any

from .style import colour, plt, readable_log

METHODS = {"six": "weighted_floating", "nine": "nine"}
OUTPUTS = {"N": "N", "xi": "ξ", "dT": "ΔT (K)"}


def over_count(entries: Sequence[Mapping[str, Any]]):
    """Errors (dots) and bound (lines) of N, xi and dT over the number of recordings, by six and nine features.

    Parameters
    ----------
    entries : what ``study.several.identify_several`` wrote, of one experiment
    """
    figure, axes = plt.subplots(1, len(OUTPUTS), figsize=(11.0, 3.6))
    for panel, (output, label) in zip(axes, OUTPUTS.items(), strict=True):
        for features, method in METHODS.items():
            own = [entry for entry in entries if entry["features"] == features]
            count = [entry["count"] for entry in own]
            panel.plot(
                count, [entry["bound"][output] for entry in own], color=colour(method), label=f"{features} features"
            )
            panel.plot(count, [entry["errors"][output] for entry in own], "o", color=colour(method))
        panel.set_xscale("log", base=2)
        panel.set_yscale("log")
        readable_log(panel.yaxis)
        panel.set_xticks(count, [str(n) for n in count])
        panel.set_xlabel("recordings")
        panel.set_title(f"mean absolute error of {label}", loc="left", fontsize=10)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return figure
