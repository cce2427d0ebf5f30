"""Text of files and users as it may be shown: what a terminal or a picture would act on is spelt out."""

from __future__ import annotations

import unicodedata


def printable(text: str) -> str:
    r"""The text on one line, with every character that is not seen in its escaped form.

    Escaped are control characters (C0, DEL, C1: what a terminal obeys), line ends of every kind, format characters (which
    turn the direction of writing, or have no width), bytes of file names that are no text, and code points without a
    meaning. Blanks of every width stay.

    Examples
    --------
    >>> print(printable("\x1b[2Jlens\nflux 9 lm"))
    \x1b[2Jlens\nflux 9 lm
    >>> print(printable("γ = 40 000 \u202emm"))
    γ = 40 000 \u202emm
    """
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() or _is_blank(letter) else _escaped(letter) for letter in text)


def _is_blank(letter: str) -> bool:
    return unicodedata.category(letter) == "Zs"


def _escaped(letter: str) -> str:
    return letter.encode("unicode_escape").decode("ascii")
