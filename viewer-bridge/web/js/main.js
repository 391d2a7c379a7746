// The page: creates its parts, connects them, and runs the animation loop.

import { Banner, sentence } from "./ui/banner.js";
import { Camera } from "./geometry/camera.js";
import { Charts } from "./panel/charts.js";
import { ColorLegend, ForceLegend } from "./legend/legend.js";
import { CommandForm } from "./panel/command-form.js";
import { Commands } from "./net/commands.js";
import { Controls } from "./ui/controls.js";
import { find } from "./ui/dom.js";
import { Composition, PictureButton } from "./save/picture.js";
import { Renderer } from "./gl/renderer.js";
import { Hud } from "./ui/hud.js";
import { Input } from "./tools/input.js";
import { Hint, Question } from "./ui/prompts.js";
import { followLink, parseLink } from "./view/link.js";
import { Settling } from "./view/settling.js";
import { Overlay } from "./ui/overlay.js";
import { Inspector } from "./panel/inspector.js";
import { RecordingControl } from "./save/recording.js";
import { Video } from "./save/video.js";
import { Panel } from "./panel/panel.js";
import { Connector } from "./net/socket.js";
import { Selection } from "./state/selection.js";
import { Simulation } from "./state/simulation.js";
import { TimelineBar } from "./timeline/timeline-bar.js";
import { LiveTrack } from "./timeline/live-track.js";
import { ReplayTrack } from "./timeline/replay-track.js";
import { Undo } from "./ui/undo.js";
import { createViewer } from "./viewer.js";
import { Views } from "./ui/views.js";
import { Subscription } from "./state/subscription.js";

/** Key of the token in sessionStorage, so that it survives a reload. */
const TOKEN_KEY = "catenary-token";
/** Reasons of refusals that are not worth a notice. */
const QUIET_REASONS = new Set(["already_torn", "not_grabbed", "stale_epoch", "changed_by_others"]);

/** Uncaught errors, for tests. @type {string[]} */
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
    document.body.classList.add("is-unusable");
    banner.set("fatal", "This page needs WebGL2, which this browser does not provide. Try another browser, or turn on hardware acceleration.");
    return null;
  }
}

/** Moves the token from the address to sessionStorage, so that it is not in copied links or screenshots. */
function loadToken() {
  if (link.token !== null) {
    sessionStorage.setItem(TOKEN_KEY, link.token);
    history.replaceState(null, "", location.pathname + location.search);
  }
  return link.token ?? sessionStorage.getItem(TOKEN_KEY);
}

/** Address of the socket: it lies beside the page, whose address that of a recording can be. */
function socketAddress() {
  const address = new URL("socket", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  return address.href;
}

/** @param {Renderer} renderer */
function start(renderer) {
  const token = loadToken();
  const connector = new Connector(socketAddress(), token, {
    onBinary: (message) => simulation.receive(message),
    onText: (message) => simulation.receiveText(message),
    onChange: (connection) => {
      banner.set("connection", connection.state === "open" ? "" : connection.text);
      simulation.setConnected(connection.state === "open");
      if (connection.state === "waiting" || connection.state === "refused") {
        commands.clear();
        input.abandon();
        timeline.gate.reset();
        // The next connection numbers its frames from the start.
        simulation.frameNumber = null;
      }
    },
    onProgress: (share) => banner.set("receiving", share === null ? "" : `Receiving the scene: ${Math.floor(100 * share)} %.`),
    onFault: (text) => {
      faults.push(text);
      banner.notify(text, "error");
    },
  });
  const commands = new Commands((message) => connector.send(message), (outcome) => {
    if (!QUIET_REASONS.has(outcome.reason)) banner.notify(`${outcome.kind}: ${outcome.text || outcome.reason}`, "warning");
  });
  const app = { simulation, camera, renderer, commands, selection: new Selection(simulation) };
  const input = new Input(renderer.canvas, app, () => controls.canChange());
  const overlay = new Overlay(find("overlay", HTMLCanvasElement), app, input);
  const settling = new Settling(app, input);
  const views = new Views(app, banner, settling);
  const timeline = new TimelineBar(simulation, { replay: new ReplayTrack(simulation, commands), live: new LiveTrack(simulation, commands, banner) });
  const undo = new Undo(app, banner);
  const controls = new Controls(app, input, views, timeline, undo);
  const panel = new Panel(find("parameters", HTMLFormElement), find("parameters-note", HTMLElement), app, banner);
  // In a text field, Ctrl+Z is about values: a cut is undone on the picture.
  panel.onUndo = () => { if (simulation.undoable === "set") undo.run(); };
  const inspector = new Inspector(app, input, banner);
  controls.onInspect = () => inspector.turn();
  controls.onFollow = () => inspector.toggleFollow();
  const charts = new Charts(app, banner);
  new CommandForm(app);
  new Hint(app, input);
  const forceLegend = new ForceLegend(app);
  const colorLegend = new ColorLegend(app);
  colorLegend.choose(link.colour);
  const composition = new Composition(app, overlay.canvas, [colorLegend, forceLegend]);
  const picture = new PictureButton(renderer, composition, banner);
  controls.onPicture = () => picture.save();
  const video = new Video(renderer, composition, banner);
  new RecordingControl(app, token);
  const subscription = new Subscription(simulation, commands, {
    forces: () => renderer.toggles.forces || inspector.wantsForces(),
    speeds: () => renderer.toggles.heat && renderer.coloring.quantity === "speed",
    inspected: () => app.selection.particles,
  });
  const hud = new Hud(find("hud", HTMLOutputElement), simulation, renderer);

  listenToSimulation(input);
  listenToSurroundings(renderer, connector);
  openLink(views, controls);

  let scriptMs = 0;
  const loop = (/** @type {number} */ nowMs) => {
    requestAnimationFrame(loop);
    const begin = performance.now();
    input.tick(nowMs);
    settling.tick(nowMs);
    panel.tick();
    inspector.tick(nowMs);
    charts.tick();
    hud.tick(nowMs);
    colorLegend.tick(nowMs);
    forceLegend.tick();
    subscription.tick();
    renderer.resize();
    video.request(nowMs);
    const between = performance.now();
    if (renderer.isDirty) renderer.draw();
    const drawn = performance.now();
    overlay.draw();
    video.add(nowMs);
    if (simulation.frameNumber !== null) connector.acknowledge(simulation.frameNumber);
    simulation.frameNumber = null;
    scriptMs += 0.05 * (between - begin + performance.now() - drawn - scriptMs);
  };
  requestAnimationFrame(loop);
  connector.connect();

  Object.defineProperty(window, "viewer", { value: createViewer({ app, connector, colorLegend, charts, banner, input, faults, scriptMs: () => scriptMs }) });
}

/** @param {Input} input */
function listenToSimulation(input) {
  simulation.on("outcome", (outcome) => input.app.commands.receive(outcome));
  simulation.on("notice", ({ text, level }) => banner.notify(text, level));
  simulation.on("node", (node) => banner.set("node", node.state === "alive" || simulation.isReplay ? "" : sentence(node.text || "no node is running")));
  // A live bridge at the same address has no recording.
  simulation.on("timeline", (timeline) => banner.set("incomplete", timeline?.incomplete ? sentence(`the recording is ${timeline.incomplete}`) : ""));
  simulation.on("scene", (scene) => {
    document.title = `${scene.name} · Catenary`;
    banner.dismissInfos();
  });
  simulation.on("frame", warnOfParticles);
  simulation.on("stats", warnOfParticles);
}

function warnOfParticles() {
  const { frame, stats } = simulation;
  if (frame === null) return;
  const frozen = stats?.epoch === frame.epoch ? stats.frozenCount : 0;
  const count = Math.max(frame.nonFinite.length, frozen);
  banner.set("nonFinite", count === 0 ? "" : `Frozen particles: ${count}. Their state is no longer finite. Reset restores them.`);
  banner.set("saturated", frame.isSaturated ? "Some particles are far outside the scene. They are shown at its border." : "");
}

/** @param {Renderer} renderer @param {Connector} connector */
function listenToSurroundings(renderer, connector) {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const applyScheme = () => {
    renderer.isDark = dark.matches;
    renderer.isDirty = true;
  };
  dark.addEventListener("change", applyScheme);
  applyScheme();
  new ResizeObserver(() => renderer.measure()).observe(renderer.canvas);
  addEventListener("online", () => connector.retryNow());
  document.addEventListener("visibilitychange", () => { if (!document.hidden) connector.retryNow(); });
  renderer.canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    banner.set("context", "The graphics context was lost. Waiting for the browser to restore it.");
  });
  renderer.canvas.addEventListener("webglcontextrestored", () => {
    renderer.create();
    banner.set("context", "");
  });
}

/** Applies the camera and toggles of the address, once the scene is known. @param {Views} views @param {Controls} controls */
function openLink(views, controls) {
  for (const [name, isOn] of Object.entries(link.toggles)) if (name in views.app.renderer.toggles) views.chosen.set(name, isOn);
  followLink(link, simulation, {
    show: (pose) => { views.linkedPose = pose; },
    ask: (wanted, present) => new Question().ask(
      { text: `This link shows the scene “${wanted}”. Loading it replaces “${present}” for everybody.`, yes: `Load ${wanted}`, no: `Keep ${present}` },
      (isYes) => {
        if (!isYes) return;
        views.poseOfScene = link.camera === null ? null : { scene: wanted, pose: link.camera };
        controls.load(wanted);
      },
    ),
    miss: (wanted) => banner.notify(`This link shows the scene “${wanted}”, which this viewer does not have.`, "warning"),
  });
}
