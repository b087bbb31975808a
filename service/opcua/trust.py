"""Certificates: the server's own, made at the first start, and those of clients, which a person has to trust."""

from __future__ import annotations

import hashlib
import os
import socket
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from asyncua.crypto.cert_gen import (
    dump_private_key_as_pem,
    generate_private_key,
    generate_self_signed_app_certificate,
)
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat, load_pem_private_key
from cryptography.x509.oid import ExtendedKeyUsageOID

from service.atomic_file import write_whole
from service.config.config import Opcua

OWN_DAYS = 3650  # of the own certificate: whoever trusts it trusts this file, and has to be told of each new one
MOST_REJECTED = 20
LARGEST_FILE = 100_000


class OpcuaError(Exception):
    """OPC UA cannot be served: where, why, what to do."""


@dataclass(frozen=True)
class OwnCertificate:
    """Certificate and private key of the server, PEM files that belong together, and the name that it proves."""

    certificate: Path
    key: Path
    application_uri: str
    ends: datetime


def own_certificate(settings: Opcua, folder: Path) -> OwnCertificate:
    """As configured, else of the folder, where it is made if there is none; raise OpcuaError."""
    certificate, key = settings.certificate, settings.key
    if certificate is None or key is None:
        certificate, key = folder / "own.pem", folder / "own.key"
        try:
            if not (certificate.exists() and key.exists()):
                _make(certificate, key)
        except OSError as error:
            raise OpcuaError(f"{folder}: no certificate can be made there: {error.strerror}") from error
    return read_own(certificate, key)


def read_own(certificate: Path, key: Path) -> OwnCertificate:
    """What the files hold; raise OpcuaError."""
    try:
        found = x509.load_pem_x509_certificate(certificate.read_bytes())
        private = load_pem_private_key(key.read_bytes(), None)
        mode = key.stat().st_mode & 0o777
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        uris = names.get_values_for_type(x509.UniformResourceIdentifier)
    except (OSError, ValueError, TypeError, x509.ExtensionNotFound) as error:
        why = getattr(error, "strerror", None) or error
        raise OpcuaError(
            f"certificate {certificate} and key {key} cannot be used: {why}. Expected PEM files, the key without a "
            "password, the certificate with the server's URI"
        ) from error
    if mode & 0o077:
        raise OpcuaError(f"{key}: has mode {mode:04o}, expected 0600. chmod 600, and make a new one")
    form = Encoding.DER, PublicFormat.SubjectPublicKeyInfo
    if not uris or found.public_key().public_bytes(*form) != private.public_key().public_bytes(*form):
        raise OpcuaError(
            f"certificate {certificate} and key {key} do not belong together, or the certificate has no URI. Make new "
            "ones, or leave opcua.certificate and opcua.key out"
        )
    return OwnCertificate(certificate, key, uris[0], found.not_valid_after_utc)


def _make(certificate: Path, key: Path) -> None:
    """Make both; raise OSError."""
    certificate.parent.mkdir(parents=True, exist_ok=True)
    host, private = socket.gethostname(), generate_private_key()
    found = generate_self_signed_app_certificate(
        private,
        f"combtrace@{host}"[:64],
        {},
        [x509.UniformResourceIdentifier(f"urn:{host}:combtrace"), x509.DNSName(host)],
        [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH],
        OWN_DAYS,
    )
    write_whole(key, dump_private_key_as_pem(private), 0o600)
    write_whole(certificate, found.public_bytes(Encoding.PEM), 0o644)


@dataclass(frozen=True)
class Trust:
    """Client certificates that lie in `trusted`, DER or PEM; read anew for each session, so that one taken out counts
    at once. Only the certificate itself is trusted, not what another one has signed.
    """

    folder: Path

    @property
    def trusted(self) -> Path:
        """Where a person lays what is trusted."""
        return self.folder / "trusted"

    def open(self) -> None:
        """Make the folders; raise OpcuaError."""
        try:
            for folder in (self.trusted, self.folder / "rejected"):
                folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OpcuaError(f"{self.folder}: no folders can be made there: {error.strerror}") from error

    def why_not(self, certificate: bytes | None) -> str | None:
        """Why a client with this certificate (DER) is not trusted; None where it is. One not known is kept to look at.

        That the client has the certificate's key was proved when its channel was opened.
        """
        if not certificate:
            return "it shows no certificate"
        name = f"{hashlib.sha1(certificate, usedforsecurity=False).hexdigest()}.der"
        if certificate not in self.certificates():
            return f"its certificate is not trusted{self._rejected(name, certificate)}"
        found = x509.load_der_x509_certificate(certificate)
        if not found.not_valid_before_utc <= datetime.now(UTC) <= found.not_valid_after_utc:
            return f"its certificate is valid from {found.not_valid_before_utc} to {found.not_valid_after_utc}"
        return None

    def certificates(self) -> list[bytes]:
        """Those that are trusted, DER; files that hold none are passed over."""
        found = []
        for path in sorted(self.trusted.iterdir()) if self.trusted.is_dir() else ():
            try:
                data = path.read_bytes()[:LARGEST_FILE]
                if b"-----BEGIN" in data:
                    data = x509.load_pem_x509_certificate(data).public_bytes(Encoding.DER)
                x509.load_der_x509_certificate(data)
                found.append(data)
            except (OSError, ValueError):
                continue
        return found

    def _rejected(self, name: str, certificate: bytes) -> str:
        """Keep it for a person; where, as the end of a sentence."""
        folder = self.folder / "rejected"
        try:
            if name not in (names := os.listdir(folder)):
                if len(names) >= MOST_REJECTED:
                    return f", and {folder} is full"
                (folder / name).write_bytes(certificate)
        except OSError as error:
            return f", and {folder} cannot be written: {error.strerror}"
        return f". To trust it: mv {folder / name} {self.trusted}"
