"""Model criticism: does the model fit, where does it fail, which absent effect would explain it, what to measure next.

verdicts, scatter < cell_means < least_squares < calibration < lack_of_fit, score_tests < constancy, intervals < residuals
< compare < signatures < rivals < explanations, ranking < next_measurement < diagnose < by_level, refine, facts < answers
< text, figures
"""
