"""Tables for pandas, which is needed by nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from typing import Any


def data_frame(columns: Mapping[str, Any], *, index: Any, index_name: str) -> Any:
    """A DataFrame of columns that are equally long. Raises ImportError, in one line, where pandas is not installed."""
    if find_spec("pandas") is None:
        raise ImportError("to_pandas needs pandas, which is not installed: pip install pandas")
    import pandas  # type: ignore[import-untyped,import-not-found,unused-ignore]  # noqa: PLC0415

    return pandas.DataFrame(dict(columns), index=pandas.Index(index, name=index_name))
