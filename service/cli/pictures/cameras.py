"""`combtrace cameras`: the cameras of this machine, with what each offers."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_FAILED, EXIT_OK

if TYPE_CHECKING:
    from drivers.camera.v4l2.controls import ControlInfo
    from drivers.camera.v4l2.formats import FormatInfo
    from drivers.camera.v4l2.listing import CameraInfo

HELP = "list the cameras of this machine"
DESCRIPTION = """\
List the cameras of this machine. V4L2: names that survive replugging, pixel formats
with sizes and frame rates, controls with their ranges and present values; formats
that combtrace cannot read are marked with a minus. GenICam (GigE Vision and USB3
Vision, where Aravis is installed): serial number, user name, address.

Exit status: 0 at least one camera, 1 none that can be read."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is shown of each camera."""
    parser.add_argument("--brief", action="store_true", help="one line a camera, without formats and controls")


def run(args: argparse.Namespace) -> int:
    """List; tell by the exit status whether there is any."""
    from drivers.camera.v4l2.listing import CameraInfo, look_at_nodes, sharing_a_device

    found = look_at_nodes()
    cameras = [entry for entry in found if isinstance(entry, CameraInfo)]
    for entry in found:
        if isinstance(entry, CameraInfo):
            _print_camera(entry, brief=args.brief)
        else:
            print(f"{entry.device}  cannot be asked: {entry.why}")
    for group in sharing_a_device(cameras):
        nodes = " and ".join(camera.device for camera in group)
        print(f"note: {nodes} belong to one device ({group[0].identity.card}); configure one of them, not both")
    if not found:
        print("no V4L2 camera: there is no /dev/video*. Check its cable, and `lsusb`; the kernel's word is in `dmesg`")
    on_genicam = _print_genicam()
    return EXIT_OK if cameras or on_genicam else EXIT_FAILED


def _print_genicam() -> bool:
    """True where there is one."""
    from drivers.camera import CameraRefused
    from drivers.camera.genicam.listing import list_cameras

    try:
        found = list_cameras()
    except CameraRefused as error:
        print(f"GenICam cameras are not looked for: {error}")
        return False
    for one in found:
        where = f", {one.address}" if one.address else ""
        print(f"genicam  {one.vendor} {one.model} ({one.protocol}{where})")
        print(f'  serial: "{one.serial}"' + (f'\n  user_name: "{one.user_name}"' if one.user_name else ""))
    if not found:
        print("no GenICam camera answers on any network card or USB port")
    return bool(found)


def _print_camera(camera: CameraInfo, *, brief: bool) -> None:
    identity = camera.identity
    serial = f", serial {identity.serial}" if identity.serial else ""
    print(f"{camera.device}  {identity.card} ({identity.driver}, {identity.bus}{serial})")
    for name in camera.names:
        print(f"  {name}")
    if brief:
        return
    print("  formats")
    for entry in camera.formats:
        _print_format(entry)
    if camera.controls:
        print("  controls")
        width = max(len(control.name) for control in camera.controls)
        for control in camera.controls:
            print(f"    {control.name:<{width}}  {_control_text(control)}")


def _print_format(entry: FormatInfo) -> None:
    mark = " " if entry.usable else "-"
    print(f"  {mark} {entry.code:<7} {entry.description}")
    if entry.usable:
        for size in entry.sizes:
            rates = ", ".join(f"{rate:.4g}" for rate in size.rates)
            print(f"              {size.text()}" + (f" at {rates} a second" if rates else ""))


def _control_text(control: ControlInfo) -> str:
    if control.value is None:
        return f"{'':<10} {control.kind}"
    notes = [control.kind, control.range_text(), f"default {control.default}"]
    notes += ["inactive: an automatic governs it"] if control.inactive else []
    notes += ["read-only"] if control.read_only else []
    return f"= {control.value:<8} {', '.join(notes)}"
