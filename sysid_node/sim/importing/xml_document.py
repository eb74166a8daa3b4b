"""XML of other people's files, read safely."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from sysid_node.errors import InputError

#: The declaration of an entity that is a constant without references.
_CONSTANT = re.compile(rb"""<!ENTITY\s+[\w.-]+\s+(?:"[^"&%<]{0,200}"|'[^'&%<]{0,200}')\s*>""")


def parse_xml(path: Path, *, comments: bool = False) -> Element:
    """The root element of an XML file, with its comments as elements if wanted.

    Raises InputError where the file cannot be read, is not XML, or declares entities that name other files or each
    other: those read what they should not, or expand without end. Plain constants, which JSBSim's systems declare, are
    accepted. UTF-16, in which a declaration could hide, is refused.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; give the model's file") from error
    declared = content.count(b"<!ENTITY")
    if b"\x00" in content or len(_CONSTANT.findall(content)) != declared:
        raise InputError(
            f"{path}: declares XML entities other than constants, or is not UTF-8; remove what it declares"
        )
    try:
        parser = ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=comments))
        return ElementTree.fromstring(content, parser)
    except ElementTree.ParseError as error:
        line, column = error.position
        raise InputError(f"{path}:{line}: not XML (column {column}); give the model's file") from error
