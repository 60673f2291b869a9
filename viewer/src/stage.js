// The 3-D picture: ground, light, camera, paths and vehicles.

import {
  AmbientLight,
  Color,
  DirectionalLight,
  Fog,
  Group,
  HemisphereLight,
  Mesh,
  PCFShadowMap,
  PerspectiveCamera,
  PlaneGeometry,
  Scene,
  ShadowMaterial,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { Path } from "./path.js";
import { VehicleModel } from "./vehicle.js";

const FIELD = 35; // degrees
const SHADED = 1.7; // of the vehicle's size: how far around it the ground is shaded
const FADES = [1.1, 6]; // of the camera's distance: between these things fade into the ground's colour
const SQUARE = 0.16; // of the camera's distance: the largest square of the grid
const SQUARES = 60; // of the grid each way

export class Stage {
  /** context: of WebGL 2; look: colours by theme (theme.js) */
  constructor(canvas, context, runs, look) {
    this.canvas = canvas;
    this.runs = runs;
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.size = Math.max(...runs.map((run) => extent(run.vehicle)));
    this.camera = new PerspectiveCamera(FIELD, 1, 0.02 * this.size, 400 * this.size);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { maxPolarAngle: 1.53, minDistance: 0.25 * this.size, maxDistance: 150 * this.size });
    this.controls.addEventListener("change", () => this.onchange?.());
    this.beside = false;
    this.showForces = true;
    this.follow = "follow";
    this.heading = null;
    this.restyle(look);
  }

  /** Builds everything in the colours of a theme. */
  restyle(look) {
    this.#dispose();
    this.scene = new Scene();
    this.scene.background = new Color(look.ground);
    this.scene.fog = new Fog(look.ground);
    this.#addLight(look);
    this.#addGround(look);
    this.parts = this.runs.map((run, k) => {
      const model = new VehicleModel(run, { ...look.vehicle, accent: look.runs[k] });
      const path = new Path(run, look.runs[k], this.size);
      const group = new Group();
      group.add(model.group, path.group);
      this.scene.add(group);
      return { run, model, path, group };
    });
    this.stand(this.beside);
  }

  /** Frees what the graphics card holds. */
  #dispose() {
    this.scene?.traverse(({ geometry, material }) => {
      geometry?.dispose();
      material?.dispose();
    });
  }

  #addLight(look) {
    this.scene.add(new HemisphereLight(look.sky, look.bounce, look.ambient), new AmbientLight("#ffffff", 0.25));
    this.sun = new DirectionalLight("#ffffff", look.sun);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.radius = 5;
    this.sun.shadow.bias = -0.0005;
    this.sun.shadow.normalBias = 0.01 * this.size;
    const box = this.sun.shadow.camera;
    const reach = SHADED * this.size;
    Object.assign(box, { left: -reach, right: reach, top: reach, bottom: -reach });
    Object.assign(box, { near: 0.1 * this.size, far: 9 * this.size });
    this.scene.add(this.sun, this.sun.target);
  }

  #addGround(look) {
    this.ground = new Group();
    this.ground.add(gridLines(false, look.line), gridLines(true, look.fifth));
    const near = new PlaneGeometry(2 * SHADED * this.size, 2 * SHADED * this.size);
    this.shadows = new Mesh(near, new ShadowMaterial({ opacity: look.shadow }));
    this.shadows.receiveShadow = true;
    this.shadows.position.z = 1e-4 * this.size;
    this.scene.add(this.ground, this.shadows);
  }

  resize(width, height, ratio) {
    this.width = width;
    this.height = height;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    const across = width / this.columns;
    for (const { path } of this.parts) path.resize(across, height);
    for (const lines of this.ground.children) lines.material.resolution.set(across, height);
  }

  /** Side by side, or over each other: then the first run's vehicle is solid. */
  stand(beside) {
    this.beside = beside;
    this.parts.forEach(({ model }, k) => model.fade(!beside && k > 0));
  }

  get columns() {
    return this.beside ? this.runs.length : 1;
  }

  /** Sets the camera: follow, ride (turns with the vehicle), path (all of it), or the number of a wheel. */
  view(follow) {
    this.follow = follow;
    this.heading = null;
    const state = this.states?.[0];
    if (!state) return;
    const target = this.#target(state);
    const away = this.#away(state);
    this.controls.target.copy(target);
    this.camera.position.copy(target).add(away);
    this.controls.update();
  }

  #target(state) {
    const { vehicle } = this.runs[0];
    if (this.follow === "path") return this.#wholePath().middle;
    const [x, y] = state.position;
    const target = new Vector3(x, y, 0.8 * vehicle.wheel_radius);
    const wheel = Number(this.follow);
    if (Number.isInteger(wheel)) {
      const place = vehicle.places[wheel];
      const [c, s] = [Math.cos(state.heading), Math.sin(state.heading)];
      target.set(x + c * place[0] - s * place[1], y + s * place[0] + c * place[1], 1.05 * vehicle.wheel_radius);
    }
    return target;
  }

  #away(state) {
    const { vehicle } = this.runs[0];
    const wheel = Number(this.follow);
    const narrow = Math.max(1, (0.93 * this.height * this.columns) / this.width);
    if (this.follow === "path") {
      const { span } = this.#wholePath();
      return new Vector3(-0.35, -0.75, 1).normalize().multiplyScalar(2.1 * Math.max(span, 2 * this.size) * narrow);
    }
    if (Number.isInteger(wheel)) {
      const angle = state.heading + vehicle.angles[wheel] - 0.45;
      const level = new Vector3(Math.cos(angle), Math.sin(angle), 0.28);
      return level.multiplyScalar(6 * vehicle.wheel_radius * Math.max(1, 0.9 * narrow));
    }
    const angle = this.follow === "ride" ? state.heading + Math.PI - 0.5 : state.heading - 0.85;
    return new Vector3(Math.cos(angle), Math.sin(angle), 0.78).normalize().multiplyScalar(4.5 * this.size * narrow);
  }

  #wholePath() {
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const { path } of this.parts) {
      [left, right] = [Math.min(left, path.box[0]), Math.max(right, path.box[1])];
      [low, high] = [Math.min(low, path.box[2]), Math.max(high, path.box[3])];
    }
    return { middle: new Vector3((left + right) / 2, (low + high) / 2, 0), span: Math.max(right - left, high - low) };
  }

  /** Moves everything to a time. */
  move(time) {
    const first = !this.states;
    this.states = this.runs.map((run) => run.at(time));
    this.parts.forEach(({ model, path }, k) => {
      model.pose(this.states[k], this.showForces);
      path.move(this.states[k]);
    });
    if (first) this.view(this.follow);
    else this.#carryCamera();
  }

  /** Keeps what is looked at where it is in the picture. */
  #carryCamera() {
    const state = this.states[0];
    const turns = this.follow === "ride" || Number.isInteger(Number(this.follow));
    const shift = this.#target(state).sub(this.lastTarget ?? this.#target(state));
    if (this.follow !== "path") {
      const away = this.camera.position.clone().sub(this.controls.target);
      this.controls.target.add(shift);
      if (turns && this.heading !== null) away.applyAxisAngle(this.camera.up, state.heading - this.heading);
      this.camera.position.copy(this.controls.target).add(away);
    }
    this.lastTarget = this.#target(state);
    this.heading = state.heading;
  }

  draw() {
    this.controls.update();
    this.lastTarget = this.#target(this.states[0]);
    this.heading = this.states[0].heading;
    const { renderer, camera, columns, width, height } = this;
    renderer.setScissorTest(columns > 1);
    for (let k = 0; k < columns; k++) {
      const across = width / columns;
      renderer.setViewport(k * across, 0, across, height);
      renderer.setScissor(k * across, 0, across, height);
      camera.aspect = across / height;
      camera.updateProjectionMatrix();
      this.parts.forEach(({ group }, part) => (group.visible = columns === 1 || part === k));
      const moved = this.#aside(k);
      camera.position.add(moved);
      this.#light(this.states[k]);
      this.#layGround(this.states[k].position);
      renderer.render(this.scene, camera);
      camera.position.sub(moved);
    }
  }

  /** Side by side each picture shows its own vehicle from the same side. */
  #aside(k) {
    if (k === 0 || this.follow === "path") return new Vector3();
    const [first, own] = [this.states[0].position, this.states[k].position];
    return new Vector3(own[0] - first[0], own[1] - first[1], 0);
  }

  #light(state) {
    const [x, y] = state.position;
    this.sun.target.position.set(x, y, 0);
    this.sun.position.set(x - 1.2 * this.size, y - 1.6 * this.size, 4 * this.size);
    this.shadows.position.set(x, y, this.shadows.position.z);
  }

  /** Squares as large as the view asks for; they go with the vehicle in whole squares, so that lines stay in place. */
  #layGround([x, y]) {
    const away = this.camera.position.distanceTo(this.controls.target);
    this.grid = roundNumber(SQUARE * away);
    const middle = this.follow === "path" ? this.controls.target.toArray() : [x, y];
    const [left, low] = middle.map((place) => Math.round(place / (5 * this.grid)) * 5 * this.grid);
    this.ground.position.set(left, low, 0);
    this.ground.scale.set(this.grid, this.grid, 1);
    [this.scene.fog.near, this.scene.fog.far] = FADES.map((factor) => factor * away);
  }

  /** Pictures that take less time. False where they are as plain as they get. */
  simplify() {
    if (!this.sun.castShadow) return false;
    this.sun.castShadow = false;
    this.shadows.visible = false;
    return true;
  }

  /** Turns the view by the keyboard. */
  orbit(left, up) {
    this.controls.rotateLeft(left);
    this.controls.rotateUp(up);
    this.controls.update();
    this.onchange?.();
  }

  zoom(factor) {
    if (factor > 1) this.controls.dollyOut(factor);
    else this.controls.dollyIn(1 / factor);
    this.controls.update();
    this.onchange?.();
  }
}

/** The radius of a vehicle with its wheels, in m. */
function extent(vehicle) {
  return Math.max(...vehicle.places.map(([x, y]) => Math.hypot(x, y))) + 0.7 * vehicle.wheel_radius;
}

/** The number 1, 2 or 5 times a power of ten that is next below. */
function roundNumber(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].find((digit) => digit * power <= value) * power;
}

/** Lines of unit squares around the origin: every fifth line, or all the others. */
function gridLines(fifth, colour) {
  const places = [];
  for (let k = -SQUARES; k <= SQUARES; k++) {
    if ((k % 5 === 0) === fifth) places.push(k, -SQUARES, 0, k, SQUARES, 0, -SQUARES, k, 0, SQUARES, k, 0);
  }
  const geometry = new LineSegmentsGeometry().setPositions(places);
  const lines = new LineSegments2(
    geometry,
    new LineMaterial({ color: colour, linewidth: 1.4, depthWrite: false, fog: true }),
  );
  lines.frustumCulled = false;
  lines.renderOrder = -1;
  return lines;
}
