"""The powder calibration."""
