"""One connection to an MQTT broker, from its opening to its end, driven by the one thread that it belongs to.

paho-mqtt has neither a thread of its own here nor its own way to connect again: each connection of Sparkplug has
another will. Whatever the broker says or leaves unsaid ends this connection at most.
"""

from __future__ import annotations

import select
import socket
import ssl
import stat
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion, MQTTProtocolVersion

from service.config.plant import Broker

CONNECT_S = 5.0
ANSWER_S = 10.0  # within which a broker answers what it must answer
KEEP_ALIVE_S = 10
LARGEST_PACKET = 1_100_000  # that is read: a length that a broker claims would else be waited for, and kept


class SessionLost(Exception):
    """The connection is not to be had, or has ended: why."""


class NotReached(SessionLost):
    """Nobody listens there, or nothing could be said: no CONNECT was sent."""


@dataclass(frozen=True)
class Message:
    """What is published, and how."""

    topic: str
    payload: bytes
    qos: int = 0
    retain: bool = False


class Waker:
    """Ends a wait of the thread that watches `sleeper`, from any thread; never blocks. stopped: no answer is due."""

    def __init__(self) -> None:
        self.stopped = threading.Event()
        self._caller, self.sleeper = socket.socketpair()
        self._caller.setblocking(False)
        self.sleeper.setblocking(False)

    def wake(self) -> None:
        """Do so. Where many have called before, one byte more is not needed; after `close` nobody waits."""
        with suppress(OSError):
            self._caller.send(b"\0")

    def stop(self) -> None:
        """From here on no answer is waited for."""
        self.stopped.set()
        self.wake()

    def awake(self) -> None:
        """Forget those who have called."""
        with suppress(OSError):
            self.sleeper.recv(4096)

    def close(self) -> None:
        """Let both ends go."""
        self._caller.close()
        self.sleeper.close()


class Session:
    """A connection; every method raises SessionLost. Left by `with`, it is closed without a word: the will is due."""

    def __init__(
        self,
        broker: Broker,
        client_id: str,
        will: Message,
        waker: Waker,
        on_message: Callable[[str, bytes, bool], None],
    ) -> None:
        """on_message: told topic, payload, and whether it was retained, within `turn`."""
        self._waker = waker
        self._answered: set[int] = set()
        self._connected: bool | None = None
        self._where = f"{broker.host}:{broker.port}"
        self._why = f"{self._where}: closed before it answered. Is it a broker's port, with TLS where tls is set alone?"
        client = paho.Client(
            CallbackAPIVersion.VERSION2, client_id, clean_session=True, protocol=MQTTProtocolVersion.MQTTv311
        )
        client.connect_timeout = CONNECT_S
        client.will_set(will.topic, will.payload, will.qos, will.retain)
        client.on_connect = self._on_connect
        client.on_disconnect = self._on_disconnect
        client.on_subscribe = lambda _client, _data, mid, _codes, _properties: self._answered.add(mid)
        client.on_message = lambda _client, _data, one: on_message(one.topic, bytes(one.payload), one.retain)
        self._client = client
        self._open(broker)

    def _open(self, broker: Broker) -> None:
        try:
            if broker.username is not None:
                self._client.username_pw_set(broker.username, password_of(broker))
            if broker.tls is not None:
                self._client.tls_set_context(tls_context(broker))
            self._client.connect(broker.host, broker.port, KEEP_ALIVE_S)
        except ssl.SSLCertVerificationError as error:
            self.close()
            told = f"{self._where}: certificate verify failed: {error.verify_message}"
            raise NotReached(f"{told}. Check tls.ca_file, and the name in the certificate") from error
        except (OSError, ValueError) as error:
            self.close()
            raise NotReached(f"{self._where}: {_words(error)}") from error
        try:
            self.turn_until(lambda: self._connected is not None, "CONNECT")
        except SessionLost:
            self.close()
            raise

    def _on_connect(self, _client: paho.Client, _data: Any, _flags: Any, code: Any, _properties: Any) -> None:
        self._connected = not code.is_failure
        if code.is_failure:
            self._why = f"{self._where}: the broker refused the connection: {code}. Check username and password_file"

    def _on_disconnect(self, _client: paho.Client, _data: Any, _flags: Any, code: Any, _properties: Any) -> None:
        if self._connected:
            self._why = f"the connection ended: {code}"

    def turn(self, timeout_s: float) -> None:
        """Take what comes and give what waits, once; wait that long for it, or until woken."""
        waits = self._client.socket()
        if waits is None:
            raise SessionLost(self._why)
        try:
            pending = isinstance(waits, ssl.SSLSocket) and waits.pending() > 0
            writes = [waits] if self._client.want_write() else []
            wait_s = 0 if pending else timeout_s
            readable, writable, _ = select.select([waits, self._waker.sleeper], writes, [], wait_s)
            if self._waker.sleeper in readable:
                self._waker.awake()
            if pending or waits in readable:
                self._client.loop_read()
                self._refuse_hoards()
            if writable:
                self._client.loop_write()
            self._client.loop_misc()
        except SessionLost:
            raise
        except Exception as error:
            raise SessionLost(f"the broker speaks no MQTT: {_words(error)}") from error
        if self._client.socket() is None or self._connected is False:
            raise SessionLost(self._why)

    def _refuse_hoards(self) -> None:
        """The library would keep what is never delivered: a packet of 256 MB, or messages of QoS 2 without end."""
        client: Any = self._client
        if client._in_packet["remaining_length"] > LARGEST_PACKET or client._in_messages:
            raise SessionLost("the broker sends what nobody asked for")

    def turn_until(self, done: Callable[[], bool], what: str) -> None:
        """Turn until `done`, which the broker owes within ANSWER_S."""
        give_up_at = time.monotonic() + ANSWER_S
        while not done():
            left_s = give_up_at - time.monotonic()
            if self._waker.stopped.is_set():
                raise SessionLost(f"stopped before the broker answered {what}")
            if left_s <= 0:
                raise SessionLost(f"the broker has not answered {what} for {ANSWER_S:g} s")
            self.turn(left_s)

    def subscribe(self, topics: Iterable[str]) -> int:
        """Ask for the topics, QoS 1; what `answered` knows the answer by."""
        code, mid = self._client.subscribe([(topic, 1) for topic in topics])
        if code != paho.MQTT_ERR_SUCCESS or mid is None:
            raise SessionLost(self._why)
        return mid

    def answered(self, mid: int) -> bool:
        """True once the broker has answered; it has then taken all that was published before."""
        return mid in self._answered

    def publish(self, message: Message) -> None:
        """Hand it to the connection; `waiting` says whether it is still here."""
        self._published(message)

    def _published(self, message: Message) -> paho.MQTTMessageInfo:
        try:
            told = self._client.publish(message.topic, message.payload, message.qos, message.retain)
        except (OSError, ValueError, RuntimeError) as error:
            raise SessionLost(_words(error)) from error
        if told.rc != paho.MQTT_ERR_SUCCESS:
            raise SessionLost(self._why)
        return told

    @property
    def waiting(self) -> bool:
        """Whether something published has not left yet."""
        return self._client.want_write()

    def end(self, last: Message, within_s: float) -> None:
        """Publish the last message, of QoS 1, and take leave once the broker has it; what takes longer is left.

        Leaving with its answer unread would reset the connection, and the broker would send the will as well.
        """
        give_up_at = time.monotonic() + within_s
        with suppress(SessionLost):
            told = self._published(last)
            while not told.is_published() and time.monotonic() < give_up_at:
                self.turn(0.1)
            self._client.disconnect()

    def close(self) -> None:
        """Let the socket go, and the library's own pair, which else would wait until memory is collected."""
        client: Any = self._client
        client._reset_sockets()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


def password_of(broker: Broker) -> str | None:
    """The first line of the password's file; raise ValueError."""
    path = broker.password_file
    if path is None:
        return None
    try:
        mode, text = path.stat().st_mode, path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: cannot be read: {_words(error)}. Expected the password in its first line") from error
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise ValueError(f"{path}: others may read it. `chmod 600 {path}`")
    lines = text.splitlines()
    if not lines or not lines[0]:
        raise ValueError(f"{path}: its first line is empty, expected the password")
    return lines[0]


def tls_context(broker: Broker) -> ssl.SSLContext:
    """By which the broker is judged, and with what one proves to be oneself; raise ValueError."""
    tls = broker.tls
    assert tls is not None
    try:
        context = ssl.create_default_context(cafile=tls.ca_file)
    except OSError as error:
        raise ValueError(f"{tls.ca_file}: {_words(error)}. Expected certificates, PEM") from error
    if tls.cert_file is not None:
        try:  # with an empty password: a library that asks for one would wait at the daemon's terminal
            context.load_cert_chain(tls.cert_file, tls.key_file, password="")
        except OSError as error:
            told = f"{tls.cert_file} with {tls.key_file}: {_words(error)}"
            raise ValueError(f"{told}. Expected a certificate and its key, PEM, without a password") from error
    return context


def _words(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error) or type(error).__name__
