// The shapes that the vehicle is drawn with.

import { BufferAttribute, LatheGeometry, Shape, Vector2 } from "three";

const GAP = 0.03; // of a roller's length, drawn between two of them so that they can be told apart

/** How far from its middle a roller whose axis has the angle `slant` to the wheel's plane touches the ground, where the
    wheel has the angle `chi`. */
export function along({ wheel_radius: radius, roller_axis_radius: axis }, slant, chi) {
  return radius * Math.cos(slant) * Math.sin(chi) + (axis * Math.sin(slant) ** 2 * Math.tan(chi)) / Math.cos(slant);
}

/** The angle of the wheel up to which a drawn roller reaches, with a gap to its neighbour. */
function end(vehicle) {
  return ((1 - GAP) * Math.PI) / vehicle.rollers;
}

/** Half of the width of a wheel: of its rollers, from end to end, and of its rows. */
export function halfWidth(vehicle, slant) {
  const { wheel_radius: radius, roller_axis_radius: axis, row_offset: side = 0 } = vehicle;
  const slanted = along(vehicle, slant, end(vehicle)) * Math.abs(Math.sin(slant));
  return Math.abs(side) + Math.max(slanted, 0.5 * (radius - axis));
}

/** A roller about the y-axis. In the wheel's plane its outline is the wheel's circle where it touches the ground. */
export function barrel(vehicle, slant, around) {
  const { wheel_radius: radius, roller_axis_radius: axis, rollers } = vehicle;
  const joint = end(vehicle);
  const rings = rollers > 8 ? 5 : 9;
  const outline = [];
  for (let k = 0; k < rings; k++) {
    const angle = joint * ((2 * k) / (rings - 1) - 1);
    const thick = Math.hypot(1, Math.sin(slant) * Math.tan(angle)) * (radius * Math.cos(angle) - axis);
    outline.push(new Vector2(thick, along(vehicle, slant, angle)));
  }
  const last = outline[rings - 1];
  const points = [
    new Vector2(0, -last.y),
    new Vector2(0.98 * last.x, -last.y),
    ...outline,
    new Vector2(0.98 * last.x, last.y),
    new Vector2(0, last.y),
  ];
  const geometry = new LatheGeometry(points, around);
  const colours = new Float32Array(3 * geometry.attributes.position.count);
  for (let k = 0; k < geometry.attributes.position.count; k++) {
    const sector = Math.floor(k / points.length) % around;
    colours.fill(sector % (around / 2) < 2 ? 0.45 : 1, 3 * k, 3 * k + 3); // two stripes show that it spins
  }
  geometry.setAttribute("color", new BufferAttribute(colours, 3));
  return geometry;
}

/** Corners of a disk around the middle. */
export function circle(radius) {
  return Array.from({ length: 24 }, (_, k) => [
    radius * Math.cos((k * Math.PI) / 12),
    radius * Math.sin((k * Math.PI) / 12),
  ]);
}

/** Andrew's monotone chain; corners against the clock. */
export function convexHull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const turn = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  const half = (list) => {
    const chain = [];
    for (const point of list) {
      while (chain.length > 1 && turn(chain.at(-2), chain.at(-1), point) <= 0) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** A shape with corners cut by curves, each over a part of its edges. */
export function rounded(corners, part) {
  const shape = new Shape();
  const between = (a, b, x) => [a[0] + (b[0] - a[0]) * x, a[1] + (b[1] - a[1]) * x];
  corners.forEach((corner, k) => {
    const before = between(corner, corners.at(k - 1), part);
    const after = between(corner, corners[(k + 1) % corners.length], part);
    if (k) shape.lineTo(...before);
    else shape.moveTo(...before);
    shape.quadraticCurveTo(...corner, ...after);
  });
  shape.closePath();
  return shape;
}

/** The distance from the middle to the nearest edge's corner. */
export function inner(corners) {
  return Math.min(
    ...corners.map((corner, k) => {
      const next = corners[(k + 1) % corners.length];
      return Math.hypot((corner[0] + next[0]) / 2, (corner[1] + next[1]) / 2);
    }),
  );
}

export function arrowShape(size) {
  const shape = new Shape();
  const points = [
    [-0.55, -0.16],
    [0.1, -0.16],
    [0.1, -0.42],
    [0.8, 0],
    [0.1, 0.42],
    [0.1, 0.16],
    [-0.55, 0.16],
  ];
  points.forEach(([x, y], k) => (k ? shape.lineTo(x * size, y * size) : shape.moveTo(x * size, y * size)));
  shape.closePath();
  return shape;
}
