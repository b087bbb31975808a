// node-opcua's client, by JSON lines: node opcua_client.js '{"url", "certificate", "key", "pki", "user", "password"}'
// It says {"up": true} or {"refused": why}, then answers each {"do": …} of its input; notifications come between.
"use strict";
const readline = require("readline");
const opcua = require("node-opcua-client");
const { OPCUACertificateManager } = require("node-opcua-certificate-manager");

const given = JSON.parse(process.argv[2]);
const MACHINE_VISION = "http://opcfoundation.org/UA/MachineVision";
const FIELDS = ["EventType", "Message", "Severity", "Time", "JobId", "ResultState", "ResultContent", "CausePath"];

const say = (line) => console.log(JSON.stringify(line));

function plain(value) {
  if (value === null || value === undefined || typeof value !== "object") return value ?? null;
  if (value instanceof opcua.Variant) return plain(value.value);
  if (value instanceof opcua.NodeId) return value.toString();
  if (value instanceof Date) return value.toISOString();
  if (Buffer.isBuffer(value)) return value.toString("hex");
  if (Array.isArray(value)) return value.map(plain);
  if (value.text !== undefined && value.locale !== undefined) return value.text;
  return Object.fromEntries(Object.entries(value).filter(([name]) => !name.startsWith("_")).map(([k, v]) => [k, plain(v)]));
}

async function manager() {
  const found = new OPCUACertificateManager({ rootFolder: given.pki, automaticallyAcceptUnknownCertificate: true });
  await found.initialize();
  return found;
}

async function main() {
  const client = opcua.OPCUAClient.create({
    applicationUri: given.uri,
    certificateFile: given.certificate,
    privateKeyFile: given.key,
    clientCertificateManager: await manager(),
    securityMode: opcua.MessageSecurityMode.SignAndEncrypt,
    securityPolicy: opcua.SecurityPolicy.Basic256Sha256,
    connectionStrategy: { maxRetry: 2, initialDelay: 200 },
    keepSessionAlive: false,
  });
  let session;
  try {
    await client.connect(given.url);
    const user = given.user
      ? { type: opcua.UserTokenType.UserName, userName: given.user, password: given.password }
      : { type: opcua.UserTokenType.Anonymous };
    session = await client.createSession(user);
  } catch (error) {
    say({ refused: error.message });
    process.exit(0);
  }
  const namespaces = await session.readNamespaceArray();
  const vision = namespaces.indexOf(MACHINE_VISION);
  say({ up: true });
  const does = {
    read: async ({ node }) => plain((await session.read({ nodeId: node, attributeId: opcua.AttributeIds.Value })).value.value),
    status: async ({ node }) => (await session.read({ nodeId: node, attributeId: opcua.AttributeIds.Value })).statusCode.name,
    browse: async ({ node }) => {
      const found = await opcua.browseAll(session, node);
      return Promise.all(
        found.references
          .filter((one) => one.isForward)
          .map(async (one) => ({ id: one.nodeId.toString(), name: one.browseName.name, type: one.typeDefinition.toString() })),
      );
    },
    write: async ({ node, value }) =>
      (await session.write({
        nodeId: node,
        attributeId: opcua.AttributeIds.Value,
        value: { value: { dataType: opcua.DataType.String, value } },
      })).name,
    call: async ({ object, method, cause }) => {
      const inputArguments = cause === undefined ? [] : [
        { dataType: opcua.DataType.Int32, value: 0 },
        { dataType: opcua.DataType.String, value: cause },
      ];
      const done = await session.call({ objectId: object, methodId: method, inputArguments });
      return { status: done.statusCode.name, outputs: plain(done.outputArguments ?? []) };
    },
    result: async ({ id }) => {
      const made = await session.constructExtensionObject(opcua.resolveNodeId(`ns=${vision};i=3021`), { id });
      const done = await session.call({
        objectId: "ns=1;s=cell.ResultManagement",
        methodId: "ns=1;s=cell.ResultManagement.GetResultById",
        inputArguments: [
          { dataType: opcua.DataType.ExtensionObject, value: made },
          { dataType: opcua.DataType.Int32, value: 0 },
        ],
      });
      return { status: done.statusCode.name, outputs: plain(done.outputArguments ?? []) };
    },
    subscribe: async ({ interval, nodes, events }) => {
      const subscription = await session.createSubscription2({
        requestedPublishingInterval: interval,
        requestedLifetimeCount: 1000,
        requestedMaxKeepAliveCount: 100,
        maxNotificationsPerPublish: 0,
        publishingEnabled: true,
        priority: 1,
      });
      for (const node of nodes) {
        const item = await subscription.monitor(
          { nodeId: node, attributeId: opcua.AttributeIds.Value },
          { samplingInterval: 0, queueSize: 100, discardOldest: true },
          opcua.TimestampsToReturn.Both,
        );
        item.on("changed", (data) =>
          say({
            at: Date.now(),
            since: data.sourceTimestamp?.getTime(),
            node,
            status: data.statusCode.name,
            value: plain(data.value.value),
          }),
        );
      }
      if (events) {
        const names = FIELDS.map((name) => (["EventType", "Message", "Severity", "Time"].includes(name) ? name : `${vision}:${name}`));
        const item = await subscription.monitor(
          { nodeId: events, attributeId: opcua.AttributeIds.EventNotifier },
          { samplingInterval: 0, queueSize: 2000, discardOldest: true, filter: opcua.constructEventFilter(names) },
          opcua.TimestampsToReturn.Both,
        );
        item.on("changed", (fields) =>
          say({ at: Date.now(), event: Object.fromEntries(FIELDS.map((name, k) => [name, plain(fields[k])])) }),
        );
      }
      return "subscribed";
    },
    bye: async () => {
      await session.close();
      await client.disconnect();
      setImmediate(() => process.exit(0));
      return "bye";
    },
  };
  for await (const line of readline.createInterface({ input: process.stdin })) {
    const asked = JSON.parse(line);
    try {
      say({ answer: await does[asked.do](asked) });
    } catch (error) {
      say({ failed: error.message });
    }
  }
}

main().catch((error) => {
  say({ refused: error.message });
  process.exit(1);
});
