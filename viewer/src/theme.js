// Light and dark: colours of what is drawn. Those of the page around it are in viewer.css.

const LIGHT = {
  runs: ["#c2570c", "#1d5fb4", "#15803d", "#7c3aed"],
  series: ["#c2570c", "#1d5fb4", "#15803d", "#7c3aed", "#a16207", "#0e7490"],
  ground: "#f1f3f6",
  line: "#d5dbe4",
  fifth: "#aeb9c8",
  sky: "#ffffff",
  bounce: "#c9cfd8",
  ambient: 1.7,
  sun: 2.0,
  shadow: 0.24,
  text: "#334155",
  axis: "#cbd5e1",
  grid: "#e5e9f0",
  tick: "#94a3b8",
  vehicle: {
    roller: "#4a5567",
    metal: "#dfe4ec",
    motor: "#6b7686",
    plate: "#e6eaf1",
    bolt: "#5d6878",
    contact: "#f59e0b",
    force: "#be185d",
    slip: "#15803d",
    load: "#0369a1",
  },
};

const DARK = {
  runs: ["#fb923c", "#60a5fa", "#4ade80", "#c4b5fd"],
  series: ["#fb923c", "#60a5fa", "#4ade80", "#c4b5fd", "#facc15", "#22d3ee"],
  ground: "#10151d",
  line: "#232d3b",
  fifth: "#3d4b5f",
  sky: "#dfe9ff",
  bounce: "#222a36",
  ambient: 1.0,
  sun: 1.9,
  shadow: 0.5,
  text: "#cbd5e1",
  axis: "#334155",
  grid: "#1f2937",
  tick: "#64748b",
  vehicle: {
    roller: "#5a6577",
    metal: "#9aa6b8",
    motor: "#3c4656",
    plate: "#2a3442",
    bolt: "#222b38",
    contact: "#fbbf24",
    force: "#f472b6",
    slip: "#4ade80",
    load: "#38bdf8",
  },
};

const system = matchMedia("(prefers-color-scheme: dark)");

/** The theme that is on, and a way to change it. */
export class Theme {
  constructor(onchange) {
    this.onchange = onchange;
    this.chosen = null;
    system.addEventListener("change", () => this.#apply());
    this.#apply();
  }

  get isDark() {
    return (this.chosen ?? (system.matches ? "dark" : "light")) === "dark";
  }

  get look() {
    return this.isDark ? DARK : LIGHT;
  }

  toggle() {
    this.chosen = this.isDark ? "light" : "dark";
    this.#apply();
  }

  #apply() {
    document.documentElement.dataset.theme = this.isDark ? "dark" : "light";
    this.look.runs.forEach((colour, k) => document.documentElement.style.setProperty(`--run-${k}`, colour));
    this.onchange?.();
  }
}
