// Events by topic: modules subscribe to changes without knowing their source.

/** @template {Record<string, unknown>} Topics */
export class Emitter {
  constructor() {
    /** @type {Map<keyof Topics, ((value: any) => void)[]>} */
    this.listeners = new Map();
  }

  /** @template {keyof Topics} T @param {T} topic @param {(value: Topics[T]) => void} listener */
  on(topic, listener) {
    this.listeners.set(topic, [...(this.listeners.get(topic) ?? []), listener]);
  }

  /** @template {keyof Topics} T @param {T} topic @param {Topics[T]} value */
  emit(topic, value) {
    for (const listener of this.listeners.get(topic) ?? []) listener(value);
  }
}
