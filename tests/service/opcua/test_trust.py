"""Certificates: the own one is made once, and of clients only what a person laid there is trusted."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from service.config.config import Opcua
from service.opcua.trust import MOST_REJECTED, OpcuaError, Trust, own_certificate
from tests.support.interop.opcua import identity
from tests.support.real_parts import need_program


def der(certificate: Path) -> bytes:
    return x509.load_pem_x509_certificate(certificate.read_bytes()).public_bytes(Encoding.DER)


def test_the_own_certificate_is_made_once_and_its_key_is_private(tmp_path: Path) -> None:
    made = own_certificate(Opcua(), tmp_path)
    again = own_certificate(Opcua(), tmp_path)
    assert made.key.stat().st_mode & 0o777 == 0o600
    assert again == made
    assert made.application_uri.endswith(":combtrace")
    openssl = need_program("openssl", "apt-get install openssl")
    said = subprocess.run(
        [openssl, "x509", "-in", made.certificate, "-text"], capture_output=True, text=True, check=True
    )
    assert f"URI:{made.application_uri}" in said.stdout
    assert "TLS Web Server Authentication" in said.stdout


def test_a_key_that_others_may_read_or_of_another_certificate_is_refused(tmp_path: Path) -> None:
    one, other = identity(tmp_path / "one"), identity(tmp_path / "other")
    one.key.chmod(0o600)
    other.key.chmod(0o644)
    with pytest.raises(OpcuaError, match="has mode 0644, expected 0600"):
        own_certificate(Opcua(certificate=other.certificate, key=other.key), tmp_path)
    with pytest.raises(OpcuaError, match="do not belong together"):
        own_certificate(Opcua(certificate=other.certificate, key=one.key), tmp_path)
    with pytest.raises(OpcuaError, match="cannot be used"):
        own_certificate(Opcua(certificate=one.key, key=one.key), tmp_path)


def test_only_what_lies_there_is_trusted_and_what_is_taken_out_is_not(tmp_path: Path) -> None:
    trust, client = Trust(tmp_path / "pki"), identity(tmp_path / "client")
    trust.open()
    certificate = der(client.certificate)
    assert trust.why_not(None) == "it shows no certificate"
    assert "its certificate is not trusted. To trust it: mv " in (trust.why_not(certificate) or "")
    (kept,) = (tmp_path / "pki" / "rejected").iterdir()
    assert kept.read_bytes() == certificate
    (trust.trusted / "no certificate").write_bytes(b"-----BEGIN")
    kept.rename(trust.trusted / kept.name)
    assert trust.why_not(certificate) is None
    (trust.trusted / kept.name).write_bytes(client.certificate.read_bytes())
    assert trust.why_not(certificate) is None, "as PEM"
    (trust.trusted / kept.name).unlink()
    assert "not trusted" in (trust.why_not(certificate) or "")


def test_a_trusted_certificate_that_has_ended_is_refused(tmp_path: Path) -> None:
    trust, client = Trust(tmp_path / "pki"), identity(tmp_path / "client", days=0)
    trust.open()
    (trust.trusted / "client.pem").write_bytes(client.certificate.read_bytes())
    assert "its certificate is valid from" in (trust.why_not(der(client.certificate)) or "")


def test_strangers_cannot_fill_the_disk(tmp_path: Path) -> None:
    trust = Trust(tmp_path)
    trust.open()
    why = [trust.why_not(bytes([k])) or "" for k in range(MOST_REJECTED + 1)]
    assert len(list((tmp_path / "rejected").iterdir())) == MOST_REJECTED
    assert why[-1].endswith("rejected is full")
