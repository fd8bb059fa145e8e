"""Command lines whose words ask for what cannot be, or for what would cost what is there already."""

import os
from pathlib import Path

from .entries import Entry, entry, file

LONG = "x" * 5000
SMOKE = "--experiment smoke"


def _link(folder: Path) -> None:
    (folder / "link").symlink_to("good.nc")


def _null(folder: Path) -> None:
    """A link, so that code that would replace what it is given replaces no device of the machine's."""
    (folder / "link").symlink_to("/dev/null")


def _dangling(folder: Path) -> None:
    (folder / "link").symlink_to("nowhere/at/all.json")


def _hard(folder: Path) -> None:
    os.link(folder / "good.nc", folder / "twin.nc")


def _pipe(folder: Path) -> None:
    os.mkfifo(folder / "pipe")


def _folder(name: str):
    return lambda folder: (folder / name).mkdir()


#: overrides of simulate -> what is named
OVERRIDES: dict[str, tuple[str, ...]] = {
    "faults.dT.hig=90": ("faults.dT.hig", "did you mean high"),
    "faults.dT.high=warm": ("faults.dT.high", "'warm'"),
    "faults.dT.high=nan": ("faults.dT.high", "nan"),
    "faults.dT.high=inf": ("faults.dT.high", "inf"),
    "faults.dT.high=1e400": ("faults.dT.high", "inf"),
    "faults.dT.high=???": ("faults.dT.high", "needs a value"),
    "faults.dT.high=": ("faults.dT.high",),
    "faults.dT.high=null": ("faults.dT.high", "None"),
    "faults.dT.high={a:1}": ("faults.dT.high",),
    "faults.dT.high=[1,2]": ("faults.dT.high",),
    "faults.dT.high=1,2": ("faults.dT.high", "sweep"),
    "faults.dT.high=range(1,3)": ("faults.dT.high", "sweep"),
    "faults.dT.high=glob(*)": ("faults.dT.high", "sweep"),
    "faults.dT.high=${faults.dT.high}": ("faults.dT.high",),
    "faults.dT.high=${oc.env:NOT_THERE}": ("NOT_THERE",),
    "faults.dT=90": ("faults.dT", "90"),
    "faults=90": ("faults", "90"),
    "faults=": ("faults",),
    "faults=null": ("faults",),
    "faults=[paper]": ("faults",),
    "faults=../paper": ("faults", "../paper"),
    "actuator=nowhere.yaml": ("actuator", "nowhere.yaml", "no such file"),
    "actuator=good": ("actuator", "'good'", "reference"),
    "actuator=bench.yaml\tactuator=reference": ("actuator", "twice"),
    "tolerances.stribeck.a=0.1": ("tolerances.stribeck", "unit_calibration"),
    "tolerances.inertia.scale=2": ("tolerances.inertia.scale", "2"),
    "faults.law=none": ("faults.law", "'none'", "stator_fixed"),
    "faults.law=???": ("faults.law", "needs a value"),
    "~faults": ("faults",),
    "~faults.dT": ("faults.dT",),
    "~command": ("command",),
    "+faults.x=1": ("faults.x",),
    "+new=1": ("new",),
    "++actuator.mass=1": ("actuator.mass",),
    "command=warp": ("command", "'warp'", "sine"),
    "command=file": ("command.path", "needs a value"),
    "command@other=sine": ("command@other",),
    "+command@actuator=sine": ("command",),
    "command/x=sine": ("command/x",),
    "command.name=warp": ("command.name", "'warp'"),
    "command.acceleration=1e300": ("command.acceleration", "100"),
    "experiment=smoke": ("experiment", "--experiment"),
    "+experiment=smoke": ("experiment",),
    "++experiment=smoke": ("experiment",),
    "experiment@x=smoke": ("experiment",),
    "hydra.run.dir=x": ("hydra",),
    "hydra/launcher=basic": ("hydra",),
    "hydra.searchpath=[file:///etc]": ("hydra",),
    "hydra.job.name=x": ("hydra",),
    "actuator.pole_pairs=4.5": ("actuator.pole_pairs", "4.5"),
    "actuator.pole_pairs=true": ("actuator.pole_pairs", "True"),
    "actuator.resistance=0": ("actuator.resistance", "0"),
    "actuator.resistance=-1": ("actuator.resistance", "-1"),
    "actuator.inertia=1e-300": ("actuator.inertia",),
    "actuator.control_period=1e-30": ("actuator.control_period",),
    "actuator.control_period=1e30": ("actuator.control_period",),
    "actuator.gear_ratio=1e300": ("actuator.gear_ratio",),
    "actuator.bus_voltage=1e300": ("actuator.bus_voltage",),
    "actuator.inductance=1e-200": ("actuator.inductance",),
    "actuator.hysteresis=1e-200": ("actuator.hysteresis",),
    "actuator.pole_pairs=99999999999999999999": ("actuator.pole_pairs",),
    "actuator.back_emf=1e200": ("actuator.back_emf",),
    "actuator.reference_temperature=1e300": ("actuator.reference_temperature",),
    "effects.stribeck.a=-1000": ("effects.stribeck.a", "-1000", "N m"),
    "effects.stribeck.a=1e300": ("effects.stribeck.a", "N m"),
    "effects.stribeck.w_s=0": ("effects.stribeck.w_s", "rad/s"),
    "effects.stribeck=5": ("effects.stribeck", "5"),
    "effects.stribek.a=0.1": ("effects.stribek", "did you mean stribeck"),
    "effects.stribeck.b=0.1": ("effects.stribeck.b", "a, w_s"),
    "effects.stribeck.a.b=0.1": ("effects.stribeck.a",),
    "effects.stribeck.a=true": ("effects.stribeck.a", "True"),
    "effects.control_delay.delay=-1": ("effects.control_delay.delay", "-1"),
    "effects.compliance.K=-1e5": ("effects.compliance.K", "-100000"),
    "effects.inertia.scale=0": ("effects.inertia.scale", "0"),
    "effects.unit_calibration.R_scale=-1": ("effects.unit_calibration.R_scale", "-1"),
    "effects.load_constant.T=1e9": ("effects.load_constant.T", "N m"),
    "effects.speed_latency.tau=1e9": ("effects.speed_latency.tau",),
    "effects=5": ("effects", "5"),
    "effects=[a]": ("effects",),
    "effects.=5": ("effects",),
    "load.constant=900\tactuator.end_stop=1e4": ("rotor_speed", "rad/s"),
    "load.constant=1e5": ("load.constant", "1000"),
    "recording.duration=0": ("recording.duration", "0.2"),
    "recording.duration=-1": ("recording.duration", "-1"),
    "recording.duration=1e300": ("recording.duration", "3600"),
    "recording.duration=1.00005": ("recording.duration", "whole number"),
    "recording.interval=0": ("recording.interval", "0"),
    "recording.interval=1": ("recording.interval", "1"),
    "recording.theta_0.low=7": ("recording.theta_0.low", "7"),
    "sensors.voltage=-1": ("sensors.voltage", "-1"),
    "sensors.voltage=1e300": ("sensors.voltage",),
    "unit.tolerance=100": ("unit.tolerance", "100"),
    "unit.reference_recordings=1.5": ("unit.reference_recordings", "1.5"),
    "magnet.coefficient=1": ("magnet.coefficient", "1"),
    "magnet.lag.high=-900": ("magnet.lag.high", "-900"),
    "network.width=8": ("network", "simulate", "actuator"),
    "training.epochs=8": ("training", "simulate", "actuator"),
    "sampling.seed=8": ("sampling", "simulate", "actuator"),
    "name=../x": ("name",),
    "=": ("=",),
    "==": ("=",),
    "a": ("'a'",),
    "a=b=c": ("a",),
    "a b=c": ("a",),
    "{}": ("{}",),
    "a={": ("a",),
    "a='": ("a",),
    "${a}=b": ("${a}",),
    "\\=a": ("\\",),
    "ü=1": ("ü",),
    "a\nb=1": ("a",),
    "a\0b=1": ("a",),
    f"{LONG}=1": ("xxx",),
    f"question={LONG}": ("question",),
    f"command=file\tcommand.path={LONG}": ("command.path", "too long"),
    "command=file\tcommand.path=nowhere.csv": ("command.path", "nowhere.csv", "existing file"),
    "command=file\tcommand.path=.": ("command.path", "existing file"),
    "command=file\tcommand.path=/dev/zero": ("command.path", "existing file"),
    "command=sine\tcommand=ramp": ("command",),
    "command=sine\tcommand.frequency=0": ("command.frequency", "0"),
    "command=reversal\tcommand.speed=1e-300": ("command.speed",),
}

#: contents of a recorded command
MOTIONS: dict[str, str | bytes] = {
    "empty": "",
    "header alone": "time_s,position_rad\n",
    "one row": "0,0\n",
    "one column": "0\n1\n2\n",
    "three columns": "0,0,0\n1,1,1\n",
    "words": "a,b\nc,d\n",
    "ragged": "0,0\n1\n2,2\n",
    "NaN": "0,0\n1,nan\n2,0\n",
    "infinite": "0,0\n1,inf\n2,0\n",
    "NaN in time": "0,0\nnan,1\n2,0\n",
    "backwards": "1,0\n0,1\n",
    "far": "0,0\n1,1e300\n",
    "binary": bytes(range(256)),
    "utf-16": "0,0\n1,1\n".encode("utf-16"),
    "semicolons": "0;0\n1;1\n",
    "NUL": "0,0\n\0,1\n",
}

#: words after ``simulate out.nc`` -> what is named
SIMULATE: dict[str, tuple[str, ...]] = {
    "--fault Na=0.1 Na=0.2": ("--fault", "Na", "twice"),
    "--fault Na=2": ("Na got 2", "0.95"),
    "--fault Na=-0.1": ("Na got -0.1",),
    "--fault Na=nan": ("Na got nan",),
    "--fault dT=inf": ("dT got inf",),
    "--fault dT=1e999": ("dT got 1e999",),
    "--fault Na=": ("Na got ''",),
    "--fault Na=0.1=0.2": ("Na",),
    "--fault Na=0x10": ("Na got '0x10'",),
    "--fault Na=1_0": ("Na got 1_0",),
    "--fault Na": ("six numbers",),
    "--fault 1 2": ("six numbers",),
    "--fault 0 0 0 0 0 0 0": ("six numbers",),
    "--fault 0 0 0 0 0 0 Na=0.1": ("six numbers",),
    "--fault 0 0 0 0 0 warm": ("dT got 'warm'",),
    "--fault xi_x=0.9 xi_y=0.9": ("xi",),
    "--fault Nd=0.1": ("Nd", "Na"),
    "--fault na=0.1": ("na",),
    "--fault dT=-250": ("dT got -250",),
    "--fault": ("--fault",),
    "--seed -1": ("--seed", "-1"),
    "--seed 1.5": ("--seed", "1.5"),
    "--seed x": ("--seed", "'x'"),
    "--seed 99999999999999999999999": ("--seed",),
    "--seed": ("--seed",),
    "--unit-seed -3": ("--unit-seed", "-3"),
    "--unit-seed x": ("--unit-seed", "'x'"),
    "--health fine": ("--health", "fine", "healthy"),
    "--healthy": ("--healthy",),
    "--experiment nothing": ("experiment", "'nothing'", "smoke"),
    "--experiment command_study --unit": ("--unit",),
    "--magic": ("--magic",),
    "-x": ("-x",),
}

#: a file to write -> what is named
TARGETS: dict[str, tuple[str, ...]] = {
    "good.nc": ("good.nc", "exists", "--force"),
    "bench": ("bench", "folder"),
    "bench/": ("bench", "folder"),
    ".": (".", "folder"),
    "good.nc/out.nc": ("good.nc", "cannot be written"),
    "/proc/out.nc": ("/proc/out.nc", "cannot be written"),
    LONG: ("too long",),
    "y" * 300: ("too long",),
    "a\0b": ("NUL",),
}

#: whole lines; ``{long}`` stands for 5000 characters
OTHERS: dict[str, tuple[str, ...]] = {
    "actuator": ("show,identify,export",),
    "actuator show nowhere.yaml": ("nowhere.yaml", "no such file"),
    "actuator show good.nc": ("good.nc", "UTF-8"),
    "actuator identify nowhere.yaml good.nc": ("nowhere.yaml", "no such file"),
    "diagnose bench --actuator nowhere.yaml": ("nowhere.yaml", "no such file"),
    "diagnose bench --actuator good.nc": ("--actuator", "good.nc", ".yaml"),
    "identify good.nc --actuator good.nc": ("--actuator", "good.nc", ".yaml"),
    "identify good.nc --diagnosis nowhere.json": ("nowhere.json", "no such file"),
    "identify good.nc --diagnosis good.nc": ("good.nc", "UTF-8"),
    "identify good.nc --diagnosis good.nc --method weighted": ("--method", "diagnosis"),
    "identify nowhere.nc": ("nowhere.nc: no such file",),
    f"identify {LONG}": ("too long",),
    "identify a\0b.nc": ("NUL",),
    "identify .git": (".git: no such file",),
    "identify results": ("results", "no recording"),
    "identify /dev/null": ("/dev/null",),
    "identify /dev/zero": ("/dev/zero",),
    "identify": ("FILE_OR_FOLDER",),
    f"identify good.nc {SMOKE} --level 0": ("--level", "0"),
    f"identify good.nc {SMOKE} --level 1": ("--level", "1"),
    f"identify good.nc {SMOKE} --level nan": ("--level", "nan"),
    f"identify good.nc {SMOKE} --level -1": ("--level", "-1"),
    f"identify good.nc {SMOKE} --level x": ("--level", "'x'"),
    f"identify good.nc {SMOKE} --level 0.9999999": ("level",),
    f"identify good.nc {SMOKE} --method magic": ("--method", "'magic'", "weighted/closed_form"),
    f"identify good.nc {SMOKE} --method ../../x": ("--method", "'../../x'"),
    f"identify good.nc {SMOKE} --method weighted/": ("--method", "'weighted/'"),
    f"identify good.nc {SMOKE} --method a/b/c": ("--method", "'a/b/c'"),
    f"identify good.nc {SMOKE} --method paper": ("--method", "paper"),
    "identify good.nc --experiment nothing": ("experiment", "'nothing'"),
    "identify good.nc --experiment ../paper": ("experiment", "'../paper'"),
    "identify good.nc --experiment command_study": ("experiment", "'command_study'", "variant"),
    f"identify good.nc --experiment {LONG}": ("experiment",),
    "identify good.nc --experiment a\0b": ("experiment",),
    "identify good.nc --results /nonexistent": ("--results", "/nonexistent"),
    "identify good.nc --results good.nc": ("--results", "good.nc"),
    f"identify good.nc --results {LONG}": ("--results", "too long"),
    f"identify good.nc {SMOKE} --reference nowhere.nc": ("nowhere.nc",),
    f"identify good.nc {SMOKE} --reference good.nc": ("good.nc", "'seeded'", "healthy"),
    f"identify good.nc {SMOKE} --reference": ("--reference",),
    f"identify good.nc {SMOKE} --json good.nc": ("--json", "good.nc", "read"),
    f"identify good.nc {SMOKE} --json good.nc --force": ("--json", "good.nc", "read"),
    f"identify good.nc {SMOKE} --json ./bench/../good.nc --force": ("--json", "good.nc", "read"),
    f"identify bench {SMOKE} --json bench/good.nc --force": ("--json", "good.nc", "read"),
    f"identify good.nc {SMOKE} --reference healthy.nc --json healthy.nc --force": ("--json", "healthy.nc", "read"),
    f"identify good.nc {SMOKE} --json bench": ("--json", "bench", "folder"),
    f"identify good.nc {SMOKE} --json good.nc/x.json": ("--json", "cannot be written"),
    f"identify good.nc {SMOKE} --json /proc/x.json": ("--json", "/proc/x.json", "cannot be written"),
    f"identify good.nc {SMOKE} --json {LONG}": ("--json", "too long"),
    f"identify good.nc {SMOKE} --json a\0b": ("--json", "NUL"),
    f"identify good.nc {SMOKE} --json": ("--json",),
    "identify good.nc --json a.json --magic": ("--magic",),
    "identify good.nc command=sine": ("command=sine",),
    "diagnose": ("PATH",),
    "diagnose nowhere": ("nowhere",),
    f"diagnose {LONG}": ("too long",),
    "diagnose a\0b": ("NUL",),
    "diagnose results": ("results", "no recording"),
    "diagnose bench faults.law=rotor_angle": ("faults.law", "actuator"),
    "diagnose bench command=sine": ("command", "actuator"),
    "diagnose bench effects.stribeck.a=0.01": ("effects.stribeck.a", "actuator"),
    "diagnose bench network.width=3": ("network.width", "actuator"),
    "diagnose bench +actuator.x=3": ("actuator.x",),
    "diagnose bench actuator.gear_ratio=0": ("actuator.gear_ratio", "0"),
    "diagnose bench actuator.gear_ratio=400 actuator.gear": ("actuator.gear",),
    "diagnose bench --exclude magic": ("exclude", "magic", "stribeck"),
    "diagnose bench --exclude": ("--exclude",),
    "diagnose bench --twin magic": ("--twin", "'magic'", "friction_axis"),
    "diagnose bench --twin nowhere.py": ("nowhere.py",),
    "diagnose bench --twin friction_axis": ("bench", "friction_axis"),
    "diagnose bench --twin friction_axis actuator.gear_ratio=400": ("actuator.gear_ratio", "tracking"),
    "diagnose good.nc --twin friction_axis": ("good.nc",),
    "diagnose bench --twin friction_axis --corrected new": ("--corrected",),
    "diagnose bench --twin friction_axis --experiment new": ("--experiment",),
    f"diagnose bench --twin {LONG}": ("--twin",),
    f"diagnose bench --twin {LONG}.py": ("too long",),
    "diagnose bench --experiment ../x": ("--experiment", "'../x'"),
    "diagnose bench --experiment paper": ("--experiment", "paper"),
    "diagnose bench --experiment ü": ("--experiment", "'ü'"),
    f"diagnose bench --experiment {LONG}": ("--experiment",),
    "diagnose bench --samples 3": ("samples", "3", "1000 or more"),
    "diagnose bench --samples -1e5": ("--samples",),
    "diagnose bench --samples many": ("--samples", "many"),
    "diagnose bench --twin friction_axis --samples 5000": ("--samples",),
    "diagnose bench --corrected bench": ("--corrected", "bench"),
    "diagnose bench --corrected good.nc": ("--corrected", "good.nc"),
    "diagnose bench --corrected good.nc/x": ("--corrected", "cannot be written"),
    "diagnose bench --corrected /proc/x": ("--corrected", "cannot be written"),
    f"diagnose bench --corrected {LONG}": ("--corrected", "too long"),
    "diagnose bench --out good.nc": ("--out", "good.nc"),
    "diagnose bench --out good.nc/x": ("--out", "cannot be written"),
    "diagnose bench --out /proc/x": ("--out", "cannot be written"),
    f"diagnose bench --out {LONG}": ("--out", "too long"),
    "diagnose bench --no-trackin --out": ("--out",),
    "diagnose bench good.nc": ("good.nc",),
    "plan": ("PATH",),
    "plan nowhere": ("nowhere",),
    "plan nowhere.json": ("nowhere.json",),
    f"plan {LONG}.json": ("too long",),
    "plan a\0b.json": ("NUL",),
    "plan bench command=sine": ("command", "actuator"),
    "plan bench --out good.nc": ("--out", "good.nc"),
    "plan bench --out /proc/x": ("--out", "cannot be written"),
    f"plan bench --out {LONG}": ("--out", "too long"),
}

#: what stands where it is to be written: line -> (how it is prepared, what is named)
THERE = {
    f"identify good.nc {SMOKE} --json link --force": (_link, ("--json", "link")),
    f"identify bench {SMOKE} --json link": (_dangling, ("--json", "link")),
    f"identify good.nc {SMOKE} --json twin.nc --force": (_hard, ("--json", "twin.nc", "read")),
    f"identify good.nc {SMOKE} --json pipe --force": (_pipe, ("--json", "pipe", "device")),
    f"identify good.nc {SMOKE} --json a.json": (file("a.json", "precious"), ("--json", "a.json", "--force")),
    f"identify good.nc {SMOKE} --json f": (_folder("f"), ("--json", "f", "folder")),
    f"identify healthy.nc {SMOKE} --json link --force": (_null, ("--json", "link")),
    "simulate pipe": (_pipe, ("pipe", "device")),
    "diagnose good.nc --out pipe": (_pipe, ("--out", "pipe")),
    "plan good.nc --out pipe": (_pipe, ("--out", "pipe")),
    "simulate link": (_link, ("link",)),
    "simulate link --force": (_link, ("link",)),
    "simulate pipe --force": (_pipe, ("pipe", "device")),
    "simulate m.csv command=file command.path=m.csv --force": (file("m.csv", "0,0\n1,0.1\n"), ("m.csv", "read")),
    "diagnose bench --out d --no-tracking": (file("d/diagnosis.json", '{"mine": 1}'), ("d/diagnosis.json", "--force")),
    "diagnose bench --out d": (file("d/report.html", "precious"), ("d/report.html", "--force")),
    "diagnose bench --out e": (file("e/experiment.yaml", "precious"), ("e/experiment.yaml", "--force")),
    "plan bench --out d": (file("d/1_sine.csv", "precious"), ("d/1_sine.csv", "--force")),
    "diagnose bench --corrected c": (file("c/x.nc", "precious"), ("--corrected", "c")),
    "identify pipe": (_pipe, ("pipe",)),
    "diagnose pipe": (_pipe, ("pipe",)),
    "plan p.json": (file("p.json", "{"), ("p.json", "JSON")),
    "plan l.json": (file("l.json", "[]"), ("l.json", "diagnosis.json")),
    "plan n.json": (file("n.json", '{"twin": "actuator"}'), ("n.json",)),
    "plan b.json": (file("b.json", b"\xff\xfe"), ("b.json",)),
    "plan m.json": (
        file("m.json", '{"twin": "actuator", "bench": "../../x", "next_experiment": [{"motion": {"name": "../x"}}]}'),
        ("m.json",),
    ),
    "diagnose bench --twin t.py": (file("t.py", "def read("), ("t.py", "SyntaxError")),
    "diagnose bench --twin e.py": (file("e.py", ""), ("e.py", "read")),
    "diagnose bench --twin x.py": (file("x.py", "raise SystemExit(0)"), ("x.py",)),
    "diagnose bench --twin b.py": (file("b.py", b"\xff\0"), ("b.py",)),
    "diagnose t.csv --twin friction_axis": (file("t.csv", "a,b\n1,2\n"), ("t.csv",)),
    "diagnose u.csv --twin friction_axis": (file("u.csv", b"\xff\xfe\0"), ("u.csv",)),
    "diagnose v.csv --twin friction_axis": (file("v.csv", ""), ("v.csv",)),
    "diagnose w.npz --twin dq_machine": (file("w.npz", "zip"), ("w.npz",)),
    "diagnose x.csv.gz --twin friction_axis": (file("x.csv.gz", b"\x1f\x8b1234"), ("x.csv.gz",)),
}

#: lines that must be taken
TAKEN = {
    "simulate new.nc recording.duration=0.2 recording.discard=0.05": None,
    "simulate good.nc recording.duration=0.2 recording.discard=0.05 --force": None,
    "simulate deep/er/new.nc recording.duration=0.2 recording.discard=0.05": None,
    "simulate -- recording.nc recording.duration=0.2 recording.discard=0.05": None,
    "simulate a{b}c.nc recording.duration=0.2 recording.discard=0.05": None,
    "simulate s.nc recording.duration=0.2 recording.discard=0.05 --seed 2147483647 --fault xi_y=-2e-5": None,
    f"identify good.nc {SMOKE}": None,
    f"identify bench {SMOKE} --json new.json": None,
    f"identify bench {SMOKE} --json a.json --force": file("a.json", "old"),
    "identify good.nc --experiment paper": None,
    "identify good.nc --experiment paper --method weighted/network": None,
    "identify good.nc --results results": None,
    "identify good.nc --results bench": None,
    f"identify good.nc {SMOKE} --reference healthy.nc": None,
}


def _entries() -> dict[str, Entry]:
    found = {}
    for text, says in OVERRIDES.items():
        found[f"simulate {text[:60]!r}"] = Entry(("simulate", "out.nc", *text.split("\t")), says)
    for name, text in MOTIONS.items():
        found[f"motion, {name}"] = entry(
            "simulate out.nc command=file command.path=m.csv", "m.csv", prepare=file("m.csv", text)
        )
    for text, says in SIMULATE.items():
        found[f"simulate {text}"] = entry(f"simulate out.nc {text}", *says)
    for path, says in TARGETS.items():
        found[f"simulate to {path[:30]!r}"] = Entry(("simulate", path), says)
    for text, says in OTHERS.items():
        found[text[:90]] = Entry(tuple(text.split(" ")), says)
    for text, (prepare, says) in THERE.items():
        found[text] = entry(text, *says, prepare=prepare)
    for text, prepare in TAKEN.items():
        found[f"taken: {text}"] = entry(text, prepare=prepare)
    return found


ENTRIES = _entries()
