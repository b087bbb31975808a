"""What is put together from messages of cells: births, aliases, gaps, deaths of other lives, and nonsense."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.fleet.cells import LONGEST_TEXT, MOST_CELLS, REBIRTH_GAP_S, Cell, Cells, Heard
from service.telemetry.cell_metrics import ALIASES, TYPES, Values
from service.telemetry.payload import MOST_METRICS, DataType, Metric
from service.telemetry.session import Message
from service.telemetry.sparkplug import Node

NAME = ("plant", "cell-1")
AT_MS = 1_000_000


def data(node: Node, values: Values, *, old: bool = False) -> Message:
    return node.data([Metric(v, TYPES[k], None, ALIASES[k], AT_MS, old) for k, v in values.items()], AT_MS)


class Ear:
    """A node, and what has been heard of it."""

    def __init__(self) -> None:
        self.cells, self.node, self.now_s = Cells(), Node(*NAME, births=3), 100.0

    def hears(self, message: Message) -> Heard:
        heard = self.cells.take(message.topic, message.payload, self.now_s, AT_MS)
        assert heard is not None
        return heard

    @property
    def cell(self) -> Cell:
        return self.cells.by_name[NAME]


@pytest.fixture
def born() -> Ear:
    heard = Ear()
    heard.hears(heard.node.birth({"State/Name": "Ready", "Job/Number": None}, TYPES, AT_MS))
    return heard


def test_a_birth_names_what_follows_by_alias(born: Ear) -> None:
    assert born.cell.values["State/Name"] == "Ready"
    born.hears(data(born.node, {"State/Name": "Error", "State/Reason": "camera silent"}))
    assert (born.cell.values["State/Name"], born.cell.values["State/Reason"]) == ("Error", "camera silent")
    assert born.cell.state_since_ms == AT_MS


def test_a_historical_value_is_none_of_now_but_its_job_counts(born: Ear) -> None:
    job: Values = {"Job/Number": 5, "Job/Settled": 77, "Job/Outcome": "refused"}
    heard = born.hears(data(born.node, {**job, "State/Name": "Error"}, old=True))
    assert heard.jobs == [job]
    assert (born.cell.values["State/Name"], born.cell.values["Job/Number"]) == ("Ready", None)


def test_a_gap_is_asked_about_not_more_often_than_it_can_be_answered(born: Ear) -> None:
    data(born.node, {"State/Code": 1})  # is lost on its way
    assert born.hears(data(born.node, {"State/Code": 3})).ask
    assert born.cell.values["State/Code"] == 3
    data(born.node, {"State/Code": 1})
    assert not born.hears(data(born.node, {"State/Code": 4})).ask
    born.now_s += REBIRTH_GAP_S
    data(born.node, {"State/Code": 1})
    assert born.hears(data(born.node, {"State/Code": 5})).ask


def test_numbers_begin_anew_after_255(born: Ear) -> None:
    assert not any(born.hears(data(born.node, {"State/Code": k})).ask for k in range(600))


def test_data_without_a_birth_is_asked_about_and_not_understood() -> None:
    heard = Ear()
    assert heard.hears(data(heard.node, {"State/Name": "Ready"})).ask
    assert heard.cell.values == {}
    assert not heard.cell.born


def test_only_the_death_of_its_present_life_ends_a_cell(born: Ear) -> None:
    born.hears(replace(born.node, births=2).death(AT_MS))
    assert born.cell.born
    born.hears(born.node.death(AT_MS))
    assert not born.cell.born


def test_more_cells_than_can_be_shown_are_not_kept() -> None:
    cells = Cells()
    for number in range(MOST_CELLS + 5):
        message = Node("plant", f"cell-{number}", 0).data([], AT_MS)
        cells.take(message.topic, message.payload, 0.0, AT_MS)
    assert len(cells.by_name) == MOST_CELLS


def test_a_cell_that_names_more_and_more_fills_no_memory(born: Ear) -> None:
    for number in range(3):
        values = [Metric("x" * 30_000, DataType.STRING, f"{number}-{k}") for k in range(30)]
        values += [Metric(k, DataType.UINT64, f"n{number}-{k}") for k in range(800)]
        born.hears(born.node.data(values, AT_MS))
    assert len(born.cell.values) == MOST_METRICS
    assert max(len(value) for value in born.cell.values.values() if isinstance(value, str)) == LONGEST_TEXT


@settings(max_examples=25)
@given(st.sampled_from(["NBIRTH", "NDATA", "NDEATH", "STATE"]), st.binary(max_size=60))
def test_nonsense_changes_no_cell(kind: str, raw: bytes) -> None:
    heard = Ear()
    heard.hears(heard.node.birth({"State/Name": "Ready"}, TYPES, AT_MS))
    heard.cells.take(f"spBv1.0/other/{kind}/cell-9", raw, 0.0, AT_MS)
    heard.cells.take(f"spBv1.0/{kind}", raw, 0.0, AT_MS)
    assert heard.cell.values["State/Name"] == "Ready"
    assert heard.cell.born
