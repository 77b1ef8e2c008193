"""Numbers of a command's options, as argparse asks for them."""

import argparse

from pellet_study.tables.numbers import number_given


def number(text: str) -> float:
    """A finite number with a decimal point."""
    try:
        return number_given(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def whole(text: str) -> int:
    """A whole number."""
    value = number(text)
    if value != int(value):
        raise argparse.ArgumentTypeError(f"expected a whole number, got {text!r}")
    return int(value)
