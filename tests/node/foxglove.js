// Talks to the Foxglove server of a viewer-bridge with the protocol's own client, decodes what comes
// by the schemas that it was sent, and prints what it saw as one JSON object.
//
// usage: foxglove.js URL read | command

import protocol from "@foxglove/ws-protocol";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor.js";
import WebSocket from "ws";

const { FoxgloveClient } = protocol;

/** Numeric types of a point cloud's field, as far as ours have them. */
const UINT32 = 5;
const FLOAT32 = 7;

/** Keeps the events of a client, so that none is missed that comes before it is waited for. */
class Events {
  constructor(client, names) {
    this.kept = new Map(names.map((name) => [name, []]));
    this.waiting = [];
    for (const name of names) {
      client.on(name, (event) => {
        this.kept.get(name).push(event);
        this.waiting = this.waiting.filter((look) => !look());
      });
    }
    client.on("error", (error) => {
      throw error;
    });
    client.on("close", () => {
      throw new Error("the connection was closed");
    });
  }

  /** The first event of that name for which `isMeant` holds; it is taken out. */
  next(name, isMeant = () => true) {
    return new Promise((resolve) => {
      const look = () => {
        const kept = this.kept.get(name);
        const place = kept.findIndex(isMeant);
        if (place >= 0) {
          resolve(kept.splice(place, 1)[0]);
        }
        return place >= 0;
      };
      if (!look()) {
        this.waiting.push(look);
      }
    });
  }
}

/** The reader of a channel's messages, made from the schema that the channel was advertised with. */
function decoder(channel) {
  if (channel.encoding === "json") {
    JSON.parse(channel.schema);
    return (data) => JSON.parse(new TextDecoder().decode(data));
  }
  const set = Buffer.from(channel.schema, "base64");
  const type = protobuf.Root.fromDescriptor(set).lookupType(channel.schemaName);
  const options = { defaults: true, longs: Number };
  return (data) => type.toObject(type.decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength)), options);
}

/** One number of each point of a cloud. */
function column(cloud, name) {
  const { offset, type } = cloud.fields.find((field) => field.name === name);
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  const places = Array.from({ length: view.byteLength / cloud.point_stride }, (_, point) => point * cloud.point_stride + offset);
  if (type === FLOAT32) {
    return places.map((place) => view.getFloat32(place, true));
  }
  if (type !== UINT32) {
    throw new Error(`${name} has the type ${type}`);
  }
  return places.map((place) => view.getUint32(place, true));
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

/** Subscribes to a topic; gives the way to its next message, and to the end of it. */
function listen({ client, events, channels }, topic) {
  const { id, decode } = channels.get(topic);
  const subscription = client.subscribe(id);
  return {
    next: async () => decode((await events.next("message", (one) => one.subscriptionId === subscription)).data),
    end: () => client.unsubscribe(subscription),
  };
}

/** What is shown of a node that stands still. */
async function read(connection) {
  const { client, events, server, channels } = connection;
  const seen = { capabilities: server.capabilities, topics: [...channels.keys()].sort() };
  const first = listen(connection, "/particles");
  const cloud = await first.next();
  first.end();
  const again = await listen(connection, "/particles").next();
  seen.is_same_again = Buffer.compare(cloud.data, again.data) === 0;
  seen.frame = cloud.frame_id;
  for (const { name } of cloud.fields) {
    seen[name] = column(cloud, name);
  }
  seen.step = (await listen(connection, "/steps").next()).step;
  seen.transform = await listen(connection, "/tf").next();
  const { entities } = await listen(connection, "/scene").next();
  const lines = entities.flatMap((entity) => entity.lines);
  const triangles = entities.flatMap((entity) => entity.triangles);
  seen.sticks = lines.map((line) => line.indices.length / 2);
  seen.triangles = triangles.map((list) => list.indices.length / 3);
  seen.ends = lines.map((line) => line.points.map(({ x, y, z }) => [x, y, z]));
  client.getParameters([], "all");
  const { parameters } = await events.next("parameterValues", (one) => one.id === "all");
  seen.parameters = Object.fromEntries(parameters.map(({ name, value }) => [name, value]));
  return seen;
}

/** What becomes of everything that would change the node. */
async function command(connection) {
  const { client, events, server } = connection;
  // The bridge may still be looking for the node.
  await listen(connection, "/particles").next();
  const isOffered = server.capabilities.includes("services");
  const services = isOffered ? await events.next("advertiseServices") : [];
  let callCount = 0;
  const call = async (name, request) => {
    const callId = ++callCount;
    const serviceId = services.find((service) => service.name === name)?.id ?? 1;
    const isMine = (one) => one.callId === callId;
    const answer = Promise.race([
      events.next("serviceCallResponse", isMine).then(({ data }) => JSON.parse(new TextDecoder().decode(data))),
      events.next("serviceCallFailure", isMine).then(({ message }) => ({ failure: message })),
    ]);
    const data = new DataView(new TextEncoder().encode(JSON.stringify(request)).buffer);
    client.sendServiceCallRequest({ serviceId, callId, encoding: "json", data });
    return answer;
  };
  const seen = { services: services.map(({ name }) => name).sort() };
  seen.step = await call("step", { count: 3 });
  seen.nonsense = await call("step", { count: 0 });
  seen.resume = await call("resume", {});
  seen.pause = await call("pause", {});
  seen.reset = await call("reset", {});
  client.setParameters([{ name: "gravity", value: [0, -1.5, 0] }], "set");
  const { parameters } = await events.next("parameterValues", (one) => one.id === "set");
  seen.gravity = parameters[0].value;
  if (server.capabilities.includes("clientPublish")) {
    const outcomes = listen(connection, "/outcomes");
    const channel = client.advertise({ topic: "/commands", encoding: "json", schemaName: "catenary.Command" });
    client.sendMessage(channel, new TextEncoder().encode('{"kind":"pin","particle":100}'));
    let outcome = await outcomes.next();
    while (outcome.kind !== "pin") {
      outcome = await outcomes.next();
    }
    seen.pin = outcome;
    // A node that stands still shows it with its next step.
    await call("step", {});
  }
  return seen;
}

const [url, what] = process.argv.slice(2);
const connection = await connect(url);
const seen = await { read, command }[what](connection);
// A stream that is read may take its time: the end of the process must not cut it off.
process.stdout.write(JSON.stringify(seen), () => process.exit(0));
