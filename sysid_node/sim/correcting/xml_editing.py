"""Edits of a model's XML that leave the rest of the file as it is, comments and layout included."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement, indent

from sysid_node.sim.importing.xml_document import parse_xml

#: What stands before the root element: the declaration, style sheets, comments, a document type.
_PROLOG = re.compile(r"\A(?:\s|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^\[>]*(?:\[.*?\]\s*)?>)*", re.DOTALL)


def read_document(path: Path) -> tuple[str, Element]:
    """What stands before the root element, and the root with its comments. Raises InputError."""
    root = parse_xml(path, comments=True)
    text = path.read_bytes().decode("utf-8", errors="replace")
    found = _PROLOG.match(text)
    return found.group(0) if found else "", root


def write_document(path: Path, prolog: str, root: Element) -> None:
    """Write the file in UTF-8."""
    path.write_text(document_text(prolog, root), encoding="utf-8")


def document_text(prolog: str, root: Element) -> str:
    """The text of a document, to be stored in UTF-8."""
    declared = re.sub(r"(<\?xml[^>]*?)\s+encoding=[\"'][^\"']*[\"']", r"\1", prolog)
    return declared + ElementTree.tostring(root, encoding="unicode") + "\n"


def text_element(parent: Element, tag: str, text: str | float, **attributes: str) -> Element:
    """A new last child with a text."""
    element = SubElement(parent, tag, attributes)
    element.text = text if isinstance(text, str) else repr(float(text))
    return element


def product_of(parent: Element, properties: Iterable[str], *values: float) -> Element:
    """A new product of properties and values."""
    product = SubElement(parent, "product")
    for name in properties:
        text_element(product, "property", name)
    for value in values:
        text_element(product, "value", value)
    return product


def append_block(parent: Element, block: Element) -> None:
    """Put a new element last into a parent, on lines of its own, indented as the parent's other children are."""
    insert_block(parent, len(parent), block)


def insert_block(parent: Element, place: int, block: Element) -> None:
    """Put a new element before the child at a place, on lines of its own, indented as the other children are."""
    margin = _margin(parent)
    indent(block, "    ")
    for element in block.iter():
        for part in ("text", "tail"):
            if "\n" in (getattr(element, part) or ""):
                setattr(element, part, getattr(element, part).replace("\n", margin))
    before = parent[place - 1] if place else None
    if before is None:
        block.tail, parent.text = parent.text or margin, margin
    else:
        block.tail, before.tail = before.tail, margin
    parent.insert(place, block)


def _margin(parent: Element) -> str:
    """The line break and indentation before the parent's children."""
    text = parent.text or ""
    return "\n" + text.rpartition("\n")[2] if "\n" in text and not text.strip() else "\n    "
