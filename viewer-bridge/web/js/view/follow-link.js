// Follows the scene and the camera pose of a link, once the page knows the scene on show.

/** @typedef {import("./link.js").CameraPose} CameraPose */
/** Shows a pose, asks before a scene is loaded, and says that there is no such scene.
 * @typedef {{ show(pose: CameraPose | null): void, ask(wanted: string, present: string): void, miss(wanted: string): void }} Follower */

/** A link to another scene never loads it by itself: others may look at the one on show.
 * @param {import("./link.js").Link} link @param {import("../state/simulation.js").Simulation} simulation @param {Follower} follower */
export function followLink({ scene: wanted, camera }, simulation, follower) {
  let isFollowed = false;
  const follow = () => {
    const { hello, isAlive, isRecording, node, scene } = simulation;
    if (isFollowed || hello === null || node === null || scene === null) return;
    const isHere = wanted === null || wanted === scene.name || isRecording;
    // The first scene can arrive before the news that its node runs.
    if (!isHere && !isAlive) return;
    isFollowed = true;
    if (isHere) follower.show(camera);
    else if (hello.scenes.some((one) => one.name === wanted)) follower.ask(wanted, scene.name);
    else follower.miss(wanted);
  };
  // Runs before the first frame of the scene, when the view applies the linked pose.
  simulation.on("scene", follow);
  simulation.on("node", follow);
}
