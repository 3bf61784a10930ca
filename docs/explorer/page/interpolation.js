// Results of a ball on a creeping coating on steel, by cubic interpolation in TABLE (see ../table.py).
"use strict";

const SIZES = Object.values(TABLE.axes).map(([, , size]) => size);

function decoded({ low, high, values }) {
  const bytes = Uint8Array.from(atob(values), (letter) => letter.charCodeAt(0));
  const whole = new DataView(bytes.buffer);
  return Float64Array.from(
    { length: bytes.length / 2 },
    (_, i) => low + ((high - low) * whole.getUint16(2 * i, true)) / 65535,
  );
}

const LOGARITHMS = Object.fromEntries(
  Object.entries(TABLE.quantities).map(([name, quantity]) => [name, decoded(quantity)]),
);

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

// The weights of all cases that a point needs, as [index of the case, weight].
function casesAround(point) {
  let cases = [[0, 1]];
  Object.entries(TABLE.axes).forEach(([name, [low, high]], axis) => {
    const size = SIZES[axis];
    const position = (Math.log(point[name] / low) / Math.log(high / low)) * (size - 1);
    const { first, weights } = cubic(position, size);
    cases = cases.flatMap(([index, weight]) =>
      weights.map((factor, i) => [index * size + first + i, weight * factor]),
    );
  });
  return cases;
}

// Results over time for inputs in SI units: load, radius, thickness, modulus, softening, delay, flow.
function experiment({ load, radius, thickness, modulus, softening, delay, flow }) {
  const cases = casesAround({
    load: (load * radius) / (modulus * thickness ** 3),
    softening,
    flow: flow / delay,
    stiffness: modulus / TABLE.steel,
  });
  const units = { approach: thickness ** 2 / radius, contact_radius: thickness };
  const curves = Object.entries(LOGARITHMS).map(([name, logarithms]) => [
    name,
    Array.from({ length: TABLE.nodes }, (_, node) =>
      cases.reduce((sum, [index, weight]) => sum + weight * logarithms[index * TABLE.nodes + node], 0),
    ),
  ]);
  const last = Math.log(1 + softening + TABLE.flown);
  return (time) => {
    const compliance = 1 - softening * Math.expm1(-time / delay) + time / flow;
    const position = (Math.log(compliance) / last) * (TABLE.nodes - 1);
    const { first, weights } = cubic(position, TABLE.nodes);
    const at = (nodes) => weights.reduce((sum, weight, i) => sum + weight * nodes[first + i], 0);
    const found = Object.fromEntries(curves.map(([name, nodes]) => [name, units[name] * Math.exp(at(nodes))]));
    return { ...found, mean_pressure: load / (Math.PI * found.contact_radius ** 2) };
  };
}
