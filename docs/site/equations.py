"""Displayed equations as MathML, which browsers draw without a script or a font from elsewhere."""

from __future__ import annotations

import re

from latex2mathml.converter import convert

_DISPLAYED = re.compile(r"^\$\$(.+?)\$\$[ \t]*$", re.MULTILINE | re.DOTALL)
_TAG = re.compile(r"\\tag\{(\w+)\}")


def draw_equations(text: str) -> str:
    r"""Markdown with each ``$$ … $$`` as a block of HTML; a ``\tag`` is its number and its anchor.

    >>> "<mi>L</mi>" in draw_equations("$$ L \\tag{3} $$"), 'id="eq-3"' in draw_equations("$$ L \\tag{3} $$")
    (True, True)
    """
    return _DISPLAYED.sub(lambda found: _drawn(found[1]), text)


def _drawn(tex: str) -> str:
    tag = _TAG.search(tex)
    drawn = convert(" ".join(_TAG.sub("", tex).split()), display="block").replace("\n", " ")
    if not tag:
        return f'<div class="equation">{drawn}</div>'
    return f'<div class="equation" id="eq-{tag[1]}">{drawn}<span>({tag[1]})</span></div>'
