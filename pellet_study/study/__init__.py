"""A study folder: study.toml, its measurements, effects and rigs of the user's own, and what is remembered of it.

measurements < user_code < study < load, edit, history
"""
