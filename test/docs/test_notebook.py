"""The notebook runs from its first cell to its last, and its results show themselves."""

import ast
import json
import time

import pytest
from snippets import ROOT


def test_the_notebook_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    cells = json.loads((ROOT / "docs" / "notebook.ipynb").read_text(encoding="utf-8"))["cells"]
    names: dict[str, object] = {}
    shown = []
    begun = time.process_time()
    for cell in cells:
        if cell["cell_type"] == "code":
            assert not cell["outputs"], "clear the outputs before the notebook is kept"
            *statements, last = ast.parse("".join(cell["source"])).body
            exec(compile(ast.Module(statements, []), "notebook", "exec"), names)
            assert isinstance(last, ast.Expr), "a cell ends with what it shows"
            shown.append(eval(compile(ast.Expression(last.value), "notebook", "eval"), names))
    flight, picture, run, estimates, pair, _ = shown
    assert "12000 samples" in repr(flight)
    assert picture.data
    assert len(estimates.data) > 27
    assert "<table>" in run._repr_html_()  # what Jupyter calls
    first, second = pair
    assert first.lower <= second.upper
    assert second.lower <= first.upper
    assert time.process_time() - begun < 20.0
