"""What a connection needs of files: each that cannot be used is named, with what was expected."""

from __future__ import annotations

import ssl
import subprocess
from pathlib import Path

import pytest

from service.config.plant import Broker, Tls
from service.telemetry.session import Message, Session, SessionLost, Waker, password_of, tls_context
from tests.support.interop.mosquitto import Mosquitto
from tests.support.real_parts import need_program


def own_pair(folder: Path) -> tuple[Path, Path]:
    """A certificate for localhost, and its key."""
    openssl = need_program("openssl", "apt-get install openssl")
    own, key = folder / "own.pem", folder / "own.key"
    made = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost", "-keyout", key, "-out", own]
    subprocess.run([openssl, *made], check=True, capture_output=True)
    return own, key


@pytest.mark.parametrize(
    ("content", "told"), [(None, "No such file"), (b"\xff\xfe", "cannot be read"), (b"\n", "empty")]
)
def test_a_password_that_cannot_be_read_is_told_with_its_file(tmp_path: Path, content: bytes | None, told: str) -> None:
    path = tmp_path / "broker.password"
    if content is not None:
        path.write_bytes(content)
        path.chmod(0o600)
    with pytest.raises(ValueError, match=rf"broker\.password: .*{told}"):
        password_of(Broker(username="cell-1", password_file=path))


def test_files_of_tls_that_cannot_be_used_are_named(tmp_path: Path) -> None:
    (tmp_path / "ca.pem").write_text("no certificate")
    for name in ("ca.pem", "missing.pem"):
        with pytest.raises(ValueError, match=rf"{name}: .*Expected certificates, PEM"):
            tls_context(Broker(tls=Tls(ca_file=tmp_path / name)))
    own, key = own_pair(tmp_path)
    locked = tmp_path / "locked.key"
    openssl = need_program("openssl", "apt-get install openssl")
    subprocess.run([openssl, "rsa", "-aes256", "-passout", "pass:word", "-in", key, "-out", locked], check=True)
    assert tls_context(Broker(tls=Tls(cert_file=own, key_file=key))).verify_mode is ssl.CERT_REQUIRED
    for name in ("missing.key", "locked.key"):
        with pytest.raises(ValueError, match=rf"own\.pem with .*{name}: .*Expected a certificate and its key"):
            tls_context(Broker(tls=Tls(cert_file=own, key_file=tmp_path / name)))


def why_not(broker: Mosquitto, settings: Broker) -> str:
    """Why no session is to be had."""
    waker = Waker()
    broker.start()
    try:
        with pytest.raises(SessionLost, match=f"^127.0.0.1:{broker.port}: ") as found:
            Session(settings, "one", Message("a", b""), waker, lambda *_: None)
    finally:
        broker.kill()
        waker.close()
    return str(found.value)


def test_a_broker_that_lets_nobody_in_is_told_with_what_to_check(tmp_path: Path) -> None:
    (tmp_path / "passwords").write_text("")
    broker = Mosquitto(tmp_path, f"allow_anonymous false\npassword_file {tmp_path / 'passwords'}\n")
    told = why_not(broker, Broker(port=broker.port))
    assert "refused the connection: Not authorized. Check username and password_file" in told


@pytest.mark.filterwarnings("ignore:unclosed <ssl.SSLSocket:ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_broker_of_another_authority_or_over_tls_unasked_is_told(tmp_path: Path) -> None:
    """Of a handshake that fails the library leaves the socket to the collector of memory."""
    own, key = own_pair(tmp_path)
    broker = Mosquitto(tmp_path, f"allow_anonymous true\ncertfile {own}\nkeyfile {key}\n")
    assert "closed before it answered" in why_not(broker, Broker(port=broker.port))
    told = why_not(broker, Broker(port=broker.port, tls=Tls()))
    assert "certificate verify failed: self-signed certificate. Check tls.ca_file" in told
