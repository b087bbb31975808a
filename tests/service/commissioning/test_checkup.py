"""What `combtrace check` finds, and that it disturbs nothing."""

from __future__ import annotations

import grp
import importlib.util
import json
import os
import pwd
import shutil
import socket
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from service.check_result import CheckResult, Level
from service.cli.main import main
from service.commissioning.checkup.devices import check_devices
from service.commissioning.checkup.files import check_files
from service.commissioning.checkup.listening import check_listening
from service.commissioning.checkup.opcua import check_opcua
from service.commissioning.checkup.page import check_page
from service.commissioning.checkup.running import holder
from service.commissioning.checkup.storage import check_storage
from service.config.adopted_recipes import Word, keep_adopted
from service.config.config import Config, Opcua
from service.config.config_file import SAMPLES, load_config
from service.config.recipe_keys import with_values
from service.daemon.lock import Lock, NameLock, name_is_held
from service.records.job import TriggerStamp
from service.records.journal import Journal
from tests.support.interop.opcua import identity
from tests.support.nobody import NOBODY, needs_root, open_folder, python_as_nobody


def written(folder: Path, camera: str = "{kind: files, path: in}", more: str = "") -> Path:
    path = folder / "config.yaml"
    (folder / "in").mkdir(exist_ok=True)
    path.write_text(
        f"camera: {camera}\ncontroller: {{kind: none}}\nservice: {{state_dir: state}}\n"
        f"journal: {{path: journal.sqlite}}\narchive: {{path: archive}}\n{more}\n"
    )
    return path


def config(folder: Path, camera: str = "{kind: files, path: in}", more: str = "") -> Config:
    return load_config(written(folder, camera, more))


def test_adopted_recipes_are_told_and_those_that_the_file_has_superseded(tmp_path: Path) -> None:
    kept = "adopted_recipes: kept/adopted.json\nrecipes: [{number: 1, name: sheet}, {number: 2, name: other}]\n"
    settings = config(tmp_path, more=kept)
    assert settings.adopted_recipes is not None
    settings.adopted_recipes.parent.mkdir()
    for number in (1, 2):
        recipe = with_values(settings.recipe(number), {"tolerance_mm": 0.5})
        keep_adopted(settings.adopted_recipes, settings, recipe, Word("anna", "2026-11-23", "less points"))
    found = list(check_files(config(tmp_path, more=kept.replace("name: other", "name: other, edge: cut"))))
    told = [(one.level, one.text) for one in found if one.part == "adopted"]
    assert told[0] == (Level.OK, "recipe 1: adopted by anna at 2026-11-23: less points")
    assert told[1][0] is Level.WARNING
    assert "The configuration's own was changed since" in told[1][1]
    gone = config(tmp_path, more="adopted_recipes: kept/adopted.json\nrecipes: [{number: 1, name: sheet}]\n")
    assert "is no longer there" in [one.text for one in check_files(gone) if one.part == "adopted"][1]
    assert part(list(check_storage(settings, running=False)), "adopted").level is Level.OK


def part(found: list[CheckResult], name: str) -> CheckResult:
    return next(one for one in found if one.part == name)


@pytest.fixture
def reachable() -> Iterator[Path]:
    with open_folder() as folder:
        yield folder


WATCHED = "{kind: files, path: in, loop: false, watch: true, move_to: done}"


def test_an_empty_watched_folder_is_no_fault_and_a_picture_in_it_is_not_taken(tmp_path: Path) -> None:
    watched = config(tmp_path, WATCHED)
    camera = part(list(check_devices(watched, None)), "camera")
    assert (camera.level, "no picture yet" in camera.text) == (Level.OK, True)
    shutil.copy(SAMPLES / "1-rectangle.jpg", tmp_path / "in")
    assert "1 picture waiting" in part(list(check_devices(watched, None)), "camera").text
    assert (tmp_path / "in" / "1-rectangle.jpg").exists()
    shutil.rmtree(tmp_path / "in")
    assert part(list(check_devices(watched, None)), "camera").level is Level.FAULT


def test_a_running_service_is_found_without_taking_its_lock(tmp_path: Path) -> None:
    path = tmp_path / "combtrace.lock"
    assert holder(path) is None
    lock = Lock(path)
    assert holder(path) == os.getpid()
    lock.release()
    assert holder(path) is None


def test_a_held_name_is_seen_and_an_other_is_not() -> None:
    lock = NameLock("127.0.0.1:5020/1")
    assert name_is_held("127.0.0.1:5020/1")
    assert not name_is_held("127.0.0.1:5020/11")
    assert not name_is_held("27.0.0.1:5020/1")
    lock.release()
    assert not name_is_held("127.0.0.1:5020/1")


def test_disks_are_a_fault_a_warning_or_well_by_what_is_kept_free(tmp_path: Path) -> None:
    free = shutil.disk_usage(tmp_path).free
    for share, level in ((2.0, Level.FAULT), (0.75, Level.WARNING), (0.1, Level.OK)):
        text = f"journal: {{path: j.sqlite, min_free_bytes: {int(free * share)}}}\narchive: {{max_bytes: 0}}"
        path = tmp_path / "config.yaml"
        path.write_text(f"camera: {{kind: files, path: in}}\ncontroller: {{kind: none}}\n{text}\n")
        found = list(check_storage(load_config(path), running=False))
        assert part(found, "disk").level is level
        assert bool(part(found, "disk").next_step) == (level is not Level.OK)
        assert "archive" not in {one.part for one in found}


def test_the_journal_is_read_and_neither_made_nor_migrated(tmp_path: Path) -> None:
    settings = config(tmp_path)
    assert part(list(check_storage(settings, running=False)), "journal").text.endswith("no job yet")
    assert not settings.journal.path.exists()
    journal = Journal(settings.journal.path)
    journal.take(TriggerStamp("manual"))
    text = part(list(check_storage(settings, running=True)), "journal").text
    assert text.endswith("no job yet, 1 in flight")
    journal.close()


def test_a_damaged_journal_is_a_fault_that_says_what_comes_of_it(tmp_path: Path) -> None:
    settings = config(tmp_path)
    settings.journal.path.write_bytes(b"SQLite format 3\0" + bytes(5000))
    found = part(list(check_storage(settings, running=False)), "journal")
    assert found.level is Level.FAULT
    assert "moved aside" in found.next_step


def test_a_clock_behind_the_last_job_is_a_warning(tmp_path: Path) -> None:
    settings = config(tmp_path)
    journal = Journal(settings.journal.path)
    journal.take(TriggerStamp("manual"))
    journal.close()
    assert part(list(check_storage(settings, running=False)), "clock").level is Level.OK
    yesterday = (datetime.now(UTC) - timedelta(days=1)).timestamp()
    found = part(list(check_storage(settings, running=False, now=lambda: yesterday)), "clock")
    assert (found.level, "before the last job" in found.text) == (Level.WARNING, True)


@needs_root
def test_who_may_not_enter_the_services_folders_gets_a_line_and_no_traceback(reachable: Path) -> None:
    path = written(reachable, more="table: {file: closed/table}")
    path.write_text(path.read_text().replace("journal: {path: journal", "journal: {path: state/journal"))
    journal = Journal(reachable / "state" / "journal.sqlite")
    journal.take(TriggerStamp("manual"))
    journal.close()
    for name in ("state", "archive", "closed"):
        (reachable / name).mkdir(exist_ok=True, mode=0o750)
        (reachable / name).chmod(0o750)
    state = reachable / "state"
    commands = ("status", "jobs", "jobs show 1", "replay --limit 1", "replay 1", "check")
    status, *read, one, check = told_to_nobody(path, *commands)
    assert "User root and group root may" in status[1]
    unread = f"{state}/journal.sqlite: cannot be looked at: Permission denied"
    assert [(refused, unread in text) for refused, text in read] == [(2, True)] * 3
    assert (one[0], "archive: cannot be looked at: Permission denied" in one[1]) == (2, True)
    run = python_as_nobody(
        "from service.cli.main import main", "main(['run', '--once', '--config', sys.argv[1]])", path
    )
    assert "closed/table: cannot be looked at: Permission denied" in run.stderr
    assert "Traceback" not in run.stderr
    assert check[0] == 1
    assert f"warn  service      {state}: may not be entered, so whether the service runs is not known" in check[1]
    assert "camera " not in check[1]
    path.chmod(0o600)
    assert "Run this as a user who may read it" in told_to_nobody(path, "jobs")[0][1]


def told_to_nobody(config: Path, *commands: str) -> list[tuple[int, str]]:
    """The exit status of each command, and all that it printed."""
    code = (
        "ended = [called(*command.split(), '--config', sys.argv[1]) for command in sys.argv[2:]]\n"
        "print(json.dumps([(one.returncode, one.stdout + one.stderr) for one in ended]))"
    )
    prepare = "import json\nfrom tests.support.processes.processes import called"
    done = python_as_nobody(prepare, code, config, *commands)
    assert (done.returncode, done.stderr) == (0, "")
    return [(status, text) for status, text in json.loads(done.stdout)]


@needs_root
def test_what_the_user_may_not_use_names_the_group_that_may(reachable: Path) -> None:
    device = reachable / "ttyUSB0"
    device.touch()
    device.chmod(0o660)
    group = next(one for one in grp.getgrall() if one.gr_gid != 0)
    os.chown(device, 0, group.gr_gid)
    path = written(reachable, more=f"triggers: [{{kind: serial, port: {device}}}]")
    done = python_as_nobody(
        "from pathlib import Path; from service.config.config_file import load_config\n"
        "from service.commissioning.checkup import devices, storage\n"
        "config = load_config(Path(sys.argv[1]))",
        "for one in (*devices.check_permissions(config), *storage.check_storage(config, running=False)):\n"
        "    print(one.level.label, one.part, one.text, one.next_step)",
        path,
    )
    assert done.returncode == 0, done.stderr
    user = pwd.getpwuid(NOBODY).pw_name
    assert (
        f"FAULT permissions {device}: user {user} may not read and write it, group {group.gr_name} may" in done.stdout
    )
    assert f"usermod -aG {group.gr_name} {user}" in done.stdout
    for name in ("state", "archive", "journal"):
        assert f"FAULT {name} " in done.stdout


# --- the command ------------------------------------------------------------------------------------------------------


def test_one_recipe_is_one_recipe(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(SAMPLES / "1-rectangle.jpg", written(tmp_path).parent / "in")
    assert main(["check", "--config", str(tmp_path / "config.yaml")]) == 0
    told = capsys.readouterr().out
    assert "1 recipe, no triggers: jobs begin by hand only" in told
    assert "calibration  none" in told


def test_a_step_above_twice_the_core_is_a_warning_where_both_are_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(SAMPLES / "1-rectangle.jpg", written(tmp_path).parent / "in")
    recipe = "{number: 4, name: a, method: sliding-matrix, parameters: {step_px: 21, core_px: CORE}}"
    for core, warned in ((10, True), (11, False)):
        path = written(tmp_path, more=f"recipes: [{recipe.replace('CORE', str(core))}]\ndefault_recipe: 4")
        assert main(["check", "--config", str(path)]) == 0
        told = capsys.readouterr().out
        assert ("warn  recipes      recipe 4: step_px is 21, expected up to 20, twice core_px" in told) == warned


def test_each_mistake_is_a_finding_and_keys_of_other_kinds_are_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path)
    keys = "host: a, port: 1, device_id: 1, word_order: big, readback: true, timeout_s: 1, colour: red"
    path.write_text(path.read_text().replace("{kind: none}", f"{{kind: none, {keys}}}"))
    assert main(["check", "--config", str(path), "--json", "-"]) == 2
    out = json.loads(capsys.readouterr().out)
    texts = [one["text"] for one in out["findings"]]
    assert (out["status"], len(texts)) == ("fault", 2)
    assert "controller: kind none has not the keys of other kinds, take them out: host, port, device_id" in texts[0]
    assert "controller.colour: unknown key" in texts[1]


def test_warnings_are_exit_status_0_unless_strict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, more="table: {file: table.npz}")
    shutil.copy(SAMPLES / "1-rectangle.jpg", tmp_path / "in")
    assert main(["check", "--config", str(path)]) == 0
    assert "warn  table" in capsys.readouterr().out
    assert main(["check", "--config", str(path), "--strict"]) == 1


def test_a_result_file_is_whole_or_as_it_was(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, result = written(tmp_path), tmp_path / "result.json"
    result.write_text("old")
    assert main(["check", "--config", str(path), "--json", str(tmp_path / "nowhere" / "x.json")]) == 2
    error = capsys.readouterr()
    assert "cannot be written" in error.err
    assert "ok " not in error.out, "nothing is done before the file is there"
    assert result.read_text() == "old"
    main(["check", "--config", str(path), "--no-devices", "--json", str(result)])
    assert json.loads(result.read_text())["config"] == str(path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["config.yaml", "in", "result.json"]


@pytest.mark.parametrize(
    ("gcode", "text"),
    [
        ("{template: none.txt}", "none.txt: No such file"),
        ("{template: own.txt}", "no $rings in it"),
        ("{safe_z_mm: 10}", "safe_z_mm 10 is not above the block of 20 mm"),
        ("{lead_in_mm: 900}", None),
    ],
)
def test_exports_that_no_job_could_make_are_told_by_the_check(tmp_path: Path, gcode: str, text: str | None) -> None:
    (tmp_path / "own.txt").write_text("G21\n")
    recipes = f"default_recipe: 3\nrecipes: [{{number: 3, name: a, exports: [gcode, svg], gcode: {gcode}}}]"
    found = [one for one in check_files(config(tmp_path, more=recipes)) if one.part == "exports"]
    assert len(found) == 1
    assert (found[0].level is Level.FAULT) == (text is not None)
    assert text is None or "recipe 3: gcode: " in found[0].text
    assert text is None or text in found[0].text


@pytest.mark.parametrize(
    ("drawing", "text"),
    [
        ('{"type": "Polygon", "coordinates": [[[0, 0], [40, 0], [40, 30], [0, 0]]]}', None),
        ('{"type": "Polygon", "coordinates": [[[0, 0], [40, 0], [40, 30], [0, 30]]]}', "is open: ring 0 ends at"),
        ("", "is no GeoJSON"),
    ],
)
def test_parts_are_read_and_what_is_wrong_with_one_is_told(tmp_path: Path, drawing: str, text: str | None) -> None:
    (tmp_path / "part.json").write_text(drawing)
    recipes = (
        f"calibration: {{file: {SAMPLES / 'calibration.yaml'}}}\n"
        "default_recipe: 3\nrecipes: [{number: 3, name: a, part: {file: part.json, units: mm}}]"
    )
    found = [one for one in check_files(config(tmp_path, more=recipes)) if one.part == "parts"]
    assert len(found) == 1
    assert (found[0].level is Level.FAULT) == (text is not None)
    expected = text or "recipe 3: part.json, 40.0 x 30.0 mm, 0 holes, drawn in mm"
    assert expected in found[0].text


def test_without_exports_there_is_nothing_to_say_of_them(tmp_path: Path) -> None:
    assert not [one for one in check_files(config(tmp_path)) if one.part == "exports"]


# --- what listens -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", ["metrics", "page", "opcua"])
def test_a_port_that_another_program_has_is_a_fault_unless_the_service_runs(tmp_path: Path, part: str) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        settings = config(tmp_path, more=f"{part}: {{port: {port}}}\n")
        (found,) = check_listening(settings, None)
        assert (found.part, found.level) == (part, Level.FAULT)
        assert f"127.0.0.1:{port} cannot be listened on: Address already in use" in found.text
        assert all(one.level is Level.OK for one in check_listening(settings, 7))
    assert all(one.level is Level.OK for one in check_listening(settings, None))


def test_metrics_without_their_package_are_a_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    (found,) = check_listening(config(tmp_path, more="metrics: {}\n"), None)
    assert (found.level, found.text) == (Level.FAULT, "prometheus_client is not installed")


def test_telemetry_needs_its_package_and_a_password_that_is_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "secret").write_text("a word\n")
    (tmp_path / "secret").chmod(0o644)
    telemetry = "telemetry: {node: cell-1, username: cell-1, password_file: secret}\n"
    (found,) = check_listening(config(tmp_path, more=telemetry), None)
    assert found.level is Level.FAULT
    assert "others may read it" in found.text
    (tmp_path / "secret").chmod(0o600)
    (found,) = check_listening(config(tmp_path, more=telemetry), None)
    assert (found.level, found.text) == (Level.OK, "combtrace/cell-1 to 127.0.0.1:1883")
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    (found,) = check_listening(config(tmp_path, more=telemetry), None)
    assert (found.level, found.text) == (Level.FAULT, "paho-mqtt is not installed")


# --- OPC UA -------------------------------------------------------------------------------------------------------


def test_opcua_tells_whom_it_lets_in_and_what_cannot_be_used(tmp_path: Path) -> None:
    settings = config(tmp_path, more="opcua: {users_file: users}\n")
    assert settings.opcua is not None
    (found,) = check_opcua(settings.opcua, tmp_path)
    assert (found.level, "users: cannot be read" in found.text) == (Level.FAULT, True)
    (tmp_path / "users").write_text(f"anna {'a' * 24}\n")
    (tmp_path / "users").chmod(0o600)
    trusted = tmp_path / "opcua" / "trusted"
    trusted.mkdir(parents=True)
    (trusted / "notes.txt").write_text("certificates go here")
    empty, found = check_opcua(settings.opcua, tmp_path)
    assert (empty.level, "no client is trusted" in empty.text) == (Level.WARNING, True)
    assert found.text == "127.0.0.1:4840, 0 clients trusted, halted and reset by anna"
    (trusted / "client.pem").write_bytes(identity(tmp_path / "client").certificate.read_bytes())
    (found,) = check_opcua(settings.opcua, tmp_path)
    assert "1 clients trusted" in found.text
    own = identity(tmp_path / "own", days=3)
    own.key.chmod(0o600)
    plants = Opcua(certificate=own.certificate, key=own.key)
    assert any("its certificate ends on" in one.text for one in check_opcua(plants, tmp_path))


# --- the operator's page ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("page", "level", "text"),
    [
        ("{}", Level.OK, "127.0.0.1:9770, it can only be looked at"),
        ("{token_file: tokens}", Level.OK, "orders by anna"),
        ("{token_file: nowhere}", Level.FAULT, "cannot be read"),
        ("{host: 0.0.0.0}", Level.WARNING, "open to the network without TLS"),
        ("{certificate: tokens, key: tokens}", Level.FAULT, "cannot be used"),
    ],
)
def test_a_page_that_is_not_safe_or_cannot_be_served_is_told(
    tmp_path: Path, page: str, level: Level, text: str
) -> None:
    (tmp_path / "tokens").write_text("anna 0123456789abcdefghij\n")
    (tmp_path / "tokens").chmod(0o600)
    settings = config(tmp_path, more=f"page: {page}\n").page
    assert settings is not None
    assert any(one.level is level and text in one.text for one in check_page(settings))
