"""An identifier's networks as one file of plain C99 for an actuator's controller: no dynamic memory, no state, float32.

Every operation is in the order and precision of ONNX Runtime on a processor with fused multiply-add: products are
summed one after the other, the bias last, and tanh and sigmoid are its rational functions (MLAS, tanh.cpp and
logistic.cpp), so that results are the same bits. Logarithms are the C library's: those of ONNX Runtime depend on where
in a batch a value stands, by up to 3 units in the last place.
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from ..io.atomic import write_text
from .export import network_of
from .identifier import Identifier
from .network import Network, logarithmic

_TANH = """static float tanh_of(float v)
{
    const float x = v < -9.0f ? -9.0f : v > 9.0f ? 9.0f : v;
    const float s = x * x;
    float p = fmaf(s, -2.76076847742355e-16f, 2.00018790482477e-13f);
    float q = fmaf(s, 1.19825839466702e-06f, 1.18534705686654e-04f);
    p = fmaf(p, s, -8.60467152213735e-11f);
    p = fmaf(p, s, 5.12229709037114e-08f);
    p = fmaf(p, s, 1.48572235717979e-05f);
    p = fmaf(p, s, 6.37261928875436e-04f);
    p = fmaf(p, s, 4.89352455891786e-03f);
    q = fmaf(q, s, 2.26843463243900e-03f);
    q = fmaf(q, s, 4.89352518554385e-03f);
    return p * x / q;
}
"""
_SIGMOID = """static float sigmoid_of(float v)
{
    const float x = v < -18.0f ? -18.0f : v > 18.0f ? 18.0f : v;
    const float s = x * x;
    float p = fmaf(s, 4.37031012579801e-11f, 1.15627324459942e-07f);
    float q = fmaf(s, 6.10247389755681e-13f, 5.76102136993427e-09f);
    p = fmaf(p, s, 6.08574864600143e-05f);
    p = fmaf(p, s, 8.51377133304701e-03f);
    p = fmaf(p, s, 2.48287947061529e-01f);
    q = fmaf(q, s, 6.29106785017040e-06f);
    q = fmaf(q, s, 1.70198817374094e-03f);
    q = fmaf(q, s, 1.16817656904453e-01f);
    q = fmaf(q, s, 9.93151921023180e-01f);
    return p * x / q + 0.5f;
}
"""
_RELU = """static float relu_of(float v)
{
    return v > 0.0f ? v : 0.0f;
}
"""
#: activation -> its C, and how many fused multiply-adds, products and divisions one takes
_ACTIVATIONS = {"tanh": (_TANH, 9, 2, 1), "sigmoid": (_SIGMOID, 9, 2, 1), "relu": (_RELU, 0, 0, 0)}
_FILE = Template("""/* Fault identification of an electromechanical actuator, written by emafault.
 *
 * void emafault_identify(const float features[$inputs], float faults[6])
 *   of a unit without healthy recordings
 * void emafault_identify_calibrated(const float features[$inputs], const float unit[$own], float faults[6])
 *   of a unit with healthy recordings
 *
 *   features  R of phases a, b, c (ohm), k of a, b, c (V s/rad)$more
 *   unit      $of_unit of the healthy unit at 20 degC, in the same order and units
 *   faults    Na, Nb, Nc, xi_x, xi_y (1), dT (K)
 *
 * C99 with float and fmaf of math.h$log; no other memory than its arguments and at most $stack bytes on the stack.
 * Compile without contraction or reassociation of floating-point expressions (-std=c99, without -ffast-math).
 * The first takes $first, the second
 * $second; constants take $constants bytes.
 */
#include <math.h>

#define INPUTS $inputs
#define OWN $own

/* what features of other units are scaled to */
static const float nominal[OWN] = $nominal;
$activations
static void dense(const float *weights, const float *biases, int inputs, int outputs, const float *x, float *y)
{
    for (int j = 0; j < outputs; j++) {
        float sum = 0.0f;
        for (int i = 0; i < inputs; i++)
            sum = fmaf(x[i], weights[j * inputs + i], sum);
        y[j] = sum + biases[j];
    }
}
$networks
void emafault_identify(const float features[INPUTS], float faults[6])
{
    network_1(features, faults);
}

void emafault_identify_calibrated(const float features[INPUTS], const float unit[OWN], float faults[6])
{
    float x[INPUTS];

    for (int i = 0; i < INPUTS; i++)
        x[i] = i < OWN ? features[i] * (nominal[i] / unit[i]) : features[i];
    network_$of_calibrated(x, faults);
}
""")
_NETWORK = Template("""
static const float feature_mean_$n[INPUTS] = $feature_mean;
static const float feature_scale_$n[INPUTS] = $feature_scale;
static const float fault_mean_$n[6] = $fault_mean;
static const float fault_scale_$n[6] = $fault_scale;
$tables
static void network_$n(const float *features, float *faults)
{
    float x[$widest], y[$widest];

    for (int i = 0; i < INPUTS; i++)
        x[i] = ((i < $logarithms ? logf(features[i]) : features[i]) - feature_mean_$n[i]) / feature_scale_$n[i];
$layers
    for (int j = 0; j < 6; j++)
        faults[j] = y[j] * fault_scale_$n[j] + fault_mean_$n[j];
}
""")


@dataclass(frozen=True)
class Cost:
    """What one identification takes."""

    multiply_adds: int  # fused, those of the activations included
    other_operations: int  # sums, products, divisions
    logarithms: int
    stack: int  # bytes of arrays

    def __str__(self) -> str:
        return (
            f"{self.multiply_adds} multiply-adds, {self.other_operations} other operations and "
            f"{self.logarithms} logarithms"
        )


def cost(network: Network) -> Cost:
    """Operations and bytes of one identification of a unit without healthy recordings."""
    widths = [W.shape for W in network.weights]
    inputs, hidden = widths[0][1] - 1, sum(outputs for outputs, _ in widths[:-1])
    _, fused, products, divisions = _ACTIVATIONS[network.settings.activation]
    biases = sum(outputs for outputs, _ in widths)
    sigmoid = hidden if network.settings.activation == "sigmoid" else 0
    return Cost(
        multiply_adds=sum(o * (i - 1) for o, i in widths) + hidden * fused,
        other_operations=biases + hidden * (products + divisions) + sigmoid + 2 * inputs + 12,
        logarithms=_logarithms(network),
        stack=8 * _widest(network),
    )


def write_c(identifier: Identifier, path: str | Path) -> dict[str, Any]:
    """Write an identifier's networks as C99; where one serves units with and without healthy recordings, once.

    Returns
    -------
    ``identify`` and ``identify_calibrated``: the fields of ``Cost``; ``constants``: bytes in read-only memory

    Raises
    ------
    InputError : an identifier without a network, or a file that cannot be written
    """
    first, second = network_of(identifier), network_of(identifier.calibrated)
    networks = [first] if second is first else [first, second]
    inputs = len(first.scaler.feature_mean)
    nominal = identifier.nominal_unit(inputs)
    own, plain = len(nominal), cost(second)
    calibrated = replace(plain, other_operations=plain.other_operations + 2 * own, stack=plain.stack + 4 * inputs)
    constants = 4 * (own + sum(network.parameters + 2 * inputs + 12 for network in networks))
    used = sorted({network.settings.activation for network in networks})
    text = _FILE.substitute(
        inputs=inputs,
        own=own,
        more={9: ", L of a, b, c (H)", 8: ", measured xi_x, xi_y (1)"}.get(inputs, ""),
        of_unit="R, k and L" if own == 9 else "R and k",
        log=" and logf" if any(map(_logarithms, networks)) else "",
        stack=max(cost(first).stack, calibrated.stack),
        first=cost(first),
        second=calibrated,
        constants=constants,
        nominal=_values(nominal),
        activations="\n".join(_ACTIVATIONS[activation][0] for activation in used),
        networks="".join(_network(n, network) for n, network in enumerate(networks, start=1)),
        of_calibrated=len(networks),
    )
    write_text(path, text)
    return {"identify": asdict(cost(first)), "identify_calibrated": asdict(calibrated), "constants": constants}


_SCALES = ("feature_mean", "feature_scale", "fault_mean", "fault_scale")


def _logarithms(network: Network) -> int:
    return logarithmic(len(network.scaler.feature_mean)) if network.scaler.coordinates == "log" else 0


def _widest(network: Network) -> int:
    return max(len(network.scaler.feature_mean), *(len(W) for W in network.weights))


def _values(values: np.ndarray) -> str:
    """Numbers in float32, exactly, as C99 writes them."""
    words = [f"{float(np.float32(x)).hex()}f" for x in values]
    lines = [", ".join(words[n : n + 6]) for n in range(0, len(words), 6)]
    return "{\n    " + ",\n    ".join(lines) + "}"


def _network(n: int, network: Network) -> str:
    """Tables and function of one network."""
    layers = range(1, len(network.weights) + 1)
    return _NETWORK.substitute(
        n=n,
        widest=_widest(network),
        logarithms=_logarithms(network),
        tables="".join(_table(f"{n}_{layer}", W) for layer, W in zip(layers, network.weights)),
        layers="".join(_layer(n, layer, network) for layer in layers),
        **{name: _values(getattr(network.scaler, name)) for name in _SCALES},
    )


def _table(name: str, W: np.ndarray) -> str:
    flat = W[:, :-1].ravel()
    weights = f"static const float weights_{name}[{flat.size}] = {_values(flat)};\n"
    return f"{weights}static const float biases_{name}[{len(W)}] = {_values(W[:, -1])};\n"


def _layer(n: int, layer: int, network: Network) -> str:
    outputs, inputs = network.weights[layer - 1].shape
    text = f"    dense(weights_{n}_{layer}, biases_{n}_{layer}, {inputs - 1}, {outputs}, x, y);\n"
    if layer == len(network.weights):
        return text
    return text + f"    for (int i = 0; i < {outputs}; i++)\n        x[i] = {network.settings.activation}_of(y[i]);\n"
