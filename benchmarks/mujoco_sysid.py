"""The measured axis (EMPS) fitted by mujoco.sysid and diagnosed by emafault, on the same recordings.

    python benchmarks/mujoco_sysid.py [FILE] [--report FOLDER]

Needs ``mujoco[sysid]``, which is no dependency of the project. The first half of the record's cycles explores; the
second is set aside for both. mujoco.sysid fits mass, damping and frictionloss of a slide joint with its own optimiser
and residual, in three ways that a user may choose: each stroke from its measured start, driven by the measured force;
the same over whole cycles; whole cycles under the bench's position controller, whose force is measured. The strokes of
one direction are fitted alone as well, by both. ``constant force`` has a fourth parameter, for a user who suspects
it. Intervals hold 90 %. Both misfits are of the cycles set aside, with what was fitted frozen:

* force: what is left of the mean force in each bin of speed, direction and acceleration, over its noise (the scatter
  within the bin and 0.2 % of the largest force), root mean square; 1 is noise alone.
* speed: what is left of the speed (mm/s) when MuJoCo simulates each stroke with the measured force.
"""

import argparse
import contextlib
import io
import re
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.signal import find_peaks

from emafault.errors import InputError, one_line
from emafault.machines import friction_axis
from emafault.machines.adapter import Recorded
from emafault.machines.diagnose import Fitted, fitted, seal
from emafault.machines.files import read_arrays
from emafault.machines.held_out import ladder, whitened
from emafault.machines.page import finding
from emafault.machines.recorded.friction_axis import cycles, filtered_motion
from emafault.machines.statement import Machine, Rows
from emafault.machines.verdict import build

try:
    import mujoco
    from absl import logging
    from mujoco import sysid
    from mujoco.sysid.report.sections.insights import AutomatedInsights
except ImportError:
    sys.exit("benchmarks/mujoco_sysid.py: mujoco.sysid is missing; pip install 'mujoco[sysid]==4.0.0' installs it")

FILE = Path(__file__).parents[1] / "data" / "measured" / "emps" / "emps_estimation.npz"
CONTROLLER = ("kp", "kv")  # arrays of the file that the position controller is made of
MODEL = """<mujoco>
<option timestep="{step}" gravity="0 0 0" integrator="implicitfast"/>
<worldbody><body name="carriage">
  <joint name="slide" type="slide" axis="1 0 0"/><geom type="box" size=".1 .1 .1" mass="1"/>
</body></worldbody>
<actuator>{actuator}</actuator>
<sensor><jointpos name="position" joint="slide"/><jointvel name="velocity" joint="slide"/>{sensor}</sensor>
</mujoco>"""
#: start, least and largest value (kg, N s/m, N, m/s2)
PARAMETERS = {
    "mass": (50.0, 1.0, 500.0), "damping": (100.0, 0.0, 1000.0), "frictionloss": (10.0, 0.0, 100.0),
    "tilt": (0.01, -1.0, 1.0),
}  # fmt: skip
STANDSTILL, SHORTEST = 0.05, 0.15  # of the largest speed, at which a stroke ends; s, of a stroke
LEVEL = 0.10  # 90 % intervals, as those of the diagnosis


@dataclass(frozen=True)
class Axis:
    """The record: position (m), speed (m/s), acceleration (m/s2), force (N) and reference (m), each (sample,), and the
    position controller's two gains."""

    machine: Machine
    step: float
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    F: np.ndarray
    reference: np.ndarray
    gains: tuple[float, float]
    cycles: list[slice]

    @property
    def cut(self) -> int:
        """How many cycles explore."""
        return len(self.machine.explore)

    def strokes(self, of: Sequence[slice]) -> list[slice]:
        """Stretches from one standstill to the next."""
        out = []
        for s in of:
            speed = np.abs(self.v[s])
            low, _ = find_peaks(-speed, height=-STANDSTILL * speed.max(), distance=int(SHORTEST / self.step))
            ends = [0, *low.tolist(), speed.size]
            shortest = SHORTEST / self.step
            out += [slice(s.start + x, s.start + y) for x, y in pairwise(ends) if y - x > shortest]
        return out


def axis(path: Path) -> Axis:
    """Read the record and cut it into cycles as the diagnosis does."""
    case, arrays = next(iter(friction_axis.read(path).items()))
    more = read_arrays(path)
    for name in ("qg", *CONTROLLER):
        if name not in more:
            raise InputError(f"{path}: array {name!r} is missing; needed are t, qm, vir, gtau, qg, kp, kv")
    moved, gtau = filtered_motion(arrays), float(arrays["gtau"].ravel()[0])
    step = float(np.median(np.diff(arrays["t"])))
    first = int(np.searchsorted(arrays["t"], moved["t"][0]))
    inner = slice(first, first + moved["q"].size)
    kp, kv = (float(more[name]) for name in CONTROLLER)
    return Axis(
        friction_axis.build(case, arrays), step, moved["q"], moved["v"], moved["a"], arrays["vir"][inner] * gtau,
        more["qg"][inner], (kp * kv * gtau, kv * gtau), cycles(moved),
    )  # fmt: skip


# --- mujoco.sysid ---


def model(axis: Axis, controlled: bool = False) -> mujoco.MjSpec:
    """A mass on a slide joint, driven by a force or by the bench's position controller."""
    kp, kv = axis.gains
    drive = f'<position name="drive" joint="slide" kp="{kp}" kv="{kv}"/>' if controlled else ""
    sensor = '<actuatorfrc name="force" actuator="drive"/>' if controlled else ""
    actuator = drive or '<motor name="drive" joint="slide"/>'
    return mujoco.MjSpec.from_string(MODEL.format(step=axis.step, actuator=actuator, sensor=sensor))


def sequences(axis: Axis, stretches: Sequence[slice], controlled: bool = False) -> sysid.ModelSequences:
    """The stretches as mujoco.sysid reads them, each from its measured state."""
    spec = model(axis, controlled)
    compiled = spec.compile()
    control = axis.reference if controlled else axis.F
    names, states, controls, sensed = [], [], [], []
    for s in stretches:
        times = np.arange(s.stop - s.start) * axis.step
        columns = [axis.q[s], axis.v[s], *([axis.F[s]] if controlled else [])]
        names.append(f"{s.start * axis.step:.2f} s")
        states.append(sysid.create_initial_state(compiled, axis.q[s][:1], axis.v[s][:1]))
        controls.append(sysid.TimeSeries.from_control_names(times, control[s][:, None], compiled))
        sensed.append(sysid.TimeSeries.from_names(times, np.column_stack(columns), compiled))
    return sysid.ModelSequences("axis", spec, names, states, controls, sensed)


def put(spec: mujoco.MjSpec, values: Mapping[str, float]) -> None:
    """Set parameters of the model."""
    for name, value in values.items():
        if name == "mass":
            spec.geoms[0].mass = value
        elif name == "damping":
            spec.joint("slide").damping[0] = value
        elif name == "frictionloss":
            spec.joint("slide").frictionloss = value
        else:
            spec.option.gravity = [value, 0.0, 0.0]


@dataclass(frozen=True)
class Fit:
    """Values and half 90 % intervals by parameter, what the report's checks say, and seconds that the fit took."""

    values: dict[str, float]
    half: dict[str, float]
    said: str
    seconds: float

    def of_machine(self) -> dict[str, float]:
        """The same values as the diagnosis names them."""
        v = self.values
        out = {"M": v["mass"], "F_v": v["damping"], "F_c": v["frictionloss"]}
        return out | ({"offset.F_0": -v["mass"] * v["tilt"]} if "tilt" in v else {})


def identify(data: sysid.ModelSequences, tilted: bool = False, report: Path | None = None) -> Fit:
    """Fit by mujoco.sysid, with its defaults; the report is written where a folder is given."""
    begun = time.perf_counter()
    start = sysid.ParameterDict()
    for name, (nominal, least, largest) in PARAMETERS.items():
        if name != "tilt" or tilted:
            modifier = lambda spec, p, name=name: put(spec, {name: p.value[0]})  # noqa: E731
            start.add(sysid.Parameter(name, nominal, least, largest, modifier=modifier))
    residual = sysid.build_residual_fn(models_sequences=[data])
    with contextlib.redirect_stdout(io.StringIO()):  # it prints every iteration
        found, result = sysid.optimize(start, residual)
    left, _, _ = residual(found.as_vector(), found, return_pred_all=True)
    _, half = sysid.calculate_intervals(left, result.jac, alpha=LEVEL)
    seconds = time.perf_counter() - begun
    insights = AutomatedInsights("Automated Insights", found).get_context()["insights"]
    if report is not None:
        report.mkdir(parents=True, exist_ok=True)
        sysid.default_report([data], start, found, residual, result, save_path=report, generate_videos=False)
    names = found.get_non_frozen_parameter_names()
    said = "; ".join(_said(one) for one in insights)
    return Fit(dict(zip(names, found.as_vector())), dict(zip(names, half)), said, seconds)


def _said(insight: Mapping[str, str]) -> str:
    if insight["type"] == "success":
        return insight["title"]
    return re.sub("<[^>]*>", "", insight["message"])


# --- both ---


def force_misfit(axis: Axis, explored: Fitted, values: Mapping[str, float]) -> float:
    """Root mean square of what the cycles set aside leave at these values, over the noise."""
    opened = Recorded(axis.machine, (*axis.machine.explore, *axis.machine.confirm), explored.recorded)
    whites = whitened(opened, axis.machine.confirm, {n: p.off for n, p in opened.parameters.items()} | dict(values))
    return float(np.sqrt(sum(w.gram[-1, -1] for w in whites) / sum(w.count for w in whites)))


def speed_misfit(axis: Axis, values: Mapping[str, float]) -> float:
    """Root mean square of the speed (mm/s) that MuJoCo's simulation of the strokes set aside leaves.

    What the catalogue adds to mass, damping and dry friction is a force on the joint, by the diagnosis' own equation.
    """
    spec = model(axis)
    put(spec, {"mass": values["M"], "damping": values["F_v"], "frictionloss": values["F_c"]})
    compiled = spec.compile()
    data = mujoco.MjData(compiled)
    p = {one.name: np.array([[one.off]]) for one in axis.machine.parameters}
    p |= {name.split(".")[-1]: np.array([[value]]) for name, value in values.items()}
    p |= {name: np.zeros((1, 1)) for name in ("M", "F_v", "F_c")}  # the joint has these itself
    explored = slice(0, axis.cycles[axis.cut - 1].stop)
    middle, fastest = float(axis.q[explored].mean()), float(np.abs(axis.v[explored]).max())
    wrong = []
    for s in axis.strokes(axis.cycles[axis.cut :]):
        mujoco.mj_resetData(compiled, data)
        data.qpos[0], data.qvel[0], data.qacc[0] = axis.q[s.start], axis.v[s.start], axis.a[s.start]
        for k in range(s.start, s.stop - 1):
            x = _inputs(data.qpos[0] - middle, data.qvel[0], data.qacc[0], k * axis.step, fastest)
            data.ctrl[0] = axis.F[k]
            data.qfrc_applied[0] = -friction_axis.force(p, x)[0, 0]
            mujoco.mj_step(compiled, data)
            wrong.append(data.qvel[0] - axis.v[k + 1])
    return 1e3 * float(np.sqrt(np.mean(np.square(wrong))))


def _inputs(q: float, v: float, a: float, t: float, fastest: float) -> dict[str, np.ndarray]:
    """What the equation of the axis reads, at one instant."""
    way = float(np.sign(v))
    each = {
        "a": a, "v": v, "q": q, "t": t, "sign": way, "speed": abs(v), "square": v * abs(v), "push": abs(a) * way,
        "place": way * q, "drift": way * t, "v_max": fastest,
    }  # fmt: skip
    return {name: np.array([value]) for name, value in each.items()} | {"samples": np.array([[v]])}


def toward(machine: Machine, way: int) -> Machine:
    """The machine with what it explored in one direction alone; what is set aside stays whole."""
    rows = []
    for r in machine.rows:
        mine = np.flatnonzero(np.sign(r.beside["direction"]) == way)
        rows.append(r if r.recording in machine.confirm else _part(r, mine))
    return replace(machine, rows=rows)


def _part(rows: Rows, mine: np.ndarray) -> Rows:
    """Some of the rows of a recording."""
    return replace(
        rows, low=rows.low[mine], high=rows.high[mine], observed=rows.observed[mine], variance=rows.variance[mine],
        inputs={n: x[mine] if len(x) == rows.size else x for n, x in rows.inputs.items()},
        labels=[rows.labels[k] for k in mine], beside={n: x[mine] for n, x in rows.beside.items()},
    )  # fmt: skip


def line(name: str, numbers: Sequence[str], said: str) -> str:
    """A row of the table."""
    columns = [f"{x:>17}" for x in numbers[:3]] + [f"{x:>7}" for x in numbers[3:]]
    return f"{name:38}{''.join(columns)}  {said}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", type=Path, default=FILE)
    parser.add_argument("--report", type=Path, metavar="FOLDER", help="write mujoco.sysid's report of each fit")
    args = parser.parse_args()
    logging.set_verbosity("ERROR")
    try:
        record = axis(args.file)
    except InputError as error:
        sys.exit(f"emafault: {one_line(error)}")
    machine = record.machine
    print(f"explored: {', '.join(machine.explore)}; set aside: {', '.join(machine.confirm)}\n")
    print(line("", ["mass (kg)", "damping (N s/m)", "friction (N)", "force", "mm/s", "s"], "says"))

    ours: dict[str, Fitted] = {}
    took = {}
    ways = {"": machine, ", forward": toward(machine, 1), ", back": toward(machine, -1)}
    for way, one in ways.items():
        begun = time.perf_counter()
        ours[way] = fitted(Recorded(one, one.explore), one)
        took[way] = time.perf_counter() - begun

    whole = record.cycles[: record.cut]
    strokes = record.strokes(whole)
    forward = [s for s in strokes if record.v[s].mean() > 0]
    back = [s for s in strokes if record.v[s].mean() < 0]
    for name, stretches, controlled, tilted in (
        ("strokes", strokes, False, False), ("strokes, forward", forward, False, False),
        ("strokes, back", back, False, False), ("cycles", whole, False, False),
        ("cycles, controlled", whole, True, False), ("strokes, constant force", strokes, False, True),
    ):  # fmt: skip
        folder = args.report / name.replace(", ", "_").replace(" ", "_") if args.report else None
        fit = identify(sequences(record, stretches, controlled), tilted, folder)
        values = fit.of_machine()
        numbers = [f"{fit.values[n]:.1f} +- {fit.half[n]:.2f}" for n in ("mass", "damping", "frictionloss")]
        numbers += [f"{force_misfit(record, ours[''], values):.2f}", f"{speed_misfit(record, values):.2f}"]
        print(line(f"mujoco.sysid, {name}", [*numbers, f"{fit.seconds:.1f}"], fit.said), flush=True)

    for way, one in ways.items():
        explored = ours[way]
        told = build(one, explored, seal(explored.reading))
        opened = Recorded(one, (*one.explore, *one.confirm), explored.recorded)
        values = dict(explored.settled.values if explored.tells else explored.base())
        after = [told["base"][n]["after"] for n in ("M", "F_v", "F_c")]
        numbers = [f"{x['value']:.1f} +- {(x['high'] - x['low']) / 2:.2f}" for x in after]
        left = ladder(explored, opened, one.confirm)["after"]
        numbers += [f"{left:.2f}", f"{speed_misfit(record, values):.2f}", f"{took[way]:.1f}"]
        said = " ".join(x for x in finding(told) if not x.startswith("On the validation"))
        print(line(f"emafault{way or ', both directions'}", numbers, said), flush=True)


if __name__ == "__main__":
    main()
