"""Hidden-effect trials: is the effect that was put into the measurements the one that refine names?

demonstration < seeds, heaps, twins < kinds, trials < counting, resume < aims < acceptance, predictions < sealed < tables
"""
