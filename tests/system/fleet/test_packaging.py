"""The files of packaging/plant: each is started, or judged by its own program, with nothing but its paths changed."""

from __future__ import annotations

import subprocess
import urllib.request
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from service.config.config_file import load_config
from service.config.plant import Broker, Tls
from service.fleet.settings import load_fleet
from service.telemetry.payload import DataType, Metric
from service.telemetry.session import Message, Session, SessionLost, Waker
from service.telemetry.sparkplug import Node
from tests.support.interop.mosquitto import Mosquitto
from tests.support.processes.page_client import Client
from tests.support.processes.processes import Process, free_port, until
from tests.support.real_parts import need_program

PACKAGING = Path(__file__).parents[3] / "packaging"
PLANT = PACKAGING / "plant"
ETC = "/etc/combtrace-plant"
MOST_EXPOSED = 22  # as the daemon's unit
PROMETHEUS_INSTALL = "apt-get install prometheus"


@dataclass
class Packaged:
    """The plant's broker as packaged; who knows its certificates and passwords."""

    broker: Mosquitto
    folder: Path

    def settings(self, name: str, password: str = "") -> Broker:
        """As that one connects; by its own password unless one is given."""
        file = self.folder / f"{name}.password"
        if password:
            file = self.folder / "another.password"
            file.write_text(password)
        file.chmod(0o600)
        tls = Tls(ca_file=self.folder / "ca.pem")
        return Broker(host="localhost", port=self.broker.port, username=name, password_file=file, tls=tls)


@pytest.fixture(scope="module")
def packaged(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Packaged]:
    folder = tmp_path_factory.mktemp("plant")
    openssl = need_program("openssl", "apt-get install openssl")
    options = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=localhost"
    options += " -addext subjectAltName=DNS:localhost -keyout broker.key -out broker.pem"
    subprocess.run([openssl, *options.split()], cwd=folder, check=True, capture_output=True)
    (folder / "ca.pem").write_bytes((folder / "broker.pem").read_bytes())
    config = folder / "mosquitto.conf"
    broker = Mosquitto(folder, config=config)
    text = (PLANT / "mosquitto.conf").read_text().replace(ETC, str(folder))
    config.write_text("user root\n" + text.replace("listener 8883", f"listener {broker.port}"))
    (folder / "broker.acl").write_text((PLANT / "broker.acl").read_text())
    (folder / "passwords").touch()
    for name in ("fleet", "cell-1"):
        (folder / f"{name}.password").write_text(f"{name} has this password\n")
        words = ["mosquitto_passwd", "-b", folder / "passwords", name, f"{name} has this password"]
        subprocess.run(words, check=True, capture_output=True)
    broker.start()
    try:
        yield Packaged(broker, folder)
    finally:
        broker.kill()


# paho-mqtt leaves the socket of a handshake that fails to the garbage collector.
@pytest.mark.filterwarnings("ignore:unclosed <ssl.SSLSocket:ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_the_packaged_broker_lets_each_in_by_its_password_over_tls_and_no_other(packaged: Packaged) -> None:
    waker = Waker()
    will = Message("spBv1.0/combtrace/NDEATH/cell-1", b"", qos=1)
    try:
        with Session(packaged.settings("cell-1"), "one", will, waker, lambda *_: None) as session:
            mid = session.subscribe(["spBv1.0/combtrace/NCMD/cell-1"])
            session.turn_until(lambda: session.answered(mid), "SUBSCRIBE")
        with pytest.raises(SessionLost, match=r"refused the connection"):
            Session(packaged.settings("cell-1", "another"), "two", will, waker, lambda *_: None)
        plain = packaged.settings("cell-1").model_copy(update={"tls": Tls()})
        with pytest.raises(SessionLost, match=r"CERTIFICATE_VERIFY_FAILED|certificate verify failed"):
            Session(plain, "three", will, waker, lambda *_: None)
        (packaged.folder / "cell-1.password").chmod(0o644)
        open_to_all = packaged.settings("fleet").model_copy(
            update={"password_file": packaged.folder / "cell-1.password"}
        )
        with pytest.raises(SessionLost, match=r"others may read it"):
            Session(open_to_all, "four", will, waker, lambda *_: None)
    finally:
        waker.close()


def test_the_packaged_fleet_page_hears_a_cell_and_none_that_speaks_in_its_name(packaged: Packaged) -> None:
    port = free_port()
    text = (PLANT / "fleet.yaml").read_text()
    for was, here in (("8883", str(packaged.broker.port)), ("9780", str(port)), ("/var/lib/combtrace-fleet/", "")):
        assert was in text
        text = text.replace(was, here)
    (packaged.folder / "fleet.yaml").write_text(text)
    (packaged.folder / "fleet.password").chmod(0o600)
    service = Process(packaged.folder / "fleet.log", "fleet", "serve", "--config", packaged.folder / "fleet.yaml")
    waker, client = Waker(), Client(port)
    types = {"State/Name": DataType.STRING}

    def known() -> list[str]:
        with suppress(OSError):
            return [cell["node"] for cell in client.get("/api/v1/cells").json["cells"]]
        return []

    try:
        until(lambda: "listening at" in service.text, what="the fleet at the broker")
        own, other = Node("combtrace", "cell-1", 0), Node("combtrace", "cell-2", 0)
        with Session(packaged.settings("cell-1"), "cell", own.death(1), waker, lambda *_: None) as session:
            session.publish(other.birth({"State/Name": "Ready"}, types, 1))
            session.publish(own.birth({"State/Name": "Ready"}, types, 1))
            session.publish(own.data([Metric("Error", DataType.STRING, None, 1, 1)], 1))
            until(lambda: "cell-1" in known(), what="the cell")
            assert known() == ["cell-1"]
    finally:
        waker.close()
        service.stop()


def test_the_packaged_files_say_what_the_settings_allow() -> None:
    fleet = load_fleet(PLANT / "fleet.yaml")
    assert fleet.broker.password_file == PLANT / "fleet.password"
    unit = (PLANT / "combtrace-fleet.service").read_text()
    assert f"--config {ETC}/fleet.yaml" in unit
    assert f"topic write spBv1.0/STATE/{fleet.host_id}\n" in (PLANT / "broker.acl").read_text()


def test_systemd_accepts_the_packaged_unit_and_finds_it_hardened(tmp_path: Path) -> None:
    analyze = need_program("systemd-analyze", "apt-get install systemd")
    unit = tmp_path / "combtrace-fleet.service"
    unit.write_text((PLANT / unit.name).read_text().replace("/opt/combtrace/bin/combtrace", "/bin/true"))
    for command in (("verify",), ("security", "--offline=yes", f"--threshold={MOST_EXPOSED}")):
        done = subprocess.run([analyze, *command, unit], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


def test_the_packaged_prometheus_starts_with_the_alerts(tmp_path: Path) -> None:
    promtool = need_program("promtool", PROMETHEUS_INSTALL)
    for file in (PLANT / "prometheus.yml", PACKAGING / "prometheus" / "combtrace-alerts.yml"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    checked = subprocess.run(
        [promtool, "check", "config", "prometheus.yml"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr
    port = free_port()
    command = [need_program("prometheus", PROMETHEUS_INSTALL), "--config.file=prometheus.yml"]
    command += ["--storage.tsdb.path=data", f"--web.listen-address=127.0.0.1:{port}"]
    with (
        (tmp_path / "log").open("wb") as log,
        subprocess.Popen(command, cwd=tmp_path, stdout=log, stderr=log) as process,
    ):
        try:
            until(lambda: _answers(f"http://127.0.0.1:{port}/-/ready"), 60, "Prometheus")
            assert _answers(f"http://127.0.0.1:{port}/api/v1/rules")
        finally:
            process.terminate()


def _answers(url: str) -> bool:
    with suppress(OSError), urllib.request.urlopen(url, timeout=10) as reply:
        return reply.status == 200
    return False


def test_a_cells_configuration_of_the_how_to_can_be_read(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "plant.md").read_text()
    section = page.split("```yaml\n")[1].split("```")[0]
    assert section.startswith("telemetry:")
    config = tmp_path / "config.yaml"
    config.write_text(f"camera: {{kind: files, path: .}}\ncontroller: {{kind: none}}\ntriggers: []\n{section}")
    assert load_config(config).telemetry is not None
