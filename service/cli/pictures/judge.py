"""`combtrace judge FOLDER`: pictures traced, and compared with the true outlines that lie beside them."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.colour import Colour, painted
from service.cli.errors import EXIT_OK, EXIT_REFUSED, EXIT_UNUSABLE, UserError
from service.cli.file_names import check_outputs
from service.cli.options.tracing import Tracing, add_tracing_arguments
from service.cli.pictures.annotate import annotate
from service.cli.pictures.given_pictures import pictures_in
from service.cli.text_output import text_output

if TYPE_CHECKING:
    from service.judging.judgement import Judgement

HELP = "compare what is traced in pictures with true outlines"
DESCRIPTION = """\
Trace each picture of the folder as `combtrace trace` does, and compare with the true
outline beside it: NAME.json for the picture NAME.png, with the rings `outer` and `holes`
([x, y] in pixels, first vertex not repeated, (0, 0) the middle of the first pixel) and
`edge`: cut, cells or mixed. Distances run both ways, the worse is told. A bound holds
where 95 % of the true outline lie within it; a refused outline is compared too.

With --annotate nothing is judged: a page is served to this machine alone, on which true
outlines are drawn with the mouse and saved as NAME.json, until Ctrl-C.

Exit status: 0 every picture accepted within its bound, 3 one refused or outside of it,
2 one could not be judged, unusable input or usage; the worst counts (0 < 3 < 2)."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The folder, how its pictures are traced, outputs."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="pictures, each beside its NAME.json")
    add_tracing_arguments(parser)
    parser.add_argument(
        "--json", metavar="FILE", help="JSON Lines, an object a picture and a summary; - is standard output"
    )
    parser.add_argument("--page", metavar="FILE", help="HTML with the table, and both outlines over each picture")
    parser.add_argument("--annotate", action="store_true", help="serve a page to draw true outlines on")
    parser.add_argument("--port", type=int, metavar="N", help="--annotate: the page's port; else any that is free")


def run(args: argparse.Namespace) -> int:
    """Judge all pictures; the worst exit status."""
    from service.judging.judgement import summary
    from service.judging.report import report
    from service.judging.table import COLUMNS, cells, line, sentence
    from service.judging.truth_file import truth_path

    if args.annotate:
        return annotate(args)
    if args.port is not None:
        raise UserError("--port: is of the page that --annotate serves. Leave it out, or add --annotate")
    images, lone_truths = _pairs(args.folder)
    outputs = (("--json", args.json), ("--page", args.page))
    read = [*images, *map(truth_path, images), *lone_truths]
    check_outputs(read, [(option, Path(name)) for option, name in outputs if name not in (None, "-")])
    if args.page == "-":
        raise UserError("--page -: the table goes to standard output. Name a file")
    judge = _Judge(Tracing.of(args), with_figures=args.page is not None)
    texts = sys.stderr if args.json == "-" else sys.stdout
    width = max(len(path.name) for path in (*images, *lone_truths))
    with text_output(args.page, "--page") as write_page, text_output(args.json) as write:
        print(line(COLUMNS, width), file=texts)
        for judgement in judge.all(images, lone_truths):
            stream = sys.stderr if judgement.status == "error" else texts
            colour = Colour.GOOD if judgement.passes else Colour.BAD
            print(painted(line(cells(judgement), width), colour, stream), file=stream, flush=True)
            write(json.dumps(judgement.record(), ensure_ascii=False) + "\n")
        print(sentence(judge.done), file=texts)
        write(json.dumps({"summary": summary(judge.done)}) + "\n")
        if args.page is not None:
            write_page(report(judge.done, judge.figures))
    if any(one.status == "error" for one in judge.done):
        return EXIT_UNUSABLE
    return EXIT_OK if all(one.passes for one in judge.done) else EXIT_REFUSED


def _pairs(folder: Path) -> tuple[list[Path], list[Path]]:
    """The folder's pictures, and its truth files that no picture lies beside; raise UserError."""
    from service.judging.truth_file import SUFFIX, TruthFileError, read_object, truth_path

    images, _ = pictures_in(folder)
    truths = {truth_path(image) for image in images}
    if not any(truth.exists() for truth in truths):
        raise UserError(
            f"{folder}: holds {len(images)} pictures and beside none a NAME.json with its true outline. "
            f"Draw them: combtrace judge --annotate {folder}"
        )
    lone = []
    for path in sorted(folder.glob(f"*{SUFFIX}")):
        with suppress(TruthFileError):  # it may be any program's
            if path not in truths and "outer" in read_object(path):
                lone.append(path)
    return images, lone


@dataclass
class _Judge:
    """Judges pictures one by one, and keeps what was found."""

    tracing: Tracing
    with_figures: bool
    done: list[Judgement] = field(default_factory=list)
    figures: list[str] = field(default_factory=list)

    def all(self, images: list[Path], lone_truths: list[Path]) -> Iterator[Judgement]:
        """The judgement of each picture as it is made, then of each truth without one."""
        from service.judging.judgement import Judgement

        for image in images:
            self.done.append(self._one(image))
            yield self.done[-1]
        for path in lone_truths:
            text = f"{path}: no picture of that name lies beside it. Add it, or take the file away"
            self.done.append(Judgement(path, "error", details=(text,)))
            yield self.done[-1]

    def _one(self, image: Path) -> Judgement:
        from contour.errors import ContourError
        from drivers.camera import CameraError
        from service.judging.judgement import Judgement, judged, outline_px
        from service.judging.report import figure
        from service.judging.truth_file import TruthFileError, read_truth, truth_path

        try:
            truth = read_truth(truth_path(image))
            picture, measurement = self.tracing.traced(image)
        except (TruthFileError, CameraError, ContourError) as error:
            return Judgement(image, "error", details=(str(error),))
        ours = outline_px(measurement, self.tracing.measurer, self.tracing.thickness_mm)
        judgement = judged(image, measurement, ours, truth)
        if self.with_figures:
            self.figures.append(figure(judgement, picture, ours, truth))
        return judgement
