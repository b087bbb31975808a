"""The unit and the udev rules as text: what they name, and what must not be in them."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.commissioning.install_files import InstallError, packaged, unit, written_folders
from service.config.config_file import ConfigError, load_config

ROOT = Path(__file__).parents[3]
PACKAGED = packaged()


def settings(text: str) -> list[tuple[str, str]]:
    """A unit's settings in order, comments left out."""
    found = [line.partition("=") for line in text.splitlines() if "=" in line and not line.startswith("#")]
    return [(name, value) for name, _, value in found]


def of_config(folder: Path, more: str, camera: str = "path: pictures") -> str:
    """The unit for a configuration in `folder`."""
    (folder / "pictures").mkdir(exist_ok=True)
    path = folder / "config.yaml"
    path.write_text(f"camera: {{kind: files, {camera}}}\ncontroller: {{kind: none}}\ntriggers: []\n{more}")
    return unit(Path("/opt/combtrace/bin/combtrace"), path, "combtrace", load_config(path))


@pytest.mark.parametrize("name", PACKAGED)
def test_the_packaged_files_are_those_that_the_command_writes(name: str) -> None:
    assert (ROOT / "packaging" / name).read_text() == PACKAGED[name], (
        "write them anew: .venv/bin/python -m service.commissioning.install_files packaging"
    )


def test_the_unit_waits_for_ready_is_watched_reloads_and_comes_back() -> None:
    found = dict(settings(PACKAGED["systemd/combtrace.service"]))
    assert found["Type"] == "notify"
    assert found["Restart"] == "always"
    assert found["StartLimitIntervalSec"] == "0"
    assert found["ExecReload"] == "/bin/kill -HUP $MAINPID"
    assert found["WatchdogSec"] == "60"
    assert int(found["TimeoutStopSec"]) > 15, "the daemon's own last resort comes first"


def test_no_setting_closes_cameras_and_serial_ports() -> None:
    """PrivateDevices, and ProtectClock before systemd 253, take /dev/video0 and /dev/ttyUSB0 away."""
    names = {name for name, _ in settings(PACKAGED["systemd/combtrace.service"])}
    assert not names & {
        "PrivateDevices",
        "ProtectClock",
        "DeviceAllow",
        "DevicePolicy",
        "PrivateNetwork",
        "DynamicUser",
    }


def test_folders_outside_of_the_state_directory_are_opened_once_each(tmp_path: Path) -> None:
    text = of_config(
        tmp_path,
        "service: {state_dir: /var/lib/combtrace/state}\njournal: {path: /srv/cell/journal.sqlite}\n"
        "archive: {path: /srv/cell}\n",
    )
    assert [value for name, value in settings(text) if name == "ReadWritePaths"] == ["/srv/cell"]
    moved = of_config(tmp_path, "", camera="path: pictures, loop: false, watch: true, move_to: done")
    opened = [value for name, value in settings(moved) if name == "ReadWritePaths"]
    assert opened == [str(tmp_path / name) for name in ("var", "var/archive", "done", "pictures")]


def test_a_path_below_home_is_left_readable() -> None:
    found = dict(settings(unit(Path("/home/anna/.venv/bin/combtrace"), Path("/etc/c.yaml"), "anna", None)))
    assert found["ProtectHome"] == "read-only"
    assert dict(settings(PACKAGED["systemd/combtrace.service"]))["ProtectHome"] == "yes"


@pytest.mark.parametrize(
    "more",
    [
        "page: {token_file: /home/anna/tokens}",
        "page: {certificate: /home/anna/chain.pem, key: /home/anna/key.pem}",
        "recipes: [{number: 1, name: a, gcode: {template: /root/frame.ngc}}]",
    ],
)
def test_what_else_is_read_below_home_is_left_readable_too(tmp_path: Path, more: str) -> None:
    elsewhere = "service: {state_dir: /srv/s}\njournal: {path: /srv/j}\narchive: {path: /srv/a}\n"
    assert dict(settings(of_config(tmp_path, elsewhere + more)))["ProtectHome"] == "read-only"
    assert dict(settings(of_config(tmp_path, elsewhere)))["ProtectHome"] == "yes"


def test_a_camera_with_a_long_wait_gets_a_longer_watchdog(tmp_path: Path) -> None:
    text = of_config(tmp_path, "", camera="path: pictures, loop: false, watch: true, timeout_s: 60")
    assert dict(settings(text))["WatchdogSec"] == "180"


@pytest.mark.parametrize("name", ["two words", "per%cent", 'quo"te', "back\\slash", "dol$lar"])
def test_odd_characters_in_a_path_are_quoted(name: str) -> None:
    line = dict(settings(unit(Path("/opt/combtrace"), Path("/etc") / name, "combtrace", None)))["ExecStart"]
    named = line.removeprefix("/opt/combtrace run --config ")
    assert named.startswith('"')
    assert named.endswith('"')
    read = named[1:-1].replace("$$", "$").replace("%%", "%").replace('\\"', '"').replace("\\\\", "\\")
    assert read == f"/etc/{name}"


def test_what_no_unit_can_name_is_refused() -> None:
    with pytest.raises(InstallError, match="no unit can name"):
        unit(Path("/opt/combtrace"), Path("/etc/a\nExecStartPre=x"), "combtrace", None)
    with pytest.raises(InstallError, match="expected a name"):
        unit(Path("/opt/combtrace"), Path("/etc/config.yaml"), "root\nUser=x", None)


def test_the_folders_to_be_made_are_those_that_are_opened(tmp_path: Path) -> None:
    of_config(tmp_path, "adopted_recipes: kept/adopted.json\n")
    folders = [tmp_path / "var", tmp_path / "var" / "archive", tmp_path / "kept"]
    assert written_folders(load_config(tmp_path / "config.yaml")) == folders


def test_only_with_a_genicam_camera_the_unit_may_ask_for_network_cards(tmp_path: Path) -> None:
    families = dict(settings(of_config(tmp_path, "")))["RestrictAddressFamilies"]
    assert "AF_NETLINK" not in families
    path = tmp_path / "genicam.yaml"
    path.write_text('camera: {kind: genicam, serial: "GV7"}\ncontroller: {kind: none}\ntriggers: []\n')
    text = unit(Path("/opt/combtrace/bin/combtrace"), path, "combtrace", load_config(path))
    assert dict(settings(text))["RestrictAddressFamilies"] == f"{families} AF_NETLINK"


@pytest.mark.parametrize("names", ["", ', serial: "1", user_name: "over table 2"'])
def test_a_genicam_camera_has_one_name(tmp_path: Path, names: str) -> None:
    path = tmp_path / "config.yaml"
    path.write_text(f"camera: {{kind: genicam{names}}}\ncontroller: {{kind: none}}\ntriggers: []\n")
    with pytest.raises(ConfigError, match="expected one: `combtrace cameras` lists them"):
        load_config(path)
