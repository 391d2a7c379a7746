// Records what the picture shows, with its legends, as a video file of the user.

import { enable, find, save } from "../ui/dom.js";
import { clock, readableBytes } from "./recording.js";
import { HEAD_BYTES, withDuration } from "./webm-duration.js";

/** Formats from the most to the least widely played. The browser chooses the first that it can write. */
export const TYPES = Object.freeze(["video/mp4;codecs=avc1", "video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"]);
/** Pictures per second. */
export const FRAMES_PER_SECOND = 30;
/** Limit on the size of a video: the browser keeps it in memory until it is saved. */
export const SIZE_BYTES_MAX = 512e6;
/** Bits per pixel of a picture: enough for thin threads. */
const BITS_PER_PIXEL = 0.15;
const BITS_PER_SECOND = { min: 2.5e6, max: 40e6 };
/** Longest side: encoders refuse more. */
const SIDE_MAX = 4096;

/** The best type that a browser can write, or null. @param {(type: string) => boolean} isSupported */
export const chooseType = (isSupported) => TYPES.find((type) => isSupported(type)) ?? null;

/** The ending of a file. @param {string} type */
export const endingOf = (type) => (type.startsWith("video/mp4") ? "mp4" : "webm");

/** The size of the pictures of a video: even, as encoders need it. @param {{ width: number, height: number }} picture */
export function videoSize({ width, height }) {
  const scale = Math.min(1, SIDE_MAX / Math.max(width, height));
  const even = (/** @type {number} */ side) => Math.max(2, 2 * Math.floor((side * scale) / 2));
  return { width: even(width), height: even(height) };
}

/** @param {{ width: number, height: number }} size */
export function bitsPerSecond({ width, height }) {
  return Math.round(Math.min(BITS_PER_SECOND.max, Math.max(BITS_PER_SECOND.min, width * height * FRAMES_PER_SECOND * BITS_PER_PIXEL)));
}

/** Time between two parts of the video in ms, so that its size is known while it grows. */
const PART_MS = 500;
/** Least time between two pictures in ms: a little less than a frame, because animation frames are not exact. */
const INTERVAL_MS = 1000 / FRAMES_PER_SECOND - 4;
const NO_VIDEO = "This browser cannot record video. Save a picture, or make an animation from a recording: recorder export run.mcap --apng run.png";

/** A video that is being made. @typedef {{ recorder: MediaRecorder, context: CanvasRenderingContext2D, type: string, name: string, parts: Blob[], sizeBytes: number, begunMs: number, endedMs: number | null }} Take */

export class Video {
  /** @param {import("../gl/renderer.js").Renderer} renderer @param {import("./picture.js").Composition} composition @param {import("../ui/banner.js").Banner} banner */
  constructor(renderer, composition, banner) {
    this.renderer = renderer;
    this.composition = composition;
    this.banner = banner;
    this.button = find("video", HTMLButtonElement);
    this.title = this.button.title;
    this.line = find("video-line", HTMLElement);
    this.text = find("video-text", HTMLOutputElement);
    /** @type {Take | null} */
    this.take = null;
    this.paintedMs = -Infinity;
    const canRecord = typeof MediaRecorder === "function" && typeof HTMLCanvasElement.prototype.captureStream === "function";
    this.type = canRecord ? chooseType((type) => MediaRecorder.isTypeSupported(type)) : null;
    enable(this.button, this.type === null ? NO_VIDEO : "");
    this.button.addEventListener("click", () => this.toggle());
    /** Number of videos that have ended and are not saved yet. */
    this.unsavedCount = 0;
    // The browser asks before it leaves a page whose video is not saved.
    addEventListener("beforeunload", (event) => { if (this.take !== null || this.unsavedCount > 0) event.preventDefault(); });
  }

  toggle() {
    if (this.take !== null) stop(this.take);
    else if (this.type !== null) this.start(this.type);
  }

  /** @param {string} type */
  start(type) {
    const canvas = document.createElement("canvas");
    const size = videoSize(this.renderer.canvas);
    Object.assign(canvas, size);
    const context = canvas.getContext("2d", { alpha: false });
    if (context === null) return this.fail("the browser has no memory for it");
    // Otherwise the first picture would be black.
    this.renderer.draw();
    this.composition.paint(context);
    try {
      const recorder = new MediaRecorder(canvas.captureStream(FRAMES_PER_SECOND), { mimeType: type, videoBitsPerSecond: bitsPerSecond(size) });
      this.take = { recorder, context, type, name: this.composition.fileName(), parts: [], sizeBytes: 0, begunMs: performance.now(), endedMs: null };
      this.listen(this.take);
      recorder.start(PART_MS);
    } catch (error) {
      this.take = null;
      return this.fail(String(error));
    }
    this.paintedMs = -Infinity;
    this.show(0);
  }

  /** @param {Take} take */
  listen(take) {
    take.recorder.ondataavailable = ({ data }) => {
      if (data.size > 0) take.parts.push(data);
      take.sizeBytes += data.size;
      if (take.sizeBytes < SIZE_BYTES_MAX || take.recorder.state === "inactive") return;
      stop(take);
      this.banner.notify(`The video ended at its greatest size, ${readableBytes(SIZE_BYTES_MAX)}. Record the simulation for longer times.`, "warning");
    };
    take.recorder.onerror = (event) => this.fail(String(/** @type {ErrorEvent} */ (event).error ?? "the encoder failed"));
    take.recorder.onstop = () => this.finish(take);
  }

  /** Saves what there is, also after an error. @param {Take} take */
  finish(take) {
    for (const track of take.recorder.stream.getTracks()) track.stop();
    this.take = null;
    this.show(0);
    if (take.sizeBytes === 0) return this.fail("the browser has encoded no picture; keep the page visible");
    void this.save(take);
  }

  /** @param {Take} take */
  async save({ parts, name, type, begunMs, endedMs }) {
    const seconds = ((endedMs ?? performance.now()) - begunMs) / 1000;
    const ending = endingOf(type);
    const video = new Blob(parts, { type });
    this.unsavedCount++;
    save(ending === "webm" ? await withDurationOf(video, seconds) : video, `${name}.${ending}`);
    this.unsavedCount--;
  }

  /** @param {string} reason */
  fail(reason) {
    this.banner.notify(`The video could not be recorded: ${reason}.`, "error");
    this.show(0);
  }

  /** Makes sure that a picture is drawn in this animation frame, also of a paused scene, if the video needs one. @param {number} nowMs */
  request(nowMs) {
    if (this.take !== null && nowMs - this.paintedMs >= INTERVAL_MS) this.renderer.isDirty = true;
  }

  /** Adds the picture that was drawn in this animation frame. @param {number} nowMs */
  add(nowMs) {
    const { take } = this;
    if (take === null || nowMs - this.paintedMs < INTERVAL_MS) return;
    this.paintedMs = nowMs;
    this.composition.paint(take.context);
    this.show(nowMs - take.begunMs);
  }

  /** Shows the elapsed time. @param {number} elapsedMs */
  show(elapsedMs) {
    const isOn = this.take !== null;
    if (this.line.hidden === isOn) {
      this.line.hidden = !isOn;
      this.button.setAttribute("aria-pressed", String(isOn));
      this.button.title = isOn ? "Stop the video and save it" : this.title;
      this.button.setAttribute("aria-label", this.button.title);
    }
    if (!isOn) return;
    const text = `Video ${clock(elapsedMs / 1000)}`;
    if (this.text.textContent !== text) this.text.textContent = text;
  }
}

/** A WebM video with its duration, or as it is if the browser cannot read it. @param {Blob} video @param {number} seconds */
async function withDurationOf(video, seconds) {
  try {
    const head = new Uint8Array(await video.slice(0, HEAD_BYTES).arrayBuffer());
    return new Blob([...withDuration(head, seconds), video.slice(HEAD_BYTES)], { type: video.type });
  } catch {
    return video;
  }
}

/** @param {Take} take */
function stop(take) {
  if (take.recorder.state === "inactive") return;
  take.endedMs = performance.now();
  take.recorder.stop();
}
