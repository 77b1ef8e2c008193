"""Design and analysis of experiments: screening, climb, response surface, target set, validation; designs made and mended.

Imports go one way, left may be imported by right:

    factors, blocks, published_designs, composite, raw_table, rounding < bookkeeping < columns, levels, screening_designs < design_table
    < terms < linear_model, interactions, confounding < block_scatter < anova, intervals, importance, lenth, box_cox, run_diagnostics
    < plackett_burman < box_behnken < reduction, standard_order
    < coded_box, box_search, transformation, selection, goals < fitted_response < desirability < pieces < joint_set
    < overlay, steepest_climb, path_turning, optimum, validation, margins, blocking, categorical
    < run_sheet, fold_over, augment, power < planned_table, repair, score
    < path_table, cautions, answers, labels < response_answers, figures/effects, figures/climbs, figures/residuals,
    figures/sections < figures/contours, figures/regions < text < screening_text, surface_text, path_text, validation_text
    < design_text, response_text
"""
