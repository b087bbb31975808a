"""Payloads: our bytes read by protobuf's own code in pysparkplug, its bytes read by ours, and bytes that are none."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.telemetry.payload import LARGEST, DataType, Metric, Payload, PayloadError, decoded, encoded
from service.telemetry.sparkplug import REBIRTH, rebirth_asked
from tests.support.interop.programs import python_packages

TIMES = st.integers(0, 2**62)
VALUES = st.one_of(
    st.tuples(st.just(DataType.UINT64), st.integers(0, 2**64 - 1)),
    st.tuples(st.just(DataType.INT64), st.integers(0, 2**62)),
    st.tuples(st.just(DataType.DATETIME), TIMES),
    st.tuples(st.just(DataType.DOUBLE), st.floats(allow_nan=False)),
    st.tuples(st.just(DataType.BOOLEAN), st.booleans()),
    st.tuples(st.just(DataType.STRING), st.text()),
    st.tuples(st.sampled_from([one for one in DataType if one]), st.none()),
)
METRICS = st.builds(
    lambda typed, *rest: Metric(typed[1], typed[0], *rest),
    VALUES,
    st.none() | st.text(min_size=1),
    st.none() | st.integers(0, 2**63),
    st.none() | TIMES,
    st.booleans(),
)
PAYLOADS = st.builds(Payload, TIMES, st.lists(METRICS, max_size=5).map(tuple), st.none() | st.integers(0, 255))
BIRTH = Payload(
    1_795_465_952_053,
    (
        Metric(3, DataType.INT64, "bdSeq", None, 1),
        Metric(2**64 - 1, DataType.UINT64, "Count", 1, 2),
        Metric(-0.125, DataType.DOUBLE, "Real", 2, 3),
        Metric(True, DataType.BOOLEAN, "Yes", 3, 4),
        Metric("größer, больше", DataType.STRING, "Text", 4, 5),
        Metric(None, DataType.STRING, "Not known", 5, 6),
        Metric(0, DataType.UINT64, "Nought", 6, 7),
        Metric("", DataType.STRING, "Empty", 7, 8),
    ),
    0,
)
DATA = Payload(1, (Metric(7, DataType.UINT64, None, 1, 9, True), Metric(0.5, DataType.DOUBLE, None, 2)), 255)
# As pysparkplug reads and writes them.
FOREIGN = """
import json, sys
import pysparkplug
birth = pysparkplug.NBirth.decode(bytes.fromhex(sys.argv[1]))
data = pysparkplug.NData.decode(bytes.fromhex(sys.argv[2]), birth=birth)
told = [[[m.name, m.datatype.name, str(m.value), m.timestamp, m.is_historical] for m in one.metrics] + [one.seq]
        for one in (birth, data)]
print(json.dumps({"told": told, "birth": birth.encode(include_dtypes=True).hex(), "data": data.encode().hex()}))
"""


def test_pysparkplug_reads_what_we_write_and_we_what_it_writes() -> None:
    words = [encoded(BIRTH, types=True).hex(), encoded(DATA, types=False).hex()]
    path = {"PYTHONPATH": str(python_packages("pysparkplug>=0.6,<0.7"))}
    done = subprocess.run([sys.executable, "-c", FOREIGN, *words], capture_output=True, text=True, env=path, check=True)
    said = json.loads(done.stdout)
    birth, data = said["told"]
    names = [one.name for one in BIRTH.metrics]
    assert [one[:3] for one in birth[:-1]] == [[one.name, one.datatype.name, str(one.value)] for one in BIRTH.metrics]
    assert (birth[-1], data[-1]) == (0, 255)
    assert data[:-1] == [[names[1], "UINT64", "7", 9, True], [names[2], "DOUBLE", "0.5", None, False]]
    assert decoded(bytes.fromhex(said["birth"])) == BIRTH
    assert [one.value for one in decoded(bytes.fromhex(said["data"])).metrics] == [7, 0.5]


@settings(max_examples=40)
@given(PAYLOADS)
def test_what_is_written_is_read_again(payload: Payload) -> None:
    assert decoded(encoded(payload, types=True)) == payload
    untyped = tuple(replace(one, datatype=DataType.UNKNOWN) for one in payload.metrics)
    assert decoded(encoded(payload, types=False)) == replace(payload, metrics=untyped)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_payload_or_a_payload_error(raw: bytes) -> None:
    try:
        found = decoded(raw)
    except PayloadError:
        return
    assert decoded(encoded(found, types=True)).seq == (None if found.seq is None else found.seq % 2**64)


@pytest.mark.parametrize("cut", range(1, 60, 7))
def test_a_payload_cut_short_is_none(cut: int) -> None:
    with pytest.raises(PayloadError, match=r"are left|not end"):
        decoded(encoded(BIRTH, types=True)[:-cut])


def test_what_is_too_large_is_not_read() -> None:
    with pytest.raises(PayloadError, match="1000000 at most"):
        decoded(bytes(LARGEST + 1))


def test_a_payload_of_too_many_metrics_is_refused_before_all_are_read() -> None:
    with pytest.raises(PayloadError, match="more than 1000 metrics"):
        decoded(b"\x12\x00" * 400_000)


def test_a_long_command_is_not_read() -> None:
    wish = Payload(1, (Metric(True, DataType.BOOLEAN, REBIRTH),))
    assert rebirth_asked(encoded(wish, types=True))
    long = replace(wish, metrics=(*wish.metrics, Metric("x" * 30_000, DataType.STRING, "more")))
    assert not rebirth_asked(encoded(long, types=True))
