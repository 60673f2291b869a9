// Speeds, energy and ledger over time, with the cursor of the time and the switches as ticks. uPlot draws the lines.

import uPlot from "uplot";

const HEIGHT = 168;
const NEAR = 6; // px: a click that is so near to a switch means the switch
const DASHES = [[], [7, 4], [2, 3], [10, 3, 2, 3]];
const POINTS = 4; // of speeds in each piece

/** Panels: title, unit, lines {label, run, quantity, times, values}. */
export function panelsOf(runs) {
  const speeds = runs.map(speedsOf);
  const energy = scaled(runs.map((run) => run.energy));
  const entries = [...new Set(runs.flatMap((run) => Object.keys(run.ledger_words)))];
  const words = Object.assign({}, ...runs.map((run) => run.ledger_words));
  const ledger = scaled(
    runs.flatMap((run) => Object.keys(run.ledger_words).map((_, k) => row(run.ledger, k, run.row_time.length))),
  );
  const lines = (label, quantity, times, values) =>
    runs.map((_, k) => ({ label, run: k, quantity, times: times(k), values: values(k) }));
  const of = (name) => [(k) => speeds[k].time, (k) => speeds[k][name]];
  return [
    {
      title: "Speed of the centre",
      unit: "m/s",
      lines: [...lines("ahead", 0, ...of("ahead")), ...lines("to the left", 1, ...of("left"))],
    },
    { title: "Yaw rate", unit: "rad/s", lines: lines("yaw rate", 0, ...of("yaw")) },
    {
      title: "Kinetic energy",
      unit: energy.unit,
      lines: lines(
        "energy",
        0,
        (k) => runs[k].energy_time,
        (k) => energy.scale(runs[k].energy),
      ),
    },
    {
      title: "Energy gained since the start",
      unit: ledger.unit,
      lines: entries.flatMap((entry, quantity) =>
        lines(
          words[entry],
          quantity,
          (k) => runs[k].row_time,
          (k) => {
            const place = Object.keys(runs[k].ledger_words).indexOf(entry);
            return place < 0 ? null : ledger.scale(row(runs[k].ledger, place, runs[k].row_time.length));
          },
        ).filter((line) => line.values),
      ),
    },
  ];
}

function speedsOf(run) {
  const curves = { time: [], ahead: [], left: [], yaw: [] };
  for (const state of run.states(POINTS)) {
    curves.time.push(state.time);
    curves.ahead.push(state.speed[0]);
    curves.left.push(state.speed[1]);
    curves.yaw.push(state.yawRate);
  }
  return curves;
}

const row = (table, k, length) => table.subarray(k * length, (k + 1) * length);

/** A unit in which energies are handy numbers. */
function scaled(arrays) {
  const largest = arrays.reduce((most, array) => array.reduce((a, b) => Math.max(a, Math.abs(b)), most), 0);
  const [factor, unit] = [
    [1, "J"],
    [1e3, "mJ"],
    [1e6, "µJ"],
  ].find(([factor]) => largest * factor >= 0.5) ?? [1e6, "µJ"];
  return { unit, scale: (array) => Float64Array.from(array, (value) => factor * value) };
}

/** Times that grow strictly, as uPlot wants them: the second row of a switch comes a hair later. */
function separated(times) {
  const hair = 1e-9 * (times[times.length - 1] - times[0] || 1);
  const result = Float64Array.from(times);
  for (let k = 1; k < result.length; k++) if (result[k] <= result[k - 1]) result[k] = result[k - 1] + hair;
  return result;
}

export class Plots {
  /** place: element; runs; look; jump(time) is called by clicks */
  constructor(place, runs, look, jump) {
    Object.assign(this, { place, runs, jump, time: 0 });
    this.panels = panelsOf(runs);
    this.figures = this.panels.map((panel) => this.#figure(panel));
    place.replaceChildren(...this.figures.map(({ figure }) => figure));
    this.restyle(look);
    new ResizeObserver(() => this.#fit()).observe(place);
  }

  #figure(panel) {
    const figure = document.createElement("figure");
    const caption = document.createElement("figcaption");
    const key = document.createElement("ul");
    const name = document.createElement("strong");
    name.textContent = panel.title;
    const unit = document.createElement("span");
    unit.textContent = ` ${panel.unit}`;
    caption.append(name, unit);
    const items = new Map(); // one for each quantity, with a value for each run
    panel.values = panel.lines.map((line) => {
      const item = items.get(line.quantity) ?? document.createElement("li");
      if (!items.has(line.quantity)) item.append(line.label, " ");
      items.set(line.quantity, item);
      const value = document.createElement("output");
      value.title = `${line.label}, ${this.runs[line.run].label}`;
      item.dataset.runs = this.runs.length > 1 ? "many" : "one";
      item.append(value);
      return value;
    });
    key.append(...items.values());
    const chart = document.createElement("div");
    figure.append(caption, key, chart);
    return { figure, chart };
  }

  colour(line) {
    return this.runs.length > 1 ? this.look.runs[line.run] : this.look.series[line.quantity];
  }

  /** Several runs have colours; their quantities have dashes. */
  #dash(line) {
    return this.runs.length > 1 ? DASHES[line.quantity % DASHES.length] : [];
  }

  restyle(look) {
    this.look = look;
    this.charts?.forEach((chart) => chart.destroy());
    this.charts = this.panels.map((panel, k) => {
      panel.lines.forEach((line, j) => {
        const item = panel.values[j].parentElement;
        (this.runs.length > 1 ? panel.values[j] : item).style.setProperty("--colour", this.colour(line));
        item.dataset.dashed = this.#dash(line).length > 0;
      });
      return this.#chart(panel, this.figures[k].chart);
    });
    this.move(this.time);
  }

  #chart(panel, place) {
    const tables = panel.lines.map((line) => [separated(line.times), line.values]);
    const axis = {
      stroke: this.look.text,
      grid: { stroke: this.look.grid, width: 1 },
      ticks: { stroke: this.look.axis, width: 1, size: 4 },
      font: "11px system-ui, sans-serif",
    };
    const options = {
      width: this.#width,
      height: HEIGHT,
      legend: { show: false },
      cursor: { sync: { key: "omniroll" }, drag: { x: true, y: false }, points: { size: 6 } },
      scales: { x: { time: false }, y: { range: (_, low, high) => range(low, high) } },
      axes: [
        { ...axis, size: 26, values: (_, splits) => splits.map((split, k) => (k ? `${split}` : `${split} s`)) },
        { ...axis, size: 52, values: (_, splits) => splits.map((split) => `${+split.toPrecision(5)}`) },
      ],
      series: [{}, ...panel.lines.map((line) => this.#series(line))],
      hooks: { draw: [(chart) => this.#drawSwitches(chart), (chart) => this.#placeCursor(chart)] },
    };
    const chart = new uPlot(options, uPlot.join(tables), place);
    this.#addCursor(chart);
    return chart;
  }

  #series(line) {
    return { stroke: this.colour(line), width: 1.6, dash: this.#dash(line), spanGaps: true, points: { show: false } };
  }

  #drawSwitches(chart) {
    const { ctx, bbox } = chart;
    const ratio = devicePixelRatio;
    const all = this.runs[0].switchTimes;
    const shown = all.filter((time) => time >= chart.scales.x.min && time <= chart.scales.x.max);
    ctx.save();
    ctx.fillStyle = this.look.tick;
    ctx.globalAlpha = Math.min(1, Math.max(0.25, 150 / (shown.length || 1)));
    for (const time of shown)
      ctx.fillRect(chart.valToPos(time, "x", true) - ratio / 2, bbox.top + bbox.height - 7 * ratio, ratio, 7 * ratio);
    ctx.restore();
  }

  #addCursor(chart) {
    const line = document.createElement("div");
    line.className = "now";
    chart.over.append(line);
    chart.now = line;
    let pressed = null;
    chart.over.addEventListener("pointerdown", (event) => (pressed = event.clientX));
    chart.over.addEventListener("click", (event) => {
      if (pressed === null || Math.abs(event.clientX - pressed) > 4) return; // a drag zooms
      const left = event.clientX - chart.over.getBoundingClientRect().left;
      this.jump(this.#nearSwitch(chart, left) ?? chart.posToVal(left, "x"));
    });
  }

  #placeCursor(chart) {
    chart.now.style.transform = `translateX(${chart.valToPos(this.time, "x")}px)`;
  }

  #nearSwitch(chart, left) {
    let [best, distance] = [null, NEAR];
    for (const time of this.runs[0].switchTimes) {
      const away = Math.abs(chart.valToPos(time, "x") - left);
      if (away < distance) [best, distance] = [time, away];
    }
    return best;
  }

  get #width() {
    return Math.max(this.figures[0].figure.clientWidth, 200);
  }

  #fit() {
    for (const chart of this.charts) chart.setSize({ width: this.#width, height: HEIGHT });
    this.move(this.time);
  }

  move(time) {
    this.time = time;
    this.charts.forEach((chart, k) => {
      this.#placeCursor(chart);
      this.panels[k].lines.forEach((line, j) => (this.panels[k].values[j].textContent = at(line, time)));
    });
  }
}

/** The value of a line at a time, in a few digits. */
function at({ times, values }, time) {
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle - 1;
  }
  const next = Math.min(low + 1, times.length - 1);
  const part = times[next] > times[low] ? Math.min((time - times[low]) / (times[next] - times[low]), 1) : 0;
  const value = values[low] + (values[next] - values[low]) * part;
  return Math.abs(value) < 1e-9 ? "0" : value.toPrecision(4);
}

/** The range of an axis; what is constant but for rounding is drawn flat. */
function range(low, high) {
  if (low === null) return [0, 1];
  const middle = (low + high) / 2;
  const half = Math.max((high - low) / 2, 1e-3 * Math.abs(middle), 1e-6);
  return [middle - 1.12 * half, middle + 1.12 * half];
}
