"""Hidden-effect trials: is the effect that was put into the measurements the one that refine names?

demonstration < bench, heaps, twins < trials < acceptance, predictions < sealed < bench_tables
"""
