// Sliders, the sketch and the curves of play.html; the numbers are those of the server's solver.
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
const STAGES = {
  compiling: "Compiling the solver for this contact: some seconds, once",
  computing: "Computing",
};
const TICKS = { 1: "1 s", 10: "10", 100: "100", 1000: "1,000", 10000: "10⁴ s" }; // short enough for a narrow screen
const STEPS = 100; // of the keyboard, from one end of a slider to the other
const SECONDS = 4; // of the animation
let WIDTH = 620; // narrower on narrow screens, so that the text keeps its size
const HEIGHT = 200, LEFT = 68, RIGHT = 16, TOP = 8, BOTTOM = 24;
const PREFIXES = { "-12": "p", "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G" };

let presets, span, preset, values; // all examples, the reach of the sliders, the name of the example and its values
let shown = null, ghost = null; // the last answer of the solver and the one before the last change
let limits = {}; // of the axes
let position = 9; // of the time in the answer's times; between two of them while it plays
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
  const reach = Math.log10(span);
  Object.assign(input, { min: -reach, max: reach });
  input.addEventListener("keydown", (event) => {
    const moves = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
    if (!(event.key in moves)) return;
    event.preventDefault();
    input.value = Number(input.value) + (moves[event.key] * 2 * reach) / STEPS;
    change(name, Number(input.value), false);
  });
  input.addEventListener("input", () => {
    change(name, Number(input.value), moving);
    moving = true;
  });
  input.addEventListener("change", () => (moving = false));
}

// A slider's position is the logarithm of its value over the default; the solver gets the digits that are shown.
function change(name, place, keepGhost) {
  const middle = presets[preset].values[name];
  const value = Number((middle * 10 ** place).toPrecision(3));
  values = { ...values, [name]: Math.min(Math.max(value, middle / span), middle * span) };
  drawInputs(name);
  ask(keepGhost);
}

function choose(name) {
  [preset, values] = [name, { ...presets[name].values }];
  [shown, ghost, limits] = [null, null, {}];
  stop();
  position = Math.round(position);
  for (const each of ["charts", "sketch", "caption"]) byId(each).replaceChildren();
  byId("play").disabled = true;
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
    const watch = setInterval(watchStage, 200);
    try {
      const response = await fetch("run", { method: "POST", body: JSON.stringify({ preset: asked.preset, values: asked.values }) });
      if (!response.ok) say(await response.text(), "beyond");
      else if (asked.preset === preset) answered(await response.json(), asked.keepGhost);
    } catch {
      say("The command jaxcontact play has ended; start it again and reload this page", "beyond");
    } finally {
      clearInterval(watch);
    }
  }
  busy = false;
}

async function watchStage() {
  const answer = await fetch("stage").catch(() => null); // the run itself reports that there is no server
  if (!answer) return;
  const { stage } = await answer.json();
  if (busy) say(STAGES[stage], "waits");
}

function answered(answer, keepGhost) {
  if (answer.failure) return say(`No result: ${answer.failure}`, "beyond");
  if (!keepGhost) ghost = shown;
  shown = answer;
  byId("play").disabled = false;
  draw();
  const strain = `The ${presets[preset].film} is compressed by ${quantity(100 * answer.strain, "×", 2).replace(" ×", " %")} of its thickness at most`;
  say([strain, ...answer.notes].join("; "), answer.notes.length ? "beyond" : "");
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

// The next of 1, 2, 5, 10, ... above a value. It stays while the curves need between a tenth and all of it.
function limit(name, value) {
  const power = 10 ** Math.floor(Math.log10(value));
  const next = power * [1, 2, 5, 10].find((step) => step * power >= value * (1 - 1e-9));
  if (!(limits[name] >= next && limits[name] <= 10 * next)) limits[name] = next;
  return limits[name];
}

function chart(title, seen, across, up, ticks, curves) {
  const bottom = HEIGHT - BOTTOM;
  const y = (value) => bottom - ((bottom - TOP) * value) / up.high;
  const x = (value) => LEFT + (WIDTH - LEFT - RIGHT) * across(value);
  const power = powerOf(up.high);
  const rows = [0, 1, 2, 3, 4, 5].map((i) => {
    const value = (up.high * i) / 5;
    const text = i ? `${Number((value / 10 ** power).toPrecision(3))} ${PREFIXES[power]}${up.unit}` : "0";
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
  return `<div><h2><span>${title}</span><span>${seen}</span></h2>
    <svg viewBox="0 0 ${WIDTH} ${HEIGHT}" role="img" aria-label="${title}: ${seen}">
    ${rows.join("")}${columns.join("")}${lines.join("")}${dot}</svg></div>`;
}

const both = () => [["ghost", ghost], ["curve", shown]].filter(([, answer]) => answer);
const largest = (lists) => Math.max(...lists.flat(2));

function pressureChart(after) {
  const wide = limit("wide", 1.2 * largest(both().map(([, answer]) => answer.contact_radius)));
  const high = limit("pressure", largest(both().map(([, { pressure }]) => pressure)));
  const power = powerOf(wide);
  const ticks = [-1, -0.5, 0, 0.5, 1].map((part) => {
    const text = `${Number(((part * wide) / 10 ** power).toPrecision(3))}`.replace("-", "−");
    return [part * wide, part === 1 ? `${text} ${PREFIXES[power]}m` : text];
  });
  const curves = both().map(([kind, answer]) => {
    const pressure = at(answer.pressure);
    return [kind, answer.x.map((x, i) => [x, pressure[i]]).filter(([x]) => Math.abs(x) <= wide)];
  });
  const seen = `${quantity(Math.max(...at(shown.pressure)), "Pa")} in the middle after ${after}`;
  const across = (x) => (x + wide) / (2 * wide);
  return chart("Pressure across the contact", seen, across, { high, unit: "Pa" }, ticks, curves);
}

function approachChart(after, time) {
  const high = limit("approach", largest(both().map(([, { approach }]) => approach)));
  const curves = both().map(([kind, answer]) => [kind, answer.times.map((t, i) => [t, answer.approach[i]]).slice(1)]);
  const up = { high, unit: "m", now: [Math.max(time, 1), at(shown.approach)] };
  const ticks = Object.entries(TICKS).map(([t, text]) => [Number(t), text]);
  const across = (t) => Math.log10(t) / 4;
  return chart("Approach", `${quantity(at(shown.approach), "m")} after ${after}`, across, up, ticks, curves);
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
    if (name !== moved) byId(name).value = Math.log10(values[name] / presets[preset].values[name]);
    label(name, LABELS[name](presets[preset]), quantity(values[name], unitOf(name)));
  }
}

function draw() {
  if (!shown) return;
  WIDTH = innerWidth > 800 ? 620 : 370;
  const time = timeNow(), after = inSeconds(time);
  byId("time").value = position;
  label("time", "Time under load", after);
  byId("charts").innerHTML = pressureChart(after) + approachChart(after, time);
  sketch(after);
}

function stop() {
  cancelAnimationFrame(frame);
  frame = 0;
  byId("play").textContent = "Play over time";
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

async function begin() {
  ({ presets, span } = await (await fetch("presets.json")).json());
  Object.keys(LABELS).forEach(slider);
  row("time", 'min="0" max="17" step="1"').addEventListener("input", (event) => {
    stop();
    position = Number(event.target.value);
    draw();
  });
  label("time", "Time under load", "");
  for (const name of Object.keys(presets)) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name;
    button.addEventListener("click", () => choose(name));
    byId("presets").append(button);
  }
  byId("play").addEventListener("click", play);
  addEventListener("resize", draw);
  choose(Object.keys(presets)[0]);
}
begin();
