"""What the driver says of things that are no camera; what needs one runs in the guest of `make test-camera`."""

from __future__ import annotations

import pytest

from drivers.camera import CameraRefused, CameraUnavailable
from drivers.camera.v4l2.camera import V4l2Camera, V4l2Settings
from drivers.camera.v4l2.controls import ControlInfo, control_name
from drivers.camera.v4l2.identity import CameraIdentity, serial_number
from drivers.camera.v4l2.listing import CameraInfo, look_at_nodes, sharing_a_device


def refusal(path):
    camera = V4l2Camera(V4l2Settings(str(path), 640, 480))
    with pytest.raises(CameraUnavailable) as refused:
        camera.open()
    with pytest.raises(CameraUnavailable, match="not open"):
        camera.grab(0.0, 1.0)
    return refused


def test_a_device_that_is_not_there_is_told_with_the_command_that_lists_cameras(tmp_path):
    refused = refusal(tmp_path / "video0")
    assert "No such file" in str(refused.value)
    assert "combtrace cameras" in str(refused.value)
    assert not isinstance(refused.value, CameraRefused)


def test_a_file_is_no_camera(tmp_path):
    (tmp_path / "video0").write_bytes(b"")
    refused = refusal(tmp_path / "video0")
    assert isinstance(refused.value, CameraRefused)
    assert "expected a camera's device file" in str(refused.value)


def test_another_kind_of_device_is_no_camera():
    refused = refusal("/dev/null")
    assert isinstance(refused.value, CameraRefused)
    assert "/dev/null: no camera" in str(refused.value)


@pytest.mark.parametrize(
    ("title", "name"),
    [
        ("Exposure Time, Absolute", "exposure_time_absolute"),
        ("White Balance, Automatic", "white_balance_automatic"),
        ("Read-Only Integer 32 Bits", "read_only_integer_32_bits"),
        ("U8 2x3x4x5 Array", "u8_2x3x4x5_array"),
    ],
)
def test_controls_are_named_as_v4l2_ctl_names_them(title, name):
    assert control_name(title) == name


def control(**changes):
    values = {
        "number": 1, "name": "gain", "kind": "int", "minimum": 2, "maximum": 10, "step": 4, "default": 2, "value": 2,
        "inactive": False, "read_only": False, "volatile": False,
    }  # fmt: skip
    return ControlInfo(**values | changes)


def test_a_control_allows_what_its_range_and_step_allow():
    assert [value for value in range(-1, 12) if control().allows(value)] == [2, 6, 10]
    assert control().range_text() == "2 to 10 in steps of 4"


def test_a_menu_allows_its_entries_only():
    menu = control(kind="menu", minimum=0, maximum=3, step=1, menu={0: "Auto", 3: "Manual"})
    assert [value for value in range(-1, 5) if menu.allows(value)] == [0, 3]
    assert menu.range_text() == "0 (Auto), 3 (Manual)"


def test_a_camera_with_a_serial_number_is_the_same_on_another_port():
    one = CameraIdentity("uvcvideo", "HD Cam", "usb-0000:00:14.0-1", "A17")
    assert str(one) == str(CameraIdentity("uvcvideo", "HD Cam", "usb-0000:00:14.0-2", "A17"))
    assert str(one) != str(CameraIdentity("uvcvideo", "HD Cam", "usb-0000:00:14.0-1", "A18"))


def test_a_camera_without_one_is_told_by_its_place():
    one = CameraIdentity("uvcvideo", "HD Cam", "usb-0000:00:14.0-1", "")
    assert str(one) != str(CameraIdentity("uvcvideo", "HD Cam", "usb-0000:00:14.0-2", ""))


def test_the_serial_number_is_that_of_the_usb_device_above_the_interface(tmp_path):
    interface = tmp_path / "usb1" / "1-1" / "1-1:1.0"
    interface.mkdir(parents=True)
    (interface.parent / "serial").write_text("A17\n")
    (tmp_path / "class" / "video3").mkdir(parents=True)
    (tmp_path / "class" / "video3" / "device").symlink_to(interface)
    assert serial_number("/dev/video3", tmp_path / "class") == "A17"
    assert serial_number("/dev/video4", tmp_path / "class") == ""


def test_no_node_means_no_camera(tmp_path):
    assert look_at_nodes(tmp_path) == []


def test_two_capture_nodes_on_one_bus_are_one_device():
    def info(device, bus):
        return CameraInfo(device, (), CameraIdentity("uvcvideo", "HD Cam", bus, ""), (), ())

    nodes = [info("/dev/video0", "usb-1"), info("/dev/video2", "usb-1"), info("/dev/video4", "usb-2")]
    assert [[node.device for node in group] for group in sharing_a_device(nodes)] == [["/dev/video0", "/dev/video2"]]
