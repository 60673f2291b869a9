// The page: makes runs of its data, and ties picture, plots and controls to one time.

import { FlatStage } from "./flat.js";
import { Plots } from "./plots.js";
import { Run } from "./run.js";
import { Stage } from "./stage.js";
import { Theme } from "./theme.js";
import { Transport } from "./transport.js";
import { unpacked } from "./unpacking.js";

const RATIOS = [0.5, 2]; // pixels of the picture per pixel of the page
const SLOW = 0.07; // s between two pictures, beyond which they are drawn more simply
const SMOOTH = 0.25; // weight of the last of these times in their mean

const element = (id) => document.getElementById(id);

class Page {
  constructor(buffer) {
    const { description, arrays } = unpacked(buffer);
    this.runs = description.runs.map((one, k) => new Run(one, only(arrays, `${k}/`)));
    this.theme = new Theme(() => this.#restyle());
    this.transport = new Transport(this.runs, (time) => this.#move(time));
    this.ratio = Math.min(devicePixelRatio, RATIOS[1]);
    this.took = 0;
    this.stage = this.#makeStage();
    this.stage.onchange = () => this.#redraw();
    this.#describe();
    this.#resize();
    this.#addViews(); // moves the vehicles to the start, too
    new ResizeObserver(() => this.#resize()).observe(element("picture"));
    requestAnimationFrame(() => setTimeout(() => this.#addPlots())); // after the first picture
    addEventListener("keydown", (event) => this.#key(event));
    element("theme").addEventListener("click", () => this.theme.toggle());
    element("help").addEventListener("click", () => element("keys").showModal());
  }

  /** 3-D, or from above where there is no WebGL. */
  #makeStage() {
    const canvas = element("stage");
    const context = canvas.getContext("webgl2", { antialias: true, alpha: true, powerPreference: "high-performance" });
    if (context) return new Stage(canvas, context, this.runs, this.theme.look);
    canvas.setAttribute("aria-label", "The vehicle from above, and its wheels from outside");
    return new FlatStage(canvas, this.runs, this.theme.look);
  }

  #describe() {
    const items = this.runs.map((run, k) => {
      const item = document.createElement("li");
      item.innerHTML = `<span class="swatch" style="--colour: var(--run-${k})"></span><span class="name"></span> `;
      item.querySelector(".name").textContent = run.label;
      item.append(`${run.switches} switches in ${+run.duration.toPrecision(4)} s`);
      return item;
    });
    element("about").replaceChildren(...items);
    if (this.stage.isFlat) {
      const note = document.createElement("li");
      note.textContent = "This browser has no WebGL: shown flat";
      element("about").append(note);
    }
  }

  #addViews() {
    const { wheels } = this.runs[0];
    const views = [
      ["follow", "follow"],
      ["ride", "ride along"],
      ["path", "whole path"],
    ];
    for (let k = 0; k < Math.min(wheels, 12); k++) views.push([`${k}`, `wheel ${k + 1}`]);
    this.camera = element("camera");
    this.camera.replaceChildren(...views.map(([value, text]) => new Option(text, value)));
    this.camera.addEventListener("change", () => this.#see());
    this.camera.parentElement.hidden = Boolean(this.stage.isFlat);
    element("side").hidden = this.runs.length < 2 || Boolean(this.stage.isFlat);
    element("beside").addEventListener("change", (event) => {
      this.stage.stand(event.target.value === "beside");
      this.#resize();
      this.#see();
    });
    element("arrows").hidden = !this.runs.some((run) => run.forces) || Boolean(this.stage.isFlat);
    element("forces").addEventListener("change", () => this.#showForces());
    this.#showForces();
  }

  #see() {
    this.stage.view(this.camera.value);
    const names = this.stage.beside ? this.runs.map((run) => run.label) : [];
    element("names").replaceChildren(
      ...names.map((name) => Object.assign(document.createElement("span"), { textContent: name })),
    );
    this.#redraw();
  }

  #showForces() {
    this.stage.showForces = element("forces").checked;
    this.#move(this.transport.time);
  }

  /** What the colours of the picture mean, and its numbers. */
  #legend() {
    const state = this.stage.states[0];
    const rows = [`${Math.hypot(...state.speed).toFixed(3)} m/s, ${state.yawRate.toFixed(3)} rad/s`];
    if (this.stage.grid) rows.push(`squares of ${+this.stage.grid.toPrecision(1)} m`);
    const colours = this.theme.look.vehicle;
    const marks = [[colours.contact, "roller in contact"]];
    if (this.runs[0].forces && this.stage.showForces && !this.stage.isFlat) {
      const { along, upwards } = this.runs[0].largestForces();
      if (upwards > 0) marks.push([colours.load, `load, at most ${upwards.toPrecision(3)} N`]);
      marks.push([colours.force, `force along the ground, at most ${along.toPrecision(3)} N`]);
      if (this.runs[0].slip) {
        marks.push([colours.slip, `slip, at most ${this.runs[0].largestSlip().toPrecision(3)} m/s`]);
      }
    }
    const text = JSON.stringify([rows, marks]);
    if (text === this.legend) return;
    this.legend = text;
    element("legend").replaceChildren(
      ...marks.map(([colour, words]) => {
        const item = document.createElement("li");
        item.innerHTML = `<span class="swatch" style="--colour: ${colour}"></span>`;
        item.append(words);
        return item;
      }),
      ...rows.map((row) => Object.assign(document.createElement("li"), { textContent: row })),
    );
  }

  #addPlots() {
    this.plots = new Plots(element("plots"), this.runs, this.theme.look, (time) => this.transport.go(time));
    this.plots.move(this.transport.time);
  }

  #move(time) {
    if (!this.stage) return;
    this.stage.move(time);
    this.plots?.move(time);
    this.#redraw();
  }

  /** Draws once, however often it is asked for before the next picture. */
  #redraw() {
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = null;
      this.#draw();
    });
  }

  #draw() {
    this.stage.draw();
    this.#legend();
    if (this.transport.isPlaying) this.#keepPace(this.transport.interval);
    if (this.drawn) return;
    this.drawn = true;
    performance.mark("omniroll: first picture");
    document.documentElement.dataset.drawn = "true";
  }

  /** Simpler pictures where they are slow to come. */
  #keepPace(interval) {
    this.took += SMOOTH * (interval - this.took);
    if (this.took < SLOW || this.stage.isFlat) return;
    this.took = 0;
    if (this.stage.simplify() || this.ratio <= RATIOS[0]) return;
    this.ratio = Math.max(RATIOS[0], 0.75 * this.ratio);
    this.#resize();
  }

  #resize() {
    const { clientWidth, clientHeight } = element("picture");
    this.stage.resize(clientWidth, clientHeight, this.ratio);
    if (this.stage.states) this.#redraw();
  }

  #restyle() {
    if (!this.stage) return; // the first look is given where things are made
    this.stage.restyle(this.theme.look);
    this.#resize();
    this.plots?.restyle(this.theme.look);
    this.transport.drawTicks();
    this.#move(this.transport.time);
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || element("keys").open) return;
    const { target } = event;
    if (target.matches("select") || (target.matches("button") && event.key === " ")) return;
    const done =
      (target.id === "stage" && this.stage.eye && this.#orbitKey(event.key)) ||
      this.#pageKey(event.key) ||
      this.transport.key(event);
    if (done) event.preventDefault();
  }

  #orbitKey(key) {
    const turns = { ArrowLeft: [0.08, 0], ArrowRight: [-0.08, 0], ArrowUp: [0, 0.06], ArrowDown: [0, -0.06] };
    const zooms = { "+": 1 / 1.15, "=": 1 / 1.15, "-": 1.15 };
    if (turns[key]) this.stage.eye.orbit(...turns[key]);
    else if (zooms[key]) this.stage.eye.zoom(zooms[key]);
    return Boolean(turns[key] || zooms[key]);
  }

  #pageKey(key) {
    const actions = {
      "?": () => element("help").click(),
      d: () => this.theme.toggle(),
      f: () => element("forces").click(),
      c: () => {
        this.camera.selectedIndex = (this.camera.selectedIndex + 1) % this.camera.length;
        this.#see();
      },
    };
    actions[key]?.();
    return key in actions;
  }
}

/** The arrays whose names begin so, without it. */
function only(arrays, prefix) {
  const own = Object.entries(arrays).filter(([name]) => name.startsWith(prefix));
  return Object.fromEntries(own.map(([name, array]) => [name.slice(prefix.length), array]));
}

globalThis.omniroll = { show: (buffer) => (globalThis.omniroll.page = new Page(buffer)) };
