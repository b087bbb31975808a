from __future__ import annotations

import subprocess
import sys
import sysconfig

import pytest

from drivers.camera import CameraRefused
from drivers.camera.genicam import binding
from tests.support.gige_camera import need_aravis


def run(code):
    """The program in a fresh interpreter of this environment."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_this_environment_finds_the_system_s_binding_and_nothing_else_of_it():
    need_aravis()
    found = run(
        "import sys; from drivers.camera.genicam.binding import aravis; import numpy;"
        "print(hasattr(aravis(), 'Camera'), numpy.__file__, any('dist-packages' in p for p in sys.path))"
    )
    exists, numpy_file, on_path = found.split()
    assert exists == "True"
    assert "dist-packages" not in numpy_file
    assert on_path == "False"


def test_nothing_of_it_is_loaded_until_a_camera_is_opened():
    loaded = run(
        "import sys; import service.wiring.devices, service.cli.main;"
        "print([n for n in sys.modules if n == 'gi' or 'genicam' in n])"
    )
    assert loaded == "[]"


def test_where_it_is_missing_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "gi", None)
    with pytest.raises(CameraRefused, match=r"apt install gir1\.2-aravis-0\.8 python3-gi") as raised:
        binding._gi(tmp_path)
    assert "\n" not in str(raised.value)


def test_a_binding_for_another_python_is_told_as_such(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "gi", None)
    (tmp_path / "gi").mkdir()
    (tmp_path / "gi" / "__init__.py").write_text("")
    (tmp_path / "gi" / "_gi.cpython-27-x86_64-linux-gnu.so").write_text("")
    with pytest.raises(CameraRefused, match=r"is built for cpython-27-x86_64-linux-gnu; expected one Python"):
        binding._gi(tmp_path)
    assert str(sysconfig.get_config_var("EXT_SUFFIX")) not in "_gi.cpython-27-x86_64-linux-gnu.so"
