"""A file or a bag as output: never over an input or something else, and never half-written."""

import pytest

from sysid_node.errors import InputError
from sysid_node.report.files.outputs.output_file import check_file, output_bag, write_file

MARK = "sysid export"


def bag(path, text="new", truth=None):
    path.mkdir()
    (path / "metadata.yaml").write_text(text)
    if truth is not None:
        path.with_name(f"{path.name}.truth.json").write_text(truth)


def test_an_earlier_file_of_the_command_is_replaced(tmp_path):
    write_file(tmp_path / "model.xml", f"<!-- {MARK} --> old")
    check_file(tmp_path / "model.xml", [], MARK, force=False)
    write_file(tmp_path / "model.xml", "new")
    assert [p.name for p in tmp_path.iterdir()] == ["model.xml"]
    assert (tmp_path / "model.xml").read_text() == "new"


def test_another_file_needs_force(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(InputError, match="holds something else; give --force"):
        check_file(tmp_path / "thesis.tex", [], MARK, force=False)
    check_file(tmp_path / "thesis.tex", [], MARK, force=True)


@pytest.mark.parametrize("force", [False, True])
def test_the_input_is_never_the_output(tmp_path, force):
    (tmp_path / "a.yaml").write_text(MARK)
    (tmp_path / "link.yaml").symlink_to(tmp_path / "a.yaml")
    with pytest.raises(InputError, match="is the input"):
        check_file(tmp_path / "link.yaml", [tmp_path / "a.yaml"], MARK, force=force)


@pytest.mark.parametrize("path", ["folder", "file/model.xml", "file/within/model.xml", "x" * 300])
def test_a_file_that_cannot_be_written_is_refused(tmp_path, path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--out"):
        check_file(tmp_path / path, [], MARK, force=True)


def test_missing_folders_are_made(tmp_path):
    path = tmp_path / "models" / "plane" / "model.xml"
    check_file(path, [], MARK, force=False)
    assert not any(tmp_path.iterdir())  # before there is something to write
    write_file(path, "new")
    assert path.read_text() == "new"


def test_a_bag_appears_whole_with_its_truth(tmp_path):
    with output_bag(tmp_path / "bag", truth=True) as path:
        bag(path, truth="{}")
        assert not (tmp_path / "bag").exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bag", "bag.truth.json"]


def test_a_bag_that_fails_leaves_nothing(tmp_path):
    with (
        pytest.raises(InputError, match=f"{tmp_path}/bag: cannot be written: No space left"),
        output_bag(tmp_path / "bag") as path,
    ):
        bag(path)
        raise OSError(28, "No space left on device")
    assert not any(tmp_path.iterdir())


def test_an_existing_bag_needs_force_and_the_truth_goes_with_it(tmp_path):
    bag(tmp_path / "bag", "old", truth="old")
    with pytest.raises(InputError, match="exists already"), output_bag(tmp_path / "bag"):
        pytest.fail("the work began")
    with output_bag(tmp_path / "bag", force=True) as path:
        bag(path)
    assert [p.name for p in tmp_path.iterdir()] == ["bag"]
    assert (tmp_path / "bag" / "metadata.yaml").read_text() == "new"


def test_truth_of_another_flight_is_never_taken_for_this_ones(tmp_path):
    (tmp_path / "bag.truth.json").write_text("{}")
    with pytest.raises(InputError, match="is of another flight"), output_bag(tmp_path / "bag"):
        pytest.fail("the work began")


def test_a_folder_that_is_no_bag_is_kept_even_with_force(tmp_path):
    bag(tmp_path / "home")
    (tmp_path / "home" / "thesis.tex").write_text("")
    with (
        pytest.raises(InputError, match=r"holds thesis.tex, so it is no bag"),
        output_bag(tmp_path / "home", force=True),
    ):
        pytest.fail("the work began")


def test_a_second_run_on_the_bag_says_so(tmp_path):
    with output_bag(tmp_path / "bag") as path, pytest.raises(InputError, match="another run"):
        bag(path)
        with output_bag(tmp_path / "bag"):
            pytest.fail("the work began")
