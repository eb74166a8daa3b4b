"""The folder of ``--out``: what is refused before the work, what a failure leaves, and what is replaced."""

import errno
import json
import os

import pytest

from sysid_node.errors import InputError
from sysid_node.report.files.outputs.output_folder import STAGE, output_folder
from sysid_node.version import VERSION


def results(folder, table="", extra=()):
    """Write what a command writes: a summary, a table, and files in a folder beneath."""
    (folder / "summary.json").write_text('{"aircraft": "kestrel"}')
    (folder / "table.csv").write_text(table)
    for name in extra:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(name)


def run(folder, command="replay", *, table="", extra=(), **options):
    with output_folder(folder, command, **options) as out:
        out.publish(lambda stage: results(stage, table, extra))


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_the_summary_lists_the_command_the_version_and_all_files(tmp_path):
    run(tmp_path / "new" / "out", extra=["bag/metadata.yaml"])
    written = json.loads((tmp_path / "new" / "out" / "summary.json").read_text())["written"]
    files = ["bag/metadata.yaml", "summary.json", "table.csv"]
    assert written == {"command": "replay", "version": VERSION, "files": files}
    assert sorted(contents(tmp_path / "new" / "out")) == files


def test_a_later_run_of_the_same_command_leaves_nothing_of_the_earlier(tmp_path):
    run(tmp_path, table="earlier", extra=["bag/metadata.yaml", "old.csv"])
    run(tmp_path, table="later", extra=["bag/other.yaml"])
    assert sorted(contents(tmp_path)) == ["bag/other.yaml", "summary.json", "table.csv"]
    assert (tmp_path / "table.csv").read_text() == "later"


@pytest.mark.parametrize("name", ["flight.mcap", "notes.txt", "bag/notes.txt", ".hidden"])
@pytest.mark.parametrize("earlier", [False, True])
def test_a_file_that_the_command_did_not_write_is_named_and_nothing_changes(tmp_path, name, earlier):
    if earlier:
        run(tmp_path, extra=["bag/metadata.yaml"])
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("mine")
    before = contents(tmp_path)
    with pytest.raises(
        InputError, match=f"holds {name.rpartition('/')[2]}, which sysid replay did not write; give --force"
    ):
        run(tmp_path)
    assert contents(tmp_path) == before


def test_results_of_another_command_are_refused(tmp_path):
    run(tmp_path, "identify")
    with pytest.raises(InputError, match="which sysid identify wrote"):
        run(tmp_path, "replay")


def test_force_removes_results_of_another_command_and_keeps_other_files(tmp_path):
    run(tmp_path, "identify", extra=["noise.csv"])
    (tmp_path / "mine.txt").write_text("mine")
    run(tmp_path, "replay", force=True)
    assert sorted(contents(tmp_path)) == ["mine.txt", "summary.json", "table.csv"]


def test_force_replaces_results_that_an_earlier_version_did_not_list(tmp_path):
    for name in ("summary.json", "gap.json", "noise.csv", "flight7.csv"):
        (tmp_path / name).write_text("{}")
    with pytest.raises(InputError, match="--force"):
        run(tmp_path)
    run(tmp_path, force=True)
    assert sorted(contents(tmp_path)) == ["flight7.csv", "summary.json", "table.csv"]


def test_a_flight_that_lies_where_a_bag_of_results_goes_is_kept_even_with_force(tmp_path):
    (tmp_path / "flight").mkdir()
    (tmp_path / "flight" / "flight.mcap").write_text("a flight")
    with pytest.raises(InputError, match=r"holds flight.mcap.*move it"):
        run(tmp_path, "excite", extra=["flight/metadata.yaml"], force=True)
    assert contents(tmp_path) == {"flight/flight.mcap": "a flight"}


@pytest.mark.parametrize("given", ["out", "out/bag", "."])
def test_an_input_is_never_the_output(tmp_path, given):
    (tmp_path / "out" / "bag").mkdir(parents=True)
    with (
        pytest.raises(InputError, match="would write into the input"),
        output_folder(tmp_path / "out", "replay", inputs=[tmp_path / given], force=True),
    ):
        pass


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EFBIG])
def test_a_full_disk_leaves_the_earlier_results(tmp_path, number):
    run(tmp_path, table="earlier", extra=["bag/metadata.yaml"])
    before = contents(tmp_path)

    def full(stage):
        results(stage, "half")
        raise OSError(number, os.strerror(number))

    with pytest.raises(InputError, match=os.strerror(number)), output_folder(tmp_path, "replay") as out:
        out.publish(full)
    assert contents(tmp_path) == before


def test_a_failed_run_leaves_no_folder(tmp_path):
    with pytest.raises(ZeroDivisionError), output_folder(tmp_path / "a" / "b", "replay"):
        raise ZeroDivisionError
    assert not any(tmp_path.iterdir())


def test_an_error_names_the_folder_that_was_given(tmp_path):
    def failing(stage):
        raise InputError(f"{stage}/x.csv: wrong")

    with pytest.raises(InputError) as error, output_folder(tmp_path / "out", "replay") as out:
        out.publish(failing)
    assert str(error.value) == f"{tmp_path}/out/x.csv: wrong"


@pytest.mark.parametrize(
    ("path", "said"), [("file", "is a file"), ("file/out", "cannot be written"), ("x" * 300, "cannot be written")]
)
def test_a_place_that_cannot_be_a_folder_is_refused_before_the_work(tmp_path, path, said):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=said), output_folder(tmp_path / path, "replay"):
        pytest.fail("the work began")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_refused_before_the_work(tmp_path):
    (tmp_path / "out").mkdir(mode=0o500)
    with pytest.raises(InputError, match="Permission denied"), output_folder(tmp_path / "out", "replay"):
        pytest.fail("the work began")


def test_a_second_run_on_the_folder_says_so(tmp_path):
    with output_folder(tmp_path, "replay"), pytest.raises(InputError, match="another run is writing"):
        run(tmp_path)
    run(tmp_path)


def test_what_a_killed_run_left_is_removed(tmp_path):
    (tmp_path / STAGE).mkdir()
    (tmp_path / STAGE / "table.csv").write_text("half")
    run(tmp_path)
    assert sorted(contents(tmp_path)) == ["summary.json", "table.csv"]


def test_what_a_command_keeps_while_it_works_may_be_there(tmp_path):
    (tmp_path / "unfinished").mkdir()
    (tmp_path / "unfinished" / "step.npz").write_text("")
    run(tmp_path, "gap", working=["unfinished"])
    assert (tmp_path / "unfinished" / "step.npz").exists()
