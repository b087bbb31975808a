#!/usr/bin/python3
"""combtrace's contours on a LinuxCNC machine: plays the controller's part of the mailbox protocol as a Modbus server.

    bridge.py --listen 127.0.0.1:5020 --folder /var/lib/combtrace-bridge --safe-z 50 --cut-z 1 [--run]

An accepted contour, or the parts that lie in it (--part-capacity), is written as a program and opened in LinuxCNC,
whose screens then show it; it runs when the operator presses cycle start, or at once with --run. E-stop, limits, feed
hold and override stay LinuxCNC's own. What lies outside of the machine's limits is refused. Needs only Debian's
linuxcnc-uspace; runs as the user who runs LinuxCNC. `request` on standard input, or the HAL pin combtrace.request, asks
for a measurement.
"""

import argparse
import math
import os
import sys
import threading
import time
from mailbox import (
    ACCEPTED,
    BAD_GEOMETRY,
    BUSY_STATE,
    FAULT_STATE,
    NOT_READY_STATE,
    OPERATOR,
    READY_STATE,
    WRAP,
    Mailbox,
    Memory,
)

import linuxcnc
from modbus_server import ModbusServer
from program import Cutting, out_of_limits, program

SCAN_S = 0.01
G54 = 540  # as LinuxCNC counts modal codes: ten times the number
NO_CONTOUR = "(combtrace: no contour)\nM2\n"


class Machine:
    """LinuxCNC as the bridge sees and drives it; all calls from one thread."""

    def __init__(self, folder):
        self.command, self.stat, self.errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
        self.folder = folder
        self.stat.poll()

    def look(self):
        """controller_state, and why it is not ready."""
        try:
            self.stat.poll()
        except linuxcnc.error as error:
            return FAULT_STATE, f"LinuxCNC does not answer ({error}): start it"
        if self.stat.task_state == linuxcnc.STATE_ESTOP:
            return FAULT_STATE, "emergency stop"
        if self.stat.task_state != linuxcnc.STATE_ON:
            return NOT_READY_STATE, "machine off: switch it on"
        joints = self.stat.joints
        if not all(self.stat.homed[:joints]):
            return NOT_READY_STATE, "not homed: home all joints"
        if self.stat.interp_state != linuxcnc.INTERP_IDLE or not self.stat.inpos:
            return BUSY_STATE, "a program runs"
        return READY_STATE, ""

    def limits_mm(self):
        """(least, most) of X, Y, Z in mm, whatever unit the machine has."""
        unit = self.stat.linear_units  # machine units in one mm
        return [
            (self.stat.axis[axis]["min_position_limit"] / unit, self.stat.axis[axis]["max_position_limit"] / unit)
            for axis in range(3)
        ]

    def offset_mm(self):
        """Offset of G54 and G92, mm; a tool's length is none, since the program begins by cancelling it (G49)."""
        unit = self.stat.linear_units
        parts = (self.stat.g5x_offset, self.stat.g92_offset)
        return [sum(part[axis] for part in parts) / unit for axis in range(3)]

    def open(self, name, text):
        """Write a program and open it: the machine's screens show it."""
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="ascii") as file:
            file.write(text)
        self.command.mode(linuxcnc.MODE_AUTO)
        self.command.wait_complete()
        self.command.program_open(path)
        self.command.wait_complete()

    def start(self):
        """Cycle start."""
        self.command.auto(linuxcnc.AUTO_RUN, 0)

    def trouble(self):
        """What LinuxCNC has to say, None where nothing."""
        said = self.errors.poll()
        return said[1].strip() if said and said[0] in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR) else None


class Bridge:
    """From an accepted contour to its end: shown, started, run. `scan` is called every SCAN_S by one thread."""

    def __init__(self, machine, memory_path, cutting, say, run_at_once=False, simulated_too=False, **layout):
        self.machine, self.cutting, self.say = machine, cutting, say
        self.run_at_once, self.simulated_too = run_at_once, simulated_too
        self.mailbox = Mailbox(Memory(memory_path), self.judge, self.accepted, **layout)
        self.shown = None  # the contour that waits for cycle start
        self.running = None
        self.why = None
        self.begun_s = 0.0
        if os.path.basename(machine.stat.file).startswith("job-") and machine.look()[0] != BUSY_STATE:
            machine.open("no-contour.ngc", NO_CONTOUR)  # of before this start: how old it is cannot be known

    def judge(self, contour):
        """The answer to a whole contour."""
        for wrong in self._objections(contour):
            self.say(f"job {contour.job_id} refused: {wrong}")
            return BAD_GEOMETRY
        return OPERATOR if self.shown is not None or self.running is not None else ACCEPTED

    def _objections(self, contour):
        """What forbids to cut it, in words."""
        if not contour.flags & 8:
            yield "its frame is not the machine's; run combtrace align first"
        if contour.flags & 1 and not self.simulated_too:
            yield "its frame is not from a live camera (--simulated-too takes such)"
        stat = self.machine.stat
        if G54 not in stat.gcodes or stat.rotation_xy != 0:
            yield f"expected work coordinates G54, not turned; others are in force, or turned by {stat.rotation_xy:g}°"
        for part in contour.parts:
            if part.margin_mm < part.needed_mm:
                yield f"part {part.number} keeps {part.margin_mm:.3f} mm, needed are {part.needed_mm:.3f}"
        outside = out_of_limits(contour, self.cutting, self.machine.limits_mm(), self.machine.offset_mm())
        if outside is not None:
            yield outside

    def accepted(self, contour):
        """It is in memory: show it, and start it where that is wanted."""
        bound = "not known" if contour.uncertainty_mm is None else f"{contour.uncertainty_mm:.3f} mm"
        vertices = sum(len(ring) for ring in contour.rings)
        self.say(
            f"job {contour.job_id} accepted: {vertices} vertices, {len(contour.rings) - 1} holes, "
            f"{contour.area_mm2} mm2, within {bound}; {len(contour.parts)} parts"
        )
        self.mailbox.set_state(BUSY_STATE)  # no second contour until this one has been cut or let go
        self.machine.open(f"job-{contour.job_id}.ngc", program(contour, self.cutting))
        self.shown = contour
        if self.run_at_once:
            self._begin()
        else:
            self.say("shown: cycle start runs it, opening another program lets it go")

    def scan(self):
        """One scan: the machine's state, the contour's way, and the mailbox."""
        trouble = self.machine.trouble()
        if trouble is not None:
            self.say(f"LinuxCNC: {trouble}")
        state, why = self.machine.look()
        if self.running is not None and state != BUSY_STATE and time.monotonic() > self.begun_s + 0.5:
            how = "done" if state == READY_STATE and trouble is None else f"stopped: {why or trouble}"
            self.say(f"job {self.running.job_id} {how}")
            self.running = None
        if self.shown is not None and self.running is None:
            self._watch_shown(state)
        if self.shown is not None or self.running is not None:
            state = BUSY_STATE if state == READY_STATE else state
        if why != self.why:
            self.say(f"state {state}" + (f": {why}" if why else ""))
            self.why = why
        self.mailbox.set_state(state)
        self.mailbox.scan()

    def _watch_shown(self, state):
        """A shown contour begins by the operator's cycle start, expires, or is let go by opening something else."""
        job = self.shown.job_id
        is_ours = os.path.basename(self.machine.stat.file) == f"job-{job}.ngc"
        if not is_ours:
            self.say(f"job {job} let go: another program was opened")
            self.shown = None
        elif state == BUSY_STATE and self._is_expired():
            self.machine.command.abort()
            self.say(f"job {job} stopped: it was too old when it was started")
            self.shown = None
        elif state == BUSY_STATE:
            self.running, self.shown, self.begun_s = self.shown, None, time.monotonic()
            self.say(f"job {job} started by the operator")
        elif self._is_expired():
            self.machine.open("no-contour.ngc", NO_CONTOUR)
            self.say(f"job {job} let go: it is too old to be cut")
            self.shown = None

    def _is_expired(self):
        expires = self.shown.expires_at_ms
        return expires is not None and (self.mailbox.clock_ms() - expires) % WRAP < WRAP // 2

    def _begin(self):
        if self._is_expired():
            return  # the next scan lets it go
        self.running, self.shown, self.begun_s = self.shown, None, time.monotonic()
        self.say(f"job {self.running.job_id} started")
        self.machine.start()


class Pins:
    """HAL pins of the component `combtrace`: request (in), recipe (in), thickness in mm (in), ready and busy (out)."""

    def __init__(self):
        import hal

        self.pins = hal.component("combtrace")
        self.pins.newpin("request", hal.HAL_BIT, hal.HAL_IN)
        self.pins.newpin("recipe", hal.HAL_U32, hal.HAL_IN)
        self.pins.newpin("thickness-mm", hal.HAL_FLOAT, hal.HAL_IN)
        self.pins.newpin("ready", hal.HAL_BIT, hal.HAL_OUT)
        self.pins.newpin("busy", hal.HAL_BIT, hal.HAL_OUT)
        self.pins.ready()
        self.was = False

    def exchange(self, bridge):
        """Ask on a rising edge; show what can be asked."""
        now = bool(self.pins["request"])
        if now and not self.was:
            request(bridge, self.pins["recipe"], self.pins["thickness-mm"])
        self.was = now
        self.pins["ready"] = bridge.mailbox.state == READY_STATE and bridge.mailbox.service_is_ready()
        self.pins["busy"] = bridge.mailbox.state == BUSY_STATE


def request(bridge, recipe, thickness_mm):
    """Ask the service for one measurement, and say what came of it."""
    if bridge.mailbox.state != READY_STATE:
        bridge.say("no measurement asked for: the machine is not ready")
    elif not bridge.mailbox.request(int(recipe), round(thickness_mm * 1000)):
        bridge.say("no measurement asked for: the service is not ready, or one is under way")
    else:
        bridge.say("a measurement is asked for")


def height(text):
    """Millimetres, finite."""
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def positive(text):
    """A finite number above 0."""
    value = height(text)
    if value <= 0:
        raise ValueError(text)
    return value


def capacity(text):
    """Registers of payload: even, within what one Modbus device holds beside the other blocks."""
    value = int(text)
    if value % 2 or not 4 <= value <= 65536 - 64:
        raise ValueError(text)
    return value


def address(text):
    """Host and port of HOST:PORT."""
    host, colon, port = text.rpartition(":")
    if not colon or not port.isdigit() or int(port) > 65535:
        raise ValueError(text)
    return host, int(port)


def main():
    """Serve until the process is ended."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--listen", type=address, default="127.0.0.1:5020", metavar="HOST:PORT", help="default 127.0.0.1:5020"
    )
    parser.add_argument("--folder", required=True, help="for memory and programs; LinuxCNC must be able to read it")
    parser.add_argument("--safe-z", type=height, required=True, metavar="MM", help="height between rings")
    parser.add_argument("--cut-z", type=height, metavar="MM", help="height of cut; without it, a dry run")
    parser.add_argument("--feed", type=positive, default=3000.0, metavar="MM/MIN")
    parser.add_argument("--plunge", type=positive, default=600.0, metavar="MM/MIN")
    parser.add_argument("--path-tolerance", type=positive, default=0.01, metavar="MM", help="G64 P")
    parser.add_argument("--run", action="store_true", help="run a contour at once; without it, cycle start does")
    parser.add_argument("--simulated-too", action="store_true", help="also contours of pictures from files")
    parser.add_argument("--hal", action="store_true", help="offer the HAL pins combtrace.*")
    parser.add_argument("--word-order", choices=("big", "little"), default="big")
    parser.add_argument("--payload-capacity", type=capacity, default=1984)
    parser.add_argument(
        "--part-capacity",
        type=capacity,
        metavar="N",
        help="take parts: a part block of so many registers behind the rest",
    )
    args = parser.parse_args()
    cutting = Cutting(args.safe_z, args.cut_z, args.feed, args.plunge, args.path_tolerance)
    machine = _machine(args.folder)
    bridge = Bridge(
        machine,
        os.path.join(args.folder, "memory.json"),
        cutting,
        lambda text: print(text, flush=True),
        run_at_once=args.run,
        simulated_too=args.simulated_too,
        word_order=args.word_order,
        payload_capacity=args.payload_capacity,
        part_capacity=args.part_capacity,
    )
    host, port = args.listen
    try:
        server = ModbusServer((host, port), bridge.mailbox)
    except OSError as error:
        raise SystemExit(
            f"--listen {host}:{port}: {error.strerror}. Name a free port and an address of this machine"
        ) from error
    threading.Thread(target=server.serve_forever, daemon=True).start()
    asked = threading.Event()
    threading.Thread(target=_requests, args=(asked,), daemon=True).start()
    pins = Pins() if args.hal else None
    bridge.say(f"listening on {host}:{server.server_address[1]}, session {bridge.mailbox.session}")
    due = time.monotonic()
    while True:
        bridge.scan()
        if pins is not None:
            pins.exchange(bridge)
        if asked.is_set():
            asked.clear()
            request(bridge, 0, 0)
        due = max(due + SCAN_S, time.monotonic())
        time.sleep(max(due - time.monotonic(), 0))


def _machine(folder):
    """LinuxCNC, as it runs, and the folder for memory and programs; SystemExit where either is not to be had."""
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise SystemExit(f"--folder {folder}: {error.strerror}. Name one that can be written") from error
    try:
        return Machine(os.path.abspath(folder))
    except linuxcnc.error as error:
        raise SystemExit(f"LinuxCNC does not answer ({error}). Start it first, as this user") from error


def _requests(asked):
    for line in sys.stdin:
        if line.strip() == "request":
            asked.set()


if __name__ == "__main__":
    main()
