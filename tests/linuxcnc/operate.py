#!/usr/bin/python3
"""What an operator and a measuring person do at the machine, for tests: operate.py prepare|estop|start|sample FILE."""

import json
import sys
import time

import linuxcnc

command, stat = linuxcnc.command(), linuxcnc.stat()


def until(condition, bound_s, what):
    """Poll until it holds, else end with what was waited for."""
    end = time.monotonic() + bound_s
    while time.monotonic() < end:
        stat.poll()
        if condition():
            return
        time.sleep(0.002)
    sys.exit(f"not within {bound_s} s: {what}")


def prepare():
    """Reset, switch on, home."""
    for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
        command.state(state)
        command.wait_complete()
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.teleop_enable(0)
    command.wait_complete()
    command.home(-1)
    until(lambda: all(stat.homed[:3]), 20, "homed")


def sample(path):
    """Positions and their times, s, from the next program's start to its end, as fast as can be; to a file."""
    until(lambda: stat.interp_state != linuxcnc.INTERP_IDLE, 60, "a program runs")
    points = []
    while stat.interp_state != linuxcnc.INTERP_IDLE or not stat.inpos:
        stat.poll()
        points.append([*(round(value, 5) for value in stat.actual_position[:3]), round(time.monotonic(), 5)])
        time.sleep(0.001)
    with open(path, "w", encoding="ascii") as file:
        json.dump(points, file)


if __name__ == "__main__":
    if sys.argv[1] == "prepare":
        prepare()
    elif sys.argv[1] == "estop":
        command.state(linuxcnc.STATE_ESTOP)
        command.wait_complete()
    elif sys.argv[1] == "start":
        command.auto(linuxcnc.AUTO_RUN, 0)
    else:
        sample(sys.argv[2])
