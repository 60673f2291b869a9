// Where the picture is seen from.

import { PerspectiveCamera, Vector2, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const FIELD = 35; // degrees
const WIDE = 0.93; // of a picture's height: narrower ones are seen from farther away

export class Eye {
  /** size of the vehicle in m; onchange() is called where the camera has moved */
  constructor(canvas, vehicle, size, onchange) {
    Object.assign(this, { vehicle, size });
    this.camera = new PerspectiveCamera(FIELD, 1, 0.02 * size, 400 * size);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { maxPolarAngle: 1.53, minDistance: 0.25 * size, maxDistance: 150 * size });
    this.controls.addEventListener("change", onchange);
    this.box = null; // Box2 of all paths
  }

  /** Whether the view stays where it is while the vehicle moves. */
  get isStill() {
    return this.name === "path";
  }

  get distance() {
    return this.camera.position.distanceTo(this.controls.target);
  }

  /** The number of the wheel that is looked at, or null. */
  get #wheel() {
    return Number.isInteger(Number(this.name)) ? Number(this.name) : null;
  }

  /** Looks anew: follow, ride, path, or the number of a wheel. aspect: width of a picture over its height. */
  view(name, state, aspect) {
    this.name = name;
    const target = this.#target(state);
    this.camera.position.copy(target).add(this.#away(state, Math.max(1, WIDE / aspect)));
    this.#look(target, state);
  }

  /** Keeps what is looked at where it is in the picture. */
  carry(state) {
    if (this.isStill) return;
    const target = this.#target(state);
    const away = this.camera.position.clone().sub(this.controls.target);
    const turns = this.name === "ride" || this.#wheel !== null;
    if (turns) away.applyAxisAngle(this.camera.up, state.heading - this.seen.heading);
    const moved = this.controls.target.clone().add(target).sub(this.seen.target); // a shifted view stays shifted
    this.camera.position.copy(moved).add(away);
    this.#look(moved, state, target);
  }

  #look(at, state, target = at) {
    this.controls.target.copy(at);
    this.seen = { target: target.clone(), heading: state.heading };
    this.controls.update();
  }

  #target({ position: [x, y], heading }) {
    const { wheel_radius: radius, places } = this.vehicle;
    if (this.isStill) {
      const middle = this.box.getCenter(new Vector2());
      return new Vector3(middle.x, middle.y, 0);
    }
    if (this.#wheel === null) return new Vector3(x, y, 0.8 * radius);
    const place = new Vector2(...places[this.#wheel]).rotateAround(new Vector2(), heading);
    return new Vector3(x + place.x, y + place.y, 1.05 * radius);
  }

  /** From the target to the camera; narrow: how much farther away a narrow picture asks for. */
  #away({ heading }, narrow) {
    const { wheel_radius: radius, angles } = this.vehicle;
    if (this.isStill) {
      const span = Math.max(...this.box.getSize(new Vector2()), 2 * this.size);
      return new Vector3(-0.35, -0.75, 1).setLength(2.1 * span * narrow);
    }
    if (this.#wheel !== null) return from(heading + angles[this.#wheel] - 0.45, 0.28, 6.2 * radius * narrow);
    const angle = this.name === "ride" ? heading + Math.PI - 0.5 : heading - 0.85;
    return from(angle, 0.78, 4.5 * this.size * narrow);
  }

  /** Turns the view by the keyboard. */
  orbit(left, up) {
    this.controls.rotateLeft(left);
    this.controls.rotateUp(up);
    this.controls.update();
  }

  zoom(factor) {
    if (factor > 1) this.controls.dollyOut(factor);
    else this.controls.dollyIn(1 / factor);
    this.controls.update();
  }
}

/** The vector of a length towards an angle from above, rising by `rise` on a way of 1. */
function from(angle, rise, length) {
  return new Vector3(Math.cos(angle), Math.sin(angle), rise).setLength(length);
}
