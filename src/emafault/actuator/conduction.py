"""What a run does most of the time: two phases conduct and the comparator switches them; and the search for events."""

from .compiled import compiled

NEVER = 1.0e30
LARGEST_CHANGE = 0.2  # of a saturating inductance, or of a current by its own decay, within a segment
MAX_SEGMENT = 5.0e-5  # s; short against L/R, so that four terms are enough
CURRENT_TOLERANCE = 1.0e-9  # A


@compiled
def crossing(c0, c1, c2, c3, c4, h):
    """First t in (0, h] at which c0 + c1 t + c2 t^2 + c3 t^3 + c4 t^4 changes sign; NEVER if it does not by t = h."""
    end = c0 + h * (c1 + h * (c2 + h * (c3 + h * c4)))
    if c0 == 0.0 or c0 * end > 0.0:
        return NEVER
    t = h
    if c1 != 0.0:
        t = -c0 / c1
        t *= 1.0 - c2 * t / c1
    for _ in range(6):
        if not 0.0 <= t <= h:
            break
        value = c0 + t * (c1 + t * (c2 + t * (c3 + t * c4)))
        slope = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * 4.0 * c4))
        if slope == 0.0:
            break
        step = value / slope
        t -= step
        if abs(step) <= 1e-7 * t:  # quadratic convergence: what remains is below rounding
            if 0.0 < t <= h:
                return t
            break
    low, high = 0.0, h
    for _ in range(60):
        t = 0.5 * (low + high)
        if c0 * (c0 + t * (c1 + t * (c2 + t * (c3 + t * c4)))) > 0.0:
            low = t
        else:
            high = t
    return high


@compiled
def passing(beyond, direction, c1, c2, c3, h):
    """Time in [0, h] at which a motion in ``direction`` (+1, -1) passes a bound, ``beyond`` + c1 t + c2 t^2 + c3 t^3
    being how far it is past it; at once where rounding has put it there before its event.
    """
    if beyond * direction >= 0.0 and c1 * direction > 0.0:
        return 0.0
    return crossing(beyond, c1, c2, c3, 0.0, h)


@compiled
def conduct_pair(
    i, w, high, duration, centre, band, V, R, inverse_L, saturation, back_emf, load, viscous, inverse_inertia, moving,
    limit_forward, limit_backward, lower, upper,
):  # fmt: skip
    """Two phases in series on the supply, switched by the comparator, until something else happens.

    Of ``run_actuator`` this is what a run does most of the time, without the terms that are zero then.

    Parameters
    ----------
    i, w, high : current (A), speed (rad/s), whether the pair is on +V
    duration : how far to go (s)
    centre, band : of the comparator, in terms of the current (A)
    V, R, inverse_L : supply (V), resistance (ohm) and 1/inductance (1/H) of the loop without current
    saturation : s of the inductance L/(1 + s i^2) (1/A2)
    back_emf : coefficient of the loop (V s/rad) and its two derivatives by the angle
    load : torque against the motion (N m), of load and, in motion, friction, and its two derivatives by the angle
    viscous : the same by speed (N m s/rad)
    inverse_inertia : 1/(kg m2), 0 at rest
    moving : direction of motion or 0
    limit_forward, limit_backward : torque that friction holds at rest (N m)
    lower, upper : edges of the cell from where the rotor is (rad)

    Returns
    -------
    number of segments, time gone (s; less than ``duration`` where the next segment would leave the cell, come to
    rest or break away), current, speed, angle gone (rad), integral of the current (A s), whether the pair is on +V
    """
    t, area, gone, segments = 0.0, 0.0, 0.0, 0
    K_0, dK, ddK = back_emf
    T_0, dT, ddT = load
    top, bottom = centre + band, centre - band
    if high and i >= top - CURRENT_TOLERANCE:
        high = False
    elif not high and i <= bottom + CURRENT_TOLERANCE:
        high = True
    while True:
        h = duration - t
        last = h <= MAX_SEGMENT
        if not last:
            h = MAX_SEGMENT
        K, slope = (K_0 + gone * dK) + (0.5 * ddK) * (gone * gone), dK + gone * ddK
        torque, stiffness = (T_0 + gone * dT) + (0.5 * ddT) * (gone * gone), dT + gone * ddT
        u0, gamma = ((V if high else -V) - R * i) - K * w, inverse_L
        if saturation != 0.0:
            gamma *= 1.0 + saturation * i * i
        y1 = u0 * gamma
        a = (K * i - viscous * w - torque) * inverse_inertia
        b = ((w * (slope * i - stiffness) - viscous * a) + K * y1) * inverse_inertia
        u1 = (-slope * w * w - K * a) - R * y1
        y2 = u1 * gamma
        if saturation != 0.0:
            rate = 2.0 * saturation * inverse_L * i * y1
            y2 += rate * u0
            fastest = max(R * gamma, 2.0 * saturation * abs(i * y1) / (1.0 + saturation * i * i))
            if h * fastest > LARGEST_CHANGE:
                h, last = LARGEST_CHANGE / fastest, False
        c = (K * y2 + slope * (2.0 * w * y1 + a * i) - stiffness * a - ddT * w * w - viscous * b) * inverse_inertia
        u2 = (-3.0 * slope * w * a - R * y2) - K * b
        y3 = u2 * gamma
        if saturation != 0.0:
            y3 += 2.0 * rate * u1 + 2.0 * saturation * inverse_L * (y1 * y1 + i * y2) * u0
        y4 = -R * y3 * gamma
        y2, y3, y4 = y2 / 2.0, y3 / 6.0, y4 / 24.0
        a_2, b_2, b_6, c_6, c_24 = 0.5 * a, 0.5 * b, b / 6.0, c / 6.0, c / 24.0
        goal = top if high else bottom
        off = i - goal
        end = i + h * (y1 + h * (y2 + h * (y3 + h * y4)))
        tripped = off * (end - goal) < 0.0
        # a processor waits for one result after the other here: pairs of terms make the way to the next segment short
        if tripped:
            inverse = 1.0 / y1
            u, q, r = -off * inverse, y2 * inverse, y3 * inverse
            u *= 1.0 - u * (q - u * (2.0 * q * q - r))
            square = u * u
            missed = (off + u * y1) + square * ((y2 + u * y3) + square * y4)
            step = missed * (inverse * ((1.0 - 2.0 * q * u) + (4.0 * q * q - 3.0 * r) * square))
            u -= step
            # one step of Newton from the reversed series leaves less than rounding, but where the current turns round
            if not (abs(step) <= 1e-5 * u and u <= h):
                u = crossing(off, y1, y2, y3, y4, h)
            h, end = u, goal
        square = h * h
        faster = (w + h * a) + square * (b_2 + h * c_6)
        turned = (gone + h * w) + square * ((a_2 + h * b_6) + square * c_24)
        if moving != 0:
            if moving * faster <= 0.0 or turned >= upper or turned <= lower:
                return segments, t, i, w, gone, area, high
        elif max(K * i, K * end) - torque > limit_forward or torque - min(K * i, K * end) > limit_backward:
            return segments, t, i, w, gone, area, high
        area += h * (i + h * (y1 * 0.5 + h * (y2 / 3.0 + h * (y3 * 0.25 + h * y4 * 0.2))))
        i = end
        w, gone = faster, turned
        segments += 1
        if tripped:
            high = not high
        elif last:
            return segments, duration, i, w, gone, area, high
        t += h
