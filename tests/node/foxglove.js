// Connects to the Foxglove server of viewer-bridge with the official client, decodes messages by their
// advertised schemas, and prints a report as one JSON object.
//
// usage: foxglove.js URL read | command

import protocol from "@foxglove/ws-protocol";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor.js";
import WebSocket from "ws";

const { FoxgloveClient } = protocol;

/** Numeric types of the fields of our point clouds. */
const UINT32 = 5;
const FLOAT32 = 7;

/** Queues the events of a client, so that none is lost before a caller waits for it. */
class Events {
  constructor(client, names) {
    this.queues = new Map(names.map((name) => [name, []]));
    this.waiters = [];
    for (const name of names) {
      client.on(name, (event) => {
        this.queues.get(name).push(event);
        this.waiters = this.waiters.filter((check) => !check());
      });
    }
    client.on("error", (error) => {
      throw error;
    });
    client.on("close", () => {
      throw new Error("the connection was closed");
    });
  }

  /** Waits for the first event with a name that matches, and removes it. */
  next(name, matches = () => true) {
    return new Promise((resolve) => {
      const check = () => {
        const queue = this.queues.get(name);
        const index = queue.findIndex(matches);
        if (index >= 0) {
          resolve(queue.splice(index, 1)[0]);
        }
        return index >= 0;
      };
      if (!check()) {
        this.waiters.push(check);
      }
    });
  }
}

/** Creates the decoder of a channel from its advertised schema. */
function decoder(channel) {
  if (channel.encoding === "json") {
    JSON.parse(channel.schema);
    return (data) => JSON.parse(new TextDecoder().decode(data));
  }
  const set = Buffer.from(channel.schema, "base64");
  // The names of the schema, not their JSON names.
  const type = protobuf.Root.fromDescriptor(set, { keepCase: true }).lookupType(channel.schemaName);
  const options = { defaults: true, longs: Number };
  return (data) => type.toObject(type.decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength)), options);
}

/** One field of each point of a cloud. */
function column(cloud, name) {
  const { offset, type } = cloud.fields.find((field) => field.name === name);
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  const offsets = Array.from({ length: view.byteLength / cloud.point_stride }, (_, point) => point * cloud.point_stride + offset);
  if (type === FLOAT32) {
    return offsets.map((at) => view.getFloat32(at, true));
  }
  if (type !== UINT32) {
    throw new Error(`${name} has the type ${type}`);
  }
  return offsets.map((at) => view.getUint32(at, true));
}

async function connect(url) {
  const client = new FoxgloveClient({
    ws: new WebSocket(url, ["foxglove.websocket.v1", "foxglove.sdk.v1"]),
  });
  const names = ["serverInfo", "status", "message", "advertise", "advertiseServices"];
  names.push("parameterValues", "serviceCallResponse", "serviceCallFailure");
  const events = new Events(client, names);
  const server = await events.next("serverInfo");
  const channels = new Map();
  for (const channel of await events.next("advertise")) {
    channels.set(channel.topic, { id: channel.id, decode: decoder(channel) });
  }
  return { client, events, server, channels };
}

/** Subscribes to a topic. Returns functions to wait for its next message and to unsubscribe. */
function subscribe({ client, events, channels }, topic) {
  const { id, decode } = channels.get(topic);
  const subscription = client.subscribe(id);
  return {
    next: async () => decode((await events.next("message", (one) => one.subscriptionId === subscription)).data),
    unsubscribe: () => client.unsubscribe(subscription),
  };
}

/** Reports the topics and parameters of a paused node. */
async function read(connection) {
  const { client, events, server, channels } = connection;
  const report = { capabilities: server.capabilities, topics: [...channels.keys()].sort() };
  const first = subscribe(connection, "/particles");
  const cloud = await first.next();
  first.unsubscribe();
  const again = await subscribe(connection, "/particles").next();
  report.is_same_again = Buffer.compare(cloud.data, again.data) === 0;
  report.frame = cloud.frame_id;
  for (const { name } of cloud.fields) {
    report[name] = column(cloud, name);
  }
  report.step = (await subscribe(connection, "/steps").next()).step;
  report.transform = await subscribe(connection, "/tf").next();
  const { entities } = await subscribe(connection, "/scene").next();
  const lines = entities.flatMap((entity) => entity.lines);
  const triangles = entities.flatMap((entity) => entity.triangles);
  report.sticks = lines.map((line) => line.indices.length / 2);
  report.triangles = triangles.map((list) => list.indices.length / 3);
  report.ends = lines.map((line) => line.points.map(({ x, y, z }) => [x, y, z]));
  client.getParameters([], "all");
  const { parameters } = await events.next("parameterValues", (one) => one.id === "all");
  report.parameters = Object.fromEntries(parameters.map(({ name, value }) => [name, value]));
  return report;
}

/** Reports the results of service calls, a parameter change and a command. */
async function command(connection) {
  const { client, events, server } = connection;
  // The bridge may not have found the node yet.
  await subscribe(connection, "/particles").next();
  const isOffered = server.capabilities.includes("services");
  const services = isOffered ? await events.next("advertiseServices") : [];
  let callCount = 0;
  const call = async (name, request) => {
    const callId = ++callCount;
    const serviceId = services.find((service) => service.name === name)?.id ?? 1;
    const isForCall = (one) => one.callId === callId;
    const answer = Promise.race([
      events.next("serviceCallResponse", isForCall).then(({ data }) => JSON.parse(new TextDecoder().decode(data))),
      events.next("serviceCallFailure", isForCall).then(({ message }) => ({ failure: message })),
    ]);
    const data = new DataView(new TextEncoder().encode(JSON.stringify(request)).buffer);
    client.sendServiceCallRequest({ serviceId, callId, encoding: "json", data });
    return answer;
  };
  const report = { services: services.map(({ name }) => name).sort() };
  report.step = await call("step", { count: 3 });
  report.nonsense = await call("step", { count: 0 });
  report.resume = await call("resume", {});
  report.pause = await call("pause", {});
  report.reset = await call("reset", {});
  client.setParameters([{ name: "gravity", value: [0, -1.5, 0] }], "set");
  const { parameters } = await events.next("parameterValues", (one) => one.id === "set");
  report.gravity = parameters[0].value;
  if (server.capabilities.includes("clientPublish")) {
    const outcomes = subscribe(connection, "/outcomes");
    const channel = client.advertise({ topic: "/commands", encoding: "json", schemaName: "catenary.Command" });
    client.sendMessage(channel, new TextEncoder().encode('{"kind":"pin","particle":100}'));
    let outcome = await outcomes.next();
    while (outcome.kind !== "pin") {
      outcome = await outcomes.next();
    }
    report.pin = outcome;
    // A paused node shows the pin with its next step.
    await call("step", {});
  }
  return report;
}

const [url, mode] = process.argv.slice(2);
const connection = await connect(url);
const report = await { read, command }[mode](connection);
// Exits only once the output is written: a pipe may be slow.
process.stdout.write(JSON.stringify(report), () => process.exit(0));
