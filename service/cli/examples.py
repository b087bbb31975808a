"""What `--help` of each command shows at its end; a test parses every line."""

from __future__ import annotations

EXAMPLES: dict[str, tuple[tuple[str, str], ...]] = {
    "run": (
        ("combtrace run --config /etc/combtrace/config.yaml", "The daemon; Ctrl-C or SIGTERM ends it in order."),
        ("combtrace run --once --config config.yaml", "One job by hand; its end is the exit status."),
    ),
    "trace": (
        ("combtrace trace block.png --overlay seen.png", "One picture, in pixels, and what was seen."),
        (
            "combtrace trace pictures/ --calibration calibration.yaml --json seen.jsonl --overlay seen/",
            "All pictures of a folder, in millimetres.",
        ),
        (
            "combtrace trace block.png --calibration calibration.yaml --thickness-mm 20 --dxf block.dxf",
            "The outline at the top of a block of 20 mm, for CAD.",
        ),
    ),
    "fit": (
        ("combtrace fit block.png --part part.dxf --calibration calibration.yaml", "Where the part lies best."),
        (
            "combtrace fit block.png --part part.dxf --margin-mm 3 --rotation 4 --config config.yaml --json -",
            "As the recipe traces, quarter turns only, for a script.",
        ),
        ("combtrace fit block.png --part part.svg --config config.yaml --overlay laid.png", "Draw it, to look at."),
    ),
    "report": (
        ("combtrace report", "How the last eight hours were, as shift.html."),
        ("combtrace report --from 2026-11-21T06:00 --to 2026-11-21T14:00 --language ru", "A shift, in Russian."),
        ("combtrace report --from 7d --recipe 2 --output week.html", "A week of one recipe."),
    ),
    "fleet": (("combtrace fleet serve --config fleet.yaml", "One page over all cells of a plant, until stopped."),),
    "remnants": (
        ("combtrace remnants", "What is left of blocks that were cut."),
        ("combtrace remnants --fits part.dxf --margin-mm 3", "Into which of it a part fits, the smallest first."),
        ("combtrace remnants --used 7", "Number 7 was taken from the shelf."),
    ),
    "judge": (
        ("combtrace judge pictures/ --page judged.html", "How well your own blocks are traced."),
        ("combtrace judge pictures/ --config config.yaml --recipe 2 --json -", "With a recipe, for a script."),
        ("combtrace judge --annotate pictures/", "Draw the true outlines of the pictures first."),
    ),
    "demo": (("combtrace demo --output demo-output", "The whole way once; the picture's path comes last."),),
    "check": (
        ("combtrace check --config config.yaml", "All there is to check, devices too."),
        ("combtrace check --no-devices --strict --json -", "The files alone, for a script; warnings count."),
    ),
    "trigger": (
        ("combtrace trigger --recipe 2", "A job of the daemon whose config.yaml lies here."),
        ("combtrace trigger --state-dir /var/lib/combtrace --thickness-mm 20.5", "The same, wherever you are."),
        ("combtrace trigger --port /dev/ttyUSB0", "As a panel at a serial line does."),
    ),
    "simulate-controller": (
        ("combtrace simulate-controller --tcp 127.0.0.1:5020 --trigger-every 5", "One that asks every 5 s."),
        ("combtrace simulate-controller --rtu /dev/ttyUSB1 --refuse", "At a serial line; it refuses every contour."),
    ),
    "simulate-service": (
        ("combtrace simulate-service --controller 192.168.0.10:502 --once", "One contour to your controller."),
        ("combtrace simulate-service --controller 192.168.0.10:502 --shape holes --every 10", "A job every 10 s."),
    ),
    "cameras": (("combtrace cameras --brief", "One line a camera."),),
    "grab": (
        ("combtrace grab --config config.yaml --output frame.png", "One frame, as a job would see it."),
        ("combtrace grab --device /dev/video0 --size 1600x1200 --output frame.png", "Without a configuration."),
    ),
    "focus": (("combtrace focus --config config.yaml", "Turn the lens until the bar is full."),),
    "live": (
        ("combtrace live --config config.yaml --overlay live.jpg", "While the block is laid down; show live.jpg."),
        ("combtrace live --simulated --frames 50", "Without a camera: how fast this machine is."),
    ),
    "board": (
        (
            "combtrace board --board charuco --squares 11x8 --square-mm 25 --output board.svg",
            "A board to print; measure a square before you calibrate.",
        ),
    ),
    "calibrate": (
        (
            "combtrace calibrate --board charuco --squares 11x8 --square-mm 25.02 --plane flat.png tilted/ "
            "--output calibration.yaml",
            "From one picture of the board on the table, and a folder of tilted ones.",
        ),
        (
            "combtrace calibrate --points marks.csv --size 1600x1200 --output calibration.yaml",
            "From four or more measured marks.",
        ),
        ("combtrace calibrate --scale 0.4 --size 1600x1200 --output calibration.yaml", "To try things out."),
    ),
    "align": (
        ("combtrace align --points jogged.csv --calibration calibration.yaml", "From points of the board's corners."),
    ),
    "verify": (
        (
            "combtrace verify master/ --outline master.json --config config.yaml --trend trend.csv",
            "The weekly check with a folder of pictures of the master part.",
        ),
    ),
    "accept": (
        ("combtrace accept --gauge plate.yaml --config config.yaml --operator Anna", "By the camera, step by step."),
        (
            "combtrace accept places/ --gauge plate.yaml --config config.yaml --against last.json --json now.json",
            "From a folder of pictures, beside last year's.",
        ),
        (
            "combtrace accept places/ --gauge plate.yaml --config config.yaml --study anna=anna/ boris=boris/",
            "With a gauge study: each operator's pictures in a folder.",
        ),
    ),
    "repeat": (("combtrace repeat --config config.yaml --count 50", "How much 50 frames of one scene scatter."),),
    "teach-table": (
        ("combtrace teach-table --config config.yaml", "The camera takes the pictures: clear the table first."),
        ("combtrace teach-table empty/ --output table.npz", "From a folder of pictures."),
    ),
    "probe": (
        ("combtrace probe --config config.yaml", "Look only."),
        ("combtrace probe --config config.yaml --write", "Find lengths and word order by writing, too."),
    ),
    "jobs": (
        ("combtrace jobs --since 8h --outcome refused", "What was refused in this shift, and why."),
        ("combtrace jobs show 418", "All that is known of one."),
        ("combtrace jobs --since 2026-11-21 --limit 0 --json", "A whole day, for a script."),
    ),
    "replay": (
        ("combtrace replay 418", "Whether it comes out as it did."),
        ("combtrace replay --since 1d --set recipe.max_uncertainty_mm=0.4", "Whose verdict another limit would flip."),
        ("combtrace replay --output year.parquet --workers 8 --report year.html", "The whole archive, in a table."),
        (
            "combtrace replay --archive s3://plant/line-1 --scheduler tcp://host:8786 --output year.parquet",
            "The same from a bucket, by a Dask cluster.",
        ),
        (
            "combtrace replay --against /opt/combtrace/venv --output upgrade.parquet --fail-on 'sent_to_refused>0'",
            "What the version installed there says, beside this one.",
        ),
    ),
    "status": (
        ("combtrace status", "Of the daemon whose config.yaml lies here."),
        ("combtrace status --state-dir /var/lib/combtrace --watch", "Follow it until Ctrl-C."),
        ("combtrace status --watch --json", "One object a change, for a script."),
    ),
    "halt": (('combtrace halt --reason "blade is being changed"', "It holds until `combtrace resume`."),),
    "resume": (("combtrace resume", "End the halt."),),
    "confirm": (("combtrace confirm", "After the cause was looked at and mended."),),
    "pin": (("combtrace pin anna", "A line for page.people_file, to be added to it; it asks for the PIN."),),
    "reset": (("combtrace reset", "Open controller, camera and ports anew."),),
    "install-service": (
        ("combtrace install-service --print unit", "Show it, install nothing."),
        ("combtrace install-service --config /etc/combtrace/config.yaml", "As root: with the machine from now on."),
    ),
    "completion": (
        ("combtrace completion bash > /etc/bash_completion.d/combtrace", "As root, for all."),
        ("combtrace completion fish > ~/.config/fish/completions/combtrace.fish", "For yourself."),
    ),
    "schema": (("combtrace schema > config.schema.json", "For an editor that completes and checks YAML."),),
    "reasons": (
        ("combtrace reasons", "All of them."),
        ("combtrace reasons 113 --language ru", "What one means and what to do, in Russian."),
    ),
    "register-map": (("combtrace register-map --config config.yaml", "By the addresses that are configured."),),
}


def examples_of(command: str) -> str:
    """The end of a command's help."""
    told = "\n".join(f"    {line}\n        {what}" for line, what in EXAMPLES.get(command, ()))
    return f"EXAMPLES\n{told}" if told else ""
