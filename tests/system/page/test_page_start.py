"""How the page starts: what cannot be served safely is told, and what stands without tokens can only be looked at."""

from __future__ import annotations

import json
import ssl
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from tests.support.processes.page_client import TOKEN, token_file
from tests.support.processes.processes import BOUND_S, Process, free_port, until
from tests.support.real_parts import need_program


@pytest.mark.parametrize(
    ("page", "expected"),
    [
        ("{token_file: tokens}", "tokens: has mode 0644, expected 0600"),
        ("{host: 192.0.2.1}", "192.0.2.1:9770 cannot be listened on"),
        ("{certificate: tokens, key: tokens}", "cannot be used"),
        ("{certificate: tokens}", "expected both or none"),
    ],
)
def test_a_page_that_cannot_be_served_safely_is_told_at_the_start(tmp_path: Path, page: str, expected: str) -> None:
    token_file(tmp_path).chmod(0o644)
    config = tmp_path / "config.yaml"
    config.write_text(f"camera: {{kind: files, path: .}}\ncontroller: {{kind: none}}\npage: {page}\n")
    process = Process(tmp_path / "log", "run", "--config", config)
    until(lambda: not process.running, what="its end")
    assert process.stop() == 2
    assert expected in process.text


def test_over_tls_and_without_tokens_it_can_only_be_looked_at(tmp_path: Path) -> None:
    openssl = need_program("openssl", "apt-get install openssl")
    options = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=localhost"
    options += " -addext subjectAltName=DNS:localhost -keyout key.pem -out cert.pem"
    subprocess.run([openssl, *options.split()], cwd=tmp_path, check=True, capture_output=True)
    port = free_port()
    config = tmp_path / "config.yaml"
    config.write_text(
        "camera: {kind: files, path: .}\ncontroller: {kind: none}\n"
        f"page: {{port: {port}, certificate: cert.pem, key: key.pem}}\n"
    )
    process = Process(tmp_path / "log", "run", "--config", config)
    try:
        trusting = ssl.create_default_context(cafile=str(tmp_path / "cert.pem"))
        url = f"https://localhost:{port}/api/v1"
        until(lambda: "page: https://127.0.0.1" in process.text, what="the page")
        time.sleep(0.2)
        with urllib.request.urlopen(f"{url}/state", timeout=BOUND_S, context=trusting) as answer:
            seen = json.loads(answer.read())
        assert (seen["link"], seen["calibration"]) == (None, None)
        headers = {"Content-Type": "application/json", "Authorization": f"Bearer {TOKEN}"}
        order = urllib.request.Request(f"{url}/halt", b"{}", headers)
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(order, timeout=BOUND_S, context=trusting)
        assert (refused.value.code, "set page.token_file" in refused.value.read().decode()) == (403, True)
        refused.value.close()
    finally:
        process.stop()
    assert "Traceback" not in process.text
