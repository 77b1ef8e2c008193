"""Heaps as pictures: the repose angle from a photograph, and a simulated heap drawn.

photograph, render < report
"""
