"""Design and analysis of experiments: Plackett-Burman, steepest climb, Box-Behnken, target set, validation.

Imports go one way, left may be imported by right:

    factors, blocks < columns, levels < design_table < linear_model < lenth < plackett_burman < box_behnken
    < steepest_climb, optimum, validation < path_table, cautions, answers, labels < figures < text
"""
