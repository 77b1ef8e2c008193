"""The verification run, its t test, and the time step."""

from itertools import product

import numpy as np

from pellet_study.paper.audit.optimum import at_optimum
from pellet_study.paper.printed import printed_text, tables
from pellet_study.paper.verdicts import DATA_MISSING, Item, compare, judged


def verification() -> list[Item]:
    """The verification run against the target, and its t test."""
    section, text = "Verification", printed_text()
    target, mean, sd = (
        text["repose_angle_physical_deg"],
        text["repose_angle_verification_deg"],
        text["repose_angle_physical_pm"],
    )
    errors = [
        100 * abs(mean + i * 0.005 - (target + j * 0.005)) / (target + j * 0.005)
        for i, j in product((-1, 0, 1), repeat=2)
    ]
    error = 100 * abs(mean - target) / target
    low, high = target - sd, target + sd
    predictions = [at_optimum(b_reversed)[1].prediction for b_reversed in (True, False)]
    bounds = " and ".join(f"{a:.4f} to {b:.4f}" for a, b in predictions)
    return [
        compare(
            section,
            "relative error, %",
            f"{text['repose_relative_error_pct']}",
            error,
            f"rounding of both means allows {min(errors):.4f} to {max(errors):.4f} %",
            (min(errors), max(errors)),
        ),
        judged(
            section,
            "abstract: less than 1 %",
            "<1",
            error,
            error < 1,
            f"{error:.3f} % from the printed means; below 1 % only if the unrounded means give "
            f"{text['repose_relative_error_pct']} %",
        ),
        _t_test(section, target - mean, sd, text["t_test_P"]),
        judged(
            section,
            f"{target} +- {sd} and the 95 % prediction interval at the optimum",
            f"{low:.2f} to {high:.2f}",
            at_optimum(True)[1].predicted,
            all(a <= low and high <= b for a, b in predictions),
            f"inside {bounds}; an interval {predictions[0][1] - predictions[0][0]:.2f} deg wide "
            f"({100 * (predictions[0][1] - predictions[0][0]) / target:.1f} %): a check with little power",
        ),
    ]


def _t_test(section, difference: float, sd: float, printed: float) -> Item:
    """Every n that the printed means and sd leave open."""
    from scipy.optimize import brentq
    from scipy.special import ndtri, stdtr, stdtrit
    from scipy.stats import ttest_ind_from_stats

    one = {n: float(2 * stdtr(n - 1, -difference / (sd / np.sqrt(n)))) for n in range(2, 31)}
    two = {n: float(2 * stdtr(2 * n - 2, -difference / (sd * np.sqrt(2 / n)))) for n in range(2, 31)}
    needed_n = (-ndtri(printed / 2) * sd / difference) ** 2
    n = 5
    needed_difference = -stdtrit(2 * n - 2, printed / 2) * sd * np.sqrt(2 / n)
    needed_sd = brentq(
        lambda other: ttest_ind_from_stats(difference, sd, n, 0, other, n, equal_var=False).pvalue - printed,
        sd,
        1000,
    )
    reverse = min(one, key=lambda k: abs(1 - one[k] - printed))
    possible = max(max(one.values()), max(two.values())) >= printed
    return judged(
        section,
        "P of the t test",
        f"{printed}",
        max(one.values()),
        possible,
        f"cannot come from the printed means and sd: the largest P of any n >= 2 is {max(one.values()):.4f} "
        f"(one sample) or {max(two.values()):.4f} (two samples); {printed} needs n = {needed_n:.3f} (normal "
        f"limit), a simulation sd of {needed_sd:.1f} deg or a difference of {needed_difference:.4f} deg (n "
        f"= {n} each); 1 - P comes near at n = {reverse} ({1 - one[reverse]:.4f}), so 1 - P may have been "
        "printed; n and sd of the simulation are not given",
        max(one.values()) - printed,
    )


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
