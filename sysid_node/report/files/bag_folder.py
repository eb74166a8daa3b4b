"""A bag that a command writes into its folder."""

from __future__ import annotations

import shutil
from pathlib import Path

from sysid_node.errors import InputError


def remove_earlier_bag(bag: Path, command: str) -> None:
    """Removes the bag that an earlier run of the command wrote.

    Raises InputError where the folder holds other files.
    """
    if not bag.exists():
        return
    others = {file.name for file in bag.iterdir()} - {"metadata.yaml", f"{bag.name}.mcap"}
    if others:
        raise InputError(f"{bag}: holds {min(others)}, which {command} did not write; give another folder as --out")
    shutil.rmtree(bag)
