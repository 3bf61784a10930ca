// Sliders, the sketch and the curves of explorer.html.
"use strict";

const INPUTS = {
  load: { label: "Load", low: 1e-3, high: 0.1, unit: "N" },
  radius: { label: "Radius of the ball", low: 2e-4, high: 2e-3, unit: "m" },
  thickness: { label: "Thickness of the coating", low: 2e-6, high: 2e-5, unit: "m" },
  modulus: { label: "Shear modulus at first", low: 1e8, high: 1e10, unit: "Pa" },
  softening: { label: "Softening", low: 0.1, high: 10, unit: "×" },
  delay: { label: "Time of softening", low: 10, high: 1e3, unit: "s" },
  flow: { label: "Time of flow", low: 1e3, high: 1e6, unit: "s" },
  time: { label: "Time under load", low: 1, high: 1e4, unit: "s" },
};
const PRESETS = {
  "Polymer coating": { load: 5e-3, radius: 5e-4, thickness: 5e-6, modulus: 1e9, softening: 3, delay: 300, flow: 5e3 },
  "Soft coating": { load: 2e-3, radius: 1e-3, thickness: 2e-5, modulus: 1e8, softening: 3, delay: 50, flow: 1e6 },
  "Stiff coating that flows": { load: 0.05, radius: 1e-3, thickness: 3e-6, modulus: 8e9, softening: 0.2, delay: 20, flow: 2e3 },
};
const TICKS = { 1: "1 s", 10: "10", 100: "100", 1000: "1,000", 10000: "10⁴ s" }; // short enough for a narrow screen
const CHARTS = {
  approach: { label: "Approach", unit: "m", low: 1e-9, high: 1e-5 },
  contact_radius: { label: "Contact radius", unit: "m", low: 1e-6, high: 1e-4 },
  mean_pressure: { label: "Mean pressure", unit: "Pa", low: 1e5, high: 1e10 },
};
let WIDTH = 620; // narrower on narrow screens, so that the text keeps its size
const HEIGHT = 170, LEFT = 62, RIGHT = 12, TOP = 8, BOTTOM = 24;
const PREFIXES = { "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G" };

let now = { ...PRESETS["Polymer coating"], time: 100 };
let before = now;
let moving = false;

const byId = (id) => document.getElementById(id);

function quantity(value, unit, digits = 3) {
  if (unit === "×" || unit === "s") return `${Number(value.toPrecision(digits)).toLocaleString("en")} ${unit}`;
  const rounded = Number(value.toPrecision(digits));
  const power = Math.min(Math.max(3 * Math.floor(Math.log10(rounded) / 3 + 1e-9), -9), 9);
  return `${Number((rounded / 10 ** power).toPrecision(digits))} ${PREFIXES[power]}${unit}`;
}

function slider(name, { label, low, high }) {
  const row = document.createElement("template");
  row.innerHTML = `<label for="${name}">${label}</label>
    <input type="range" id="${name}" min="${Math.log10(low)}" max="${Math.log10(high)}" step="any">
    <output for="${name}" id="${name}-value"></output>`;
  byId("sliders").append(row.content);
  const input = byId(name);
  const step = Math.log10(high / low) / 100;
  input.addEventListener("keydown", (event) => {
    const moves = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
    if (!(event.key in moves)) return;
    event.preventDefault();
    input.value = Number(input.value) + moves[event.key] * step;
    change({ [name]: 10 ** Number(input.value) });
  });
  input.addEventListener("input", () => {
    change({ [name]: 10 ** Number(input.value) }, moving);
    moving = true;
  });
  input.addEventListener("change", () => (moving = false));
}

// The curve before a change stays as the grey one; while a slider is dragged, the one from before the drag stays.
function change(values, keepGhost = false) {
  if (!keepGhost && !("time" in values && Object.keys(values).length === 1)) before = now;
  now = { ...now, ...values };
  draw();
}

const across = (time) => LEFT + ((WIDTH - LEFT - RIGHT) * Math.log10(time)) / 4;
const TIMES = Array.from({ length: 81 }, (_, i) => 10 ** (i / 20));

function curve(result, name, up) {
  return TIMES.map((time) => `${across(time).toFixed(1)},${up(result(time)[name]).toFixed(1)}`).join(" ");
}

function decades(low, high) {
  return Array.from({ length: Math.round(Math.log10(high / low)) + 1 }, (_, i) => low * 10 ** i);
}

function chart(name, result, ghost) {
  const { label, unit, low, high } = CHARTS[name];
  const bottom = HEIGHT - BOTTOM;
  const up = (value) => bottom - ((bottom - TOP) * Math.log(value / low)) / Math.log(high / low);
  const value = result(now.time)[name];
  const rows = decades(low, high).map(
    (v) => `<line class="grid" x1="${LEFT}" x2="${WIDTH - RIGHT}" y1="${up(v)}" y2="${up(v)}"/>
      <text class="tick" x="${LEFT - 6}" y="${up(v) + 4}" text-anchor="end">${quantity(v, unit, 1)}</text>`,
  );
  const columns = decades(1, 1e4).map(
    (t) => `<line class="grid" x1="${across(t)}" x2="${across(t)}" y1="${TOP}" y2="${bottom}"/>
      <text class="tick" x="${across(t)}" y="${HEIGHT - 6}" text-anchor="${t === 1e4 ? "end" : "middle"}">${TICKS[t]}</text>`,
  );
  const description = `${label} over time: ${quantity(result(1)[name], unit)} after 1 s, ${quantity(result(1e4)[name], unit)} after 10,000 s`;
  return `<div><h2><span>${label}</span><span>${quantity(value, unit)} after ${quantity(now.time, "s")}</span></h2>
    <svg viewBox="0 0 ${WIDTH} ${HEIGHT}" role="img" aria-label="${description}">
    ${rows.join("")}${columns.join("")}
    <polyline class="ghost" points="${curve(ghost, name, up)}"/>
    <polyline class="curve" points="${curve(result, name, up)}"/>
    <circle class="now" cx="${across(now.time)}" cy="${up(value)}" r="5"/></svg></div>`;
}

// The contact is drawn wide if it is wide in comparison with the thickness; nothing else is to scale.
function sketch(values) {
  const half = Math.min(Math.max(52 + 26 * Math.log10(values.contact_radius / now.thickness), 18), 100);
  const radius = 190, film = 160, top = film - Math.sqrt(radius ** 2 - half ** 2);
  const ends = Math.sqrt(radius ** 2 - top ** 2);
  byId("sketch").innerHTML = `
    <rect class="steel" x="0" y="205" width="400" height="45"/>
    <rect class="film" x="0" y="${film}" width="400" height="45"/>
    <path class="steel" d="M ${200 - ends} 0 A ${radius} ${radius} 0 0 0 ${200 - half} ${film} L ${200 + half} ${film}
      A ${radius} ${radius} 0 0 0 ${200 + ends} 0 Z"/>
    <path class="mark" d="M 200 22 V 62"/><path class="head" d="M 194 60 L 206 60 L 200 72 Z"/>
    <text x="210" y="48">load ${quantity(now.load, "N")}</text>
    <text x="200" y="100" text-anchor="middle">ball, radius ${quantity(now.radius, "m")}</text>
    <path class="mark" d="M ${200 - half} ${film - 12} V ${film - 4} M ${200 + half} ${film - 12} V ${film - 4}
      M ${200 - half} ${film - 8} H ${200 + half}"/>
    <text x="200" y="${film - 16}" text-anchor="middle">contact ${quantity(2 * values.contact_radius, "m")}</text>
    <path class="mark" d="M 24 ${film} V 205 M 19 ${film} H 29 M 19 205 H 29"/>
    <text x="36" y="${film + 27}">coating ${quantity(now.thickness, "m")}</text>
    <text x="390" y="${film + 27}" text-anchor="end">${quantity(now.modulus, "Pa")} at first</text>
    <text x="36" y="232">steel</text>`;
  byId("caption").textContent =
    `Approach ${quantity(values.approach, "m")}, contact ${quantity(2 * values.contact_radius, "m")} wide ` +
    `after ${quantity(now.time, "s")} (not to scale)`;
}

function validity(result) {
  const share = result(1e4).approach / now.thickness;
  const beyond = share > 0.2;
  byId("validity").className = beyond ? "beyond" : "";
  byId("validity").textContent =
    `The approach after 10,000 s is ${quantity(100 * share, "×", 2).replace(" ×", " %")} of the thickness of the coating` +
    (beyond ? ", which may be beyond the range of linear theory (20 %)." : ".");
}

function draw() {
  WIDTH = innerWidth > 800 ? 620 : 370;
  for (const [name, { unit }] of Object.entries(INPUTS)) {
    const text = quantity(now[name], unit);
    byId(name).value = Math.log10(now[name]);
    byId(name).setAttribute("aria-valuetext", text);
    byId(`${name}-value`).textContent = text;
  }
  const result = experiment(now), ghost = experiment(before);
  byId("charts").innerHTML = Object.keys(CHARTS).map((name) => chart(name, result, ghost)).join("");
  sketch(result(now.time));
  validity(result);
}

Object.entries(INPUTS).forEach(([name, input]) => slider(name, input));
for (const [name, values] of Object.entries(PRESETS)) {
  const button = document.createElement("button");
  button.textContent = name;
  button.addEventListener("click", () => change(values));
  byId("presets").append(button);
}
byId("home").hidden = !location.protocol.startsWith("http");
draw();
addEventListener("resize", draw);
