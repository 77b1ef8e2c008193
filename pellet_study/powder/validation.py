"""Does the setting give the measured angle? New heaps, and a test of equivalence."""

LEAST_GAIN = 0.1  # share of what the heaps miss below which a correction inside the box is not worth new heaps
ALPHA = 0.05  # of the equivalence test, over all settings that are validated
