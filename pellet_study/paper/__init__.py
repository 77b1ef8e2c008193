"""Papers recomputed: the source paper, whose tables are data here, and any other that a folder describes.

"Determination and testing of pelletized coated particles" (powder of soybean meal and diatomaceous earth on alfalfa seeds,
EDEM); tables.json holds every printed cell as text and as number.

    verdicts, printed < html, judging/fits, judging/path, judging/settings, judging/validation < designs
    < audit/bench, audit/climb, audit/optimum, audit/screening, audit/surface < audit/verification
    < described/entries, described/description < described/reading, described/analyses < described/printed_numbers
    < described/claims, described/climbs, described/goal < described/audit < described/results, results
"""
