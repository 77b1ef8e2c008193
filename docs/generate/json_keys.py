"""The JSON of every command: what each key means. tests/test_json_keys.py holds it against the answers."""

import json_of_designs as designs
import json_of_simulations as simulations
import json_of_studies as studies

MEANINGS = {
    "check": studies.CHECK,
    "compare, add, drop": studies.COMPARE,
    "diagnose": studies.DIAGNOSE,
    "refine": studies.REFINE,
    "history": studies.HISTORY,
    "bench": simulations.BENCH,
    "calibrate": simulations.CALIBRATE,
    "pb": designs.PB,
    "bbd": designs.BBD,
    "pb --design, bbd --design": designs.MADE,
    "pb with a factor of three words": designs.LEVELS,
    "design power": {**designs.POWER, **designs.NOTES},
    "design score": {**designs.SCORE, **designs.NOTES},
    "design fold": {**designs.FOLD, **designs.NOTES},
    "design axial": {**designs.AXIAL, **designs.NOTES},
    "design repair": {**designs.REPAIR, **designs.NOTES},
    "audit": designs.AUDIT,
    "audit FOLDER": designs.AUDIT_FOLDER,
    "challenge": simulations.CHALLENGE,
    "angle of photographs": simulations.ANGLE,
    "angle of grains": simulations.GRAINS,
    "doctor": simulations.DOCTOR,
    "init": simulations.INIT,
    "report": simulations.REPORT,
}
