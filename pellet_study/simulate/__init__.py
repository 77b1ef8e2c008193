"""Cases in, rows out: YADE processes on this machine or a cluster, and the store of what they finished.

yade < store < local < cluster < dispatch < law_checks
"""
