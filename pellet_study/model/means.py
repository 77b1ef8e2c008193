"""Means over seeds of simulated cases, remembered beside the store."""

COLUMNS = ("key", "observable", "mean", "sd", "n", "lost", "reason")
