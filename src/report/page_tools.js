// SPDX-License-Identifier: Apache-2.0
// What the report pages share: reading #data, numbers, legends, plots. No network, no state outside the page.
"use strict";
const errors = [];
window.addEventListener("error", e => errors.push(String(e.message)));
for (const level of ["error", "warn"]) {
  const plain = console[level].bind(console);
  console[level] = (...words) => { errors.push(words.join(" ")); plain(...words); };
}

const data = JSON.parse(document.getElementById("data").textContent);
const byId = id => document.getElementById(id);
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const isNumber = value => typeof value === "number" && isFinite(value);

function element(tag, attributes = {}, ...children) {
  const svg = ["svg", "path", "line", "g", "text", "circle", "rect", "clipPath", "defs"].includes(tag);
  const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

// Three significant digits, plain for ordinary sizes.
function number(value, digits = 4) {
  if (!isNumber(value)) return "\u2013";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(2);
  return String(Number(value.toPrecision(digits)));
}

function card(name, value, unit, meaning, main) {
  const shown = value === "infinity" ? "unbounded" : number(value);
  const b = element("b", {}, shown);
  if (isNumber(value)) b.append(" ", element("small", {}, unit));
  return element("div", {class: main ? "card main" : "card"},
    element("span", {class: "name"}, name), b, element("span", {}, meaning));
}

function legend(entries) {
  const box = element("div", {class: "legend"});
  for (const e of entries) {
    const svg = element("svg", {width: 30, height: 12, "aria-hidden": "true"});
    if (e.fill) svg.append(element("rect", {width: 30, height: 12, fill: e.fill}));
    else svg.append(element("line", {x1: 0, x2: 30, y1: 6, y2: 6, stroke: e.stroke, "stroke-width": e.width,
      "stroke-dasharray": (e.dash || []).join(" ")}));
    box.append(element("span", {}, svg, e.label));
  }
  return box;
}

function ticks(low, high, count) {
  const raw = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= raw) || raw;
  const values = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i) values.push(i * step);
  return values;
}

function axis(label, values) {
  return {label, stroke: css("--soft"), grid: {stroke: css("--grid"), width: 1}, ticks: {stroke: css("--grid"), width: 1},
    font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", labelSize: 18,
    size: values ? 40 : 62, values: (_, list) => list.map(v => v === null ? "" : number(v, 7))};
}

function plot(box, {x, series, bands = [], yLabel, height = 260, yRange, xLabel = "time (s)", lines = []}) {
  const readout = element("div", {class: "readout"});
  const target = element("div");
  box.replaceChildren(legend(series.filter(s => s.label && !s.hidden).concat(bands.map(b => b.legend))), target, readout);
  const options = {
    width: Math.max(280, box.clientWidth), height, legend: {show: false}, cursor: {drag: {x: true, y: false}},
    scales: {x: {time: false}, y: yRange ? {range: yRange} : {}},
    axes: [axis(xLabel, true), axis(yLabel)],
    series: [{}].concat(series.map(s => ({label: s.label, stroke: s.stroke, width: s.width, dash: s.dash, fill: s.fill,
      paths: s.paths, points: s.points || {show: false}, spanGaps: false}))),
    bands: bands.map(b => ({series: b.series, fill: b.fill})),
    hooks: {
      draw: [u => {
        for (const level of lines) {
          const y = u.valToPos(level, "y", true);
          u.ctx.save();
          u.ctx.strokeStyle = css("--nominal");
          u.ctx.setLineDash([4, 4]);
          u.ctx.beginPath(); u.ctx.moveTo(u.bbox.left, y); u.ctx.lineTo(u.bbox.left + u.bbox.width, y); u.ctx.stroke();
          u.ctx.restore();
        }
      }],
      setCursor: [u => {
        const i = u.cursor.idx;
        readout.textContent = i === null || i === undefined ? "" : `${xLabel.split(" ")[0]} ${number(u.data[0][i], 5)}: ` +
          series.map((s, k) => [s, u.data[k + 1][i]]).filter(([s, v]) => s.label && isNumber(v))
            .map(([s, v]) => `${s.label} ${number(v)}`).join("  \u00b7  ");
      }],
    },
  };
  return new uPlot(options, [x].concat(series.map(s => s.values)), target);
}

/// For the test of this page: what was drawn, and every error, as an attribute of the root element.
function selfCheck() {
  const drawn = {};
  for (const canvas of document.querySelectorAll("canvas")) {
    const id = canvas.closest("[id]").id;
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let count = 0;
    for (let i = 3; i < pixels.length; i += 4) count += pixels[i] > 0;
    drawn[id] = Math.min(count, drawn[id] ?? Infinity);
  }
  for (const curve of document.querySelectorAll("path[data-curve]")) {
    drawn["plan-" + curve.dataset.curve] = Math.round(curve.getTotalLength());
  }
  document.documentElement.dataset.check = JSON.stringify({errors, drawn});
}

/// Writes the text once; draws now and again whenever the size or the colours change.
function startPage(write, draw) {
  try {
    write();
    draw();
    let pending = 0;
    const again = () => { clearTimeout(pending); pending = setTimeout(draw, 150); };
    window.addEventListener("resize", again);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  } catch (error) {
    console.error(String(error.stack || error));
  }
  if (location.hash === "#check") setTimeout(selfCheck, 500);
}
