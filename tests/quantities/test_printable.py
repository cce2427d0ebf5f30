"""Text as it may be shown: nothing of it is obeyed, nothing of it is lost."""

from __future__ import annotations

import codecs
import unicodedata

from etendue.quantities.printable import printable
from hypothesis import given
from hypothesis import strategies as st

OBEYED = ("Cc", "Cf", "Cs", "Co", "Zl", "Zp")
"""Categories of characters that a terminal acts on, or that are not seen."""


@given(st.text() | st.text(st.characters(categories=OBEYED)))
def test_nothing_remains_that_a_terminal_obeys(text: str) -> None:
    shown = printable(text)
    assert not {unicodedata.category(letter) for letter in shown} & set(OBEYED)
    assert len(shown.splitlines()) <= 1
    assert printable(shown) == shown


@given(st.text(st.characters(exclude_characters="\\")))
def test_every_character_can_be_told_from_what_is_shown(text: str) -> None:
    """Where the text has no backslashes of its own."""
    ascii_only = printable(text).encode("latin-1", "backslashreplace")
    assert codecs.decode(ascii_only, "unicode_escape") == text


def test_letters_of_every_language_and_blanks_stay() -> None:
    for text in ("θ = 40 000 mm²", "輝度", "Leuchtdichte größer", "100 lm", "a\\b", "😀"):
        assert printable(text) == text
