"""Reduced models, transformed responses and goals of several responses as plain data, ready for JSON; see `answers`."""

from pellet_study.doe.answers import plain, surface_answer
from pellet_study.doe.box_behnken import Surface
from pellet_study.doe.box_cox import BoxCox
from pellet_study.doe.joint_set import JointSet
from pellet_study.doe.selection import Selection
from pellet_study.doe.transformation import Transformation


def reduced_answer(surface: Surface, dropped: list[str], selection: Selection | None = None) -> dict:
    """A reduced model; where AICc chose it, the criterion after each term, and the predicted R2 with the choice counted."""
    chosen = {} if selection is None else {
        "aicc": selection.aicc, "r2_predicted_honest": selection.r2_predicted_honest
    }  # fmt: skip
    return plain({"dropped": dropped, **surface_answer(surface), "p_follow_selection": bool(dropped), **chosen})


def transformation_answer(
    name: str, scale: Transformation | None, box_cox: BoxCox | None, advised: str | None
) -> dict | None:
    """The power applied to a response, and what the likelihood of the response on its own scale says of it."""
    if scale is None:
        return None
    return plain({"of": name, "power": scale.power, "advised": advised, "box_cox": box_cox})


def joint_answer(found: JointSet) -> dict:
    """The settings that meet the goals of several responses, and the most desirable one."""
    names = [factor.name for factor in found.factors]
    return plain(
        {
            "fraction_of_box": found.fraction,
            "fraction_not_excluded": found.fraction_not_excluded,
            "fraction_assured": found.fraction_assured,
            "alpha": found.alpha,
            "extents": found.extents,
            "pieces": found.pieces,
            "assured": found.assured,
            "met": found.met,
            "desirability": found.desirability,
            "coded": dict(zip(names, found.coded, strict=True)),
            "physical": found.physical,
            "next_response": found.next_response and found.next_response.response.name,
            "responses": {
                part.response.name: {
                    "goal": part.goal,
                    "fraction_of_box": part.fraction,
                    "fraction_of_the_others": part.fraction_of_the_others,
                    "fraction_not_excluded_after_replicate": part.after_replicate,
                    "prediction": part.prediction,
                    "desirability": part.desirability,
                    "on_limit": part.limit,
                }
                for part in found.parts
            },
        }
    )
