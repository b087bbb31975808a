"""`combtrace focus`: sharpness and clipping in the terminal, while a person turns the lens."""

from __future__ import annotations

import argparse
import sys
import time
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_OK
from service.cli.options.camera import add_camera_arguments, opened_camera

if TYPE_CHECKING:
    from contour.image.picture_figures import PictureFigures

HELP = "show sharpness and clipping live, while the lens is turned"
DESCRIPTION = """\
Put the block, or the calibration board, under the camera and turn the lens until
sharpness is highest: the bar is full at the best seen so far. Then set the aperture or
the exposure so that neither black nor white is clipped. Ctrl-C ends it.

Exit status: 0 ended, 1 no frame, 2 bad configuration or usage."""

BAR = 30
PERIOD_S = 0.2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The camera, and a bound for scripts."""
    parser.add_argument("--frames", type=int, default=0, metavar="N", help="end after N frames; default 0: never")
    add_camera_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Show line upon line, or one line anew on a terminal."""
    from contour.image.picture_figures import picture_figures

    best, count = 0.0, 0
    live = sys.stdout.isatty()
    try:
        with opened_camera(args) as camera:
            while not args.frames or count < args.frames:
                figures = picture_figures(camera.grab(time.monotonic(), args.timeout_s).pixels)
                best, count = max(best, figures.sharpness), count + 1
                print(("\r\x1b[K" if live else "") + focus_line(figures, best), end="" if live else "\n", flush=True)
                time.sleep(PERIOD_S)
    except KeyboardInterrupt:
        pass
    if live:
        print()
    print(f"best sharpness {best:.1f} % in {count} frames")
    return EXIT_OK


def focus_line(figures: PictureFigures, best: float) -> str:
    """One line for the person at the lens: a bar that is full at the best so far, figures, and what is clipped."""
    from contour.image.picture_figures import MOST_CLIPPED

    share = figures.sharpness / best if best > 0 else 0.0
    bar = "#" * round(BAR * share)
    notes = []
    if figures.bright_share > MOST_CLIPPED:
        notes.append("white clipped: less light or exposure")
    if figures.dark_share > MOST_CLIPPED:
        notes.append("black clipped: more light or exposure")
    text = f"[{bar:<{BAR}}] {share:4.0%} of the best; {figures}"
    return text + (" - " + ", ".join(notes) if notes else "")
