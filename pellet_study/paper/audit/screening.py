"""The Plackett-Burman test: Tables 7 to 9."""

import numpy as np

from pellet_study.doe.screening_designs import coded_matrix
from pellet_study.paper import designs
from pellet_study.paper.judging import fits
from pellet_study.paper.printed import printed_cells
from pellet_study.paper.verdicts import DATA_MISSING, INCONSISTENT, REPRODUCED, Item, compare, judged


def screening_design() -> list[Item]:
    """Table 7 as a design."""
    section, matrix = "Table 7, design", designs.screening_table().coded.to_numpy()
    corners = matrix[(matrix != 0).all(axis=1)]
    runs, n_factors = corners.shape
    orthogonal = np.allclose(corners.T @ corners, runs * np.eye(n_factors)) and not corners.sum(axis=0).any()
    standard = np.array_equal(corners, coded_matrix(n_factors, runs))
    match = _library_match(corners)
    return [
        Item(
            section,
            "12 runs orthogonal and balanced",
            "Plackett-Burman",
            str(orthogonal),
            None,
            REPRODUCED if orthogonal else INCONSISTENT,
            f"D'D = {runs} I; in order the first {n_factors} columns of the standard cyclic design: {standard}",
        ),
        Item(
            section,
            "equivalent to pyDOE3.pbdesign(11)",
            "",
            str(match is not None),
            None,
            REPRODUCED if match else INCONSISTENT,
            f"columns {match[0]} with signs {match[1]}; pbdesign({n_factors}) itself has "
            f"{_library_runs(n_factors)} runs"
            if match
            else "no choice of columns, signs and rows maps one to the other",
        ),
    ]


def _library_runs(n_factors: int) -> int:
    import pyDOE3

    return len(pyDOE3.pbdesign(n_factors))


def _library_match(corners: np.ndarray) -> tuple[list[int], list[int]] | None:
    """Columns and signs of pyDOE3.pbdesign(11) that give the same set of rows; None where there are none."""
    import pyDOE3

    library = pyDOE3.pbdesign(len(corners) - 1)
    wanted = [sorted(map(tuple, corners[:, : k + 1])) for k in range(corners.shape[1])]
    for image in library:  # the library row that becomes the row of all -1
        flipped = -library * image
        stack: list[list[int]] = [[]]
        while stack:
            chosen = stack.pop()
            if len(chosen) == corners.shape[1]:
                return chosen, [int(-image[i]) for i in chosen]
            for column in set(range(library.shape[1])) - set(chosen):
                candidate = [*chosen, column]
                if sorted(map(tuple, flipped[:, candidate])) == wanted[len(chosen)]:
                    stack.append(candidate)
    return None


def effects() -> list[Item]:
    """Table 8."""
    section, screening, cells = "Table 8", designs.screening(), printed_cells(8)
    items = []
    for name, cell in cells.items():
        items += [
            compare(section, f"{name} effect", cell["Stdized effects"], screening.effects[name]),
            compare(section, f"{name} sum of squares", cell["Sum of squares"], screening.sums_of_squares[name]),
            compare(section, f"{name} contribution, %", cell["Contribution degree"], screening.contributions[name]),
        ]
    positive = {name for name, effect in screening.effects.items() if effect > 0}
    claimed = set("ACEFG")
    items.append(
        Item(
            section,
            "signs: A, C, E, F, G positive, B, D negative",
            "yes",
            "yes" if positive == claimed else "no",
            None,
            REPRODUCED if positive == claimed else INCONSISTENT,
        )
    )
    error = np.sqrt(screening.model.mean_square_error * 4 / 12)
    standardised = {name: effect / error for name, effect in screening.effects.items()}
    raw = all(abs(float(cells[n]["Stdized effects"]) - screening.effects[n]) < 0.0051 for n in cells)
    items.append(
        judged(
            section,
            "column headed 'Stdized effects'",
            "standardised",
            "raw effects" if raw else "unknown",
            not raw,
            f"the values are mean(+) - mean(-) in degrees; standardised (t) B would be {standardised['B']:.3f}",
        )
    )
    return items


def screening_anova() -> list[Item]:
    """Table 9: the centre point split off as curvature, 4 residual degrees of freedom."""
    section, screening, cells = "Table 9", designs.screening(), printed_cells(9)
    rows = {row["source"]: row for row in screening.anova}
    pooled_df = rows["residual"]["df"] + 1
    pooled = (rows["residual"]["sum_of_squares"] + rows["curvature"]["sum_of_squares"]) / pooled_df

    def reason(name: str, key: str, row: dict) -> str:
        if (name, key) != ("Model", "f"):
            return ""
        return f"with the centre point pooled into the residual {row['mean_square'] / pooled:.4f}"

    columns = [("sum of squares", "Sum of squares", "sum_of_squares"), ("F", "F-value", "f"), ("P", "P-value", "p")]
    items = fits.anova(section, cells, rows, columns, lambda name: "model" if name == "Model" else name, reason)
    residual, curvature = rows["residual"], rows["curvature"]
    items.append(
        Item(
            section,
            "residual sum of squares and df",
            "absent",
            residual["sum_of_squares"],
            None,
            DATA_MISSING,
            f"df {residual['df']}, mean square {residual['mean_square']:.6f}; curvature "
            f"{curvature['sum_of_squares']:.4f} on 1 df, F = {curvature['f']:.4f}, p = {curvature['p']:.4f}",
        )
    )
    highly = [name for name, p in screening.p.items() if p < 0.01]
    items.append(
        judged(
            section,
            "text: G highly significant, C and B significant",
            "G",
            ", ".join(highly),
            highly == ["G"],
            f"p of C is {screening.p['C']:.4f}, below 0.01 and printed {cells['C']['P-value']}: by the "
            "paper's own rule C is extremely significant too",
        )
    )
    return items
