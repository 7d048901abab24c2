// Plays an animation of a file by three.js: `three.cjs FILE ANIMATION TIMES`, with the folder of its package in NODE_PATH.
// Prints the animation's length, and where every node is in the world at each time.

const { readFileSync } = require("node:fs");
const path = require("node:path");
const { pathToFileURL } = require("node:url");

const [file, name, times] = process.argv.slice(2);
const home = path.join(path.dirname(require.resolve("three")), "..");
const load = (part) => import(pathToFileURL(path.join(home, part)));

async function glb(bytes) {
  const { GLTFLoader } = await load("examples/jsm/loaders/GLTFLoader.js");
  const { scene, animations } = await new GLTFLoader().parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), "");
  return { root: scene, clips: animations };
}

async function bvh(bytes) {
  const { BVHLoader } = await load("examples/jsm/loaders/BVHLoader.js");
  const { skeleton, clip } = new BVHLoader().parse(bytes.toString());
  return { root: skeleton.bones[0], clips: [clip] };
}

(async () => {
  const { AnimationMixer, LoopOnce, Quaternion, Vector3 } = await load("build/three.module.js");
  const { root, clips } = await (file.endsWith(".bvh") ? bvh : glb)(readFileSync(file));
  const clip = clips.find((one) => one.name === name);
  if (!clip) throw new Error(`there is no animation ${name} among ${clips.map((one) => one.name)}`);
  const mixer = new AnimationMixer(root);
  const action = mixer.clipAction(clip);
  action.setLoop(LoopOnce, 1);
  action.clampWhenFinished = true;
  action.play();
  const frames = JSON.parse(times).map((time) => {
    mixer.setTime(time);
    root.updateMatrixWorld(true);
    const nodes = {};
    root.traverse((node) => {
      if (node.name) nodes[node.name] = [node.getWorldPosition(new Vector3()).toArray(), node.getWorldQuaternion(new Quaternion()).toArray()];
    });
    return nodes;
  });
  console.log(JSON.stringify({ duration: clip.duration, frames }));
})();
