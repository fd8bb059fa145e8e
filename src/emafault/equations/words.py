"""Fitted numbers of the reference actuator in words, as the table of a page has them; keys stay those of the model."""

from ..diagnosis.described import Described
from .acquisition import DRIFTS, GAIN_NAMES, RATE
from .point import SEEDED
from .telling import bare
from .telling_chain import CHANNELS, LATE, WINDING, channel_in_words, of_phase

FAULTS = {
    "Na": "shorted turns of phase a, share of all", "Nb": "shorted turns of phase b, share of all",
    "Nc": "shorted turns of phase c, share of all", "xi_x": "static eccentricity along x, share of the air gap",
    "xi_y": "static eccentricity along y, share of the air gap",
}  # fmt: skip
CONTROLLER = {
    "position_gain": "position gain", "speed_gain": "speed gain", "speed_integral_gain": "integral gain of the speed",
    "speed_limit": "limit of the demanded speed",
    "commutation_time": "commutation time of a small current",
    "commutation_slope": "commutation time, increase per ampere",
    "commutation_speed": "commutation time, increase at the speed at which the back-EMF is half the bus voltage",
    "commutation_power": "commutation time, increase per ampere at that speed",
    "bias": "offset of the speed that the controller compares, against the recorded ones",
    "timing": "delay of the sampled demand against the recording",
}  # fmt: skip
#: of the catalogue and of what an effect is fitted in, by effect; "{}" is a phase
EFFECTS = {
    "angle_offset": {"offset": "recorded less true"},
    "back_emf_shape": {"width": "width of the plateau", "h5": "fifth harmonic", "h7": "seventh harmonic"},
    "backlash": {"blk": "play"},
    "bus_resistance": {"R": "resistance"},
    "bus_voltage": {"Vdc": "of the supply"},
    "cogging": {"a": "torque amplitude"},
    "compliance": {"K": "stiffness", "C": "damping", "flexibility": "inverse of the stiffness"},
    "contact_resistance": {"R_x_{}": "phase {}"},
    "control_delay": {"delay": "time"},
    "current_gain": {"g_{}": "phase {}, recorded over true"},
    "current_offset": {"o_{}": "phase {}"},
    "dynamic_eccentricity": {
        "d": "amplitude, share of the air gap", "psi": "angle", "d_cos": "cosine part, share of the air gap",
        "d_sin": "sine part, share of the air gap",
    },
    "friction_asymmetry": {"a": "half the relative difference of the directions"},
    "friction_level": {"scale": "Coulomb friction relative to nominal"},
    "friction_temperature": {"beta": "relative change per kelvin"},
    "hall_displacement": {"d_{}": "sensor of phase {}"},
    "inductance_saturation": {"s": "coefficient of the squared current"},
    "inductance_tolerance": {"L_scale": "relative to nominal"},
    "inertia": {"scale": "relative to nominal"},
    "load_constant": {"T": "torque"},
    "load_spring": {"c": "stiffness"},
    "magnet_temperature": {"alpha_m": "temperature coefficient"},
    "self_heating": {"heating_rate": "inverse of the heat capacity", "Rth": "thermal resistance", "C": "heat capacity"},
    "speed_latency": {"tau": "time constant"},
    "speed_quantisation": {"step": "size of a step"},
    "speed_scale": {"scale": "recorded over true"},
    "stribeck": {"a": "torque above Coulomb friction at standstill", "w_s": "Stribeck speed"},
    "unit_calibration": {
        "R_scale": "resistance relative to nominal", "k_scale": "back-EMF constant relative to nominal",
    },
    "virtual_neutral": {
        "on": "share of the mean of the three voltages", "w_a": "excess weight of phase a",
        "w_b": "excess weight of phase b",
    },
    "viscous_friction": {"scale": "relative to nominal"},
    "voltage_gain": {"g_{}": "phase {}, recorded over true"},
}  # fmt: skip
FORMS = {
    "order": "wave along the rotor angle", "frequency": "oscillation", "bump": "bump", "step_change": "step",
    "pulse": "pulse", "function": "function", "power": "power of the speed", "memory": "low-pass filtered part",
    "travel": "drag that builds up",
}  # fmt: skip
_PASSING = {
    "ahead_out": "forward, the current flowing out of the staying phase", "ahead_in": "forward, flowing into it",
    "back_out": "backward, flowing out of it", "back_in": "backward, flowing into it",
}  # fmt: skip


def effect_number(effect: str, short: str) -> str:
    """A parameter of a listed effect; the key itself where there are no words for it."""
    known = {k.format(j): w.format(j) for k, w in EFFECTS.get(effect, {}).items() for j in "abc"}
    return f"{effect.replace('_', ' ')}: {known.get(short, short)}"


def of_number(name: str) -> str:
    """A nuisance or a parameter of an effect or of the measuring chain, by its full name."""
    name, _, recording = name.partition("@")
    group, _, short = name.rpartition(".")
    words = _of_group(group, short)
    return f"{words}, {recording.removesuffix('.nc')}" if recording else words


def _of_group(group: str, short: str) -> str:
    phase = short[-1]
    if not group:
        fixed = {"dT": "winding temperature less the recorded one", "output_zero": "zero of the output position"}
        return (fixed | FAULTS).get(short, short)
    if f"{group}." == SEEDED:
        return f"{FAULTS[short]}, in all seeded recordings"
    if group == "controller":
        if short.startswith("edge_"):
            return f"commutation of phase {phase} comes early by"
        if short.startswith("commutation_time_"):
            return f"commutation time, deviation of phase {phase}"
        if short.startswith("passing_"):
            _, phase, way = short.split("_", 2)
            return f"commutation time, deviation of phase {phase}: {_PASSING[way]}"
        return CONTROLLER.get(short, short)
    if group == "command":
        return {"filter": "filter of the command", "feedforward": "feed-forward of the command's speed"}[short]
    if group == "emf":
        return f"harmonic of the back-EMF of order {short.removeprefix('h')}"
    if group == "saliency":
        return f"saliency, {'cosine' if short == 'cos' else 'sine'} of twice the electrical angle"
    if group == "mutual":
        return f"inductance between phases {short[0]} and {short[1]}, over that of one"
    if group == "winding":
        return f"{WINDING[short.rpartition('_')[0]]} of phase {short[-1]}, beside those of all phases"
    channel, _, side = short.partition("_")
    late = short.rpartition("_")[0]
    chain = {
        "ambient": "temperature at the start above the recorded ambient one",
        "load": "constant load of its own, at the rotor",
        "skew": f"{short} channel is sampled late by",
        "clock": f"{short} is recorded late by",
        "clock_rate": f"{short} is recorded by a clock that is slow by",
        "counts": f"rounding of the output position, {short.replace('_', ' of harmonic ')}",
        "steps": f"rounding of the current, {short.replace('_', ' of harmonic ')}",
        "rounded": f"rounding of the current, stretch {short.replace('_', ', ')}",
        "lag": f"{channel_in_words(late)} {_late(short.rpartition('_')[2])}",
        **{
            f"crosstalk_{quantity}": f"{quantity} of phase {phase} in the channel of phase {short[0]}"
            for quantity in ("current", "voltage")
        },
        "pickup": f"{channel} channel{f' of phase {side}' if side else 's'}: pickup of the phase's voltage",
        "curve": f"{channel} channel{f' of phase {side}' if side else 's'}: cubic nonlinearity at full range",
        "halves": f"{channel} channel{f' of phase {side}' if side else 's'}: half the difference of its gains",
        "dead": "dead band of the current, turned about"
        if short == "turn"
        else f"{channel} channel{f' of phase {side}' if side else 's'}: dead band",
        "drop": f"drop of the switches{f' of phase {side}' if side else ''}{', turned about' * (short == 'turn')}",
        **{
            f"{kind}_{q}": f"{kind.replace(RATE, 'rate of drift')} of the {CHANNELS.get(q, q)} channel"
            + f" of phase {short}" * (short != "all")
            for kind in ("drift", "offset", RATE)
            for q in DRIFTS
        },
        "gain_output": f"gain of the output position, less one, of the {short}",
        **{
            f"{kind}_{q}": f"gain of the {of_phase(q, short.removeprefix('all'))}, {what}"
            for kind, what in zip(GAIN_NAMES, ("less one", "change along the recording"), strict=True)
            for q in ("current", "voltage")
        },
    }
    return chain[group] if group in chain else effect_number(group, short.removeprefix("log_"))


def _late(way: str) -> str:
    return "is averaged and late by" if way == "averaged" else LATE.get(way, way).partition(" {")[0]


def of_form(form: Described, what: str, name: str) -> str:
    """A coefficient of a described form, by its full name; ``what`` has the form."""
    name, _, recording = name.partition("@")
    coefficient = name.rpartition(".")[2].replace("at_100_rad_s", "at 100 rad/s").replace("c_", "coefficient ")
    words = f"{bare(what)}: {FORMS[form.word]}, {coefficient}"
    return f"{words}, {recording.removesuffix('.nc')}" if recording else words
