// The time: played, paused, set by the slider, the keys, the switches.

const FRAME = 1 / 60; // s of the clock on the wall
const LONGEST = 0.5; // s: a page that was asleep goes on where it was

const element = (id) => document.getElementById(id);

export class Transport {
  /** move(time) is called at every change; times in s since the start */
  constructor(runs, move) {
    Object.assign(this, { runs, move, time: 0, isPlaying: false });
    this.duration = Math.max(...runs.map((run) => run.duration));
    this.switches = [...new Set(runs.flatMap((run) => run.switchTimes))].sort((a, b) => a - b);
    this.slider = element("time");
    this.slider.max = this.duration;
    this.speed = element("speed");
    this.slider.addEventListener("input", () => this.go(Number(this.slider.value)));
    element("play").addEventListener("click", () => this.toggle());
    element("before").addEventListener("click", () => this.goToSwitch(-1));
    element("after").addEventListener("click", () => this.goToSwitch(1));
    for (const id of ["before", "after"]) element(id).disabled = this.switches.length === 0;
    this.digits = Math.max(3, 3 - Math.floor(Math.log10(this.duration || 1)));
    new ResizeObserver(() => this.drawTicks()).observe(element("track"));
    this.#show();
  }

  /** Sets the time. */
  go(time) {
    this.time = Math.min(Math.max(time, 0), this.duration);
    this.#show();
    this.move(this.time);
  }

  /** To the next switch (direction 1) or the one before (-1): the state after it. */
  goToSwitch(direction) {
    const later = this.switches.findIndex((time) => time > this.time);
    const next = later < 0 ? this.switches.length : later;
    const on = this.switches[next - 1] === this.time;
    const place = direction > 0 ? next : next - (on ? 2 : 1);
    this.pause();
    this.go(this.switches[place] ?? (direction > 0 ? this.duration : 0));
  }

  toggle() {
    if (this.isPlaying) this.pause();
    else this.play();
  }

  play() {
    if (this.time >= this.duration) this.go(0);
    this.#set(true);
    let last = null;
    const tick = (now) => {
      if (!this.isPlaying) return;
      this.interval = last === null ? 0 : Math.min((now - last) / 1000, LONGEST);
      last = now;
      this.go(this.time + this.interval * Number(this.speed.value));
      if (this.time >= this.duration) this.pause();
      else this.frame = requestAnimationFrame(tick);
    };
    cancelAnimationFrame(this.frame);
    this.frame = requestAnimationFrame(tick);
  }

  pause() {
    this.#set(false);
  }

  #set(isPlaying) {
    this.isPlaying = isPlaying;
    const button = element("play");
    button.dataset.on = isPlaying;
    button.setAttribute("aria-label", isPlaying ? "Pause" : "Play");
  }

  #show() {
    this.slider.value = this.time;
    const clock = this.runs[0].start_time + this.time;
    const text = `${clock.toFixed(this.digits)} s`;
    element("clock").textContent = text;
    this.slider.setAttribute("aria-valuetext", text);
    element("play").dataset.on = this.isPlaying;
  }

  /** What a key does; whether it did anything. */
  key({ key, shiftKey }) {
    const step = (shiftKey ? 1 : FRAME * Number(this.speed.value)) || FRAME;
    const actions = {
      " ": () => this.toggle(),
      ArrowRight: () => this.go(this.time + step),
      ArrowLeft: () => this.go(this.time - step),
      "]": () => this.goToSwitch(1),
      "[": () => this.goToSwitch(-1),
      Home: () => this.go(0),
      End: () => this.go(this.duration),
      ".": () => this.#changeSpeed(1),
      ",": () => this.#changeSpeed(-1),
    };
    actions[key]?.();
    return key in actions;
  }

  #changeSpeed(by) {
    this.speed.selectedIndex = Math.min(Math.max(this.speed.selectedIndex + by, 0), this.speed.length - 1);
  }

  /** The switches of each wheel of each run as ticks around the slider. */
  drawTicks() {
    const canvas = element("ticks");
    const { clientWidth: width, clientHeight: height } = canvas;
    canvas.width = width * devicePixelRatio;
    canvas.height = height * devicePixelRatio;
    const context = canvas.getContext("2d");
    context.scale(devicePixelRatio, devicePixelRatio);
    const styles = getComputedStyle(document.documentElement);
    this.runs.forEach((run, k) => {
      context.fillStyle =
        this.runs.length > 1 ? styles.getPropertyValue(`--run-${k}`) : styles.getPropertyValue("--tick");
      context.globalAlpha = Math.min(0.9, Math.max(0.25, (0.6 * width) / (run.switch_time.length || 1)));
      const room = (height / 2 - 7) / this.runs.length;
      for (const time of run.switch_time) {
        context.fillRect((time / (this.duration || 1)) * width - 0.5, height / 2 + 6 + k * room, 1, room - 1);
      }
    });
  }
}
