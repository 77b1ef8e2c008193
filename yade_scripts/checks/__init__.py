"""Checks of the contact laws against closed forms, each in the form of a rig.

A check is a rig (`RIG`, `simulate(case)`) with two more functions, both without YADE:

expected(case) : {observable: the value asked of the law}
instead(case) : {observable: (value, reason)} of what the law cannot do: what it gives in place of it, by its own
    closed form where there is one (else None), and why; empty where the law can.

By hand:  yade -x -n yade_scripts/checks/restitution.py --example cases.json
          yade -x -n yade_scripts/checks/restitution.py cases.json observables.csv
"""
