"""What a run does most of the time: two phases conduct and the comparator switches them; and the search for events.

Such stretches of several runs are followed side by side, each in a *lane* of its own: the processor does for eight
lanes in one instruction what would else keep it waiting for one result after the other. Lanes know nothing of each
other.
"""

from ..compiled import compiled, compiled_inline

NEVER = 1.0e30
LARGEST_CHANGE = 0.2  # of a saturating inductance, or of a current by its own decay, within a segment
MAX_SEGMENT = 5.0e-5  # s; short against L/R, so that four terms are enough
CURRENT_TOLERANCE = 1.0e-9  # A
BUS_FILTER = 1.0e-3  # s
NEAR = 1.0e-4  # of the time to a trip, that a step of Newton may move it by and the next one to leave it exact


LANES = 8
ROWS = 37
#: where the rows of the lanes' table begin, a number per lane each. What goes on: current (A), speed (rad/s), +1 or -1
#: for a pair on +V or -V, time gone (s), angle gone (rad), integral of the current (A s), 1 while the lane goes on;
#: the current behind the bus's filter (A), integrals of the current's square (A2 s) and of the supply (V s)
(I, SPEED, SIGN, TIME, ANGLE, AREA, LIVE, BUS_CURRENT, SQUARE, BUS_AREA) = range(0, 10 * LANES, LANES)
#: what stays: how far to go (s); the current at which the comparator switches up and down (A); supply (V), resistance
#: (ohm), 1/inductance (1/H) of the loop without current, s of L/(1 + s i^2) (1/A2) and resistance of the bus (ohm); the
#: loop's back-EMF coefficient (V s/rad) and the torque against the motion, of load and, in motion, friction (N m), each
#: with two derivatives by the angle; the torque by speed (N m s/rad); 1/inertia (1/(kg m2), 0 at rest); direction of
#: motion or 0; the torque that friction holds at rest in either direction (N m); edges of the cell from where the rotor
#: is (rad)
(DURATION, TOP, BOTTOM, SUPPLY, RESISTANCE, INVERSE_L, SATURATION, BUS_RESISTANCE, BACK_EMF, SLOPE, CURVATURE, TORQUE,
 STIFFNESS, BEND, VISCOUS, INVERSE_INERTIA, MOVING, LIMIT_FORWARD, LIMIT_BACKWARD, LOWER,
 UPPER) = range(10 * LANES, 31 * LANES, LANES)  # fmt: skip
#: of a comparator trip that the reversed series misses: the time before which it comes (s, else 0) and its polynomial,
#: the first of whose coefficients gives way to its root (s), which is nil where it is not known
(MISSED, C0, C1, C2, C3, C4) = range(31 * LANES, 37 * LANES, LANES)
TRIP = C0


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


def _segment_of(extras: bool):
    """One segment of every lane; extras are a saturating inductance, a bus that gives way and the square's integral.

    A lane without them comes out the same by either, bit for bit.
    """

    @compiled_inline
    def segment(x, lanes):
        # without branches, conditional loads or stores: only then the compiler puts the lanes into one instruction
        for n in range(lanes):
            i, w, sign, t, gone, live = x[I + n], x[SPEED + n], x[SIGN + n], x[TIME + n], x[ANGLE + n], x[LIVE + n]
            R, gamma = x[RESISTANCE + n], x[INVERSE_L + n]
            viscous, inverse_inertia = x[VISCOUS + n], x[INVERSE_INERTIA + n]
            dK, ddK, dT, ddT = x[SLOPE + n], x[CURVATURE + n], x[STIFFNESS + n], x[BEND + n]
            duration, top, bottom = x[DURATION + n], x[TOP + n], x[BOTTOM + n]
            moving, trip = x[MOVING + n], x[TRIP + n]
            h = duration - t
            last = h <= MAX_SEGMENT
            h = h if last else MAX_SEGMENT
            K, slope = (x[BACK_EMF + n] + gone * dK) + (0.5 * ddK) * (gone * gone), dK + gone * ddK
            torque, stiffness = (x[TORQUE + n] + gone * dT) + (0.5 * ddT) * (gone * gone), dT + gone * ddT
            supply = x[SUPPLY + n]
            if extras:
                bus = x[BUS_CURRENT + n]
                supply -= x[BUS_RESISTANCE + n] * bus
            u0 = (sign * supply - R * i) - K * w
            if extras:
                s, inverse_L = x[SATURATION + n], gamma
                gamma = inverse_L * (1.0 + s * i * i)
            y1 = u0 * gamma
            a = (K * i - viscous * w - torque) * inverse_inertia
            b = ((w * (slope * i - stiffness) - viscous * a) + K * y1) * inverse_inertia
            u1 = (-slope * w * w - K * a) - R * y1
            y2 = u1 * gamma
            if extras:
                rate = 2.0 * s * inverse_L * i * y1
                y2 += rate * u0
                change, decay = 2.0 * s * i * y1 / (1.0 + s * i * i), R * gamma
                change = change if change > 0.0 else -change
                fastest = decay if decay > change else change
                long = h * fastest > LARGEST_CHANGE
                h, last = LARGEST_CHANGE / fastest if long else h, last & (not long)
            c = K * y2 + slope * (2.0 * w * y1 + a * i) - stiffness * a - ddT * w * w - viscous * b
            c *= inverse_inertia
            u2 = (-3.0 * slope * w * a - R * y2) - K * b
            y3 = u2 * gamma
            if extras:
                y3 += 2.0 * rate * u1 + 2.0 * s * inverse_L * (y1 * y1 + i * y2) * u0
            y4 = -R * y3 * gamma
            y2, y3, y4 = y2 / 2.0, y3 / 6.0, y4 / 24.0
            a_2, b_2, b_6, c_6, c_24 = 0.5 * a, 0.5 * b, b / 6.0, c / 6.0, c / 24.0
            goal = top if sign > 0.0 else bottom
            off = i - goal
            end = i + h * (y1 + h * (y2 + h * (y3 + h * y4)))
            tripped = off * (end - goal) < 0.0
            # the time of a trip by the reversed series and two steps of Newton, the second of which leaves less than
            # rounding unless the current turns round
            inverse = 1.0 / y1
            u, q, r = -off * inverse, y2 * inverse, y3 * inverse
            u *= 1.0 - u * (q - u * (2.0 * q * q - r))
            square = u * u
            per = inverse * ((1.0 - 2.0 * q * u) + (4.0 * q * q - 3.0 * r) * square)
            step = ((off + u * y1) + square * ((y2 + u * y3) + square * y4)) * per
            u -= step
            square = u * u
            u -= ((off + u * y1) + square * ((y2 + u * y3) + square * y4)) * per
            step = step if step > 0.0 else -step
            missed = tripped & (not ((step <= NEAR * u) & (u <= h))) & (trip == 0.0) & (live != 0.0)
            u = trip if trip != 0.0 else u
            x[C0 + n], x[C1 + n], x[C2 + n], x[C3 + n], x[C4 + n] = off if missed else 0.0, y1, y2, y3, y4
            x[MISSED + n] = h if missed else 0.0
            h, end = u if tripped else h, goal if tripped else end
            square = h * h
            faster = (w + h * a) + square * (b_2 + h * c_6)
            turned = (gone + h * w) + square * ((a_2 + h * b_6) + square * c_24)
            before, after = K * i, K * end
            most, least = before if before > after else after, after if before > after else before
            away = (moving * faster <= 0.0) | (turned >= x[UPPER + n]) | (turned <= x[LOWER + n])
            loose = (most - torque > x[LIMIT_FORWARD + n]) | (torque - least > x[LIMIT_BACKWARD + n])
            over = (away & (moving != 0.0)) | (loose & (moving == 0.0))
            goes = (live != 0.0) & (not missed) & (not over)
            done = last & (not tripped)
            area = x[AREA + n]
            mean = i + h * (y1 * 0.5 + h * (y2 / 3.0 + h * (y3 * 0.25 + h * y4 * 0.2)))
            more = area + h * mean
            if extras:
                middle, share = 1.5 * mean - 0.25 * (i + end), h / BUS_FILTER
                squares, supplies = x[SQUARE + n], x[BUS_AREA + n]
                square_now = squares + h * (i * i + 4.0 * middle * middle + end * end) / 6.0
                # 1 - exp(-share), of a share that is a twentieth at most
                share *= 1.0 - share / 2.0 * (1.0 - share / 3.0 * (1.0 - share / 4.0 * (1.0 - share / 5.0)))
                bus_now, supply_now = bus + (sign * mean - bus) * share, supplies + h * supply
                x[SQUARE + n], x[BUS_AREA + n] = square_now if goes else squares, supply_now if goes else supplies
                x[BUS_CURRENT + n] = bus_now if goes else bus
            later = duration if done else t + h
            x[AREA + n], x[I + n], x[SPEED + n] = more if goes else area, end if goes else i, faster if goes else w
            x[ANGLE + n], x[TIME + n] = turned if goes else gone, later if goes else t
            x[SIGN + n] = -sign if goes & tripped else sign
            x[LIVE + n] = live if missed | (goes & (not done)) else 0.0

    return segment


_segment, _whole_segment = _segment_of(False), _segment_of(True)


@compiled_inline
def conduct(x, lanes, extras):
    """Two phases in series on the supply, switched by the comparator, in every lane until something else happens.

    Of ``run_batch`` this is what a run does most of the time, without the terms that are zero then. A lane ends at its
    ``DURATION``, or before it where the next segment would leave the cell, come to rest or break away.

    Parameters
    ----------
    x : (ROWS * LANES,) the lanes' table; ``LIVE`` is 1 for those that take part and 0 afterwards
    lanes : so many of its lanes are looked at
    extras : whether any of the lanes has some (see ``_segment_of``)
    """
    while True:
        if extras:
            _whole_segment(x, lanes)
        else:
            _segment(x, lanes)
        going = False
        for n in range(lanes):
            if x[LIVE + n] != 0.0:
                going = True
            if x[MISSED + n] != 0.0:
                x[TRIP + n] = crossing(x[C0 + n], x[C1 + n], x[C2 + n], x[C3 + n], x[C4 + n], x[MISSED + n])
        if not going:
            return
