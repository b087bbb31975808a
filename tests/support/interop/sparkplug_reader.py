"""Reads all that a broker passes on, by pysparkplug, on another MQTT client than ours: PORT FILE [HOST].

A line of JSON in FILE for each message. With HOST it is a host application of that name: it says STATE.
"""

import json
import os
import sys
import time

import pysparkplug
from paho.mqtt import client as paho

PORT, FILE, HOST = int(sys.argv[1]), sys.argv[2], sys.argv[3:]
BEGUN = round(time.time() * 1000)  # of birth and will alike
births: dict[str, object] = {}
written = open(FILE, "a", buffering=1, encoding="utf-8")  # noqa: SIM115 - until it is killed


def state(online: bool) -> bytes:
    return json.dumps({"online": online, "timestamp": BEGUN}).encode()


def connected(client, _data, _flags, _code) -> None:
    client.subscribe("spBv1.0/#", 1)
    for host in HOST:
        client.publish(f"spBv1.0/STATE/{host}", state(True), 1, True)
    written.write(json.dumps({"kind": "connected", "node": None}) + "\n")


def came(_client, _data, message) -> None:
    _, group, kind, *node = message.topic.split("/")
    if group == "STATE":
        return
    line = {"kind": kind, "node": "/".join(node), "group": group, "qos": message.qos, "retain": message.retain}
    try:
        read = pysparkplug.Message.from_mqtt_message(message, birth=births.get(message.topic.split(kind)[1]))
        payload = read.payload
        if kind == "NBIRTH":
            births[message.topic.split(kind)[1]] = payload
        line |= {"seq": getattr(payload, "seq", None), "at": payload.timestamp, "bytes": len(message.payload)}
        line["metrics"] = [
            {"name": one.name, "value": one.value, "at": one.timestamp, "old": one.is_historical, "alias": one.alias}
            | {"type": one.datatype.name}
            for one in getattr(payload, "metrics", None) or (payload.bd_seq_metric,)
        ]
    except Exception as error:  # noqa: BLE001 - what it cannot read is what is to be found
        line["error"] = f"{type(error).__name__}: {error}"
    written.write(json.dumps(line, default=str) + "\n")


client = paho.Client(f"foreign-reader-{os.getpid()}", clean_session=True)
client.on_connect, client.on_message = connected, came
for host in HOST:
    client.will_set(f"spBv1.0/STATE/{host}", state(False), 1, True)
client.reconnect_delay_set(0.05, 0.1)
client.connect("127.0.0.1", PORT, 60)
print("ready", PORT, flush=True)
client.loop_forever()
