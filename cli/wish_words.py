"""Wishes as the command takes them: "warmer=10,glossier=1"."""

from __future__ import annotations

import argparse


def amounts(text: str, sign: str = "=") -> dict[str, float]:
    """Amounts by words, which are not checked here; raises `ArgumentTypeError` where the text is no such list."""
    found: dict[str, float] = {}
    for part in text.split(","):
        word, given, number = (piece.strip() for piece in part.partition(sign))
        if not (word and given and number):
            raise argparse.ArgumentTypeError(f"{part!r} is not WORD{sign}N, such as warmer{sign}10")
        try:
            amount = float(number)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{word}: a number, not {number}") from None
        if word in found:
            raise argparse.ArgumentTypeError(f"{word} is said twice")
        found[word] = amount
    return found
