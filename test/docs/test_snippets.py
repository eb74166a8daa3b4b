"""Every command and every snippet of the documentation does what the page says. Truth: the program itself."""

from __future__ import annotations

import contextlib
import io
import json
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import yaml
from short_bags import short_bag
from snippets import LANGUAGES, ROOT, Snippet, commands, pages, snippets

from sysid_node.cli.main import build_parser, main

PAGES = pages()
#: Programs that are not ours, or that change the machine: a page may show them, with the reason why they are not run.
FOREIGN = (
    *("cd", "mkdir", "cp", "printf", ".", "sudo", "apt", "git"),
    *("pip", "dask", "rosdep", "colcon", "ros2", "MicroXRCEAgent"),
)


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


#: Pages that state nothing of what their flights give: the beginning of these flights does as well.
SHORT = ("docs/python_api.md", "docs/how-to/batch.md")

#: Pages that take more than three seconds.
SLOW = (
    *("README.md", "docs/python_api.md", "docs/explanation/faults.md", "docs/start/own_aircraft.md"),
    *("docs/start/slow_servos.md", "docs/how-to/aircraft_file.md", "docs/how-to/batch.md", "docs/how-to/manoeuvre.md"),
    *("docs/how-to/import_model.md", "docs/how-to/new_estimator.md", "docs/how-to/own_simulator.md"),
    *("docs/how-to/record_and_replay.md", "docs/how-to/correct_simulator.md", "docs/how-to/view.md"),
    "docs/start/first_flight.md",
)


class Desk:
    """A folder with the bundled bags and aircraft, in which pages are worked through; a command is run once."""

    def __init__(self, folder: Path, bags: Path) -> None:
        self.folder = folder
        self.printed: dict[str, str] = {}
        self.first_names: dict[Path, dict[str, object]] = {}  # what a page's first block of Python leaves
        (folder / "config").symlink_to(ROOT / "config")
        (folder / "bags").symlink_to(bags)

    def work_through(self, page: Path) -> None:
        names: dict[str, object] = {"__name__": "documentation"}
        printed = ""
        for snippet in snippets(page):
            if snippet.is_output:
                assert_printed(snippet, printed)
            elif snippet.language == "yaml":
                self.write_yaml(snippet)
            elif snippet.language == "json":
                json.loads(snippet.text)
            elif snippet.language == "bash" and not snippet.not_run:
                printed = "".join(self.run(words, snippet) for words in commands(snippet.text))
            elif snippet.language == "python" and not snippet.not_run:
                with contextlib.redirect_stdout(io.StringIO()) as out:
                    exec(compile(snippet.text, snippet.place, "exec"), names)
                printed = out.getvalue()
                self.first_names.setdefault(page, dict(names))

    def write_yaml(self, snippet: Snippet) -> None:
        assert yaml.safe_load(snippet.text) is not None, snippet.place
        file = re.match(r"# (\w+\.yaml)\n", snippet.text)
        if file:
            (self.folder / file[1]).write_text(snippet.text, encoding="utf-8")

    def run(self, words: list[str], snippet: Snippet) -> str:
        key = " ".join(words)
        if key not in self.printed:
            assert words[0] == "sysid", f"{snippet.place}: {words[0]} is not run here: say '<!-- not run: why -->'"
            with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
                code = main(words[1:])
            assert code == 0, f"{snippet.place}: {key}\n{err.getvalue()}"
            self.printed[key] = out.getvalue()
        return self.printed[key]


def assert_printed(snippet: Snippet, printed: str) -> None:
    """Every line of the page, but for ``...``, was printed; spaces do not count."""
    flat = re.sub(r"\s+", " ", printed)
    for line in snippet.text.splitlines():
        words = re.sub(r"\s+", " ", line.strip())
        assert words in ("", "...") or words in flat, f"{snippet.place}: not printed: {words}\n{printed}"


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Desk:
    return Desk(tmp_path_factory.mktemp("desk"), ROOT / "bags")


@pytest.fixture(scope="module")
def short_desk(tmp_path_factory: pytest.TempPathFactory) -> Desk:
    """The same with the first 24 s of two flights."""
    bags = tmp_path_factory.mktemp("bags")
    for name in ("cdrw_multistep", "cdrw_random"):
        short_bag(name, 24.0, bags)
    return Desk(tmp_path_factory.mktemp("short_desk"), bags)


@pytest.mark.parametrize(
    "page", [pytest.param(page, marks=[pytest.mark.slow] * (name_of(page) in SLOW), id=name_of(page)) for page in PAGES]
)
def test_what_the_page_shows_can_be_done(
    page: Path, desk: Desk, short_desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk = short_desk if name_of(page) in SHORT else desk
    monkeypatch.chdir(desk.folder)
    monkeypatch.setenv("COLUMNS", "120")
    desk.work_through(page)


@pytest.mark.slow
def test_the_five_lines_of_the_python_interface_run(short_desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first block of docs/python_api.md, as it stands there."""
    page = ROOT / "docs" / "python_api.md"
    (code, *_) = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    lines = [line for line in code.splitlines() if line and not line.startswith(("from", "import"))]
    assert len(lines) == 5
    if page not in short_desk.first_names:
        monkeypatch.chdir(short_desk.folder)
        monkeypatch.setenv("COLUMNS", "120")
        short_desk.work_through(page)
    names = short_desk.first_names[page]
    assert "cdrw_multistep" in repr(names["flight"])
    assert type(names["figure"]).__name__ == "Figure"
    gap: Any = names["gap"]
    assert gap.verdict == "no_gap"  # the simulator made the bundled flight


def test_slow_pages_exist() -> None:
    assert set(SLOW) <= set(map(name_of, PAGES))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_block_says_its_language(page: Path) -> None:
    for snippet in snippets(page):
        assert snippet.language in LANGUAGES, f"{snippet.place}: got {snippet.language!r}, expected one of {LANGUAGES}"
        if snippet.language == "text" and not snippet.is_output:
            assert not re.search(r"^(\$ |sysid |python )", snippet.text, re.M), f"{snippet.place}: a command as text"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_that_are_not_run_have_options_that_exist(page: Path) -> None:
    for snippet in snippets(page):
        if snippet.language == "bash" and snippet.not_run:
            for words in commands(snippet.text):
                check(words, snippet.place)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_within_sentences_exist(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
    for command in re.findall(r"`(sysid \w+[^`]*)`", text):
        name = command.split()[1]
        if name == "COMMAND":
            continue
        known = build_parser(name).format_help() + options_of(name)
        for option in re.findall(r"(?<!\S)--[a-z-]+", command):
            assert option in known, f"{name_of(page)}: `{command}`: {option} is no option of sysid {name}"
    for path in re.findall(r"`(?:python )?((?:bench|docs|tools|sysid_node|test)/\w[\w/]*(?:\.py|/))", text):
        assert "/my_" in path or (ROOT / path).exists(), f"{name_of(page)}: {path} is not there"


def options_of(name: str) -> str:
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        build_parser(name).parse_args([name, "--help"])
    return out.getvalue()


def check(words: list[str], place: str) -> None:
    """That the command exists and has these options, without running it."""
    program, *arguments = words
    if program == "sysid":
        with contextlib.redirect_stderr(io.StringIO()) as err:
            try:
                build_parser(arguments[0]).parse_args(arguments)
            except SystemExit:
                pytest.fail(f"{place}: {err.getvalue()}")
    elif program == "make":
        targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
        assert {word for word in arguments if "=" not in word} <= targets, place
    elif program == "python" and arguments[0] == "-m":
        module = arguments[1]
        assert module in ("venv", "pip", "http.server") or find_spec(module), f"{place}: no module {module}"
        if module.startswith("bench."):
            check_options(ROOT / f"{module.replace('.', '/')}.py", arguments[2:], place)
    elif program == "python":
        source = ROOT / arguments[0]
        assert source.is_file(), f"{place}: {arguments[0]} is not there"
        check_options(source, arguments[1:], place)
    elif words[:3] == ["ros2", "run", "sysid_node"]:
        assert re.search(rf'"{arguments[2]} = ', (ROOT / "setup.py").read_text(encoding="utf-8")), f"{place}: {words}"
    elif words[:3] == ["ros2", "launch", "sysid_node"]:
        launch = (ROOT / "launch" / arguments[2]).read_text(encoding="utf-8")
        for argument in arguments[3:]:
            assert f'"{argument.partition(":=")[0]}"' in launch, f"{place}: {arguments[2]} has no {argument}"
    else:
        assert program in FOREIGN, f"{place}: what is {program}?"


def check_options(source: Path, arguments: list[str], place: str) -> None:
    """That a program's source has these options."""
    for option in (word.partition("=")[0] for word in arguments if word.startswith("--")):
        assert f'"{option}"' in source.read_text(encoding="utf-8"), f"{place}: {source.name} has no {option}"


def test_the_make_file_of_the_pages_is_complete() -> None:
    """``make help`` lists what the README speaks of."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in set(re.findall(r"`make (\w+)", readme)):
        assert re.search(rf"^{target}:", makefile, re.M), target


def test_pages_are_found() -> None:
    assert len(PAGES) > 20
