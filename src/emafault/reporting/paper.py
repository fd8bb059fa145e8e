"""The seed paper's figures 2, 3, 6, 7 and 9, drawn from this project's own simulations."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..faults import FAULT_NAMES
from .style import GREY, INK, LABELS, PHASE_COLOURS, plt


def coefficient_over_angle(theta: np.ndarray, ratio: np.ndarray, k_prime: np.ndarray, pole_pairs: float):
    """Figure 2: reconstructed k_a over rotor angle and i/w.

    Parameters
    ----------
    theta, ratio, k_prime : (sample,) electrical angle in [0, 2 pi) (rad), i/w (A s/rad), k' (V s/rad)
    """
    figure = plt.figure(figsize=(8.5, 5.6), constrained_layout=False)
    axes: Any = figure.add_axes((0.0, 0.03, 0.86, 0.94), projection="3d")
    points = axes.scatter(theta, ratio, k_prime, c=k_prime, s=2.5, cmap="viridis", linewidths=0)
    axes.set_xlabel(r"electrical angle $p\,\theta$ mod $2\pi$ (rad)")
    axes.set_ylabel(r"$i_a/\omega$ (A s/rad)")
    axes.set_zlabel(r"reconstructed $k_a$ (V s/rad)", labelpad=8)
    axes.view_init(22, -58)
    bar = figure.add_axes((0.9, 0.25, 0.016, 0.5))
    figure.colorbar(points, cax=bar)
    return figure


def coefficient_over_ratio(
    ratio: np.ndarray, k_prime: np.ndarray, line: tuple[float, float], kept: np.ndarray, k0: float
):
    """Figure 3: reconstructed k_a over i/w, not optimised, with the straight line whose slope is dR.

    Parameters
    ----------
    ratio, k_prime : (sample,) i/w (A s/rad) and k' (V s/rad)
    line : k (V s/rad) and dR (ohm)
    kept : (sample,) whether a sample is large enough to be used
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), width_ratios=(1.2, 1))
    left.scatter(ratio[~kept], k_prime[~kept], s=3, color="#c9c9c9", linewidths=0, label="dropped")
    left.scatter(ratio[kept], k_prime[kept], s=3, color=PHASE_COLOURS[1], linewidths=0, label="kept, $|k'| > k_0/2$")
    left.set_xlabel(r"$i_a/\omega$ (A s/rad)")
    left.set_ylabel(r"$k'_a$ (V s/rad)")
    left.legend(loc="lower right", markerscale=4)
    sign = np.sign(k_prime[kept])
    x, y = sign * ratio[kept], np.abs(k_prime[kept])
    right.scatter(x, y, s=3, color=PHASE_COLOURS[1], linewidths=0)
    ends = np.array([np.min(x), np.max(x)])
    k, dR = line
    right.plot(
        ends, k + dR * ends, color=PHASE_COLOURS[0], label=rf"slope $\Delta R$ = {dR:.4f} $\Omega$, $k$ = {k:.5f}"
    )
    right.axhline(k0, color=GREY, ls=":", lw=1, label=f"nominal $k_0$ = {k0}")
    right.set_xlabel(r"$\mathrm{sign}(k'_a)\; i_a/\omega$ (A s/rad)")
    right.set_ylabel(r"$|k'_a|$ (V s/rad)")
    right.legend(loc="best", fontsize=9)
    return figure


def coefficient_in_words(k_prime: np.ndarray, line: tuple[float, float], kept: np.ndarray, k0: float) -> str:
    """What figures 2 and 3 show, for who cannot see them."""
    return (
        f"The reconstructed coefficient has a median size of {np.median(np.abs(k_prime)):.3g} V s/rad, nominal "
        f"{k0:.3g}; {np.mean(kept):.0%} of the samples are kept, and the line through them gives k = {line[0]:.4g} "
        f"V s/rad and a deviation of the resistance of {line[1]:.3g} ohm."
    )


def signal_by_fault(
    time: np.ndarray, signal: np.ndarray, labels: Sequence[str], ylabel: str, windows: Sequence[tuple[float, float]]
):
    """Figures 6 and 7: phase currents or voltages for different fault conditions, at the start and in motion.

    Parameters
    ----------
    time, signal : (time,) s and (run, time, phase)
    windows : (from, to) s of each column
    """
    size = (10.5, 1.65 * len(labels) + 0.5)
    figure, axes = plt.subplots(len(labels), len(windows), figsize=size, sharex="col", sharey="col", squeeze=False)
    for row, label in enumerate(labels):
        for column, (low, high) in enumerate(windows):
            part = (time >= low) & (time <= high)
            for j, letter in enumerate("abc"):
                axes[row, column].plot(
                    1e3 * time[part], signal[row, part, j], lw=0.8, color=PHASE_COLOURS[j], label=f"phase {letter}"
                )
            axes[row, column].margins(x=0)
        axes[row, 0].set_title(label, fontsize=9, loc="left", pad=3)
        axes[row, 0].set_ylabel(ylabel)
    for axis in axes[-1]:
        axis.set_xlabel("time (ms)")
    axes[0, -1].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=8, borderaxespad=0.2)
    return figure


def signal_in_words(signal: np.ndarray, labels: Sequence[str], unit: str) -> str:
    """What figures 6 and 7 show, for who cannot see them: the largest of each phase; ``signal`` (run, time, phase)."""
    peaks = np.abs(signal).max(axis=1)
    said = [f"{label} {', '.join(f'{p:.3g}' for p in row)}" for label, row in zip(labels, peaks, strict=True)]
    return f"Largest of phases a, b, c in {unit}: {'; '.join(said)}."


def few_row_errors(errors: np.ndarray, width: np.ndarray, title: str):
    """Figure 9: box plot of the absolute error of each variable on the paper's terms, ten fresh rows, over its range.

    Parameters
    ----------
    errors : (run, 6) estimate less truth; width : (6,) ranges
    """
    used = [j for j in range(6) if width[j] > 0.0]
    figure, axes = plt.subplots(figsize=(7.5, 3.8))
    shares = [np.abs(errors[:, j]) / width[j] for j in used]
    boxes = axes.boxplot(shares, widths=0.5, patch_artist=True, medianprops={"color": INK}, whis=(0, 100))
    for box in boxes["boxes"]:
        box.set(facecolor="#cfe3f1", edgecolor=PHASE_COLOURS[1])
    for place, share in enumerate(shares, 1):
        axes.plot(np.full(len(share), place) + 0.33, share, ".", color=GREY, ms=4)
    axes.axhline(0.02, color=PHASE_COLOURS[0], ls="--", lw=1, label="the paper's mean, about 0.02")
    axes.set_xticks(range(1, len(used) + 1), [LABELS[FAULT_NAMES[j]].replace(" (K)", "") for j in used])
    axes.set_ylabel("absolute error over range")
    axes.set_ylim(0.0)
    axes.set_title(title, fontsize=10, loc="left")
    axes.legend(loc="upper right")
    return figure


def few_rows_in_words(errors: np.ndarray, width: np.ndarray) -> str:
    """What figure 9 shows, for who cannot see it; as ``few_row_errors`` takes it."""
    means = {FAULT_NAMES[j]: float(np.mean(np.abs(errors[:, j])) / width[j]) for j in range(6) if width[j] > 0.0}
    return f"Mean absolute error over range: {', '.join(f'{c} {m:.3f}' for c, m in means.items())}."
