// The path of a run's centre in the picture.

import { Box2, Group, Vector2 } from "three";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";

const MOST_POINTS = 20000; // of a path

/** The path of the centre: all of it faintly, what has been driven strongly. */
export class Path {
  constructor(run, colour, size) {
    const count = run.pieces > MOST_POINTS / 4 ? 1 : 4;
    const points = [];
    this.times = [];
    this.box = new Box2();
    for (const state of run.states(count)) {
      const [x, y] = state.position;
      this.times.push(state.time);
      points.push(x, y, 0.006 * size);
      this.box.expandByPoint(new Vector2(x, y));
    }
    if (points.length === 3) points.push(...points);
    this.group = new Group();
    this.lines = [0.28, 1].map((opacity) => {
      const geometry = new LineGeometry();
      geometry.setPositions(points);
      const line = new Line2(
        geometry,
        new LineMaterial({ color: colour, linewidth: opacity < 1 ? 1.5 : 3, transparent: true, opacity, fog: true }),
      );
      line.frustumCulled = false;
      this.group.add(line);
      return line;
    });
  }

  resize(width, height) {
    for (const line of this.lines) line.material.resolution.set(width, height);
  }

  move(state) {
    let [low, high] = [0, this.times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= state.time) low = middle + 1;
      else high = middle;
    }
    this.lines[1].geometry.instanceCount = Math.max(low - 1, 0);
  }
}
