"""Where several responses are all acceptable: their regions laid over one another."""

from itertools import combinations
from typing import Any

import numpy as np

from pellet_study.doe.importance import importance
from pellet_study.doe.joint_set import JointSet
from pellet_study.doe.labels import drawable, folded
from pellet_study.doe.overlay import Overlay, overlay
from pellet_study.output import style
from pellet_study.output.style import letters_in, new_panels, room_for, styled

MOST = 3  # factors whose pairs are drawn
ALL_MET, NOT_MET = "#FFF3B0", "#E4E4E4"


@styled
def overlaid_regions(joint: JointSet, units: dict[str, str] | None = None, ax=None):
    """The settings that meet all goals, for the pairs of the most important factors, the others where all are most desirable.

    Coloured lines are the limits of each response; the light region meets all goals.

    Parameters
    ----------
    joint : JointSet
        Of two factors or more.
    units : dict, optional
        {response: unit}.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    responses = [part.response.name for part in joint.parts]
    names = [factor.name for factor in joint.factors]
    shown = drawable([*names, *responses])
    pairs = list(combinations(most_important(joint), 2))
    figure, grid = new_panels(len(pairs), (3.5, 3.5), (5.4, 0.9), ax=ax)
    letters = letters_in(room_for(figure, ax, len(pairs)) - 0.9)
    missed = False
    for axes, (first, second) in zip(grid, pairs, strict=True):
        plane = overlay(joint, first, second)
        missed |= not plane.all_met.all()
        _draw_plane(axes, plane, responses)
        axes.plot(
            joint.physical[first], joint.physical[second], "*", color="white", markeredgecolor="black", markersize=14, zorder=6,
            clip_on=False,
        )  # fmt: skip
        held = ", ".join(f"{shown(name)} = {level:.4g}" for name, level in plane.rest.items())
        said = [
            f"{held} (most desirable)" if held else "",
            "" if plane.all_met.any() else "no setting here meets all goals",
        ]
        axes.set_title("\n".join(folded(text, letters) for text in said if text), fontsize="small")
        labels = {factor.name: shown(factor.label) for factor in joint.factors}
        axes.set_xlabel(folded(labels[first], letters))
        axes.set_ylabel(folded(labels[second], letters_in(2.6)))
    handles: list[Any] = [Patch(facecolor=ALL_MET, edgecolor="black", linewidth=0.6)]
    words = ["all goals met"]
    if missed:
        handles.append(Patch(facecolor=NOT_MET, edgecolor="black", linewidth=0.6))
        words.append("some goal missed")
    for name, part in zip(responses, joint.parts, strict=True):
        look = style.look_of([name], responses)
        handles.append(Line2D([], [], color=look.colour, linestyle=look.dash))
        words.append(f"{shown(name)} {_accepted(part.goal.accepted, (units or {}).get(name) or '')}".strip())
    handles.append(Line2D([], [], marker="*", color="white", markeredgecolor="black", markersize=12, linestyle=""))
    words.append("most desirable setting")
    style.legend_below(figure, handles, words, columns=3, ax=ax)
    return figure


def most_important(joint: JointSet, most: int = MOST) -> list[str]:
    """The factors that matter most to the responses together, each response's sums of squares in parts of their sum."""
    weight = dict.fromkeys((factor.name for factor in joint.factors), 0.0)
    for part in joint.parts:
        found = importance(part.response.surface.model)
        total = sum(found.values()) or 1.0
        for name, value in zip(weight, found.values(), strict=True):
            weight[name] += value / total
    return sorted(weight, key=lambda name: -weight[name])[:most]


def _draw_plane(axes, plane: Overlay, responses: list[str]) -> None:
    """The light region that meets all goals, and the limits of every response where they cross the plane."""
    inside = np.min([_room(plane.predicted[name], plane.accepted[name]) for name in responses], axis=0)
    axes.set_facecolor(NOT_MET)
    if plane.all_met.any():
        axes.contourf(plane.x, plane.y, inside, levels=[0, np.inf], colors=[ALL_MET])
    for name in responses:
        look, values = style.look_of([name], responses), plane.predicted[name]
        limits = [limit for limit in plane.accepted[name] if np.isfinite(limit) and values.min() < limit < values.max()]
        if limits:
            lines = axes.contour(plane.x, plane.y, values, levels=limits, colors=look.colour, linestyles=[look.dash])
            axes.clabel(lines, fmt="%.4g", fontsize="small")
    axes.set_xlim(plane.x.min(), plane.x.max())
    axes.set_ylim(plane.y.min(), plane.y.max())


def _room(values: np.ndarray, accepted: tuple[float, float]) -> np.ndarray:
    """How far a prediction lies within its limits, in parts of the predictions' range; below 0 where it is unacceptable."""
    scale = float(np.ptp(values)) or 1.0
    room = [(values - accepted[0]) / scale if np.isfinite(accepted[0]) else np.full(values.shape, np.inf)]
    room.append((accepted[1] - values) / scale if np.isfinite(accepted[1]) else np.full(values.shape, np.inf))
    return np.minimum(np.min(room, axis=0), 10.0)


def _accepted(limits: tuple[float, float], unit: str) -> str:
    """What will do, in words."""
    low, high = limits
    if np.isfinite(low) and np.isfinite(high):
        return f"{low:.4g} to {high:.4g} {unit}"
    if np.isfinite(low):
        return f"at least {low:.4g} {unit}"
    return f"at most {high:.4g} {unit}" if np.isfinite(high) else "any"
