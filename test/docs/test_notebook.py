"""The notebook runs from its first cell to its last, and its results show themselves."""

import ast
import json
from pathlib import Path

import pytest
from short_bags import short_bag
from snippets import ROOT


@pytest.mark.slow
def test_the_notebook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On the first half of its flight, to be quick."""
    (tmp_path / "bags").mkdir()
    short_bag("cdrw_multistep", 30.0, tmp_path / "bags")
    monkeypatch.chdir(tmp_path)
    cells = json.loads((ROOT / "docs" / "notebook.ipynb").read_text(encoding="utf-8"))["cells"]
    names: dict[str, object] = {}
    shown = []
    for cell in cells:
        if cell["cell_type"] == "code":
            assert not cell["outputs"], "clear the outputs before the notebook is kept"
            *statements, last = ast.parse("".join(cell["source"])).body
            exec(compile(ast.Module(statements, []), "notebook", "exec"), names)
            assert isinstance(last, ast.Expr), "a cell ends with what it shows"
            shown.append(eval(compile(ast.Expression(last.value), "notebook", "eval"), names))
    flight, picture, run, estimates, pair, _ = shown
    assert "30.0 s, 5998 samples" in repr(flight)
    assert picture.data
    assert len(estimates.data) > 27
    assert "<table>" in run._repr_html_()  # what Jupyter calls
    first, second = pair
    assert first.lower <= second.upper
    assert second.lower <= first.upper
