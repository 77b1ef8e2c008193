"""What the keys of answers about simulations, photographs and files mean."""

from nested import within  # beside this file

BENCH = {
    "stages": "the calibrations, one after the other",
    "stages[].rig": "the test",
    "stages[].parameter": "what is calibrated",
    "stages[].value": "at which the parabola meets the reading; null where it does not",
    "stages[].interval": "of it, 95 % by inverse prediction; an end is null where it has none",
    "stages[].r2": "of the parabola",
    "stages[].coefficients": "of 1, x, x^2",
    "stages[].coefficient_intervals": "[low, high] of each, 95 %",
    "stages[].observable": "what is read",
    "stages[].measured": "the reading",
    "stages[].verification": "mean of new simulations at `value`",
    "stages[].verification_standard_error": "of this mean",
    "stages[].verification_error_percent": "100 |verification - measured|/measured",
    "stages[].joint_prediction": "the observable with all parameters at their values; null where a stage has none",
    "assumed": "{condition or parameter: default} of what no file of the study gives",
}
SCREENING = {
    "factors": "that go on",
    "clear": "those beyond two standard errors",
    "coefficients": "{factor: deg per coded unit}",
    "curvature_deg": "of the centre points",
    "curvature_standard_error_deg": "of this",
    "scatter_deg": "of heaps at one point",
}
CLIMB = {
    "factors": "of the path",
    "reached": "does the path meet the target?",
    "centre": "{factor: level} where it does, else the nearest point",
    "box": "{factor: [low, high]} around it",
    "moves": "of the box so far",
}
SURFACE = {
    "box": "{factor: [low, high]} that counts",
    "boxes": "every box that was run: {factor: [low, high]}",
    "chosen_box": "its number in `boxes`",
    "coefficients": "{term: deg per coded unit}",
    "standard_errors": "{term: standard error}",
    "r2": "of the surface",
    "r2_adjusted": "corrected for the number of terms",
    "r2_predicted": "1 - PRESS/SST",
    "r2_predicted_ceiling": "the most that the scatter of heaps at one point leaves of it, 1 - n s2/SST; null without replicates",
    "lack_of_fit_p": "against replicates",
    "reachable": "does the surface take the target in the box?",
    "box_runs": "heaps in that box",
}
OPTIMUM = {
    "point": "{factor: level} recommended, physical",
    "factors": "that were varied on the surface",
    "outside": "{factor: how it lies outside of the range in study.toml}",
    "predicted_deg": "angle there",
    "prediction_standard_error_deg": "of this",
    "reachable": "does the surface take the target in the box?",
    "rule": "how the point was picked",
    "fraction_of_box": "share of the box that meets the target as well",
    "lowest": "predicted angle in the box, deg",
    "highest": "predicted angle in the box, deg",
    "unidentified": "factors that the target leaves free",
    "extents": "{factor: [low, high]} of the settings that meet the target",
    "bond_number": "pull-off force over weight of a grain",
    "box": "{factor: [low, high]} of the surface",
    "joint": "what all readings tell of the factors; null in files of release 0.1",
    "joint.readings": "each that was measured: `observable`, `measured` (mean), `sd`, `n`, `freedom` (of the sd), `standard_error` (of the "
    "mean, wider where the sd is of few), `predicted` and `predicted_standard_error` (at `point`), `lowest` and `highest` (in the "
    "box), `nearest` (the value there nearest to it), `out_of_reach` (beyond the scatter)",
    "joint.known": "of each factor `low` and `high` (95 % interval), `share_of_range`, `word` (identified, narrowed, not identified), "
    "`at_end` (ends of the box at which it ends)",
    "joint.varied": "factors that are not on the surface, each anywhere in its range",
    "joint.share_of_box": "of the smallest region that holds 95 % of the posterior",
    "joint.share_of_box_first": "of the first reading alone",
    "joint.distance": "least squared distance of the readings from the surfaces, in units of their scatter",
    "joint.distance_p": "its p; below 0.01 the readings contradict each other",
    "joint.doubtful": "the one reading without which the others do not contradict each other, where all do; else null",
    "joint.gains": "further readings, best first: `observable`, `n`, `sd`, `share_of_box` that would be left on average",
    "joint.heaps": "of the surfaces",
}
ATTEMPT = {
    "mean_deg": "of the heaps",
    "sd_deg": "of one heap",
    "standard_error_deg": "of the mean",
    "interval_deg": "[low, high] of mean less measured, as the equivalence test takes it",
    "heaps": "that were run",
    "lost": "that gave no angle",
    "measured_deg": "the angle to be met",
    "error_percent": "100 (mean - measured)/measured",
    "error_interval_percent": "[low, high] of it, 95 %",
    "margin_deg": "within which it counts as met, declared before",
    "p_tost": "of the two one-sided tests",
    "equivalent": "shown to be within the margin?",
    "p_difference": "of the t test; a large one is no proof of equality",
    "attainable": "could enough heaps show equivalence at all, the measured angle being known as it is?",
    "point": "{factor: level} of the heaps",
    "factors": OPTIMUM["factors"],
    "outside": OPTIMUM["outside"],
    "bond_number": OPTIMUM["bond_number"],
    "others": "the other readings that were measured: `observable`, `mean`, `standard_error`, `measured`, `margin`, `p_tost`, "
    "`equivalent`, `p_difference`, `attainable`",
}
VALIDATION = {
    **ATTEMPT,
    "attempts": "all of them, the last of which counts",
    "nothing_nearer": "true where the box left no correction",
}
OF_STAGES = {
    "heaps": "that the stage ran",
    "lost": "that gave no angle",
    "repeats": "heaps at a point",
}
PLAN = {
    "contact_law": "of the heaps",
    "plan": "what it was made for: a decision is used for nothing else",
    "plan.factors": "{factor: [low, high]} of study.toml",
    "plan.fixed": "{parameter: value} of study.toml",
    "plan.conditions": "{condition: value} of the heaps",
    "plan.numerics": "{setting: value} of the heaps",
    "plan.observable": "which angle was measured",
    "plan.target_deg": "the measured angle",
    "plan.sd_deg": "of one reading of it",
    "plan.n": "readings in it",
    "plan.others": "{observable: [mean, sd, n]} of the other readings",
}


FEW = {
    "place": "of the setting on the path, 0 at its start",
    "wanted_error_deg": "standard error with which the interval of the angle lies within the margin",
    "enough": "does it?",
    "slope_deg": "of the line along the path",
    "met": "false where the path ends before the target",
    "path_heaps": "on the path",
    "path_lost": "of these without an angle",
    "needed_heaps": "in all, the least whose interval can lie within the margin at this scatter",
}
PATH = {
    **FEW,
    **{key: OF_STAGES[key] for key in ("heaps", "lost")},
    **{key: OPTIMUM[key] for key in ("point", "factors", "outside")},
}
PATH |= {"standard_error_deg": "of the angle there, with --few", "scatter_deg": "of heaps at one point, with --few"}
STAGES = {**SCREENING, **CLIMB, **SURFACE, **OPTIMUM, **VALIDATION, **OF_STAGES, **PLAN}
CALIBRATE = {
    "stages": "the stages that are done, each as its decision.json has it; a key stands in the stages that have it",
    "stages[].stage": "screening, climb, surface, optimum or validation; with --few: path",
    **within("stages[]", {**STAGES, **FEW}),
    **within("stages[].attempts[]", ATTEMPT),
    "optimum": "the setting; null before that stage. With --few the setting on the path",
    **within("optimum", {**OPTIMUM, **PLAN, **PATH}),
    "validation": "the heaps at the setting; null before that stage. With --few the heaps on the path: their line at the setting, each one-sided test at 2 %",
    **within("validation", {**VALIDATION, **PLAN}),
    **within("validation.attempts[]", ATTEMPT),
    "assumed": BENCH["assumed"],
}
CHALLENGE = {
    "trials": "that are done",
    "identified": "of those with one effect hidden: the answer is that effect, alone or in a tie",
    "in_answer": "of those: the effect is in the answer",
    "hidden_trials": "with one effect hidden",
    "false_alarms": "of those with nothing hidden: an effect is named",
    "null_trials": "with nothing hidden",
    "figures": "the rates beside their aims",
    "figures[].figure": "the rate, in words",
    "figures[].aim": "what it should be",
    "figures[].measured": "what it is",
    "figures[].interval": "95 %, Clopper and Pearson's for a share",
    "figures[].trials": "it is counted over",
    "figures[].met": "yes or no; with few trials a bound may not be met though the rate is",
}
DOCTOR = {
    "pellet_study": "its version",
    "python": "its version",
    "yade": "the executable; null where there is none",
    "version": "of YADE; null where there is none",
    "packages": "{package: version}",
    "lacks": "{what this build of YADE lacks: what that costs}; not there without YADE",
    "ok": "do the contact laws pass, but for reasons that are known? false without YADE",
    "checks": "the law checks, a row each",
    "checks[].check": "the script in yade_scripts/checks",
    "checks[].contact_law": "the law",
    "checks[].setting": "what was read, and at which setting",
    "checks[].requested": "by the law's closed form",
    "checks[].measured": "in YADE",
    "checks[].difference": "measured - requested",
    "checks[].tolerance": "2 % of the request, 0.005 if that is more for restitution and zero",
    "checks[].within": "does it lie within?",
    "checks[].remark": "why not, and by how much",
}
ANGLE = {
    "angle_deg": "repose angle: mean over the photographs (the triangle's)",
    "sd": "over the photographs; null for one",
    "flank_deg": "mean of the lines through both flanks",
    "flank_sd": "over the photographs; null for one",
    "triangle_deg": "mean of the least-squares triangles",
    "triangle_sd": "over the photographs; null for one",
    "photos": "each photograph",
    "photos[].photo": "its file",
    "photos[].angle_deg": "its angle",
    "photos[].uncertainty_deg": "of this",
    "photos[].flank_deg": "mean of its flanks",
    "photos[].flank_uncertainty_deg": "of this",
    "photos[].triangle_deg": "its triangle",
    "photos[].left_deg": "left flank",
    "photos[].right_deg": "right flank",
    "photos[].tilt_deg": "of the camera, positive where the level rises to the right",
    "photos[].tilt_from": "what the tilt was read from",
    "photos[].doubts": "what speaks against the reading; with any no row is printed",
    "photos[].overlay": "the picture of what was fitted",
}
GRAINS = {
    "angle_deg": "mean over the heaps",
    "heaps": "each heap",
    "heaps[].grains": "its file",
    "heaps[].angle_deg": "repose angle",
    "heaps[].standard_error_deg": "over the directions",
    "heaps[].flank_deg": "by lines through the flanks; null where it has none",
    "heaps[].flank_error_deg": "of this",
    "heaps[].triangle_deg": "by triangles",
    "heaps[].triangle_error_deg": "of this",
    "heaps[].moment_deg": "by the moments",
    "heaps[].moment_error_deg": "of this",
}
INIT = {"path": "of the study, absolute", "files": "that were written"}
REPORT = {"path": "of the page, absolute"}
