"""config.yaml: every mistake is named with its path, what was seen and what is expected."""

from __future__ import annotations

import json
import os
from dataclasses import fields
from pathlib import Path

import pytest
import yaml

from service.config import reference as config_reference
from service.config.cameras import FilesCamera
from service.config.config import Config
from service.config.config_file import ConfigError, config_schema, default_config, load_config
from service.config.controllers import ModbusTcp, NoController
from service.config.plain_recipe import PlainRecipe
from service.config.triggers import SerialTrigger

ROOT = Path(__file__).parents[3]
SMALL = "camera: {kind: files, path: in}\ncalibration: {file: c.yaml}\ncontroller: {kind: modbus-tcp}\n"


def load(folder: Path, text: str | bytes) -> Config:
    path = folder / "config.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_config(path)


def mistakes(folder: Path, text: str | bytes) -> list[str]:
    with pytest.raises(ConfigError) as error:
        load(folder, text)
    lines = str(error.value).splitlines()
    prefix = f"{folder / 'config.yaml'}: "
    assert all(line.startswith(prefix) for line in lines)
    return [line.removeprefix(prefix) for line in lines]


def test_the_shipped_config_is_the_contracts_example_and_loads() -> None:
    config = load_config(ROOT / "config.yaml")
    assert isinstance(config.camera, FilesCamera)
    assert isinstance(config.controller, ModbusTcp)
    controller = config.controller
    assert (controller.link_address, controller.service_address, controller.contour_address) == (0, 16, 32)
    assert (controller.device_id, controller.single_write) == (1, "fc6")
    assert (controller.payload_capacity, controller.word_order, controller.handshake) == (1984, "big", "full")
    assert (controller.valid_for_s, controller.job_timeout_s, controller.max_repeats) == (30, 120, 3)
    assert config.recipes[0].name == "default"


def test_every_default_of_the_shipped_config_is_the_models_default() -> None:
    """What config.yaml shows as usual must be what a file without these keys gives."""
    shown = load_config(ROOT / "config.yaml")
    data = yaml.safe_load((ROOT / "config.yaml").read_text())
    bare = {"camera": data["camera"], "calibration": {"file": "x"}, "controller": {"kind": "modbus-tcp", "port": 5020}}
    default = Config.model_validate(bare)
    assert shown.recipes == default.recipes
    assert shown.controller == default.controller
    assert shown.default_recipe == default.default_recipe


def test_the_plain_recipe_is_the_default_one() -> None:
    (recipe,) = default_config().recipes
    plain = PlainRecipe()
    for key in fields(PlainRecipe):  # by repr: 20 is told otherwise than 20.0
        assert (key.name, repr(getattr(plain, key.name))) == (key.name, repr(getattr(recipe, key.name)))


def test_line_1_of_the_shipped_config_names_the_schema() -> None:
    first = (ROOT / "config.yaml").read_text().splitlines()[0]
    assert first == "# yaml-language-server: $schema=config.schema.json"
    assert (ROOT / "config.schema.json").exists()


def test_schema_and_reference_are_fresh() -> None:
    how = "run: python -m service.config.reference docs/reference/configuration.md config.schema.json"
    assert (ROOT / "config.schema.json").read_text() == config_reference.schema_text(), how
    assert (ROOT / "docs" / "reference" / "configuration.md").read_text() == config_reference.reference(), how


def test_every_section_of_the_configuration_is_in_the_reference() -> None:
    told = {model.__name__ for _, models in config_reference.SECTIONS for model in models}
    assert told - {"Config"} == set(config_schema()["$defs"])


def test_every_key_has_a_sentence_and_every_number_its_bounds() -> None:
    schema = config_schema()
    for name, model in [("Config", schema), *schema["$defs"].items()]:
        for key, value in model.get("properties", {}).items():
            if key == "kind":
                continue
            assert value.get("description", "").endswith("."), f"{name}.{key}"
            for branch in value.get("anyOf", [value]):
                if branch.get("type") in ("integer", "number") and not {"enum", "const"} & branch.keys():
                    low = "minimum" in branch or "exclusiveMinimum" in branch
                    high = "maximum" in branch or "exclusiveMaximum" in branch
                    assert low, f"{name}.{key} has no lower bound"
                    assert high, f"{name}.{key} has no upper bound"


def test_relative_paths_count_from_the_files_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir("/")
    config = load(tmp_path, SMALL)
    assert config.camera.path == tmp_path / "in"
    assert config.calibration is not None
    assert config.calibration.file == tmp_path / "c.yaml"
    assert config.journal.path == tmp_path / "var" / "journal.sqlite"


def test_both_paths_of_a_file_camera_count_from_the_files_folder(tmp_path: Path) -> None:
    config = load(tmp_path, SMALL.replace("path: in", "path: in, loop: false, watch: true, move_to: done"))
    assert (config.camera.path, config.camera.move_to) == (tmp_path / "in", tmp_path / "done")


@pytest.mark.parametrize("option", ["watch: true", "move_to: done"])
def test_files_are_not_taken_once_and_again(tmp_path: Path, option: str) -> None:
    with pytest.raises(ConfigError, match="Set loop: false"):
        load(tmp_path, SMALL.replace("path: in", f"path: in, loop: true, {option}"))


def test_absolute_paths_stay(tmp_path: Path) -> None:
    assert load(tmp_path, SMALL.replace("path: in", "path: /srv/in")).camera.path == Path("/srv/in")


def test_the_embedded_defaults_need_no_file() -> None:
    config = default_config()
    assert config.camera.path.is_dir()
    assert config.calibration is not None
    assert config.calibration.file.is_file()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (SMALL.replace("path: in", "path: in, lop: true"), "camera.lop: unknown key; did you mean loop?"),
        (SMALL.replace("modbus-tcp", "modbus-tpc"), "controller.kind: seen 'modbus-tpc', expected"),
        (
            SMALL.replace("modbus-tcp", "modbus-tcp, port: 70000"),
            "controller.port: seen 70000, expected 65535 at most (TCP port)",
        ),
        (
            SMALL.replace("modbus-tcp", "modbus-tcp, port: true"),
            "controller.port: seen true, as yes and on are read, expected a whole",
        ),
        (
            SMALL.replace("modbus-tcp", "modbus-tcp, link_addres: 1"),
            "controller.link_addres: unknown key; did you mean",
        ),
        (SMALL.replace("modbus-tcp", "modbus-tcp, timeout_s: .nan"), "controller.timeout_s: seen nan"),
        (
            SMALL.replace("modbus-tcp", "modbus-tcp, timeout_s: 0"),
            "controller.timeout_s: seen 0, expected a number above 0",
        ),
        (SMALL.replace("modbus-tcp", "modbus-tcp, word_order: huge"), "controller.word_order: seen 'huge'"),
        (SMALL.replace("modbus-tcp", "modbus-tcp, payload_capacity: 99"), "payload_capacity: is 99, expected an even"),
        (SMALL.replace("modbus-tcp", "modbus-tcp, longest_write: 15"), "seen 15, expected 16 or more (Most registers"),
        (SMALL.replace("modbus-tcp", "modbus-tcp, longest_read: 10"), "in one read; blocks of 16 go whole"),
        (
            SMALL.replace("modbus-tcp", "modbus-rtu, port: /dev/x, device_id: 0"),
            "device_id: seen 0, expected 1 or more",
        ),
        (SMALL.replace("modbus-tcp", "modbus-rtu-over-tcp, device_id: 0"), "device_id: seen 0, expected 1 or more"),
        (SMALL.replace("modbus-tcp", "modbus-tcp, link_address: 20"), "link_address (20 to 35) and service_address"),
        (SMALL.replace("modbus-tcp", "modbus-tcp, contour_address: 65000"), "contour_address 65000 and 2016 registers"),
        (SMALL.replace("modbus-tcp", "modbus-tcp, ack_timeout_s: 0.01"), "ack_timeout_s is 0.01, expected more than"),
        (SMALL + "triggers: [{kind: interval, period_s: soon}]\n", "triggers[0].period_s: seen 'soon'"),
        (SMALL + "triggers: [{period_s: 3}]\n", "triggers[0].kind: is missing"),
        (
            SMALL + "triggers: [{kind: controller}, {kind: controller}]\n",
            "line 4: triggers[1]: kind controller is there more than once",
        ),
        (
            SMALL.replace("modbus-tcp", "modbus-tcp, handshake: none") + "triggers: [{kind: controller}]\n",
            "kind controller needs a controller with handshake full",
        ),
        (SMALL + "triggers: [{kind: serial}]\n", "triggers[0].port: is missing"),
        (SMALL + "page: {port: 9000}\nmetrics: {port: 9000}\n", "page.port and metrics.port are both 9000"),
        (SMALL + "metrics: {port: 9000}\nopcua: {port: 9000}\n", "metrics.port and opcua.port are both 9000"),
        (SMALL + "opcua: {certificate: x}\n", "only one of them is given, expected both or none"),
        (SMALL + "recipes: []\n", "recipes is empty"),
        (SMALL.replace("c.yaml", "c.yaml, max_age_days: -1"), "calibration.max_age_days: seen -1"),
        (SMALL.replace("modbus-tcp", "modbus-tcp, port: 05020"), "05020 begins with 0; write 5020"),
        (SMALL + "recipes: [{number: 1, name: a, binarize: otsu}]\n", "wall-tips finds its own threshold"),
        (
            SMALL + "recipes: [{number: 1, name: a}, {number: 1, name: b}]\n",
            "line 4: recipes[1].number: 1 is there more than once",
        ),
        (
            SMALL + "recipes: [{number: 1, name: a},\n {number: 2, name: a}]\n",
            "line 5: recipes[1].name: a is there more than once",
        ),
        (SMALL + "default_recipe: 7\n", "default_recipe is 7, but recipes have only the numbers 1"),
        (SMALL + "recipes: [{number: 1, name: a, binarize: 256}]\n", "recipes[0].binarize: seen 256"),
        (SMALL + "recipes: [{number: 1, name: a, binarize: no}]\n", "recipes[0].binarize: seen false, as no"),
        (SMALL + "recipes: [{number: 1, name: a, tolerance_mm: -1}]\n", "recipes[0].tolerance_mm: seen -1"),
        (
            SMALL + "recipes: [{number: 1, name: a, min_area_mm2: 9, max_area_mm2: 9}]\n",
            "expected less than max_area_mm2",
        ),
        (
            SMALL + "recipes: [{number: 1, name: a, method: sliding-matrix, parameters: {core: 3}}]\n",
            "parameters.core is none of sliding-matrix's",
        ),
        (
            SMALL + "recipes: [{number: 1, name: a, method: sliding-matrix, parameters: {core_px: 0}}]\n",
            "parameters.core_px is 0, expected 1 to",
        ),
        (
            SMALL + "recipes: [{number: 1, name: a, method: sliding-matrix, parameters: {core_px: 2.5}}]\n",
            "expected a whole number of pixels",
        ),
        (SMALL + "work_area_mm: [[0, 0], [1, 1]]\n", "work_area_mm: has 2 points, expected 3 or more"),
        (SMALL + "work_area_mm: [[0, 0], [1, 1], [0, 1], [1, 0]]\n", "work_area_mm: is no simple polygon"),
        (SMALL + "work_area_mm: [[0, 0], [1, 1, 4], [0, 1]]\n", "work_area_mm[1]"),
        (SMALL.replace("calibration: {file: c.yaml}\n", ""), "calibration is missing: a controller needs millimetres"),
        (SMALL + "camera: {kind: files, path: b}\n", "line 4, column 1: key 'camera' stands twice, first in line 1"),
        (SMALL + "service: {queue_depth: 101}\n", "service.queue_depth: seen 101"),
        (
            SMALL + "recipes: [{number: 1, name: a, parameters: {core_px: yes}}]\n",
            "core_px: is true, as yes and on are read, expected a number",
        ),
        (SMALL + "work_area_mm: [[0, 0], [1, no], [0, 1]]\n", "work_area_mm[1][1]: is false, as no and off are read"),
        (SMALL + "extra: 1\n", "extra: unknown key, expected one of adopted_recipes, archive, calibration, camera"),
        (
            SMALL.replace("file: c.yaml", "file: c.yaml, max_vertices: 3"),
            "calibration.max_vertices: unknown key, expected one of file, max_age_days, sentinel_tolerance_px, ",
        ),
        (SMALL + "recipes: [{number: 1, name: a, tolerance: 1}]\n", "unknown key; did you mean tolerance_mm?"),
        (SMALL.replace("path: in", "path: ''"), "camera.path: is '', expected the path of a file"),
        (SMALL.replace("path: in", r'path: "a\0b"'), "expected the path of a file or folder"),
        (SMALL.replace("path: in", "path: 2026-13-45"), "2026-13-45 is no date (month must be in 1..12)"),
        (SMALL.replace("path: in", "path: \x01"), "line 1: holds a control character (code 1)"),
        (SMALL.replace("path: in", "path: !!int x"), "text that begins with ! has to be put in quotes"),
        ("", "is empty, expected keys such as camera"),
        ("- 1\n", "holds a list, expected keys"),
        ("camera: [1\n", "line 2, column 1: the bracket opened in line 1 is not closed by ]"),
        ("camera: *nobody\n", "text that begins with * has to be put in quotes"),
        ("? [1, 2]\n: 3\n", "a key is not a plain word"),
        (b"camera: \xff\xfe\n", "is no UTF-8 text (byte 8)"),
        ("camera: !!python/object/apply:os.system [id]\n", "line 1, column 9: text that begins with !"),
    ],
)
def test_a_mistake_is_named_with_its_place(tmp_path: Path, text: str | bytes, expected: str) -> None:
    lines = mistakes(tmp_path, text)
    assert any(expected in line for line in lines), lines


def test_all_mistakes_are_told_at_once(tmp_path: Path) -> None:
    text = SMALL.replace("modbus-tcp", "modbus-tcp, port: 0, host: ''") + "defualt_recipe: 1\n"
    assert len(mistakes(tmp_path, text)) == 3


def test_a_missing_file_is_an_error_that_names_it(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.yaml: cannot be read: No such file"):
        load_config(tmp_path / "nowhere.yaml")


def test_a_folder_is_no_configuration(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read: Is a directory"):
        load_config(tmp_path)


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "config.yaml"
    with path.open("wb") as file:
        os.ftruncate(file.fileno(), 5_000_000_000)
    with pytest.raises(ConfigError, match="5000000000 bytes, expected 1000000 at most"):
        load_config(path)


def test_a_deeply_nested_file_is_an_error_and_no_crash(tmp_path: Path) -> None:
    assert mistakes(tmp_path, "[" * 5000)


def test_without_a_controller_a_calibration_is_optional(tmp_path: Path) -> None:
    config = load(tmp_path, "camera: {kind: files, path: in}\ncontroller: {kind: none}\n")
    assert isinstance(config.controller, NoController)
    assert config.calibration is None


def test_the_kinds_that_come_later_are_known_to_the_configuration_already(tmp_path: Path) -> None:
    text = (
        "camera: {kind: v4l2, device: /dev/video0, width: 1280, height: 720}\n"
        "calibration: {file: c.yaml}\ncontroller: {kind: modbus-rtu, port: /dev/ttyS0}\n"
        "triggers: [{kind: serial, port: /dev/ttyS1}]\n"
    )
    config = load(tmp_path, text)
    assert isinstance(config.triggers[0], SerialTrigger)
    expected = "line 4: triggers[0].port: /dev/ttyS0 is named more than once. A serial port serves one"
    assert mistakes(tmp_path, text.replace("ttyS1", "ttyS0")) == [expected]


def test_the_schema_is_json_and_names_its_dialect() -> None:
    schema = json.loads(config_reference.schema_text())
    assert schema["$schema"].endswith("2020-12/schema")
    assert schema["additionalProperties"] is False


@pytest.mark.parametrize(
    ("address", "seen"),
    [(2047, "contour_address (32 to 2047) and part_block (2047 to 2162) overlap"), (65_500, "past 65535")],
)
def test_a_part_block_that_has_no_room_of_its_own_is_refused(tmp_path: Path, address: int, seen: str) -> None:
    file = tmp_path / "config.yaml"
    block = f"{{address: {address}, capacity: 100}}"
    file.write_text(f"controller: {{kind: modbus-tcp, part_block: {block}}}\n", encoding="utf-8")
    with pytest.raises(ConfigError) as error:
        load_config(file)
    assert seen in str(error.value)
