// The picture where there is no WebGL: the vehicle from above, and each wheel from outside with its rollers.

import { halfWidth } from "./shapes.js";

const TURN = 2 * Math.PI;

export class FlatStage {
  constructor(canvas, runs, look) {
    Object.assign(this, { canvas, runs, look, showForces: true, beside: false, isFlat: true });
    this.context = canvas.getContext("2d");
    this.paths = runs.map((run) => Array.from(run.states(2), ({ position, time }) => [...position, time]));
    this.size = Math.max(
      ...runs.map(
        ({ vehicle }) => Math.max(...vehicle.places.map(([x, y]) => Math.hypot(x, y))) + vehicle.wheel_radius,
      ),
    );
  }

  restyle(look) {
    this.look = look;
  }

  resize(width, height, ratio) {
    Object.assign(this, { width, height, ratio });
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
  }

  view() {}

  move(time) {
    this.states = this.runs.map((run) => run.at(time));
  }

  draw() {
    const { context, width, height, ratio } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = this.look.ground;
    context.fillRect(0, 0, width, height);
    const strip = Math.min(0.42 * height, width / this.runs[0].wheels);
    this.runs.forEach((run, k) => this.#fromAbove(k, width / 2, (height - strip) / 2));
    context.fillStyle = this.look.ground;
    context.fillRect(0, height - strip, width, strip);
    for (let wheel = 0; wheel < this.runs[0].wheels; wheel++) {
      this.#wheel(wheel, ((wheel + 0.5) * width) / this.runs[0].wheels, height - 0.52 * strip, 0.4 * strip);
    }
  }

  /** The first vehicle stands in the middle. */
  #fromAbove(k, middle, level) {
    const { context, look } = this;
    const scale = (0.36 * Math.min(this.width, 2 * level)) / this.size;
    const [x0, y0] = this.states[0].position;
    const { vehicle } = this.runs[k];
    const state = this.states[k];
    context.save();
    context.translate(middle, level);
    context.scale(scale, -scale);
    context.translate(-x0, -y0);
    context.lineWidth = 2 / scale;
    context.strokeStyle = look.runs[k];
    for (const [part, alpha] of [
      [this.paths[k], 0.3],
      [this.paths[k].filter(([, , time]) => time <= state.time), 1],
    ]) {
      context.globalAlpha = alpha;
      context.beginPath();
      for (const [x, y] of part) context.lineTo(x, y);
      context.stroke();
    }
    context.translate(...state.position);
    context.rotate(state.heading);
    context.fillStyle = look.vehicle.plate;
    context.beginPath();
    context.arc(0, 0, 0.7 * this.size, 0, TURN);
    context.fill();
    context.stroke();
    context.fillStyle = look.runs[k];
    context.beginPath();
    for (const [x, y] of [
      [0.5, 0],
      [-0.2, 0.25],
      [-0.2, -0.25],
    ])
      context.lineTo(x * this.size, y * this.size);
    context.fill();
    vehicle.places.forEach((place, wheel) => {
      context.save();
      context.translate(...place);
      context.rotate(vehicle.angles[wheel]);
      const slant = this.runs[k].slant(wheel);
      const own = this.runs[k].own[wheel];
      const radius = own.wheel_radius;
      const half = halfWidth(own, slant) + 0.5 * (radius - own.roller_axis_radius);
      context.fillStyle = look.vehicle.roller;
      context.fillRect(-half, -radius, 2 * half, 2 * radius);
      if (slant) this.#slanted(half, radius, slant);
      context.restore();
    });
    context.restore();
  }

  /** The rollers on top of a wheel, as lines: on the ground they lie the other way. */
  #slanted(half, radius, slant) {
    const { context } = this;
    context.save();
    context.beginPath();
    context.rect(-half, -radius, 2 * half, 2 * radius);
    context.clip();
    context.lineWidth = 0.08 * radius;
    context.strokeStyle = this.look.ground;
    context.beginPath();
    const rise = half / Math.tan(slant);
    for (let y = -2.5; y <= 2.5; y += 0.5) {
      context.moveTo(-half, y * radius + rise);
      context.lineTo(half, y * radius - rise);
    }
    context.stroke();
    context.restore();
  }

  /** A wheel of the first run, seen from outside: its rolling direction is to the right. */
  #wheel(wheel, x, y, radius) {
    const { context, look } = this;
    const run = this.runs[0];
    const { wheel_radius, roller_axis_radius, rollers } = run.own[wheel];
    const axis = (radius * roller_axis_radius) / wheel_radius;
    const joint = Math.PI / rollers;
    context.save();
    context.translate(x, y);
    context.strokeStyle = look.tick;
    context.beginPath();
    context.moveTo(-1.15 * radius, radius);
    context.lineTo(1.15 * radius, radius);
    context.stroke();
    for (let roller = 0; roller < rollers; roller++) {
      context.save();
      context.rotate(-run.rollerAngle(this.states[0], wheel, roller));
      context.fillStyle = roller === this.states[0].contact[wheel] ? look.vehicle.contact : look.vehicle.roller;
      context.beginPath();
      context.strokeStyle = look.ground;
      context.arc(0, 0, radius, Math.PI / 2 - joint, Math.PI / 2 + joint);
      context.arc(0, 2 * axis, radius, -Math.PI / 2 - joint, -Math.PI / 2 + joint); // the rim mirrored at the axis
      context.closePath();
      context.fill();
      context.stroke();
      context.restore();
    }
    context.fillStyle = look.text;
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "center";
    context.fillText(`wheel ${wheel + 1}`, 0, 4);
    context.restore();
  }
}
