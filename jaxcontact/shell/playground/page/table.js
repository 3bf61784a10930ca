// The source of explorer.html: a ball on a creeping coating on steel, by cubic interpolation in TABLE, that is in
// numbers.js (see docs/explorer/table.py).
"use strict";

const LIMITS = { // of the sliders, from which the table reaches over all combinations
  load: [1e-3, 0.1],
  radius: [2e-4, 2e-3],
  thickness: [2e-6, 2e-5],
  stiffness: [1e8, 1e10],
  softening: [0.1, 10],
  delay: [10, 1e3],
  flow: [1e3, 1e6],
};
const EXAMPLES = {
  "Polymer coating": { load: 5e-3, radius: 5e-4, thickness: 5e-6, stiffness: 1e9, softening: 3, delay: 300, flow: 5e3 },
  "Soft coating": { load: 2e-3, radius: 1e-3, thickness: 2e-5, stiffness: 1e8, softening: 3, delay: 50, flow: 1e6 },
  "Stiff coating that flows": { load: 0.05, radius: 1e-3, thickness: 3e-6, stiffness: 8e9, softening: 0.2, delay: 20, flow: 2e3 },
};

// Whole numbers of one or two bytes, between the limits of the values.
function decoded({ low, high, values }, bytes) {
  const letters = atob(values);
  const whole = (i) => letters.charCodeAt(i * bytes) + (bytes === 2 ? 256 * letters.charCodeAt(i * bytes + 1) : 0);
  return Float64Array.from({ length: letters.length / bytes }, (_, i) => low + ((high - low) * whole(i)) / (256 ** bytes - 1));
}

const LOGARITHMS = Object.entries(TABLE.quantities).map(([name, packed]) => [name, decoded(packed, 2)]);
const SHAPES = TABLE.shape.values.map((packed) => decoded(packed, 1));

// The first of the four nodes around a position, counted in nodes, and their weights in the cubic polynomial.
function cubic(position, size) {
  const first = Math.min(Math.max(Math.floor(position) - 1, 0), size - 4);
  const nodes = [0, 1, 2, 3];
  const x = position - first;
  const weights = nodes.map((i) =>
    nodes.filter((j) => j !== i).reduce((product, j) => (product * (x - j)) / (i - j), 1),
  );
  return { first, weights };
}

const place = (value, [low, high, size]) => (Math.log(value / low) / Math.log(high / low)) * (size - 1);
const mixed = ({ first, weights }, nodes) => weights.reduce((sum, weight, i) => sum + weight * nodes[first + i], 0);

// The weights of all cases of some axes that a point needs, as [index of the case, weight].
function casesAround(point, axes) {
  let cases = [[0, 1]];
  for (const [name, axis] of Object.entries(axes)) {
    const { first, weights } = cubic(place(point[name], axis), axis[2]);
    cases = cases.flatMap(([index, weight]) => weights.map((factor, i) => [index * axis[2] + first + i, weight * factor]));
  }
  return cases;
}

// Values at the nodes of time, between those of cases.
function between(cases, values, nodes) {
  return Array.from({ length: nodes }, (_, node) =>
    cases.reduce((sum, [index, weight]) => sum + weight * values[index * nodes + node], 0),
  );
}

// Results as a function of time, for inputs in SI units; pressure is a function of the distance from the axis.
function experiment({ load, radius, thickness, stiffness, softening, delay, flow }) {
  const point = {
    load: (load * radius) / (stiffness * thickness ** 3),
    softening,
    flow: flow / delay,
    stiffness: stiffness / TABLE.steel,
  };
  const units = { approach: thickness ** 2 / radius, contact_radius: thickness };
  const cases = casesAround(point, TABLE.axes);
  const curves = LOGARITHMS.map(([name, logarithms]) => [name, between(cases, logarithms, TABLE.nodes)]);
  const last = Math.log(1 + softening + TABLE.flown);
  const { axes, times } = TABLE.shape;
  const around = casesAround(point, axes);
  const shapes = SHAPES.map((values) => between(around, values, times[2]));
  return (time) => {
    const compliance = 1 - softening * Math.expm1(-time / delay) + time / flow;
    const where = cubic((Math.log(compliance) / last) * (TABLE.nodes - 1), TABLE.nodes);
    const found = Object.fromEntries(curves.map(([name, nodes]) => [name, units[name] * Math.exp(mixed(where, nodes))]));
    const when = cubic(Math.min(Math.max(place(time / delay, times), 0), times[2] - 1), times[2]);
    const g = shapes.map((nodes) => mixed(when, nodes));
    const mean = load / (Math.PI * found.contact_radius ** 2);
    const pressure = (r) => {
      const u = (r / found.contact_radius) ** 2;
      return u < 1 ? Math.max(mean * Math.sqrt(1 - u) * mixed({ first: 0, weights: cubic(3 * u, 4).weights }, g), 0) : 0;
    };
    return { ...found, pressure };
  };
}

const AGES = [1e-3, ...Array.from({ length: 81 }, (_, i) => 10 ** (i / 20))]; // the first as good as at once

const SOURCE = {
  documented: true, // beside the documentation, where there is a site
  intro: "A steel ball is pressed on a coating on steel under a constant load. The page interpolates runs of jaxcontact that were computed beforehand; nothing needs to be installed.",
  accuracy: "Poisson's ratio of the coating is 0.4. Approach and contact radius differ by less than 1 %, and the pressure in the middle by less than 5 %, from direct runs on a finer grid.",

  async presets() {
    const shared = { indenter: "ball", film: "coating", substrate: "steel", nu: 0.4, limits: LIMITS };
    return Object.fromEntries(Object.entries(EXAMPLES).map(([name, values]) => [name, { ...shared, values }]));
  },

  async stage() {
    return "Reading the table";
  },

  async answer(preset, values) {
    const result = experiment(values);
    const all = AGES.map(result);
    const wide = 1.3 * Math.max(...all.map(({ contact_radius }) => contact_radius));
    const x = Array.from({ length: 261 }, (_, i) => (wide * (i - 130)) / 130);
    const share = Math.max(...all.map(({ approach }) => approach)) / values.thickness;
    return {
      times: [0, ...AGES.slice(1)],
      x,
      pressure: all.map(({ pressure }) => x.map(pressure)),
      approach: all.map(({ approach }) => approach),
      contact_radius: all.map(({ contact_radius }) => contact_radius),
      remark: `The approach is ${Number((100 * share).toPrecision(2))} % of the thickness of the coating at most`,
      notes: share > 0.2 ? ["this may be beyond the range of linear theory (20 %)"] : [],
    };
  },

  grid() {
    return "n = 64\n";
  },
};
