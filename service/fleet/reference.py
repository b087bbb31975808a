"""fleet.yaml as Markdown, made from its models: `python -m service.fleet.reference docs/reference/fleet.md`."""

from __future__ import annotations

import sys
from pathlib import Path

from service.config.plant import Broker, Tls
from service.config.reference import rows
from service.fleet.settings import Fleet, FleetPage

HEAD = """\
# The fleet page's configuration

Made from the models in `service/fleet/settings.py`; a test keeps it fresh. What `combtrace fleet serve` shows and
answers: [a plant](../how-to/plant.md). Unknown keys are refused, relative paths count from the file's folder.
"""


def reference() -> str:
    """The whole page."""
    sections = (("Top level", Fleet), ("`broker`", Broker), ("`broker.tls`", Tls), ("`page`", FleetPage))
    table = "| key | value | default | meaning |\n|---|---|---|---|\n"
    told = (
        f"\n## {title}\n\n{(model.__doc__ or '').strip()}\n\n{table}{''.join(rows(model))}" for title, model in sections
    )
    return HEAD + "".join(told)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(reference(), encoding="utf-8")
