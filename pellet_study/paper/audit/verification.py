"""The verification run, its t test, and the time step."""

import numpy as np

from pellet_study.paper.audit.optimum import at_optimum
from pellet_study.paper.judging import validation
from pellet_study.paper.printed import printed_text, tables
from pellet_study.paper.verdicts import DATA_MISSING, Item


def verification() -> list[Item]:
    """The verification run against the target, and its t test."""
    section, text = "Verification", printed_text()
    target, mean, sd = (
        text["repose_angle_physical_deg"],
        text["repose_angle_verification_deg"],
        text["repose_angle_physical_pm"],
    )
    at = {b_reversed: at_optimum(b_reversed)[1] for b_reversed in (True, False)}
    printed, says = f"{text['repose_relative_error_pct']}", "abstract: less than 1 %"
    return [
        validation.relative_error(section, mean, target, printed, half=0.005),
        validation.less_than(section, says, "1", mean, target, printed),
        validation.t_test(section, target - mean, sd, f"{text['t_test_P']}", "deg"),
        validation.interval_around(
            section, target, sd, [found.prediction for found in at.values()], at[True].predicted, "deg"
        ),
    ]


def time_step() -> list[Item]:
    r"""The radius behind the printed Rayleigh step :math:`\pi R \sqrt{\rho/G} / (0.1631\nu + 0.8766)`."""
    text = printed_text()
    poisson, shear_modulus, density = tables()["tables"]["1"]["values"][3:6]
    per_metre = np.pi * np.sqrt(density / shear_modulus) / (0.1631 * poisson + 0.8766)
    radius = 1e3 * text["rayleigh_time_step_s"] / per_metre
    amplification = text["particle_size_amplification"]
    return [
        Item(
            "Time step",
            f"radius of the powder spheres behind {text['rayleigh_time_step_s']:g} s, mm",
            "absent",
            radius,
            None,
            DATA_MISSING,
            f"diameter {2 * radius:.4f} mm amplified, {2000 * radius / amplification:.1f} um before; grid 3 "
            f"R = {3 * radius:.4f} mm; if the step were 20 % of Rayleigh's, the radius would be "
            f"{radius / 0.2:.3f} mm",
        )
    ]
