// The vehicle in 3-D. Its axes: x ahead, y to the left, z up; lengths in m.
// A wheel's axes: x along its axle, outwards; y along its rolling direction; z up. docs/theory.md draws them.

import {
  BoxGeometry,
  Color,
  CylinderGeometry,
  DynamicDrawUsage,
  ExtrudeGeometry,
  Group,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  RingGeometry,
  Vector3,
} from "three";
import { Arrow } from "./arrow.js";
import { along, arrowShape, barrel, circle, convexHull, halfWidth, inner, rounded } from "./shapes.js";

const FADED = 0.4; // opacity of a vehicle that stands over another one
const MANY = 400; // rollers, beyond which each is drawn with fewer corners
const PLATE = 0.04; // thickness of a plate at the side of a mecanum wheel, over the radius of its rollers' axes
const ALONG = new Vector3();

export class VehicleModel {
  /** colours: accent, roller, metal, plate, contact, force, load, slip */
  constructor(run, colours) {
    this.run = run;
    this.vehicle = run.vehicle;
    this.colours = colours;
    this.group = new Group();
    this.materials = [];
    this.wheels = this.vehicle.places.map((place, k) => this.#wheel(place, this.vehicle.angles[k], k));
    this.body = new Group(); // on springs it heaves and tilts over the ground
    this.body.add(this.#platform(), ...this.wheels.map((wheel) => wheel.group));
    this.group.add(this.body);
    if (run.forces) this.#addArrows();
  }

  #material(colour, more = {}) {
    const material = new MeshLambertMaterial({ color: colour, ...more });
    this.materials.push(material);
    return material;
  }

  #wheel(place, angle, wheel) {
    const { wheel_radius: radius } = this.run.own[wheel];
    const group = new Group();
    group.position.set(place[0], place[1], radius);
    group.rotation.z = angle;
    const disk = this.#disk(wheel);
    const rollers = this.#rollers(wheel);
    const width = 0.26 * radius;
    const patch = new Mesh(
      new RingGeometry(0.6 * width, 0.85 * width, 40),
      new MeshBasicMaterial({ color: this.colours.contact, transparent: true, opacity: 0.85, depthWrite: false }),
    );
    patch.position.z = 0.004 * radius - radius;
    group.add(disk, rollers, patch, this.#motor(wheel));
    return { group, disk, rollers, patch, marked: -1 };
  }

  /** What turns with the wheel but its rollers: a hub, brackets between the rollers, bolts of which one is coloured. */
  #disk(wheel) {
    const own = this.run.own[wheel];
    const slant = this.run.slant(wheel);
    const { wheel_radius: radius, roller_axis_radius: axis, row_offset: side = 0, rollers } = own;
    const thick = radius - axis;
    const width = slant ? 2 * halfWidth(own, slant) : 1.1 * thick + 2 * Math.abs(side);
    const bolted = slant ? 2 * PLATE * axis : 0;
    const hub = Math.max(axis - 1.02 * thick, 0.3 * radius);
    const disk = new Group();
    const metal = this.#material(this.colours.metal);
    const body = shadowed(new Mesh(new CylinderGeometry(hub, hub, width, 48).rotateZ(Math.PI / 2), metal));
    const joint = axis / Math.cos(Math.PI / rollers);
    const brackets = new InstancedMesh(
      new BoxGeometry(0.5 * thick, Math.min(0.05 * radius, (0.5 * axis) / rollers), joint - 0.9 * hub),
      metal,
      rollers,
    );
    const bolts = new InstancedMesh(
      new CylinderGeometry(0.07 * radius, 0.07 * radius, width + 0.12 * thick + bolted, 16).rotateZ(Math.PI / 2),
      this.#material("#ffffff"),
      5,
    );
    const matrix = new Matrix4();
    for (let k = 0; k < rollers; k++) {
      // between two rollers of a row: of two rows, where the other row has a roller
      const middle = new Matrix4().makeTranslation(-this.run.row(wheel, k), 0, -(joint + 0.9 * hub) / 2);
      brackets.setMatrixAt(k, matrix.makeRotationX(((2 * k + (side ? 0 : 1)) * Math.PI) / rollers).multiply(middle));
    }
    for (let k = 0; k < 5; k++) {
      const middle = new Matrix4().makeTranslation(0, 0, -0.66 * hub);
      bolts.setMatrixAt(k, matrix.makeRotationX((2 * k * Math.PI) / 5).multiply(middle));
      bolts.setColorAt(k, new Color(k ? this.colours.bolt : this.colours.accent));
    }
    disk.add(body, slant ? this.#plates(own, slant, metal) : shadowed(brackets), bolts);
    return disk;
  }

  /** The two plates that hold slanted rollers at their ends. */
  #plates(own, slant, metal) {
    const { roller_axis_radius: axis, rollers } = own;
    const reach = Math.hypot(axis, along(own, slant, Math.PI / rollers) * Math.cos(slant));
    const plates = new Group();
    for (const side of [-1, 1]) {
      const plate = new CylinderGeometry(reach, reach, PLATE * axis, 48).rotateZ(Math.PI / 2);
      plate.translate(side * halfWidth(own, slant), 0, 0);
      plates.add(shadowed(new Mesh(plate, metal)));
    }
    return plates;
  }

  #rollers(wheel) {
    const { rollers, wheels } = this.run.own[wheel];
    const instances = new InstancedMesh(
      barrel(this.run.own[wheel], this.run.slant(wheel), rollers * wheels > MANY ? 10 : 20),
      this.#material("#ffffff", { vertexColors: true }),
      rollers,
    );
    instances.instanceMatrix.setUsage(DynamicDrawUsage);
    instances.frustumCulled = false; // its bounds would be those of the first picture
    for (let k = 0; k < rollers; k++) instances.setColorAt(k, this.#rollerColour(k));
    return shadowed(instances);
  }

  /** Neighbours differ a little. */
  #rollerColour(roller) {
    return new Color(this.colours.roller).multiplyScalar(roller % 2 ? 0.72 : 1.15);
  }

  #motor(wheel) {
    const { wheel_radius: radius } = this.run.own[wheel];
    const length = 0.9 * radius;
    const motor = new CylinderGeometry(0.3 * radius, 0.3 * radius, length, 32).rotateZ(Math.PI / 2);
    motor.translate(-length / 2 - halfWidth(this.run.own[wheel], this.run.slant(wheel)), 0, 0);
    return shadowed(new Mesh(motor, this.#material(this.colours.motor)));
  }

  /** A plate whose edges face the wheels, with an arrow ahead. */
  #platform() {
    const { places, angles } = this.vehicle;
    const { own } = this.run;
    const radius = Math.max(...own.map((wheel) => wheel.wheel_radius));
    const corners = places.flatMap((place, k) => {
      const thick = own[k].wheel_radius - own[k].roller_axis_radius;
      const inset = 0.6 * thick + halfWidth(own[k], this.run.slant(k)) + 0.12 * radius;
      const [c, s] = [Math.cos(angles[k]), Math.sin(angles[k])];
      return [-1, 1].map((side) => [
        place[0] - inset * c - side * 0.55 * radius * s,
        place[1] - inset * s + side * 0.55 * radius * c,
      ]);
    });
    const size = Math.max(...corners.map(([x, y]) => Math.hypot(x, y)));
    const hull = convexHull(places.length < 3 ? [...corners, ...circle(0.6 * size)] : corners);
    const thickness = 0.13 * radius;
    const plate = new ExtrudeGeometry(rounded(hull, 0.3), {
      depth: thickness,
      bevelEnabled: true,
      bevelSize: 0.04 * radius,
      bevelThickness: 0.04 * radius,
      bevelSegments: 3,
    });
    const group = new Group();
    const deck = 0.42 * radius;
    const mesh = shadowed(new Mesh(plate, this.#material(this.colours.plate)));
    mesh.position.z = radius + deck;
    const arrow = new ExtrudeGeometry(arrowShape(0.62 * inner(hull)), { depth: 0.02 * radius, bevelEnabled: false });
    const ahead = new Mesh(arrow, this.#material(this.colours.accent));
    ahead.position.z = radius + deck + thickness + 0.045 * radius;
    group.add(mesh, ahead);
    const legs = places.map((place, k) => {
      const height = radius + deck - own[k].wheel_radius;
      const leg = new Mesh(new BoxGeometry(0.7 * radius, 0.42 * radius, height), this.#material(this.colours.motor));
      leg.position.set(
        place[0] - 0.65 * radius * Math.cos(angles[k]),
        place[1] - 0.65 * radius * Math.sin(angles[k]),
        own[k].wheel_radius + height / 2,
      );
      leg.rotation.z = angles[k];
      return shadowed(leg);
    });
    group.add(...legs);
    return group;
  }

  #addArrows() {
    const { wheel_radius: radius } = this.vehicle;
    const largest = this.run.largestForces();
    for (const [k, wheel] of this.wheels.entries()) {
      const ground = -this.run.own[k].wheel_radius;
      wheel.along = new Arrow(this.colours.force, 0.035 * radius, (2.1 * radius) / (largest.along || 1));
      wheel.load = new Arrow(this.colours.load, 0.035 * radius, (2.6 * radius) / (largest.upwards || 1));
      wheel.along.group.position.z = 0.06 * radius + ground;
      wheel.load.group.position.z = ground;
      wheel.group.add(wheel.along.group, wheel.load.group);
      if (!this.run.slip) continue;
      wheel.slip = new Arrow(this.colours.slip, 0.035 * radius, (2.1 * radius) / (this.run.largestSlip() || 1));
      wheel.slip.group.position.z = 0.03 * radius + ground;
      wheel.group.add(wheel.slip.group);
    }
  }

  /** Draws it translucent, or not. */
  fade(isFaded) {
    for (const material of this.materials) {
      Object.assign(material, { transparent: isFaded, opacity: isFaded ? FADED : 1 });
      material.needsUpdate = true;
    }
  }

  /** Moves the model to a state of its run. */
  pose(state, showForces) {
    const { run } = this;
    this.group.position.set(state.position[0], state.position[1], 0);
    this.group.rotation.z = state.heading;
    this.#tilt(run.tiltAt(state));
    const spins = run.spinAngles(state);
    const forces = run.forcesAt(state);
    const slip = run.slipAt(state);
    this.wheels.forEach((wheel, k) => {
      wheel.disk.rotation.x = run.rollerAngle(state, k, 0) % (2 * Math.PI);
      this.#placeRollers(wheel.rollers, state, k, spins);
      this.#mark(wheel, state.contact[k]);
      const side = run.contactSide(state, k);
      wheel.patch.position.x = side;
      if (!forces) return;
      for (const arrow of [wheel.along, wheel.load, wheel.slip]) if (arrow) arrow.group.position.x = side;
      wheel.along.set(ALONG.set(forces[3 * k], forces[3 * k + 1], 0), showForces);
      wheel.load.set(ALONG.set(0, 0, forces[3 * k + 2]), showForces);
      if (slip) wheel.slip.set(ALONG.set(slip[2 * k], slip[2 * k + 1], 0), showForces);
    });
  }

  /** Contact points stay where they are on the ground, and rise over it. */
  #tilt(tilt) {
    if (!tilt) return;
    const [x, y] = this.vehicle.center_of_mass;
    this.body.position.z = tilt[0] - y * tilt[1] + x * tilt[2];
    this.body.rotation.set(tilt[1], tilt[2], 0);
  }

  #placeRollers(rollers, state, wheel, spins) {
    const { rollers: count, roller_axis_radius: axis } = this.run.own[wheel];
    const target = rollers.instanceMatrix.array;
    const [cp, sp] = [Math.cos(this.run.slant(wheel)), Math.sin(this.run.slant(wheel))];
    for (let k = 0; k < count; k++) {
      const angle = this.run.rollerAngle(state, wheel, k);
      const spin = spins[wheel * this.run.rollers + k];
      const [c, s, cs, ss] = [Math.cos(angle), Math.sin(angle), Math.cos(spin), Math.sin(spin)];
      // about x by the angle, then down to the axis and out to the row, then about z by the slant, then about y by the
      // spin; columns one after the other
      target.set([cp * cs, s * ss - c * sp * cs, -c * ss - s * sp * cs, 0, sp, c * cp, s * cp, 0], 16 * k);
      target.set([cp * ss, -s * cs - c * sp * ss, c * cs - s * sp * ss, 0], 16 * k + 8);
      target.set([this.run.row(wheel, k), s * axis, -c * axis, 1], 16 * k + 12);
    }
    rollers.instanceMatrix.needsUpdate = true;
  }

  /** Gives the roller in contact its colour. */
  #mark(wheel, contact) {
    if (wheel.marked === contact) return;
    if (wheel.marked >= 0) wheel.rollers.setColorAt(wheel.marked, this.#rollerColour(wheel.marked));
    wheel.rollers.setColorAt(contact, new Color(this.colours.contact));
    wheel.rollers.instanceColor.needsUpdate = true;
    wheel.marked = contact;
  }

  /** The picture's rollers of a wheel, read off what is drawn: their axes, and their places along the axle. */
  drawnAxes(wheel) {
    const matrix = this.wheels[wheel].rollers.instanceMatrix.array;
    return Array.from({ length: this.run.own[wheel].rollers }, (_, k) => ({
      axis: Array.from(matrix.subarray(16 * k + 4, 16 * k + 7)),
      row: matrix[16 * k + 12],
    }));
  }

  /** Where the picture has a wheel's rollers: their angles from straight down, read off what is drawn. */
  drawnAngles(wheel) {
    const matrix = this.wheels[wheel].rollers.instanceMatrix.array;
    return Array.from({ length: this.run.own[wheel].rollers }, (_, k) =>
      Math.atan2(matrix[16 * k + 13], -matrix[16 * k + 14]),
    );
  }
}

function shadowed(mesh) {
  mesh.castShadow = true;
  mesh.receiveShadow = true;
  return mesh;
}
