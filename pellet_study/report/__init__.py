"""One self-contained HTML page about a study, made of the files in its folder.

parts < particles, criticism, powder < measured, bench < page
"""
