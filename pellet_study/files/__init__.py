"""Files opened and written in one way each: regular and of a bounded size; beside their place, renamed, through no link.

opening, locking < writing < outputs, toml
"""
