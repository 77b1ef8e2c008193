"""The Box-Behnken test: Tables 11 to 13, Eq. 4."""

from pellet_study.paper import designs
from pellet_study.paper.judging import fits
from pellet_study.paper.printed import printed_cells, printed_text, tables
from pellet_study.paper.verdicts import DATA_MISSING, INCONSISTENT, REPRODUCED, Item, compare


def surface_design() -> list[Item]:
    """Tables 11 and 12 as a design."""
    import pyDOE3

    matrix = designs.surface_table().coded.to_numpy()
    library = pyDOE3.bbdesign(3, center=int((matrix == 0).all(axis=1).sum()))
    same = sorted(map(tuple, matrix)) == sorted(map(tuple, library + 0.0))
    return [
        Item(
            "Tables 11 and 12, design",
            "Box-Behnken, 3 factors, 12 edges and 5 centre points",
            "Box-Behnken",
            str(same),
            None,
            REPRODUCED if same else INCONSISTENT,
            f"the {len(library)} runs of pyDOE3.bbdesign(3), in Design-Expert's standard order, not randomised",
        )
    ]


def surface_anova() -> list[Item]:
    """Table 13: partial sums of squares in coded units."""
    section, rows = "Table 13", {row["source"]: row for row in designs.surface().anova}
    keys = {
        "Model": "model",
        "Residual": "residual",
        "Lack of fit": "lack of fit",
        "Pure error": "pure error",
        "Sum": "total",
    }
    columns = [
        ("mean square", "Mean square", "mean_square"),
        ("sum of squares", "Sum of square", "sum_of_squares"),
        ("P", "P-value", "p"),
    ]
    items = fits.anova(section, printed_cells(13), rows, columns, lambda name: keys.get(name, name.replace("²", "2")))
    cell, row = printed_cells(13)["BC"], rows["BC"]
    items.append(
        compare(
            section,
            f"{cell['Mean square']} printed as mean square and as sum of squares of BC",
            cell["Sum of square"],
            row["sum_of_squares"],
            f"mean square = sum of squares on {row['df']} degree of freedom",
        )
    )
    return items


def equation_four() -> list[Item]:
    """Eq. 4 in coded units."""
    printed = tables()["equations"]["4"]
    cells = dict(zip(printed["terms"], printed["printed_coefs"], strict=True))
    return fits.terms("Eq. 4", cells, designs.surface().coefficients, {"B2": "printed without its exponent"})


def goodness_of_fit() -> list[Item]:
    """R2 and its kin."""
    section, surface, text = "R2, C.V.", designs.surface(), printed_text()
    gap = surface.r2_adjusted - surface.r2_predicted
    return [
        compare(section, "R2", f"{text['R2_BB']}", surface.r2),
        compare(section, "adjusted R2", f"{text['R2_adj_BB']}", surface.r2_adjusted),
        compare(section, "C.V., %", f"{text['CV_BB_pct']}", surface.cv_percent),
        Item(
            section,
            "predicted R2",
            "absent",
            surface.r2_predicted,
            None,
            DATA_MISSING,
            f"PRESS {surface.press:.6f}; {gap:.4f} below the adjusted R2 (0.2 is the usual limit)",
        ),
        Item(
            section,
            "adequate precision",
            "absent",
            surface.adequate_precision,
            None,
            DATA_MISSING,
            "above 4 is wanted",
        ),
    ]
