"""fleet.yaml: its reference is fresh, paths count from its folder, mistakes are named."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.config.config_file import ConfigError
from service.fleet.reference import reference
from service.fleet.settings import Fleet, load_fleet

ROOT = Path(__file__).parents[3]


def test_the_reference_is_fresh() -> None:
    how = "run: python -m service.fleet.reference docs/reference/fleet.md"
    assert (ROOT / "docs" / "reference" / "fleet.md").read_text() == reference(), how


def test_an_empty_mapping_is_enough_and_paths_count_from_the_file(tmp_path: Path) -> None:
    path = tmp_path / "fleet.yaml"
    path.write_text("{}\n")
    assert load_fleet(path) == Fleet(store=tmp_path / "fleet.sqlite")
    path.write_text("broker: {username: fleet, password_file: secret, tls: {ca_file: ca.pem}}\n")
    broker = load_fleet(path).broker
    assert broker.password_file == tmp_path / "secret"
    assert broker.tls is not None
    assert broker.tls.ca_file == tmp_path / "ca.pem"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("- 1\n", "holds a list"),
        ("brocker: {}\n", "brocker"),
        ("broker: {password_file: x}\n", "without a username"),
        ("broker: {tls: {cert_file: x}}\n", "expected both or none"),
        ("page: {key: x}\n", "expected both or none"),
        ("groups: ['a/b']\n", r"without \+ # /"),
        ("shifts: []\n", "expected one time of day or more"),
        ("shifts: ['25:00']\n", "expected HH:MM"),
        ("shifts: ['23:00-12:00']\n", "expected HH:MM"),
        ('host_id: "a\\tb"\n', "printable characters"),
    ],
)
def test_a_mistake_is_told(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "fleet.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=expected):
        load_fleet(path)
