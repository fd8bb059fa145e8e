"""Guessed maps: what names and units tell, and blanks for what they do not."""

import pytest
import yaml

from emafault.cli import main
from emafault.errors import InputError
from emafault.imports.guess import guess
from emafault.imports.mapping import read_map
from emafault.io.bench import read_bench

from .measured import ACTUATOR, Log, log
from .writers import csv, mat

NAMES = [
    {"ua": "Voltage U", "ub": "Voltage V", "uc": "Voltage W", "ia": "Current U", "ib": "Current V", "ic": "Current W",
     "angle": "Encoder", "speed": "Motor speed", "out": "Shaft position", "cmd": "Setpoint", "bus": "DC link"},
    {"ua": "phase_voltage_1", "ub": "phase_voltage_2", "uc": "phase_voltage_3", "ia": "i1", "ib": "i2", "ic": "i3",
     "angle": "theta", "speed": "omega", "out": "position_out", "cmd": "position_ref", "bus": "v_bus"},
]  # fmt: skip


@pytest.mark.parametrize("names", NAMES)
@pytest.mark.parametrize("writer", [csv, mat])
def test_channels_are_told_by_names_and_units(names, writer, fine, tmp_path):
    whole = log({name: values[:100] for name, values in fine.items()})
    plain = {k: v.replace(" ", "_") for k, v in names.items()} if writer is mat else names
    channels = {plain[name]: values for name, values in whole.channels.items()}
    file = tmp_path / ("log.mat" if writer is mat else "log.csv")
    writer(file, Log(whole.time, channels, {plain[name]: unit for name, unit in whole.units.items()}))
    signals = yaml.safe_load(guess([file], tmp_path))["signals"]
    above = "log/" if writer is mat else ""
    assert signals["phase_voltage"]["channels"] == [above + plain[f"u{letter}"] for letter in "abc"]
    assert signals["phase_current"]["channels"] == [above + plain[f"i{letter}"] for letter in "abc"]
    wanted = {"rotor_angle": "angle", "rotor_speed": "speed", "output_position": "out", "commanded_position": "cmd"}
    for name, key in (wanted | {"bus_voltage": "bus"}).items():
        assert signals[name]["channel"] == above + plain[key]
    assert signals["phase_voltage"]["reference"] == "???" and ("unit" in signals["rotor_angle"]) == (writer is mat)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("Motor Efficiency", "%"), ("Motor Efficiency", ""), ("Frequency", ""), ("Rectangle", ""), ("Mode offset", ""),
        ("Route", ""), ("Output power", "W"), ("Set temperature", "degC"), ("Shaft torque", "N*m"),
        ("PWM rate", "Hz"), ("Speed loop", "kHz"),
    ],
)  # fmt: skip
def test_a_word_that_only_holds_a_stem_or_has_another_unit_leaves_the_blank(name, unit, tmp_path):
    content = f"time [s],{name}{f' [{unit}]' if unit else ''}\n0,1\n0.1,2\n"
    (tmp_path / "log.csv").write_text(content)
    signals = yaml.safe_load(guess([tmp_path / "log.csv"], tmp_path))["signals"]
    for signal in ("rotor_angle", "output_position", "commanded_position"):
        assert signals[signal]["channel"] == "???", signal
    assert "rotor_speed" not in signals and "bus_voltage" not in signals


@pytest.mark.parametrize("name", ["RotorAngle", "motorangle", "enc_count", "EncoderPos1", "theta_m", "Resolver"])
def test_the_rotor_s_angle_is_known_by_its_words(name, tmp_path):
    (tmp_path / "log.csv").write_text(f"time [s],{name}\n0,1\n0.1,2\n")
    assert yaml.safe_load(guess([tmp_path / "log.csv"], tmp_path))["signals"]["rotor_angle"]["channel"] == name


def test_a_commanded_speed_is_not_the_speed(tmp_path):
    (tmp_path / "log.csv").write_text("time [s],Speed ref [rpm],Motor speed [rpm]\n0,1,1\n0.1,2,2\n")
    signals = yaml.safe_load(guess([tmp_path / "log.csv"], tmp_path))["signals"]
    assert signals["rotor_speed"]["channel"] == "Motor speed"


def test_a_guessed_map_is_refused_until_it_is_filled_in_and_then_imports(fine, tmp_path, capsys):
    csv(tmp_path / "log.csv", log(fine))
    where = tmp_path / "map.yaml"
    assert main(["import", "--guess", str(where), str(tmp_path / "log.csv")]) == 0
    assert main(["import", "--guess", str(where), str(tmp_path / "log.csv")]) == 2
    text = where.read_text()
    for blank, said in (("samples", "means"), ("reference", "star"), ("health", "healthy"), ("ambient", "24 degC")):
        with pytest.raises(InputError, match=r"still \?\?\?; say what it is"):
            read_map(where)
        assert f"{blank}: ???" in text
        text = text.replace(f"{blank}: ???", f"{blank}: {said}")
        where.write_text(text)
    assert main(["import", "--map", str(where), "--out", str(tmp_path / "bench")]) == 0
    assert read_bench(tmp_path / "bench", ACTUATOR).recordings["log.nc"].health == "healthy"
    capsys.readouterr()
    assert main(["import", "--map", str(where)]) == 2
    assert capsys.readouterr().err == "emafault import: --map: needs --out DIR, a folder to write to\n"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda m: m["signals"]["phase_voltage"].pop("reference"), "'reference' is a required property"),
        (lambda m: m["recordings"][0].pop("ambient"), "'ambient' is a required property"),
        (lambda m: m["recordings"][0].pop("health"), "'health' is a required property"),
        (lambda m: m["signals"]["phase_voltage"].update(reference="earth"), "'earth' is not one of"),
        (lambda m: m["signals"].update(torque={"channel": "T"}), "'torque' was unexpected"),
        (lambda m: m["signals"]["rotor_speed"].update(logger="pod"), "got 'pod', the map's loggers are daq"),
        (lambda m: m["recordings"].append(m["recordings"][0]), "two recordings are named 'one'"),
        (lambda m: m.update(interval="5 kg"), "accepted is a number with a unit of s"),
    ],
)
def test_a_map_that_breaks_the_schema_is_refused(change, says, fine, tmp_path):
    from .measured import map_of
    from .writers import parquet

    given = map_of()
    change(given)
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(given))
    parquet(tmp_path / "log.parquet", log({name: values[:100] for name, values in fine.items()}))
    with pytest.raises(InputError, match=says):
        from emafault.imports.run import imported

        imported(read_map(tmp_path / "map.yaml"), ACTUATOR, 0.05)
