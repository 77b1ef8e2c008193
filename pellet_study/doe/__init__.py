"""Design and analysis of experiments: Plackett-Burman, steepest climb, Box-Behnken, target set, validation; designs made, judged and
mended.

Imports go one way, left may be imported by right:

    factors, blocks, published_designs, composite < columns, levels < design_table < linear_model < lenth
    < plackett_burman < box_behnken < steepest_climb, optimum, validation, blocking
    < run_sheet, fold_over, augment, power < repair, score < path_table, cautions, answers, labels < figures < text
"""
