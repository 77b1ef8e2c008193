"""What a program calls: studies, answers as objects, and the same steps as the commands, which call them too.

answers < studies < criticism, simulation < figures
"""
