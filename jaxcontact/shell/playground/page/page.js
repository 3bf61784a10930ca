// Sliders, the sketch and the curves of the page. Its numbers are those of SOURCE: of the solver (solver.js), which
// `jaxcontact play` serves, or of a table (table.js), which needs no server.
"use strict";

const LABELS = {
  load: ({ indenter }) => (indenter === "roller" ? "Load per metre" : "Load"),
  radius: ({ indenter }) => `Radius of the ${indenter}`,
  thickness: ({ film }) => `Thickness of the ${film}`,
  stiffness: () => "Shear modulus at first",
  softening: () => "Softening",
  delay: () => "Time of softening",
  flow: () => "Time of flow",
};
const UNITS = { radius: "m", thickness: "m", stiffness: "Pa", softening: "×", delay: "s", flow: "s" };
const TICKS = { 1: "1 s", 10: "10", 100: "100", 1000: "1,000", 10000: "10⁴ s" }; // short enough for a narrow screen
const CHARTS = { pressure: "Pressure", approach: "Approach", contact_radius: "Contact radius" };
const STEPS = 100; // of the keyboard, from one end of a slider to the other
const SECONDS = 4; // of the animation
let WIDTH = 620; // narrower on narrow screens, so that the text keeps its size
const HEIGHT = 180, LEFT = 68, RIGHT = 16, TOP = 8, BOTTOM = 24;
const ELASTIC = { steel: ["210e9", 0.3], glass: ["70e9", 0.22] }; // Young's modulus [Pa] and Poisson's ratio
const PREFIXES = { "-12": "p", "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G" };

let presets, preset, values; // all examples, the name of the one that is shown and its values
let shown = null, ghost = null; // the last answer of the source and the one before the last change
let axes = {}; // low, high and step of each chart
let chosen = "pressure"; // the chart of a narrow screen
let position = null; // of the time in the answer's times; between two of them while it plays
let waited = 0; // seconds on the clock
let wanted = null, busy = false, moving = false, frame = 0;

const byId = (id) => document.getElementById(id);
const powerOf = (value) => Math.min(Math.max(3 * Math.floor(Math.log10(value) / 3 + 1e-9), -12), 9);

function quantity(value, unit, digits = 3) {
  if (unit === "s") return duration(value, digits);
  const rounded = Number(value.toPrecision(digits));
  if (unit === "×" || !rounded) return `${rounded.toLocaleString("en")} ${unit}`;
  const power = powerOf(rounded);
  return `${Number((rounded / 10 ** power).toPrecision(digits))} ${PREFIXES[power]}${unit}`;
}

function duration(value, digits) {
  const [unit, seconds] = value >= 7200 ? ["h", 3600] : value >= 300 ? ["min", 60] : ["s", 1];
  return `${Number((value / seconds).toPrecision(digits)).toLocaleString("en")} ${unit}`;
}

const inSeconds = (time) => `${Number(time.toPrecision(3)).toLocaleString("en")} s`;
const unitOf = (name) => UNITS[name] ?? (presets[preset].indenter === "roller" ? "N/m" : "N");

function row(name, attributes) {
  const part = document.createElement("template");
  part.innerHTML = `<label for="${name}" id="${name}-label"></label>
    <input type="range" id="${name}" ${attributes}>
    <output for="${name}" id="${name}-value"></output>`;
  byId("sliders").append(part.content);
  return byId(name);
}

function slider(name) {
  const input = row(name, 'step="any"');
  input.addEventListener("keydown", (event) => {
    const moves = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
    if (!(event.key in moves)) return;
    event.preventDefault();
    input.value = Number(input.value) + (moves[event.key] * (input.max - input.min)) / STEPS;
    change(name, Number(input.value), false);
  });
  input.addEventListener("input", () => {
    change(name, Number(input.value), moving);
    moving = true;
  });
  input.addEventListener("change", () => (moving = false));
}

// A slider's position is the logarithm of its value; the source gets the digits that are shown.
function change(name, place, keepGhost) {
  const [low, high] = presets[preset].limits[name];
  values = { ...values, [name]: Math.min(Math.max(Number((10 ** place).toPrecision(3)), low), high) };
  drawInputs(name);
  ask(keepGhost);
}

function choose(name) {
  [preset, values] = [name, { ...presets[name].values }];
  [shown, ghost, axes] = [null, null, {}];
  stop();
  if (position) position = Math.round(position);
  for (const [each, [low, high]] of Object.entries(presets[name].limits)) {
    Object.assign(byId(each), { min: Math.log10(low), max: Math.log10(high) });
  }
  for (const each of ["charts", "sketch", "caption"]) byId(each).replaceChildren();
  byId("play").disabled = byId("copy").disabled = true;
  for (const button of byId("presets").children) button.setAttribute("aria-pressed", button.textContent === name);
  drawInputs();
  ask(false);
}

// One run at a time: of the moves during a run only the last is asked for. The curve before a change stays as the grey
// one; while a slider is dragged, the one from before the drag stays.
function ask(keepGhost) {
  wanted = { preset, values, keepGhost: wanted && wanted.preset === preset ? wanted.keepGhost && keepGhost : keepGhost };
  if (!busy) run();
}

async function run() {
  busy = true;
  while (wanted) {
    const asked = wanted;
    wanted = null;
    const since = performance.now();
    waited = 0;
    const watch = setInterval(() => waitSince(since), 200);
    try {
      const answer = await SOURCE.answer(asked.preset, asked.values);
      clearInterval(watch);
      if (asked.preset === preset) answered(answer, asked);
    } catch (error) {
      clearInterval(watch);
      say(error.message, "beyond");
    }
  }
  busy = false;
}

// What is waited for, with the seconds since it was asked for.
async function waitSince(start) {
  const stage = await SOURCE.stage().catch(() => null); // the answer itself reports that there is no server
  const seconds = Math.floor((performance.now() - start) / 1000);
  if (busy && stage && seconds >= waited) say(`${stage} (${(waited = seconds)} s)`, "waits");
}

function answered(answer, asked) {
  if (!asked.keepGhost) ghost = shown;
  shown = answer;
  position ??= answer.times.findIndex((time) => time >= 100);
  Object.assign(byId("time"), { max: answer.times.length - 1 });
  byId("play").disabled = byId("copy").disabled = false;
  draw();
  byId("text").textContent = caseFile(asked.preset, asked.values, answer);
  say([answer.remark, ...answer.notes].join("; "), answer.notes.length ? "beyond" : "");
}

function say(text, kind) {
  byId("state").className = kind;
  if (byId("state").textContent !== text) byId("state").textContent = text;
}

// A number, or each of a list, between those of two times.
function at(series) {
  const first = Math.min(Math.floor(position), series.length - 2), part = position - first;
  const between = (a, b) => a + part * (b - a);
  const [a, b] = [series[first], series[first + 1]];
  return Array.isArray(a) ? a.map((each, i) => between(each, b[i])) : between(a, b);
}

// Low end, high end and step of an axis for values from low to high, with ends at multiples of the step, 1, 2 or 5 times a
// power of ten. It starts at zero if the values come near it, and stays while they fill 40 % of it, lest it jumps with each move.
function axis(name, low, high) {
  const from = low < 0.4 * high ? 0 : low, kept = axes[name];
  if (kept && kept.low <= from && high <= kept.high && high - from >= 0.4 * (kept.high - kept.low)) return kept;
  const least = Math.max(high - from, 0.02 * high) / 4, power = 10 ** Math.floor(Math.log10(least));
  const step = power * [1, 2, 5, 10].find((each) => each * power >= least * (1 - 1e-9));
  axes[name] = { low: Math.floor(from / step + 1e-9) * step, high: Math.ceil(high / step - 1e-9) * step, step };
  return axes[name];
}

function chart(name, title, seen, across, up, ticks, curves) {
  const bottom = HEIGHT - BOTTOM;
  const { low, high, step } = up;
  const y = (value) => bottom - ((bottom - TOP) * (value - low)) / (high - low);
  const x = (value) => LEFT + (WIDTH - LEFT - RIGHT) * across(value);
  const power = powerOf(high);
  const rows = Array.from({ length: Math.round((high - low) / step) + 1 }, (_, i) => {
    const value = low + i * step;
    const text = value ? `${Number((value / 10 ** power).toPrecision(4))} ${PREFIXES[power]}${up.unit}` : "0";
    return `<line class="grid" x1="${LEFT}" x2="${WIDTH - RIGHT}" y1="${y(value)}" y2="${y(value)}"/>
      <text class="tick" x="${LEFT - 6}" y="${y(value) + 4}" text-anchor="end">${text}</text>`;
  });
  const columns = ticks.map(([value, text], i) => {
    const anchor = i === ticks.length - 1 ? "end" : "middle";
    return `<line class="grid" x1="${x(value)}" x2="${x(value)}" y1="${TOP}" y2="${bottom}"/>
      <text class="tick" x="${x(value) + (anchor === "end" ? RIGHT : 0)}" y="${HEIGHT - 6}" text-anchor="${anchor}">${text}</text>`;
  });
  const lines = curves.map(
    ([kind, points]) =>
      `<polyline class="${kind}" points="${points.map(([a, b]) => `${x(a).toFixed(1)},${y(b).toFixed(1)}`).join(" ")}"/>`,
  );
  const dot = up.now ? `<circle class="now" cx="${x(up.now[0])}" cy="${y(up.now[1])}" r="5"/>` : "";
  return `<div${name === chosen ? ' class="chosen"' : ""}><h2><span>${title}</span><span>${seen}</span></h2>
    <svg viewBox="0 0 ${WIDTH} ${HEIGHT}" role="img" aria-label="${title}: ${seen}">
    ${rows.join("")}${columns.join("")}${lines.join("")}${dot}</svg></div>`;
}

const both = () => [["ghost", ghost], ["curve", shown]].filter(([, answer]) => answer);
const largest = (lists) => lists.flat(2).reduce((most, each) => Math.max(most, each), 0);

function pressureChart(after) {
  const wide = axis("wide", 0, 1.15 * largest(both().map(([, answer]) => answer.contact_radius))).high;
  const up = axis("pressure", 0, largest(both().map(([, { pressure }]) => pressure)));
  const power = powerOf(wide);
  const ticks = [-1, -0.5, 0, 0.5, 1].map((part) => {
    const text = `${Number(((part * wide) / 10 ** power).toPrecision(3))}`.replace("-", "−");
    return [part * wide, part === 1 ? `${text} ${PREFIXES[power]}m` : text];
  });
  const curves = both().map(([kind, answer]) => {
    const pressure = at(answer.pressure);
    return [kind, answer.x.map((x, i) => [x, pressure[i]]).filter(([x]) => Math.abs(x) <= wide)];
  });
  const seen = `up to ${quantity(Math.max(...at(shown.pressure)), "Pa")} after ${after}`;
  const across = (x) => (x + wide) / (2 * wide);
  return chart("pressure", "Pressure", seen, across, { ...up, unit: "Pa" }, ticks, curves);
}

function courseChart(name, after, time) {
  const course = both().map(([kind, answer]) => [kind, answer.times.map((t, i) => [t, answer[name][i]]).slice(1)]);
  const seen = course.flatMap(([, points]) => points.map(([, value]) => value));
  const up = { ...axis(name, Math.min(...seen), largest(seen)), unit: "m", now: [Math.max(time, 1), at(shown[name])] };
  if (time < 1) up.now[1] = shown[name][1];
  const ticks = Object.entries(TICKS).map(([t, text]) => [Number(t), text]);
  return chart(name, CHARTS[name], `${quantity(at(shown[name]), "m")} after ${after}`, (t) => Math.log10(t) / 4, up, ticks, course);
}

// The time of a position: between two of the answer's times as on the logarithmic axis, but for the first, which is 0.
function timeNow() {
  const first = Math.min(Math.floor(position), shown.times.length - 2), part = position - first;
  const [a, b] = [shown.times[first], shown.times[first + 1]];
  return a ? a * (b / a) ** part : part * b;
}

// The contact is drawn wide if it is wide in comparison with the thickness; nothing else is to scale.
function sketch(after) {
  const { indenter, film: name, substrate } = presets[preset];
  const contact = at(shown.contact_radius);
  const half = Math.min(Math.max(52 + 26 * Math.log10(contact / values.thickness), 18), 100);
  const radius = 190, film = 160, top = film - Math.sqrt(radius ** 2 - half ** 2);
  const ends = Math.sqrt(radius ** 2 - top ** 2);
  byId("sketch").innerHTML = `
    <rect class="solid" x="0" y="205" width="400" height="45"/>
    <rect class="film" x="0" y="${film}" width="400" height="45"/>
    <path class="solid" d="M ${200 - ends} 0 A ${radius} ${radius} 0 0 0 ${200 - half} ${film} L ${200 + half} ${film}
      A ${radius} ${radius} 0 0 0 ${200 + ends} 0 Z"/>
    <path class="mark" d="M 200 22 V 62"/><path class="head" d="M 194 60 L 206 60 L 200 72 Z"/>
    <text x="210" y="48">load ${quantity(values.load, unitOf("load"))}</text>
    <text x="200" y="100" text-anchor="middle">${indenter}, radius ${quantity(values.radius, "m")}</text>
    <path class="mark" d="M ${200 - half} ${film - 12} V ${film - 4} M ${200 + half} ${film - 12} V ${film - 4}
      M ${200 - half} ${film - 8} H ${200 + half}"/>
    <text x="200" y="${film - 16}" text-anchor="middle">contact ${quantity(2 * contact, "m")}</text>
    <path class="mark" d="M 24 ${film} V 205 M 19 ${film} H 29 M 19 205 H 29"/>
    <text x="36" y="${film + 27}">${name} ${quantity(values.thickness, "m")}</text>
    <text x="390" y="${film + 27}" text-anchor="end">${quantity(values.stiffness, "Pa")} at first</text>
    <text x="36" y="232">${substrate}</text>`;
  byId("caption").textContent =
    `Approach ${quantity(at(shown.approach), "m")}, contact ${quantity(2 * contact, "m")} wide after ${after} (not to scale)`;
}

function label(name, text, value) {
  byId(`${name}-label`).textContent = text;
  byId(`${name}-value`).textContent = value;
  byId(name).setAttribute("aria-valuetext", value);
}

// The slider that moves keeps its place: it is between the digits that are shown.
function drawInputs(moved) {
  for (const name of Object.keys(LABELS)) {
    if (name !== moved) byId(name).value = Math.log10(values[name]);
    label(name, LABELS[name](presets[preset]), quantity(values[name], unitOf(name)));
  }
}

function draw() {
  if (!shown) return;
  WIDTH = innerWidth > 800 ? 620 : 370;
  const time = timeNow(), after = inSeconds(time);
  byId("time").value = position;
  label("time", "Time under load", after);
  const courses = ["approach", "contact_radius"].map((name) => courseChart(name, after, time));
  byId("charts").innerHTML = [pressureChart(after), ...courses].join("");
  sketch(after);
}

function stop() {
  cancelAnimationFrame(frame);
  frame = 0;
  byId("play").textContent = "Play";
}

function play() {
  if (frame) {
    stop();
    position = Math.round(position);
    return draw();
  }
  const start = performance.now();
  byId("play").textContent = "Stop";
  const next = (now) => {
    const last = shown.times.length - 1;
    position = Math.min(Math.max((now - start) / (1000 * SECONDS), 0), 1) * last;
    frame = requestAnimationFrame(next);
    if (position === last) stop();
    draw();
  };
  frame = requestAnimationFrame(next);
}

// The contact as a case file of `jaxcontact run`, with the times of the answer.
function caseFile(name, { load, radius, thickness, stiffness, softening, delay, flow }, { times, x }) {
  const { indenter, nu, substrate } = presets[name];
  const number = (value) => Number(value.toPrecision(6)).toExponential().replace("e+", "e");
  const [E, nuBelow] = ELASTIC[substrate], [steel, nuSteel] = ELASTIC.steel;
  const shape = indenter === "roller" ? `shape = "cylinder"\nlength = 1.0 # [m]` : `shape = "sphere"`;
  return `# ${name}: from the page with sliders
[layer]
material = "burgers"
G1 = ${number(stiffness)} # [Pa]
G2 = ${number(stiffness / softening)} # [Pa]
eta1 = ${number(stiffness * flow)} # [Pa s]
eta2 = ${number((stiffness / softening) * delay)} # [Pa s]
nu = ${nu}
thickness = ${number(thickness)} # [m]

[substrate]
material = "elastic"
E = ${E} # [Pa]
nu = ${nuBelow}

[indenter]
${shape}
radius = ${number(radius)} # [m]

[indenter.material]
E = ${steel} # [Pa]
nu = ${nuSteel}

[control]
load = ${number(load)} # [N]

[times]
values = [${times.filter((time) => !time || Math.abs(time - Number(time.toPrecision(1))) < 1e-9 * time).join(", ")}] # [s]

[grid]
${SOURCE.grid(presets[name], { x })}
[solver]
substeps = 2
`;
}

// The clipboard is not there for every page: then the text is marked, to be copied by hand.
async function copy() {
  try {
    await navigator.clipboard.writeText(byId("text").textContent);
    byId("copied").textContent = "Copied";
  } catch {
    byId("case").open = true;
    getSelection().selectAllChildren(byId("text"));
    byId("copied").textContent = "Marked: copy it with Ctrl-C";
  }
  setTimeout(() => byId("copied").replaceChildren(), 3000);
}

function button(text, place, action) {
  const made = Object.assign(document.createElement("button"), { type: "button", textContent: text });
  made.addEventListener("click", action);
  byId(place).append(made);
  return made;
}

function show(name) {
  chosen = name;
  for (const [i, each] of Object.keys(CHARTS).entries()) byId("tabs").children[i].setAttribute("aria-pressed", each === name);
  draw();
}

async function begin() {
  for (const text of ["intro", "accuracy"]) byId(text).textContent = SOURCE[text];
  byId("home").hidden = !(SOURCE.documented && location.protocol.startsWith("http"));
  presets = await SOURCE.presets();
  Object.keys(LABELS).forEach(slider);
  row("time", 'min="0" step="1"').addEventListener("input", (event) => {
    stop();
    position = Number(event.target.value);
    draw();
  });
  label("time", "Time under load", "");
  for (const [name, text] of Object.entries(CHARTS)) button(text, "tabs", () => show(name));
  for (const name of Object.keys(presets)) button(name, "presets", () => choose(name));
  byId("play").addEventListener("click", play);
  byId("copy").addEventListener("click", copy);
  addEventListener("resize", draw);
  show(chosen);
  choose(Object.keys(presets)[0]);
}
begin();
