// A run at any time, from its pieces. omniroll/viewer/shown.py says what the arrays hold.

const GAUSS = [
  [0.5 - Math.sqrt(0.15), 5 / 18],
  [0.5, 8 / 18],
  [0.5 + Math.sqrt(0.15), 5 / 18],
];
const TURN = 2 * Math.PI;

export class Run {
  constructor(description, arrays) {
    Object.assign(this, description, arrays);
    this.pieces = this.start.length;
    this.duration = this.start[this.pieces - 1];
    this.wheels = this.vehicle.wheels;
    this.rollers = this.vehicle.rollers; // of the wheel that has most
    this.own = this.vehicle.places.map((_, k) => ({ ...this.vehicle, ...this.vehicle.kinds?.[k] })); // of each wheel
    this.columns = 6 + 2 * this.wheels;
    this.offsets = new Int32Array(this.pieces + 1);
    for (let k = 0; k < this.pieces; k++) this.offsets[k + 1] = this.offsets[k] + this.degree[k] + 1;
    this.#sumCoefficients();
    this.spinAtStart = null; // made when spins are first asked for
  }

  /** Coefficients are stored as changes from one to the next. */
  #sumCoefficients() {
    const total = this.offsets[this.pieces];
    for (let column = 0; column < this.columns; column++) {
      for (let piece = 0; piece < this.pieces; piece++) {
        const first = column * total + this.offsets[piece];
        for (let k = 1; k <= this.degree[piece]; k++) this.coefficients[first + k] += this.coefficients[first + k - 1];
      }
    }
  }

  /** The piece at a time: at a switch the one after it. */
  pieceAt(time) {
    let low = 0;
    let high = this.pieces - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.start[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  length(piece) {
    return piece + 1 < this.pieces ? this.start[piece + 1] - this.start[piece] : 0;
  }

  /** All columns of a piece at 0 <= x <= 1, by de Casteljau's rule. */
  columnsAt(piece, x) {
    const total = this.offsets[this.pieces];
    const degree = this.degree[piece];
    const values = new Float64Array(this.columns);
    const row = new Float64Array(degree + 1);
    for (let column = 0; column < this.columns; column++) {
      const first = column * total + this.offsets[piece];
      for (let k = 0; k <= degree; k++) row[k] = this.coefficients[first + k];
      for (let left = degree; left > 0; left--) {
        for (let k = 0; k < left; k++) row[k] += (row[k + 1] - row[k]) * x;
      }
      values[column] = row[0];
    }
    return values;
  }

  /** The state at a time in s since the start; SI units. */
  at(time) {
    const inside = Math.min(Math.max(time, 0), this.duration);
    const piece = this.pieceAt(inside);
    const length = this.length(piece);
    return this.state(piece, length > 0 ? Math.min((inside - this.start[piece]) / length, 1) : 0);
  }

  state(piece, x) {
    const { wheels, vehicle } = this;
    const values = this.columnsAt(piece, x);
    const radius = vehicle.platform_radius;
    return {
      piece,
      x,
      time: this.start[piece] + x * this.length(piece),
      position: [radius * values[0], radius * values[1]],
      heading: values[2],
      speed: [radius * values[3], radius * values[4]],
      yawRate: values[5] / vehicle.yaw_scale,
      chi: values.subarray(6, 6 + wheels),
      turned: values.subarray(6 + wheels),
      contact: this.contact.subarray(piece * wheels, (piece + 1) * wheels),
    };
  }

  /** The angle of a roller on its wheel, from straight down, where it has the number `roller`. */
  rollerAngle(state, wheel, roller) {
    return state.chi[wheel] + (TURN * (roller - state.contact[wheel])) / this.own[wheel].rollers;
  }

  /** The angle of a wheel's rollers out of its plane: its hand is the sign. */
  slant(wheel) {
    return this.vehicle.roller_angles?.[wheel] ?? 0;
  }

  /** How far a roller's row is outside of the middle of its wheel. */
  row(wheel, roller) {
    return (roller % 2 ? -1 : 1) * (this.own[wheel].row_offset ?? 0);
  }

  /** How far the contact is outside of the middle of its wheel. */
  contactSide(state, wheel) {
    const slanted = this.own[wheel].roller_axis_radius * Math.tan(this.slant(wheel)) * Math.tan(state.chi[wheel]);
    return this.row(wheel, state.contact[wheel]) - slanted;
  }

  // Spins of the rollers: integrated here, for display only

  /** Angles (N n) by which the rollers have turned about their own axes, in rad, but for whole turns. */
  spinAngles(state) {
    this.spinAtStart ??= this.#integratedSpins();
    const count = this.wheels * this.rollers;
    const angles = Float64Array.from(this.spinAtStart.subarray(state.piece * count, (state.piece + 1) * count));
    this.#addSpins(state, angles);
    return angles;
  }

  #integratedSpins() {
    const count = this.wheels * this.rollers;
    const all = new Float32Array(this.pieces * count);
    const angles = new Float64Array(count);
    for (let piece = 0; piece + 1 < this.pieces; piece++) {
      this.#addSpins(this.state(piece, 1), angles);
      for (let k = 0; k < count; k++) angles[k] %= TURN;
      all.set(angles, (piece + 1) * count);
    }
    return all;
  }

  /** Adds what the rollers turn from the start of the state's piece up to the state. */
  #addSpins(state, angles) {
    const { wheels, rollers, axial } = this;
    const elapsed = state.x * this.length(state.piece);
    for (let wheel = 0; wheel < wheels; wheel++) {
      angles[wheel * rollers + state.contact[wheel]] += state.turned[wheel];
    }
    if (!axial || elapsed === 0) return;
    for (const [node, weight] of GAUSS) {
      const x = node * state.x;
      const between = this.state(state.piece, x);
      for (let wheel = 0; wheel < wheels; wheel++) {
        for (let roller = 0; roller < this.own[wheel].rollers; roller++) {
          if (roller === state.contact[wheel]) continue;
          const place = wheel * rollers + roller;
          const first = axial[2 * place * this.pieces + state.piece];
          const last = axial[(2 * place + 1) * this.pieces + state.piece];
          const slant = this.slant(wheel);
          const inclined = between.yawRate * Math.cos(slant) * Math.sin(this.rollerAngle(between, wheel, roller));
          angles[place] += weight * elapsed * (first + (last - first) * x - inclined);
        }
      }
    }
    this.#addDisks(state, angles);
  }

  /** A wheel takes rollers at an angle along as it turns: their spin is what is left of the axial speed. */
  #addDisks(state, angles) {
    const start = this.state(state.piece, 0);
    for (let wheel = 0; wheel < this.wheels; wheel++) {
      const taken = Math.sin(this.slant(wheel)) * (state.chi[wheel] - start.chi[wheel]);
      if (!taken) continue;
      for (let roller = 0; roller < this.own[wheel].rollers; roller++) {
        if (roller !== state.contact[wheel]) angles[wheel * this.rollers + roller] -= taken;
      }
    }
  }

  /** The ground's forces (N, 3) on the wheels: along the axle, along the rolling direction, upwards; or null. */
  forcesAt(state) {
    return this.#between(this.forces, 3 * this.wheels, state);
  }

  /** The slip velocities (N, 2) of the contacts: along the axle, along the rolling direction; or null. */
  slipAt(state) {
    return this.#between(this.slip, 2 * this.wheels, state);
  }

  /** Heave of the centre of mass, and the turns of the platform about x and y; or null where it has no springs. */
  tiltAt(state) {
    return this.#between(this.tilt, 3, state);
  }

  /** So many numbers, which stand at the starts and ends of the pieces; or null. */
  #between(numbers, size, state) {
    if (!numbers) return null;
    const first = state.piece * size;
    const last = (this.pieces + state.piece) * size;
    return Float64Array.from({ length: size }, (_, k) => {
      const before = numbers[first + k];
      return before + (numbers[last + k] - before) * state.x;
    });
  }

  /** The fastest slip of the run. */
  largestSlip() {
    let largest = 0;
    for (let k = 0; k < (this.slip?.length ?? 0); k += 2) {
      largest = Math.max(largest, Math.hypot(this.slip[k], this.slip[k + 1]));
    }
    return largest;
  }

  /** The largest forces of the run: along the ground, and upwards. */
  largestForces() {
    let along = 0;
    let upwards = 0;
    for (let k = 0; k < (this.forces?.length ?? 0); k += 3) {
      along = Math.max(along, Math.hypot(this.forces[k], this.forces[k + 1]));
      upwards = Math.max(upwards, Math.abs(this.forces[k + 2]));
    }
    return { along, upwards };
  }

  /** `count` states of each piece, evenly spaced from its start, and the run's end. */
  *states(count) {
    for (let piece = 0; piece < this.pieces; piece++) {
      const within = this.length(piece) > 0 ? count : 1;
      for (let k = 0; k < within; k++) yield this.state(piece, k / within);
      if (piece + 1 < this.pieces) yield this.state(piece, 1);
    }
  }

  /** The times at which a wheel switches, joint switches once. */
  get switchTimes() {
    return [...new Set(this.switch_time)];
  }
}
