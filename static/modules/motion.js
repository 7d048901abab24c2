// Motions in time: `at(t)` of each gives where the root is, the angle of every joint by its name, the target of
// every joint, and the contacts where they are known.

import { aboutAxis, between, heading, multiply, turn } from "./quaternion.js";

/** The loop of a motion document, as it was simulated, on and on. */
export function loopOf(motion) {
  const { start, end, root_advance: advance } = motion.loop;
  const period = end - start;
  const poses = motion.poses ?? posesOfKeyframes(motion);
  const first = poses[0].root;
  const angle0 = heading(first.orientation);
  // Where each cycle starts: the way from the first, and the turn.
  const starts = [[0, 0, 0]];
  const startOf = (cycle) => {
    while (starts.length <= cycle) {
      const before = starts.at(-1);
      const way = turn(aboutAxis([0, 0, 1], angle0 + (starts.length - 1) * advance.yaw), advance.translation);
      starts.push(before.map((part, at) => part + way[at]));
    }
    return starts[cycle];
  };
  return {
    duration: period,
    repeats: true,
    at(time) {
      const cycle = Math.max(0, Math.floor(time / period + 1e-9));
      const local = Math.min(Math.max(time - cycle * period, 0), period);
      const { angles, root } = sample(poses, local);
      const yaw = aboutAxis([0, 0, 1], cycle * advance.yaw);
      const from = turn(yaw, root.position.map((part, at) => part - first.position[at]));
      const position = startOf(cycle).map((part, at) => part + first.position[at] + from[at]);
      return {
        root: { position, orientation: multiply(yaw, root.orientation) },
        angles: named(motion.joints, angles),
        targets: named(motion.joints, keyed(motion.keyframes, start + local)),
        contacts: null,
      };
    },
  };
}

/** A simulation of the motion from the standing pose on: `samples` are the lines of `POST /v1/simulations`. */
export function simulationOf(motion, samples) {
  const entry = motion.entry.at(-1)?.time ?? 0;
  const { start, end } = motion.loop;
  const interval = samples[1].time - samples[0].time;
  const duration = samples.at(-1).time;
  return {
    duration,
    repeats: false,
    at(time) {
      const place = Math.min(Math.max(time / interval, 0), samples.length - 1);
      const [before, share] = [Math.floor(place), place % 1];
      const [from, to] = [samples[before], samples[Math.min(before + 1, samples.length - 1)]];
      const angles = {};
      for (const [name, joint] of Object.entries(from.joints)) {
        angles[name] = joint.angle + (to.joints[name].angle - joint.angle) * share;
      }
      const after = time - entry;
      const looped = after < end ? after : start + ((after - start) % (end - start));
      const keys = after < 0 ? keyed(motion.entry, time) : keyed(motion.keyframes, looped);
      return {
        root: mixed(from.root, to.root, share),
        angles,
        targets: named(motion.joints, keys),
        contacts: from.contacts,
      };
    },
  };
}

/** Poses of a document that has none: the keyframes themselves. */
function posesOfKeyframes({ keyframes, loop }) {
  const cycle = keyframes.filter((keyframe) => keyframe.time >= loop.start);
  return cycle.map(({ time, angles, root }) => ({ time: time - loop.start, angles, root }));
}

function named(joints, angles) {
  return Object.fromEntries(joints.map((joint, at) => [joint, angles[at]]));
}

function mixed(from, to, share) {
  return {
    position: from.position.map((part, at) => part + (to.position[at] - part) * share),
    orientation: between(from.orientation, to.orientation, share),
  };
}

/** The place of `time` among rising times: the index before it, and the share of the way to the next. */
function place(items, time) {
  let [low, high] = [0, items.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (items[middle].time <= time) low = middle;
    else high = middle;
  }
  const width = items[high].time - items[low].time;
  return [low, high, width > 0 ? Math.min(Math.max((time - items[low].time) / width, 0), 1) : 0, width];
}

function sample(poses, time) {
  const [low, high, share] = place(poses, time);
  const angles = poses[low].angles.map((angle, at) => angle + (poses[high].angles[at] - angle) * share);
  return { angles, root: mixed(poses[low].root, poses[high].root, share) };
}

/** The targets at a time: cubics with the keyframes' angles and velocities at their ends. */
function keyed(keyframes, time) {
  const [low, high, s, width] = place(keyframes, time);
  const [a, b] = [keyframes[low], keyframes[high]];
  const [s2, s3] = [s * s, s * s * s];
  return a.angles.map(
    (angle, at) =>
      (2 * s3 - 3 * s2 + 1) * angle +
      (s3 - 2 * s2 + s) * width * a.velocities[at] +
      (3 * s2 - 2 * s3) * b.angles[at] +
      (s3 - s2) * width * b.velocities[at],
  );
}
