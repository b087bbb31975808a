"""Runs a command in a small virtual machine whose kernel has a camera: `vivid`, the test driver of a Debian kernel.

    python tests/camera_guest/guest.py [--timeout SECONDS] [--vivid "MODULE OPTIONS"] -- COMMAND...

The guest sees this machine's files at the same paths (what it writes there is lost, except below the folder that is
/run/out in it), has no network but loopback, and ends with the command, whose exit status becomes this one's; 124 after
the time-out, 125 where the guest died. QEMU, busybox and the kernel come from Debian by package name; what is unpacked
of them stays in the user's cache folder. The kernel is not installed, the machine's own is never touched.
"""

from __future__ import annotations

import argparse
import fcntl
import lzma
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "combtrace-camera-guest"
PACKAGES = {"qemu-system-x86_64": "qemu-system-x86", "busybox": "busybox-static", "v4l2-ctl": "v4l-utils"}
MODULE_FOLDERS = (
    "drivers/media",
    "drivers/virtio",
    "drivers/usb",
    "net/9p",
    "fs/9p",
    "fs/netfs",
    "fs/fscache",
    "fs/overlayfs",
)
BOOT_MODULES = ("virtio_pci", "9pnet_virtio", "9p", "overlay")
# Node 0: a webcam and an HDMI input. Node 1: an HDMI output whose pictures can be looped into that input; without
# cropping and composing (ccs_*) they arrive pixel by pixel.
VIVID = (
    "n_devs=1 node_types=0x101 num_inputs=2 input_types=0xc num_outputs=1 output_types=1 ccs_cap_mode=0 ccs_out_mode=0"
)
TIMED_OUT, DIED = 124, 125


class GuestError(Exception):
    """The guest cannot be made or run: seen, expected, next step."""


def main() -> int:
    """Run the command line's command in a guest; its exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--timeout", type=float, default=600.0, metavar="SECONDS")
    parser.add_argument("--memory", type=int, default=2048, metavar="MB")
    parser.add_argument("--vivid", default=VIVID, metavar="OPTIONS", help="module options of the virtual camera")
    parser.add_argument("--out", type=Path, help="folder that is /run/out in the guest")
    parser.add_argument("command", nargs="+")
    args = parser.parse_args()
    try:
        prepare()
        return run(args.command, args.timeout, args.memory, args.vivid, args.out)
    except GuestError as error:
        print(f"guest: {error}", file=sys.stderr)
        return DIED


# --- what the guest boots from -------------------------------------------------------------------------------------


def prepare() -> None:
    """Have kernel and initial file system in the cache; the first time this takes packages from Debian."""
    CACHE.mkdir(parents=True, exist_ok=True)
    with open(CACHE / "lock", "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        _install([package for program, package in PACKAGES.items() if shutil.which(program) is None])
        recipe = Path(__file__).read_bytes()
        made_by = CACHE / "made-by"
        if not made_by.exists() or made_by.read_bytes() != recipe:
            _unpack_kernel()
            _make_initial_file_system()
            made_by.write_bytes(recipe)


def _install(packages: list[str]) -> None:
    if not packages:
        return
    if os.geteuid() != 0:
        raise GuestError(f"{', '.join(packages)} missing. Install: apt-get install {' '.join(packages)}")
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    _called(["apt-get", "update", "-qq"], env=environment)
    _called(["apt-get", "install", "-y", "-qq", "--no-install-recommends", *packages], env=environment)


def _unpack_kernel() -> None:
    """Kernel and modules of Debian's present kernel package, unpacked but not installed."""
    debs = CACHE / "deb"
    if not list(debs.glob("linux-image-*.deb")):
        debs.mkdir(exist_ok=True)
        depends = _called(["apt-cache", "depends", "linux-image-amd64"])
        names = [line.split()[1] for line in depends.splitlines() if "Depends: linux-image-" in line]
        if not names:
            _called(["apt-get", "update", "-qq"])
            depends = _called(["apt-cache", "depends", "linux-image-amd64"])
            names = [line.split()[1] for line in depends.splitlines() if "Depends: linux-image-" in line]
        if not names:
            raise GuestError("no package linux-image-amd64 is known; expected Debian's. Run apt-get update")
        _called(["apt-get", "download", "-qq", names[0]], cwd=debs)
    deb = max(debs.glob("linux-image-*.deb"))
    root = CACHE / "kernel"
    shutil.rmtree(root, ignore_errors=True)
    root.mkdir()
    wanted = ["./boot/*", "./lib/modules/*/modules.*"]
    wanted += [f"./lib/modules/*/kernel/{folder}/*" for folder in MODULE_FOLDERS]
    with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", str(deb)], stdout=subprocess.PIPE) as package:
        subprocess.run(["tar", "-x", "-C", str(root), "--wildcards", *wanted], stdin=package.stdout, check=True)
    _called(["busybox", "depmod", "-b", str(root), _modules().name])
    (CACHE / "vmlinux").write_bytes(_uncompressed(next((root / "boot").glob("vmlinuz-*")).read_bytes()))


def _modules() -> Path:
    return next((CACHE / "kernel/lib/modules").iterdir())


def _uncompressed(image: bytes) -> bytes:
    """The kernel's ELF image: QEMU starts it at once, where its own unpacking takes seconds without acceleration."""
    at = -1
    while (at := image.find(b"\xfd7zXZ\x00", at + 1)) >= 0:
        try:
            kernel = lzma.LZMADecompressor().decompress(image[at:])
        except lzma.LZMAError:
            continue
        if kernel.startswith(b"\x7fELF"):
            return kernel
    raise GuestError("no xz-packed kernel in Debian's image; expected one")


def _make_initial_file_system() -> None:
    """An archive with busybox, the modules that mount this machine's files, and the script that does it."""
    root = CACHE / "initial"
    shutil.rmtree(root, ignore_errors=True)
    (root / "bin").mkdir(parents=True)
    (root / "modules").mkdir()
    shutil.copy2(str(shutil.which("busybox")), root / "bin/busybox")
    order = []
    for name in BOOT_MODULES:
        for module in _with_dependencies(name):
            if module.name not in order:
                shutil.copy(module, root / "modules")
                order.append(module.name)
    (root / "modules/order").write_text("\n".join(order) + "\n", encoding="ascii")
    shutil.copy(Path(__file__).with_name("guest-init.sh"), root / "init")
    (root / "init").chmod(0o755)
    names = "\n".join(str(path.relative_to(root)) for path in sorted(root.rglob("*")))
    with open(CACHE / "initial.cpio", "wb") as archive:
        subprocess.run(
            ["busybox", "cpio", "-o", "-H", "newc"], input=names.encode(), stdout=archive, cwd=root,
            stderr=subprocess.DEVNULL, check=True,
        )  # fmt: skip


def _with_dependencies(name: str) -> Iterator[Path]:
    """The files of a module and of all it needs, those first."""
    modules = _modules()
    for line in (modules / "modules.dep").read_text(encoding="utf-8").splitlines():
        path, _, needs = line.partition(":")
        if Path(path).name == f"{name}.ko":
            for needed in reversed(needs.split()):
                yield modules / needed
            yield modules / path
            return


def _called(command: list[str], *, cwd: Path | None = None, env: dict[str, str] | None = None) -> str:
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise GuestError(f"{shlex.join(command)} ended with {done.returncode}: {done.stderr.strip()[-500:]}")
    return done.stdout


# --- the guest -----------------------------------------------------------------------------------------------------


def run(command: list[str], timeout_s: float, memory_mb: int, vivid: str, out: Path | None) -> int:
    """The command's exit status, its output on standard output as it comes."""
    with tempfile.TemporaryDirectory() as temporary:
        shared = out or Path(temporary)
        shared.mkdir(parents=True, exist_ok=True)
        shared = shared.resolve()
        status = shared / "status"
        status.unlink(missing_ok=True)
        environment = {"HOME": "/root", "PATH": os.environ["PATH"], **_handed_on()}
        lines = [f"export {name}={shlex.quote(value)}" for name, value in environment.items()]
        lines += [f"cd {shlex.quote(os.getcwd())}", shlex.join(command)]
        (shared / "command").write_text("\n".join(lines) + "\n", encoding="utf-8")
        settings = {"VIVID": vivid, "MODULES": str(CACHE / "kernel/lib/modules")}
        text = "".join(f"{name}={shlex.quote(value)}\n" for name, value in settings.items())
        (shared / "settings").write_text(text, encoding="utf-8")
        with subprocess.Popen(_qemu(shared, memory_mb), stdin=subprocess.DEVNULL) as machine:
            try:
                machine.wait(timeout_s)
            except subprocess.TimeoutExpired:
                machine.kill()
                print(f"guest: not done within {timeout_s:g} s; {_end_of_console(shared)}", file=sys.stderr)
                return TIMED_OUT
            except BaseException:
                machine.kill()
                raise
        if status.exists():
            return int(status.read_text(encoding="ascii"))
        raise GuestError(f"it died before it was done; {_end_of_console(shared)}")


def _end_of_console(shared: Path) -> str:
    console = (shared / "console").read_text(encoding="utf-8", errors="replace")
    return "the end of its console:\n" + console[-3000:]


def _handed_on() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name == "CI" or name.startswith("COMBTRACE_")}


def _qemu(shared: Path, memory_mb: int) -> list[str]:
    return [
        "qemu-system-x86_64",
        *("-accel", "tcg,thread=multi", "-cpu", "max", "-machine", "q35", "-smp", "2"),
        *("-m", str(memory_mb), "-nodefaults", "-no-user-config", "-display", "none", "-monitor", "none", "-no-reboot"),
        *("-kernel", str(CACHE / "vmlinux"), "-initrd", str(CACHE / "initial.cpio")),
        *("-append", "console=ttyS0 quiet panic=-1 mitigations=off tsc=unstable"),
        *("-serial", f"file:{shared / 'console'}", "-serial", "stdio"),
        # ttyS2 and a USB adapter (FTDI's, ttyUSB0) are the two ends of a cable; ttyS3 has nothing behind its plug.
        *("-chardev", f"socket,id=near,path={shared / 'cable'},server=on,wait=off"),
        *("-chardev", f"socket,id=far,path={shared / 'cable'}"),
        *("-serial", "chardev:near", "-serial", "null"),
        *("-device", "qemu-xhci", "-device", "usb-serial,chardev=far"),
        *("-fsdev", "local,id=root,path=/,security_model=none,readonly=on,multidevs=remap"),
        *("-device", "virtio-9p-pci,fsdev=root,mount_tag=machine"),
        *("-fsdev", f"local,id=out,path={shared},security_model=none"),
        *("-device", "virtio-9p-pci,fsdev=out,mount_tag=out"),
    ]


if __name__ == "__main__":
    sys.exit(main())
