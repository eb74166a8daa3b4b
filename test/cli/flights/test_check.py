"""``sysid check``: one table a log, and what to change."""

from simulated_logs import FULL_RATES, PX4_DEFAULT, dataflash_log, px4_log

from sysid_node.cli.main import main


def test_a_good_log_and_a_slow_one(tmp_path, capsys):
    px4_log(tmp_path / "good.ulg")
    px4_log(tmp_path / "slow.ulg", PX4_DEFAULT)
    assert main(["check", str(tmp_path / "good.ulg"), str(tmp_path / "slow.ulg")]) == 0
    good, slow = capsys.readouterr().out.split("slow.ulg")
    assert "replay, identify, gap: yes, without vanes" in good
    assert "actuator_servos" in good
    assert "change" not in good
    assert "actuator_servos comes at 10 Hz; 20 Hz are needed" in slow
    assert "change    SDLOG_PROFILE = 27" in slow
    assert "pitch: well" in slow


def test_ardupilots_setting_is_named(tmp_path, capsys):
    dataflash_log(tmp_path / "flight.bin", {**FULL_RATES, "controls": 10.0})
    assert main(["check", str(tmp_path / "flight.bin")]) == 0
    assert "LOG_BITMASK: set bit 13" in capsys.readouterr().out


def test_the_others_are_shown_before_what_cannot_be_read_is_refused(tmp_path, capsys):
    (tmp_path / "empty.ulg").write_bytes(b"")
    px4_log(tmp_path / "good.ulg", drop=("airspeed_validated",))
    assert main(["check", str(tmp_path / "empty.ulg"), str(tmp_path / "good.ulg")]) == 2
    out, err = capsys.readouterr()
    assert "no airspeed in it" in out
    assert "empty.ulg: is empty" in err
    assert err.count("\n") == 1
