"""Hidden-effect trials: is the effect that was put into the measurements the one that refine names?

demonstration < seeds, heaps, twins < trials < counting < acceptance, predictions < sealed < tables
"""
