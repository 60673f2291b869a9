// The 3-D picture: ground, light, camera, paths and vehicles.

import {
  AmbientLight,
  Box2,
  Color,
  DirectionalLight,
  Fog,
  Group,
  HemisphereLight,
  Mesh,
  PCFShadowMap,
  PlaneGeometry,
  Scene,
  ShadowMaterial,
  Vector3,
  WebGLRenderer,
} from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { Eye } from "./eye.js";
import { Path } from "./path.js";
import { VehicleModel } from "./vehicle.js";

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
    this.eye = new Eye(canvas, runs[0].vehicle, this.size, () => this.onchange?.());
    this.beside = false;
    this.showForces = true;
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
    this.eye.box = this.parts.reduce((box, { path }) => box.union(path.box), new Box2());
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

  /** Sets the view: follow, ride (turns with the vehicle), path (all of it), or the number of a wheel. */
  view(name) {
    if (this.states) this.eye.view(name, this.states[0], this.width / this.columns / this.height);
  }

  /** Moves everything to a time. */
  move(time) {
    const first = !this.states;
    this.states = this.runs.map((run) => run.at(time));
    this.parts.forEach(({ model, path }, k) => {
      model.pose(this.states[k], this.showForces);
      path.move(this.states[k]);
    });
    if (first) this.view("follow");
    else this.eye.carry(this.states[0]);
  }

  draw() {
    const { renderer, columns, width, height } = this;
    const { camera } = this.eye;
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
    if (k === 0 || this.eye.isStill) return new Vector3();
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
    const away = this.eye.distance;
    this.grid = roundNumber(SQUARE * away);
    const middle = this.eye.isStill ? this.eye.controls.target.toArray() : [x, y];
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
