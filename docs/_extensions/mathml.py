"""Equations as MathML, which browsers typeset by themselves: no script, no font and no network is needed."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator


def setup(app: Sphinx) -> dict[str, Any]:
    """Registers the renderer ``mathml`` and chooses it."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    app.config.html_math_renderer = "mathml"
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _inline(translator: HTML5Translator, node: nodes.math) -> None:
    translator.body.append(_typeset(node, as_block=False))
    raise nodes.SkipNode


def _display(translator: HTML5Translator, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="equation">{_typeset(node, as_block=True)}</div>')
    raise nodes.SkipNode


def _typeset(node: nodes.Element, as_block: bool) -> str:
    """The equation as MathML; one that cannot be typeset is a warning at its place, and shown as it is written."""
    try:
        mathml = str(tex2mathml(node.astext(), as_block=as_block))
    except MathError as error:
        logging.getLogger(__name__).warning("equation %r: %s", node.astext(), error, location=node)
        return f"<code>{node.astext()}</code>"
    # Browsers draw a dot or a bar that is marked as an accent onto the letter where the font is not one for equations.
    return mathml.replace(' accent="true"', "")
