"""Quantities that histories can record for each kind of object, with units; the language reads this table too."""

from __future__ import annotations

from hpcdem.physics.fdem import groups as g
from hpcdem.physics.fields import kinds

MODEL, WELL = "model", "well"
LAW_STATE = "law_state"
"""Value of a history of a state variable of user laws, see user_laws.py; the quantity of the history has the name of
the variable."""
UNITS: dict[str, dict[str, str]] = {
    g.NODE: {
        "displacement": "m", "velocity": "m/s",
        "position_x": "m", "position_y": "m", "position_z": "m", "displacement_x": "m", "displacement_y": "m",
        "displacement_z": "m", "velocity_x": "m/s", "velocity_y": "m/s", "velocity_z": "m/s", "reaction_x": "N/m",
        "reaction_y": "N/m", "reaction_z": "N/m", "temperature": "K",
        **{one.name: one.unit for one in kinds().values()},
    },
    g.ELEMENT: {
        "stress_xx": "Pa", "stress_yy": "Pa", "stress_xy": "Pa", "stress_zz": "Pa", "stress_xz": "Pa",
        "stress_yz": "Pa", "plastic_state": "1",
        "plastic_shear_strain": "1", "plastic_volume_strain": "1", "plastic_work": "J/m", "creep_strain_xx": "1",
        "creep_strain_yy": "1", "creep_strain_xy": "1", "kelvin_strain_xx": "1", "kelvin_strain_yy": "1",
        "kelvin_strain_xy": "1", "creep_strain_zz": "1", "creep_strain_xz": "1", "creep_strain_yz": "1",
        "kelvin_strain_zz": "1", "kelvin_strain_xz": "1", "kelvin_strain_yz": "1", "creep_work": "J/m",
        "mean_temperature": "K", **{f"mean_{one.name}": one.unit for one in kinds().values()},
        **{name: unit for one in kinds().values() for name, (unit, _) in one.derived.items()},
        LAW_STATE: "that of the law",
    },
    g.JOINT: {
        "opening": "m", "slip": "m", "damage": "1", "normal_stress": "Pa", "shear_stress": "Pa", "state": "1",
        "normal_stress_largest": "Pa", "normal_stress_first": "Pa", "normal_stress_middle": "Pa",
        "normal_stress_last": "Pa", "shear_stress_largest": "Pa", "shear_stress_first": "Pa",
        "shear_stress_middle": "Pa", "shear_stress_last": "Pa",
    },
    g.BOLT_NODE: {
        "position_x": "m", "position_y": "m", "position_z": "m", "displacement_x": "m", "displacement_y": "m",
        "displacement_z": "m", "velocity_x": "m/s", "velocity_y": "m/s", "velocity_z": "m/s", "bond_force": "N/m",
        "slip": "m", "bond_state": "1", "reaction_x": "N", "reaction_y": "N", "reaction_z": "N", "host": "1",
        "distance": "m",
    },
    g.BOLT_ELEMENT: {"axial_force": "N", "axial_strain": "1", "plastic_strain": "1", "bolt_state": "1"},
    g.FLOW_NODE: {"pressure": "Pa", "saturation": "1", "fluid": "m2", "volume": "m2", "inflow": "m2/s",
                  "temperature": "K", "concentration": "1", "proppant": "m2", "pack_pressure": "Pa"},
    g.CHANNEL: {"pressure": "Pa", "saturation": "1", "aperture": "m", "flow_rate": "m2/s", "velocity": "m/s",
                     "temperature": "K", "concentration": "1", "pack_pressure": "Pa"},
    WELL: {"pressure": "Pa", "rate": "m2/s", "injected": "m2", "stage": "1"},
    g.LINER_NODE: {
        "position_x": "m", "position_y": "m", "position_z": "m", "displacement_x": "m", "displacement_y": "m",
        "displacement_z": "m", "velocity_x": "m/s", "velocity_y": "m/s", "velocity_z": "m/s", "rotation": "rad",
        "rotation_x": "rad", "rotation_y": "rad", "rotation_z": "rad", "spin": "rad/s", "spin_x": "rad/s",
        "spin_y": "rad/s", "spin_z": "rad/s", "reaction_x": "N/m", "reaction_y": "N/m", "reaction_z": "N/m",
        "reaction_moment": "N m/m", "reaction_moment_x": "N m/m", "reaction_moment_y": "N m/m",
        "reaction_moment_z": "N m/m", "distance": "m",
    },
    g.LINER_ELEMENT: {
        "axial_force": "N/m", "shear_force": "N/m", "moment_first": "N m/m", "moment_last": "N m/m",
        **{f"{name}_{part}": unit for name, unit in (("membrane", "N/m"), ("bending", "N m/m"))
           for part in ("largest", "smallest", "xx", "yy", "xy", "zz", "xz", "yz")},
        "transverse_shear": "N/m",
        "axial_strain": "1", "plastic_strain": "1", "plastic_rotation": "rad", "plastic_curvature": "1/m",
        "liner_state": "1",
        "bond_pressure": "Pa", "bond_shear": "Pa", "gap": "m", "slip": "m", "bond_state": "1", "host": "1",
    },
    MODEL: {
        "time": "s", "creep_time": "s", "cycle": "1", "ratio": "1", "intact_joints": "1", "yielded_joints": "1",
        "broken_joints": "1",
        "kinetic_energy": "J/m", "strain_energy": "J/m", "joint_energy": "J/m", "joint_loss": "J/m",
        "contact_energy": "J/m", "viscous_loss": "J/m", "plastic_loss": "J/m", "creep_loss": "J/m",
        "gravity_work": "J/m", "outside_work": "J/m", "disc_work": "J/m", "bolt_work": "J/m", "liner_work": "J/m",
        "heat_work": "J/m", "energy_error": "J/m",
        "flow_time": "s", "fluid_given": "m2", "fluid_stored": "m2", "fluid_leaked": "m2",
        "proppant_came": "m2", "proppant_stored": "m2", "proppant_packed": "m2", "proppant_left": "m2",
        "heat_time": "s", "heat_given": "J/m", "heat_stored": "J/m", "heat_in_fluid": "J/m",
        **{f"{one.name}_time": "s" for one in kinds().values()},
        **{f"{one.name}_{part}": one.amount for one in kinds().values() for part in ("given", "stored")},
    },
}  # fmt: skip
