"""What runs inside YADE: seed and powder particles, contact laws, rigs; knows nothing of pellet_study.

Every file here is read by two Pythons: YADE's own, where `simulate(case)` runs, and the package's, which reads only
the declarations at the top. So nothing but the standard library and numpy is imported at the top of a file.
"""
