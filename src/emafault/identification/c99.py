"""A network as one file of plain C99 for an actuator's controller: no dynamic memory, no state, float32.

Every operation is in the order and precision of ONNX Runtime on a processor with fused multiply-add: products are
summed one after the other, the bias last, and tanh and sigmoid are its rational functions (MLAS, tanh.cpp and
logistic.cpp), so that results are the same bits. Logarithms are the C library's: those of ONNX Runtime depend on where
in a batch a value stands, by up to 3 units in the last place.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from string import Template

import numpy as np

from ..io.atomic import write_text
from .network import Network, logarithmic

_TANH = """static float activation(float v)
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
_SIGMOID = """static float activation(float v)
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
_RELU = """static float activation(float v)
{
    return v > 0.0f ? v : 0.0f;
}
"""
#: activation -> its C, and how many fused multiply-adds, products and divisions one takes
_ACTIVATIONS = {"tanh": (_TANH, 9, 2, 1), "sigmoid": (_SIGMOID, 9, 2, 1), "relu": (_RELU, 0, 0, 0)}
_FILE = Template("""/* Fault identification of an electromechanical actuator, written by emafault.
 *
 * void emafault_identify(const float features[$inputs], float faults[6])
 *   features  R of phases a, b, c (ohm), k of a, b, c (V s/rad)$more
 *   faults    Na, Nb, Nc, xi_x, xi_y (1), dT (K)
 *
 * C99 with float and fmaf of math.h$log; no other memory than its arguments and $stack bytes on the stack. Compile
 * without contraction or reassociation of floating-point expressions (-std=c99, without -ffast-math). $operations
 */
#include <math.h>

#define INPUTS $inputs
#define LOGARITHMS $logarithms
#define WIDEST $widest

static const float feature_mean[INPUTS] = $feature_mean;
static const float feature_scale[INPUTS] = $feature_scale;
static const float fault_mean[6] = $fault_mean;
static const float fault_scale[6] = $fault_scale;
$tables
$activation
static void dense(const float *weights, const float *biases, int inputs, int outputs, const float *x, float *y)
{
    for (int j = 0; j < outputs; j++) {
        float sum = 0.0f;
        for (int i = 0; i < inputs; i++)
            sum = fmaf(x[i], weights[j * inputs + i], sum);
        y[j] = sum + biases[j];
    }
}

void emafault_identify(const float features[INPUTS], float faults[6])
{
    float x[WIDEST], y[WIDEST];

    for (int i = 0; i < INPUTS; i++)
        x[i] = ((i < LOGARITHMS ? logf(features[i]) : features[i]) - feature_mean[i]) / feature_scale[i];
$layers
    for (int j = 0; j < 6; j++)
        faults[j] = y[j] * fault_scale[j] + fault_mean[j];
}
""")


@dataclass(frozen=True)
class Cost:
    """What one identification takes, and what is kept of the network."""

    multiply_adds: int  # fused, those of the activations included
    other_operations: int  # sums, products, divisions
    logarithms: int
    constants: int  # bytes, in read-only memory
    stack: int  # bytes of arrays


def cost(network: Network) -> Cost:
    """Operations and bytes of one identification."""
    widths = [W.shape for W in network.weights]
    inputs, hidden = widths[0][1] - 1, sum(outputs for outputs, _ in widths[:-1])
    _, fused, products, divisions = _ACTIVATIONS[network.settings.activation]
    biases = sum(outputs for outputs, _ in widths)
    sigmoid = hidden if network.settings.activation == "sigmoid" else 0
    return Cost(
        multiply_adds=sum(o * (i - 1) for o, i in widths) + hidden * fused,
        other_operations=biases + hidden * (products + divisions) + sigmoid + 2 * inputs + 12,
        logarithms=_logarithms(network),
        constants=4 * (network.parameters + 2 * inputs + 12),
        stack=8 * _widest(network),
    )


def write_c(network: Network, path: str | Path) -> dict[str, int]:
    """Write the network as C99.

    Returns
    -------
    the fields of ``Cost``

    Raises
    ------
    InputError : the file cannot be written
    """
    taken, scaler = cost(network), network.scaler
    inputs = len(scaler.feature_mean)
    text = _FILE.substitute(
        inputs=inputs,
        more={9: ", L of a, b, c (H)", 8: ", measured xi_x, xi_y (1)"}.get(inputs, ""),
        log=" and logf" if taken.logarithms else "",
        stack=taken.stack,
        operations=f"One call takes\n * {taken.multiply_adds} multiply-adds, {taken.other_operations} other operations "
        f"and {taken.logarithms} logarithms; constants take {taken.constants} bytes.",
        logarithms=taken.logarithms,
        widest=_widest(network),
        tables="".join(_table(n, W) for n, W in enumerate(network.weights, start=1)),
        activation=_ACTIVATIONS[network.settings.activation][0],
        layers="".join(_layer(n, W.shape, len(network.weights)) for n, W in enumerate(network.weights, start=1)),
        **{name: _values(getattr(scaler, name)) for name in _SCALES},
    )
    write_text(path, text)
    return asdict(taken)


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


def _table(n: int, W: np.ndarray) -> str:
    flat = W[:, :-1].ravel()
    weights = f"static const float weights_{n}[{flat.size}] = {_values(flat)};\n"
    return f"{weights}static const float biases_{n}[{len(W)}] = {_values(W[:, -1])};\n"


def _layer(n: int, shape: tuple[int, ...], last: int) -> str:
    outputs, inputs = shape[0], shape[1] - 1
    text = f"    dense(weights_{n}, biases_{n}, {inputs}, {outputs}, x, y);\n"
    return text + (f"    for (int i = 0; i < {outputs}; i++)\n        x[i] = activation(y[i]);\n" if n < last else "")
