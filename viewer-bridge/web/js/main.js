// The page: makes its parts, joins them, and runs one loop of animation frames.

import { Banner, sentence } from "./banner.js";
import { Camera } from "./camera.js";
import { Charts } from "./charts.js";
import { Commands } from "./commands.js";
import { Controls } from "./controls.js";
import { find } from "./dom.js";
import { Renderer } from "./gl/renderer.js";
import { Hud } from "./hud.js";
import { Input } from "./input.js";
import { parseLink } from "./link.js";
import { Overlay } from "./overlay.js";
import { Panel } from "./panel.js";
import { Connector } from "./socket.js";
import { Simulation } from "./state.js";
import { TimelineBar } from "./timeline-bar.js";
import { viewerOf } from "./viewer.js";
import { Views } from "./views.js";

/** Where the token is kept, so that a reload still has it. */
const TOKEN_KEY = "catenary-token";
/** Refusals that say nothing new to the one who caused them. */
const QUIET_REASONS = new Set(["already_torn", "not_grabbed", "stale_epoch"]);

/** Everything that went wrong, for tests. @type {string[]} */
const faults = [];
addEventListener("error", (event) => faults.push(String(event.message)));
addEventListener("unhandledrejection", (event) => faults.push(String(event.reason)));

const link = parseLink(location.hash);
const banner = new Banner(find("banner", HTMLElement), find("notices", HTMLElement));
const simulation = new Simulation();
const camera = new Camera();
const renderer = openRenderer();
if (renderer !== null) start(renderer);

/** @returns {Renderer | null} */
function openRenderer() {
  const antialias = new URLSearchParams(location.search).get("aa") !== "0";
  try {
    return new Renderer(find("picture-canvas", HTMLCanvasElement), simulation, camera, antialias);
  } catch (error) {
    faults.push(String(error));
    banner.set("fatal", "This browser has no WebGL2, which the picture needs. Another browser, or its hardware acceleration turned on, will show it.");
    return null;
  }
}

/** The token leaves the address at once: it must not be in a copied link or a picture of the screen. */
function takeToken() {
  if (link.token !== null) {
    sessionStorage.setItem(TOKEN_KEY, link.token);
    history.replaceState(null, "", location.pathname + location.search);
  }
  return link.token ?? sessionStorage.getItem(TOKEN_KEY);
}

/** @param {Renderer} renderer */
function start(renderer) {
  const url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`;
  const connector = new Connector(url, takeToken(), {
    onBinary: (message) => simulation.receive(message),
    onText: (message) => simulation.receiveText(message),
    onChange: (connection) => {
      banner.set("connection", connection.state === "open" ? "" : connection.text);
      if (connection.state === "waiting" || connection.state === "refused") {
        commands.forget();
        input.abandon();
        timeline.gate.reset();
        // The next connection counts its frames anew.
        simulation.frameNumber = null;
      }
    },
    onFault: (text) => {
      faults.push(text);
      banner.notify(text, "error");
    },
  });
  const commands = new Commands((message) => connector.send(message), (outcome) => {
    if (!QUIET_REASONS.has(outcome.reason)) banner.notify(`${outcome.kind}: ${outcome.text || outcome.reason}`, "warning");
  });
  const bench = { simulation, camera, renderer, commands };
  const input = new Input(renderer.canvas, bench, () => controls.canChange());
  const overlay = new Overlay(find("overlay", HTMLCanvasElement), bench, input);
  const views = new Views(bench, banner);
  const timeline = new TimelineBar(simulation, commands);
  const controls = new Controls(bench, input, views, timeline, banner);
  const panel = new Panel(find("parameters", HTMLFormElement), find("parameters-note", HTMLElement), simulation, commands);
  new Charts(find("plots", HTMLElement), find("figures", HTMLElement), simulation);
  const hud = new Hud(find("hud", HTMLOutputElement), simulation, renderer);

  listenToSimulation(input);
  listenToSurroundings(renderer, connector);
  followLink(views, controls);

  let scriptMs = 0;
  const loop = (/** @type {number} */ nowMs) => {
    requestAnimationFrame(loop);
    const begin = performance.now();
    input.tick(nowMs);
    panel.tick();
    hud.tick(nowMs);
    renderer.resize();
    const between = performance.now();
    if (renderer.isDirty) renderer.draw();
    const drawn = performance.now();
    overlay.draw();
    if (simulation.frameNumber !== null) connector.acknowledge(simulation.frameNumber);
    simulation.frameNumber = null;
    scriptMs += 0.05 * (between - begin + performance.now() - drawn - scriptMs);
  };
  requestAnimationFrame(loop);
  connector.connect();

  Object.defineProperty(window, "viewer", { value: viewerOf({ bench, connector, banner, input, faults, scriptMs: () => scriptMs }) });
}

/** @param {Input} input */
function listenToSimulation(input) {
  simulation.on("outcome", (outcome) => input.bench.commands.receive(outcome));
  simulation.on("notice", ({ text, level }) => banner.notify(text, level));
  simulation.on("node", (node) => banner.set("node", node.state === "alive" || simulation.isReplay ? "" : sentence(node.text || "no node is running")));
  simulation.on("scene", (scene) => {
    input.abandon();
    document.title = `${scene.name} · Catenary`;
  });
  simulation.on("reset", () => input.abandon());
  simulation.on("frame", (frame) => {
    const lost = frame.nonFinite.length;
    const frozen = simulation.stats?.frozenCount ?? 0;
    banner.set("nonFinite", lost + frozen === 0 ? "" : `${Math.max(lost, frozen)} particles have no finite state and stand still: reset brings them back.`);
    banner.set("saturated", frame.isSaturated ? "Something has flown far away: it is shown at the border of its box." : "");
  });
}

/** @param {Renderer} renderer @param {Connector} connector */
function listenToSurroundings(renderer, connector) {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const recolor = () => {
    renderer.isDark = dark.matches;
    renderer.isDirty = true;
  };
  dark.addEventListener("change", recolor);
  recolor();
  new ResizeObserver(() => renderer.measure()).observe(renderer.canvas);
  addEventListener("online", () => connector.hurry());
  document.addEventListener("visibilitychange", () => { if (!document.hidden) connector.hurry(); });
  renderer.canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    banner.set("context", "The graphics card was taken away: waiting for it to come back.");
  });
  renderer.canvas.addEventListener("webglcontextrestored", () => {
    renderer.create();
    banner.set("context", "");
  });
}

/** Does what the address asks for, once it is known what there is. @param {Views} views @param {Controls} controls */
function followLink(views, controls) {
  for (const [name, isOn] of Object.entries(link.toggles)) if (name in views.bench.renderer.toggles) views.chosen.set(name, isOn);
  let wanted = link.scene;
  const isReady = () => simulation.scene !== null && simulation.hello !== null && simulation.node !== null;
  let pose = link.camera;
  const follow = () => {
    if (!isReady()) return;
    const isOther = wanted !== null && wanted !== simulation.scene?.name && controls.canChange();
    if (isOther && wanted !== null) controls.load(wanted);
    else {
      views.linkedPose = pose;
      pose = null;
    }
    wanted = null;
  };
  // Before the views look at the scene, so that they look from where the link says.
  simulation.on("scene", follow);
}
