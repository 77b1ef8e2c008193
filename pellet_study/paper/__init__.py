"""The source paper: what it prints, as data, and what becomes of it when it is recomputed.

"Determination and testing of pelletized coated particles" (powder of soybean meal and diatomaceous earth on alfalfa seeds,
EDEM); tables.json holds every printed cell as text and as number.

    verdicts, printed < judging/fits, judging/settings, judging/validation < designs
    < audit/bench, audit/climb, audit/optimum, audit/screening, audit/surface < audit/verification < results
"""
