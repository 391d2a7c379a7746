// The structure of the page's modules: the folders form layers, and no module imports one that
// imports it, not even for a type.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { dirname, join, normalize, sep } from "node:path";
import { test } from "node:test";

const ROOT = new URL("../js/", import.meta.url).pathname;
/** Each folder, with the folders in it, may import from itself and from the folders before it. */
const LAYERS = ["geometry", "net", "state", "gl", "tools", "view", "ui", "legend", "save", "timeline", "panel", "."];

const modules = readdirSync(ROOT, { recursive: true, encoding: "utf8" }).filter((path) => path.endsWith(".js"));

const layerOf = (/** @type {string} */ path) => LAYERS.indexOf(dirname(path).split(sep)[0]);

/** The modules that a module names, in an import or in the type of a comment. */
function importsOf(path) {
  const text = readFileSync(join(ROOT, path), "utf8");
  return [...text.matchAll(/(?:from |import\()"(\.[^"]+)"/g)].map(([, target]) => normalize(join(dirname(path), target)));
}

test("a folder imports only from the folders of lower layers", () => {
  for (const path of modules) {
    const layer = layerOf(path);
    assert.notEqual(layer, -1, `${path} is in no known folder`);
    for (const target of importsOf(path)) {
      assert.ok(modules.includes(target), `${path} imports ${target}, which does not exist`);
      assert.ok(layerOf(target) <= layer, `${path} imports ${target}`);
    }
  }
});

test("no modules import each other in a circle", () => {
  const done = new Set();
  const visit = (path, above) => {
    assert.ok(!above.includes(path), `a circle: ${[...above, path].join(" -> ")}`);
    if (done.has(path)) return;
    for (const target of importsOf(path)) visit(target, [...above, path]);
    done.add(path);
  };
  for (const path of modules) visit(path, []);
});
