// The wheel in notches: a mouse turns by one at a time, a trackpad by many small parts of one.

/** Pixels that a notch of the wheel scrolls in most browsers. */
const NOTCH = 100;

export class Notches {
  constructor() {
    /** Turn since the last notch, in pixels. */
    this.turned = 0;
  }

  /** The direction of the notch that an event completes, or 0. @param {Pick<WheelEvent, "deltaMode" | "deltaY">} event */
  add({ deltaMode, deltaY }) {
    const turn = deltaMode === 0 ? deltaY : Math.sign(deltaY) * NOTCH;
    this.turned = turn * this.turned < 0 ? turn : this.turned + turn;
    if (Math.abs(this.turned) < NOTCH) return 0;
    const direction = Math.sign(this.turned);
    this.turned = 0;
    return direction;
  }
}
