"""How answers look: the style of figures, lines on a terminal, numbers and names in words.

words, fonts < style, terminal
"""
