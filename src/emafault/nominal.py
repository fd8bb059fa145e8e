"""The nominal actuator: what its parameters are, for its simulation and for the catalogue of what it leaves out."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ActuatorParameters:
    """The nominal actuator (SI; angles in rad, mechanical unless called electrical); numbers live in conf/actuator."""

    bus_voltage: float  # V
    resistance: float  # ohm per phase at the reference temperature
    inductance: float  # H per phase
    back_emf: float  # V s/rad per phase
    pole_pairs: int
    inertia: float  # kg m2 at the motor
    viscous_friction: float  # N m s/rad at the motor
    coulomb_friction: float  # N m at the motor
    static_over_coulomb: float
    gear_ratio: float  # motor over output
    backlash: float  # rad at the output, total play
    end_stop: float  # rad at the output, either side
    current_limit: float  # A
    speed_limit: float  # rad/s at the motor
    position_gain: float  # 1/s
    speed_gain: float  # A s/rad
    speed_integral_gain: float  # A/rad
    hysteresis: float  # A, half band
    switch_resistance: float  # ohm
    diode_voltage: float  # V
    copper_coefficient: float  # 1/K
    reference_temperature: float  # degC
    control_period: float  # s
