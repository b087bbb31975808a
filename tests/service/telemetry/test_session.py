"""What a connection needs of files: each that cannot be used is named, with what was expected."""

from __future__ import annotations

import ssl
import subprocess
from pathlib import Path

import pytest

from service.config.plant import Broker, Tls
from service.telemetry.session import password_of, tls_context
from tests.support.real_parts import need_program


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
    own, key, locked = (tmp_path / name for name in ("own.pem", "own.key", "locked.key"))
    openssl = need_program("openssl", "apt-get install openssl")
    made = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=cell-1", "-keyout", key, "-out", own]
    subprocess.run([openssl, *made], check=True, capture_output=True)
    subprocess.run([openssl, "rsa", "-aes256", "-passout", "pass:word", "-in", key, "-out", locked], check=True)
    assert tls_context(Broker(tls=Tls(cert_file=own, key_file=key))).verify_mode is ssl.CERT_REQUIRED
    for name in ("missing.key", "locked.key"):
        with pytest.raises(ValueError, match=rf"own\.pem with .*{name}: .*Expected a certificate and its key"):
            tls_context(Broker(tls=Tls(cert_file=own, key_file=tmp_path / name)))
