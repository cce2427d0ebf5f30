"""Displayed equations as MathML, which browsers draw without a script or a font from elsewhere."""

from __future__ import annotations

import re

from latex2mathml.converter import convert

_DISPLAYED = re.compile(r"^\$\$(.+?)\$\$[ \t]*$", re.MULTILINE | re.DOTALL)
_TAG = re.compile(r"\\tag\{(\w+)\}")
_UPRIGHT = re.compile(r"\\mathrm\{([A-Za-z]+)\}")
"""A single letter of MathML is slanted unless it is text."""


def draw_equations(text: str) -> str:
    r"""Markdown with each ``$$ … $$`` as a block of HTML; a ``\tag`` is its number and its anchor.

    >>> "<mi>L</mi>" in draw_equations("$$ L \\tag{3} $$"), 'id="eq-3"' in draw_equations("$$ L \\tag{3} $$")
    (True, True)
    """
    return _DISPLAYED.sub(lambda found: _drawn(found[1]), text)


def _drawn(tex: str) -> str:
    tag = _TAG.search(tex)
    # A large bracket with an exponent keeps its size only as a group of its own.
    tex = re.sub(r"(\\[Bb]ig+\s*\))\s*\^", r"{\1}^", tex)
    tex = re.sub(r"\\[Bb]ig+\s*(\\[lr]angle)", r"\1", tex)  # these have one size
    upright = _UPRIGHT.sub(r"\\text{\1}", _TAG.sub("", tex))
    drawn = convert(" ".join(upright.split()), display="block").replace("\n", " ")
    if not tag:
        return f'<div class="equation">{drawn}</div>'
    return f'<div class="equation" id="eq-{tag[1]}">{drawn}<span>({tag[1]})</span></div>'
